//! Moving the two sides of a split apart.

use super::Way;
use super::bins::twice_center;
use super::lanes::Lanes;
use super::references::{Reference, VectorBox};

/// Moves the lower side to the front; returns where the other begins and the boxes around both sides'
/// centres.
#[inline(always)]
pub(super) fn move_apart<L: Lanes>(
    lanes: L,
    way: Way,
    references: &mut [Reference],
) -> (usize, [VectorBox; 2]) {
    match way {
        Way::Plane { axis, bin, binning } => {
            let [origin, scale] = [binning.origin, binning.scale].map(|n| lanes.splat(n[axis]));
            let bin = lanes.splat(bin);
            // As the integer below the place is below the bin; no less than the last one is.
            let is_lower = |_, twice_center| {
                let from_origin = lanes.sub(lanes.spread(twice_center, axis), origin);
                lanes.is_less(lanes.mul(from_origin, scale), bin)
            };
            swap_to_sides(lanes, references, is_lower)
        }
        Way::Set(set) => swap_to_sides(lanes, references, |index, _| {
            let is_lower = (set >> index & 1) as f32;
            lanes.is_less(lanes.splat(0.0), lanes.splat(is_lower))
        }),
    }
}

#[inline(always)]
fn swap_to_sides<L: Lanes>(
    lanes: L,
    references: &mut [Reference],
    is_lower: impl Fn(usize, L::Eight) -> L::Mask,
) -> (usize, [VectorBox; 2]) {
    let mut centers = [lanes.splat(f32::INFINITY); 2];
    let mut lower = 0;
    for index in 0..references.len() {
        let around = lanes.load(&references[index].vectors.0);
        let twice_center = twice_center(lanes, around);
        let is_lower = is_lower(index, twice_center);
        // Without branches: no processor foresees the side. What is between `lower` and here is upper.
        let first_upper = lanes.load(&references[lower].vectors.0);
        lanes.store(&mut references[index].vectors.0, first_upper);
        lanes.store(&mut references[lower].vectors.0, around);
        lower += lanes.bit(is_lower);
        // Of NaN and another number the other is the smaller one.
        let [of_lower, of_upper] =
            [lanes.not(is_lower), is_lower].map(|mask| lanes.unless(mask, twice_center));
        centers = [lanes.min(of_lower, centers[0]), lanes.min(of_upper, centers[1])];
    }
    let stored = centers.map(|around| {
        let mut stored = VectorBox::EMPTY;
        lanes.store(&mut stored.0, around);
        stored
    });
    (lower, stored)
}

//! Moving the two sides of a split apart.

use super::Way;
use super::bins::{center, place};
use super::lanes::Lanes;
use super::references::{Reference, VectorBox};
use glam::Vec4;

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
            let half = lanes.splat(0.5);
            let on_axis = |numbers: Vec4| lanes.splat(numbers[axis]);
            let numbers =
                [on_axis(binning.origin), on_axis(binning.scale), half, on_axis(binning.last)];
            // As the nearest integer to the place is below the bin.
            const INTEGERS: f32 = (3 << 22) as f32;
            let integers = lanes.splat(INTEGERS);
            let bin = lanes.splat(bin + INTEGERS);
            let is_lower = |_, reference: &Reference| {
                let corner = |lane: usize| lanes.splat(reference.vectors.0[lane & 7]);
                let center =
                    lanes.sub(lanes.mul(corner(axis), half), lanes.mul(corner(axis + 4), half));
                lanes.is_less(lanes.add(place(lanes, center, numbers), integers), bin)
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
    is_lower: impl Fn(usize, &Reference) -> L::Mask,
) -> (usize, [VectorBox; 2]) {
    let (half, nothing) = (lanes.splat(0.5), lanes.splat(f32::INFINITY));
    let mut centers = [nothing; 2];
    let mut lower = 0;
    for index in 0..references.len() {
        let reference = &references[index];
        let around = lanes.load(&reference.vectors.0);
        let center = center(lanes, around, half);
        let is_lower = is_lower(index, reference);
        // Without branches: no processor foresees the side. What is between `lower` and here is upper.
        let first_upper = lanes.load(&references[lower].vectors.0);
        lanes.store(&mut references[index].vectors.0, first_upper);
        lanes.store(&mut references[lower].vectors.0, around);
        lower += lanes.bit(is_lower);
        centers[0] = lanes.min(centers[0], lanes.select(is_lower, center, nothing));
        centers[1] = lanes.min(centers[1], lanes.select(is_lower, nothing, center));
    }
    let stored = centers.map(|around| {
        let mut stored = VectorBox::EMPTY;
        lanes.store(&mut stored.0, around);
        stored
    });
    (lower, stored)
}

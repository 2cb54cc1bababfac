//! One ray against the triangles of a leaf.
//!
//! In three steps, as most triangles fall at the first. The signs of the watertight test are
//! computed as that test computes them, so they are the same; the plane's distance is bounded in
//! `f32`, which turns away the surface that a shadow ray starts on; and a triangle that bounds
//! show to be hit needs no more. What is left in doubt is given to the scalar test.
//!
//! # The plane's distance
//!
//! `t = h / s` with `h = N (a - o)` and `s = N d`, for a unit normal `N`. With `u = 2^-24`: a
//! component of the stored normal is off by `1.01 u` of itself (and `2^-30`, see [`normal`]), one of
//! `a - o` by `u`, and products and sums by `3 u` of the sum of magnitudes. So `h` is off by less
//! than `6 u |a - o|` and `s` by less than `6 u |d|`, in the norm that sums components; the rest of
//! `8 u |d|` is for products with the ends of the interval.

use super::rays::Rays;
use super::simd::{LANES, Simd};
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS};

const UNIT: f32 = 1.0 / (1u32 << 24) as f32;
pub(super) const HEIGHT_SLACK: f32 = 6.0 * UNIT;
/// Keeps slack above what underflow takes: `2^-100`.
pub(super) const UNDERFLOW: f32 = 1.0 / (1u128 << 100) as f32;

/// A leaf's numbers, and what follows them.
struct Block<'a> {
    numbers: &'a [f32],
    count: usize,
}

impl<'a> Block<'a> {
    #[inline(always)]
    fn of(tree: &'a Bvh8, leaf: ChildRef) -> Self {
        let slots = leaf.leaf_slots();
        Self { numbers: &tree.leaves[slots.start * LEAF_ROWS..], count: slots.len() }
    }

    /// A row, read whole: lanes beyond the last triangle hold something else.
    #[inline(always)]
    fn row<S: Simd>(&self, s: S, row: usize) -> S::Floats {
        self.at(s, row * self.count)
    }

    #[inline(always)]
    fn at<S: Simd>(&self, s: S, start: usize) -> S::Floats {
        s.load(self.numbers[start..start + LANES].try_into().expect("eight numbers"))
    }
}

/// What the signs of the watertight test are computed from.
#[derive(Clone, Copy)]
pub(super) struct Line {
    /// The last one being the direction's largest.
    pub(super) axes: [usize; 3],
    /// In the order of `axes`.
    pub(super) origin: [f32; 3],
    pub(super) factors: [f32; 2],
}

impl Line {
    #[inline(always)]
    fn of(rays: &Rays, index: usize) -> Self {
        const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];
        let [x, y, z] = &rays.turned_origin;
        Self {
            axes: AXES[rays.axis.0[index].to_bits() as usize & 3],
            origin: [x.0[index], y.0[index], z.0[index]],
            factors: [rays.shear[0].0[index], rays.shear[1].0[index]],
        }
    }

    /// The corners whose rows begin there, in the order of `axes`, across the line.
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, block: &Block<'_>, first: [usize; 3]) -> [S::Floats; 2] {
        let z = s.sub(block.at(s, first[2]), s.splat(self.origin[2]));
        let x = s.sub(block.at(s, first[0]), s.splat(self.origin[0]));
        let y = s.sub(block.at(s, first[1]), s.splat(self.origin[1]));
        [s.sub(x, s.mul(s.splat(self.factors[0]), z)), s.sub(y, s.mul(s.splat(self.factors[1]), z))]
    }
}

#[inline(always)]
fn cross<S: Simd>(s: S, p: [S::Floats; 2], q: [S::Floats; 2]) -> S::Floats {
    s.sub(s.mul(p[0], q[1]), s.mul(p[1], q[0]))
}

/// What a line finds in a leaf.
pub(super) struct Passed<S: Simd> {
    /// The triangles that no sign speaks against, one bit each.
    pub(super) candidates: u32,
    /// The corners across the line.
    corners: [[S::Floats; 2]; 3],
    /// The signs' numbers.
    uvw: [S::Floats; 3],
}

/// The triangles of a leaf that the line passes through.
#[inline(always)]
pub(super) fn passed_through<S: Simd>(s: S, tree: &Bvh8, leaf: ChildRef, line: &Line) -> Passed<S> {
    let block = Block::of(tree, leaf);
    let [x, y, z] = line.axes;
    let step = block.count * 3;
    let first = [x * block.count, y * block.count, z * block.count];
    let a = line.project(s, &block, first);
    let b = line.project(s, &block, [first[0] + step, first[1] + step, first[2] + step]);
    let step = 2 * step;
    let c = line.project(s, &block, [first[0] + step, first[1] + step, first[2] + step]);
    let uvw = [cross(s, c, b), cross(s, a, c), cross(s, b, a)];
    // Should one be NaN, the minimum and the maximum leave out at most that one: then fewer
    // triangles are turned away.
    let zero = s.splat(0.0);
    let below = s.less(s.min(s.min(uvw[0], uvw[1]), uvw[2]), zero);
    let above = s.less(zero, s.max(s.max(uvw[0], uvw[1]), uvw[2]));
    let mixed = s.bits(s.both(below, above));
    Passed { candidates: !mixed & ((1 << block.count) - 1), corners: [a, b, c], uvw }
}

/// Whether ray `index` hits a triangle of a leaf.
#[inline(always)]
pub(super) fn hits_leaf<S: Simd>(
    s: S,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays,
    index: usize,
) -> bool {
    let passed = passed_through(s, tree, leaf, &Line::of(rays, index));
    passed.candidates != 0 && hits_candidate(s, tree, leaf, rays, index, &passed)
}

/// Whether ray `index` hits one of the triangles that its line passes through, of which there is one
/// at least.
#[inline(always)]
fn hits_candidate<S: Simd>(
    s: S,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays,
    index: usize,
    passed: &Passed<S>,
) -> bool {
    let Passed { mut candidates, corners, uvw } = *passed;
    let block = Block::of(tree, leaf);
    let zero = s.splat(0.0);
    let mut height = zero;
    let mut slope = zero;
    let mut reach = s.splat(UNDERFLOW);
    for k in 0..3 {
        let normal = block.row(s, 9 + k);
        let across = s.sub(block.row(s, k), s.splat(rays.origin[k].0[index]));
        height = s.add(height, s.mul(normal, across));
        slope = s.add(slope, s.mul(normal, s.splat(rays.direction[k].0[index])));
        reach = s.add(reach, s.abs(across));
    }
    let slack = s.mul(reach, s.splat(HEIGHT_SLACK));
    // Turned so that the ray goes through the plane upwards.
    let height = s.flip_sign(height, slope);
    let slope = s.abs(slope);
    let slope_slack = s.splat(rays.slope_slack.0[index]);
    let (start, end) = (s.splat(rays.start.0[index]), s.splat(rays.end.0[index]));
    let (at_start, at_end) = (s.mul(start, slope), s.mul(end, slope));
    let (start_slack, end_slack) =
        (s.mul(s.abs(start), slope_slack), s.mul(s.abs(end), slope_slack));
    let sure_of_side = s.bits(s.less(slope_slack, slope));
    // An end at infinity makes sums NaN or infinite, and no comparison true that should not be.
    let before = s.less(s.add(height, slack), s.sub(at_start, start_slack));
    let after = s.less(s.add(at_end, end_slack), s.sub(height, slack));
    candidates &= !(s.bits(s.either(before, after)) & sure_of_side);
    if candidates == 0 {
        return false;
    }
    let unbounded = s.less(s.splat(f32::MAX), end);
    let product = s.abs(s.mul(s.mul(uvw[0], uvw[1]), uvw[2]));
    let no_doubt = s.both(
        s.less_equal(s.splat(f32::MIN_POSITIVE), product),
        s.less_equal(product, s.splat(f32::MAX)),
    );
    let within = s.both(
        s.less(s.add(at_start, start_slack), s.sub(height, slack)),
        s.either(unbounded, s.less(s.add(height, slack), s.sub(at_end, end_slack))),
    );
    let certain = s.bits(s.both(no_doubt, within)) & sure_of_side & candidates;
    if certain != 0 && certain & clear_of_edges(s, rays, index, corners, uvw) != 0 {
        return true;
    }
    while candidates != 0 {
        let triangle = candidates.trailing_zeros() as usize;
        if rays.confirm(index, &tree.triangle(leaf, triangle)) {
            return true;
        }
        candidates &= candidates - 1;
    }
    false
}

/// The triangles whose edges the line of ray `index` passes so clearly that the scalar test finds the
/// point where it meets their plane inside them; see [`Rays::edge_slack`].
#[inline(always)]
fn clear_of_edges<S: Simd>(
    s: S,
    rays: &Rays,
    index: usize,
    [a, b, c]: [[S::Floats; 2]; 3],
    uvw: [S::Floats; 3],
) -> u32 {
    let far = |p: [S::Floats; 2]| s.add(s.abs(p[0]), s.abs(p[1]));
    let farthest = s.max(s.max(far(a), far(b)), far(c));
    let least = s.min(s.min(s.abs(uvw[0]), s.abs(uvw[1])), s.abs(uvw[2]));
    s.bits(s.less(s.mul(s.splat(rays.edge_slack.0[index]), farthest), least))
}

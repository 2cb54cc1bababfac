//! What the conservative tests compute with, from rays as they are given.
//!
//! # Why the box test here accepts what [`PreparedRay::enter`] accepts
//!
//! That test finds the entry of an ascending ray into a slab at `fl(fl(p - n) r)`, where `n` is the
//! origin `o` moved forwards by its padding and `r` the reciprocal of the direction. Here it is
//! `fl(p r - c)` with `c = fl(fl(o + P) r)`, one operation once `c` is known. With `u = 2^-24` and
//! `m` the scene's extent seen from the origin:
//!
//! - `n` is at most `o + 16.01 u m + 3.1 u |o|`, and the other test's result at least
//!   `(p - n) r - 2.01 u |p - n| r`, where `|p - n|` is at most `1.01 m + 4 u |o|`;
//! - `c` is at least `(o + P - 2.01 u (|o| + P)) r`, and this test's result at most
//!   `p r - c + u |p r - c| + u |p r|`, the last term where `p r` is rounded as well, with
//!   `|p| <= |o| + m`.
//!
//! So it is enough that `P >= (16.01 + 2.01 + 2.1) u m + (3.1 + 2.01 + 1.1) u |o|`. What underflow
//! takes, at most `2^-105` in units of space, is in a constant. Exits and descending rays are mirror
//! images. Nothing overflows, as rays for which something might are left unbounded on that axis.
//!
//! # Intervals
//!
//! Ends of an interval are moved by a slack `s` that is more than what the other test moves them by. For
//! [quick](Simd::quick_max) comparisons no number may be negative but the exits of boxes that are missed.
//! So exits are moved on by `e = s + max(-t_min, 0)` as well, and what is held against them is `b = max(t_min,
//! 0)` and `t_max + e`: where `t_min - s` is no larger than an exit, `b` is no larger than that and `e`, and
//! everything else is held against something later than before. Subtracting `e` from `c` is one more
//! rounding, `1.1 u (|o| + m)` where it matters: where `e` is larger than that, exits of boxes that are
//! in question are far above `b`. All in all, `23 u m + 9 u |o|` exceed what is needed by more than their
//! own rounding.

use super::leaf::{ANY_HEIGHT_SLACK, EDGE_SLACK_FAST, END_SLACK, Lines, SLOPE_SLACK, UNDERFLOW};
use super::simd::Vector;
use crate::geometry::{Aabb, TriangleMesh};
use crate::intersect::Mode;
use crate::ray::Ray;

pub(super) const UNIT: f32 = 1.0 / (1u32 << 24) as f32;
pub(super) const OF_EXTENT: f32 = 23.0 * UNIT;
const OF_ORIGIN: f32 = 9.0 * UNIT;
/// `2^-100`.
pub(super) const OF_UNDERFLOW: f32 = 1.0 / (1u128 << 100) as f32;

/// Products up to here are far from overflow: `2^124`.
pub(super) const LARGEST_REACH: f32 = (1u128 << 124) as f32;

/// Rays with longer or shorter directions, or further out, are odd: for others no number of the box
/// and triangle tests overflows, and what underflows is bounded.
const SHORTEST: f32 = 1.0 / (1u64 << 20) as f32;
const LONGEST: f32 = (1u64 << 20) as f32;
pub(super) const FARTHEST: f32 = (1u64 << 40) as f32;
/// As [`PreparedRay`] has it.
const SMALLEST_SHARE: f32 = 1.0 / (1u64 << 60) as f32;

/// Whether a valid ray is not odd; `extent` is that of the scene from its origin.
pub(super) fn is_plain(ray: &Ray, extent: f32) -> bool {
    let (o, d) = (ray.origin.abs(), ray.direction.abs());
    let in_reach = o.x + o.y + o.z < FARTHEST && extent < FARTHEST;
    in_reach && d.x + d.y + d.z < LONGEST && d.max_element() >= SHORTEST
}

/// The largest distance on an axis between the origin and a point of `bounds`.
pub(super) fn extent_from(ray: &Ray, bounds: &Aabb) -> f32 {
    (ray.origin - bounds.min).max(bounds.max - ray.origin).max_element()
}

/// What rays are tested against, and how.
#[derive(Clone, Copy)]
pub(super) struct Target<'a> {
    pub(super) bounds: &'a Aabb,
    pub(super) mesh: &'a TriangleMesh,
    pub(super) mode: Mode,
}

/// A ray as it was given, or one in each lane.
#[derive(Clone, Copy)]
pub(super) struct Given<V: Vector> {
    pub(super) origin: [V::Floats; 3],
    pub(super) direction: [V::Floats; 3],
    pub(super) t_min: V::Floats,
    pub(super) t_max: V::Floats,
}

/// What it is tested against boxes with.
#[derive(Clone, Copy)]
pub(super) struct Slabs<V: Vector> {
    pub(super) reciprocal: [V::Floats; 3],
    /// Subtracted from the products of entry planes and reciprocals.
    pub(super) near: [V::Floats; 3],
    /// Subtracted from those of exit planes.
    pub(super) far: [V::Floats; 3],
    pub(super) t_min: V::Floats,
    pub(super) t_max: V::Floats,
    /// What any-hit rays' exits are held against in place of `t_min`: not negative.
    pub(super) begin: V::Floats,
}

/// What it is tested with against boxes, and against triangles; and which rays are not odd: valid, and of
/// common size. Numbers of odd ones mean nothing.
#[inline(always)]
pub(super) fn prepare<V: Vector>(
    v: V,
    given: &Given<V>,
    target: Target<'_>,
) -> (Slabs<V>, Lines<V>, u64) {
    let Given { origin, direction, t_min, t_max } = *given;
    let size = [v.abs(direction[0]), v.abs(direction[1]), v.abs(direction[2])];
    let far_out = [v.abs(origin[0]), v.abs(origin[1]), v.abs(origin[2])];
    let largest = v.max(v.max(size[0], size[1]), size[2]);
    let length = v.add(v.add(size[0], size[1]), size[2]);
    let distance = v.add(v.add(far_out[0], far_out[1]), far_out[2]);
    let mut extent = v.splat(0.0);
    for (axis, origin) in origin.iter().enumerate() {
        let (lower, upper) = (v.splat(target.bounds.min[axis]), v.splat(target.bounds.max[axis]));
        extent = v.max(v.max(v.sub(*origin, lower), v.sub(upper, *origin)), extent);
    }
    // Of NaN no comparison holds.
    let in_reach = v.both(
        v.less(distance, v.splat(FARTHEST)),
        v.both(v.less(extent, v.splat(FARTHEST)), v.less(length, v.splat(LONGEST))),
    );
    let plain = v.both(
        v.both(in_reach, v.less_equal(v.splat(SHORTEST), largest)),
        v.less_equal(t_min, t_max),
    );
    let scene_pad = v.mul_add(extent, v.splat(OF_EXTENT), v.splat(OF_UNDERFLOW));
    let zero = v.splat(0.0);
    let smallest = v.mul(largest, v.splat(SMALLEST_SHARE));
    let (mut reciprocals, mut least_reciprocal) = ([zero; 3], v.splat(f32::INFINITY));
    for axis in 0..3 {
        let reciprocal = v.div(v.splat(1.0), v.max(size[axis], smallest));
        least_reciprocal = v.min(reciprocal, least_reciprocal);
        reciprocals[axis] = v.flip_sign(reciprocal, direction[axis]);
    }
    let slack = v.mul(scene_pad, v.mul(least_reciprocal, v.splat(1.0 + 4.0 * UNIT)));
    let later = v.add(slack, v.max(v.sub(zero, t_min), zero));
    let (mut near, mut far) = ([zero; 3], [zero; 3]);
    for axis in 0..3 {
        let (o, d, reciprocal) = (origin[axis], direction[axis], reciprocals[axis]);
        let forwards = v.flip_sign(v.mul_add(far_out[axis], v.splat(OF_ORIGIN), scene_pad), d);
        near[axis] = v.mul(v.add(o, forwards), reciprocal);
        far[axis] = v.sub(v.mul(v.sub(o, forwards), reciprocal), later);
    }
    let slabs = Slabs {
        reciprocal: reciprocals,
        near,
        far,
        t_min: v.sub(t_min, slack),
        t_max: v.add(t_max, later),
        begin: v.max(t_min, zero),
    };
    // Four times as far as any hit, which lies in the scene.
    let beyond = v.mul(v.mul(extent, v.splat(4.0)), least_reciprocal);
    let before = v.sub(zero, beyond);
    let start = v.min(v.max(t_min, before), beyond);
    let end = v.max(v.min(t_max, beyond), before);
    let unit = v.mul(length, v.splat(END_SLACK));
    let tiny = v.splat(UNDERFLOW);
    let lines = Lines {
        origin,
        direction,
        start,
        end,
        slope_slack: v.mul(length, v.splat(SLOPE_SLACK)),
        edge_slack: match target.mode {
            Mode::Exact => tiny,
            // What the plain test's sheared coordinates are off by.
            Mode::Fast => v.mul_add(v.mul(extent, length), v.splat(EDGE_SLACK_FAST), tiny),
        },
        start_slack: v.mul_add(v.abs(start), unit, tiny),
        end_slack: v.mul_add(v.abs(end), unit, tiny),
        height_slack: v.mul(extent, v.splat(ANY_HEIGHT_SLACK)),
    };
    (slabs, lines, v.bits(plain))
}

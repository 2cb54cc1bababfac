//! Boxes around what a stream's rays may touch, held against all children of a node at once: for most
//! children there is no need to ask each ray.
//!
//! # Why no child is overlooked
//!
//! Let the [box test](crate::intersect) find that a ray is in a child's box, by its padding of less than
//! `20 u m + 4 u |o|` and at a `t` that lies outside of the ray's interval by less than what takes it over
//! the same way; with `u = 2^-24`, and `m` the scene's extent seen from the origin `o`. Where the interval is
//! cut (see [`Numbers`](super::rays::Numbers)), the ray is outside of the scene by three times its extent,
//! so `t` is not beyond that. Ends of the interval are off by less than `12 u m + 2 u |o|`. So the child's
//! box comes within `52 u m + 10 u |o|` of the box around all starts and ends, less than what that is padded
//! by.

use super::group::of_group;
use super::leaf::SLOPE_SLACK;
use super::numbers::UNIT;
use super::rays::{Rays, STREAM, load_3};
use super::simd::{Simd, Wide};
use crate::geometry::Aabb;
use crate::tree::Node8;

/// Two corners of a box.
type Corners = [[f32; 3]; 2];

/// What holds all rays of a stream.
pub(super) struct Around {
    /// Where they start.
    starts: Corners,
    /// All that they may touch.
    reach: Corners,
}

impl Around {
    /// What tells nothing of any child.
    pub(super) const UNBOUNDED: Self = Self {
        starts: [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]],
        reach: [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]],
    };

    /// Of those of a stream.
    #[inline(always)]
    pub(super) fn new<W: Wide>(w: W, rays: &Rays<'_>) -> Self {
        if !rays.are_plain || rays.valid == 0 {
            return Self::UNBOUNDED;
        }
        let first = rays.valid.trailing_zeros() as usize / W::GROUP;
        let mut longest = way(w, rays, first);
        let mut least = ends_of(w, rays, first);
        let mut most = least;
        for group in first + 1..STREAM / W::GROUP {
            if of_group::<W>(rays.valid, group) == 0 {
                continue;
            }
            for (end, points) in ends_of(w, rays, group).into_iter().enumerate() {
                for (axis, number) in points.into_iter().enumerate() {
                    least[end][axis] = w.min(number, least[end][axis]);
                    most[end][axis] = w.max(number, most[end][axis]);
                }
            }
            longest = w.max(way(w, rays, group), longest);
        }
        // Origins are no further than this from starts.
        let way = w.most(longest) * (1.01 / SLOPE_SLACK);
        let (mut starts, mut reach, mut extent) = ([[0.0; 3]; 2], [[0.0; 3]; 2], 0.0);
        for axis in 0..3 {
            let lower = [w.least(least[0][axis]), w.least(least[1][axis])];
            let upper = [w.most(most[0][axis]), w.most(most[1][axis])];
            (starts[0][axis], starts[1][axis]) = (lower[0], upper[0]);
            reach[0][axis] = if lower[0] < lower[1] { lower[0] } else { lower[1] };
            reach[1][axis] = if upper[0] > upper[1] { upper[0] } else { upper[1] };
            let Aabb { min, max } = rays.bounds();
            for distance in [upper[0] - min[axis], max[axis] - lower[0]] {
                extent = if distance > extent { distance } else { extent };
            }
        }
        let of_all = 64.0 * UNIT * (extent + way) + f32::MIN_POSITIVE;
        for axis in 0..3 {
            let (lower, upper) = (-starts[0][axis], starts[1][axis]);
            let far_out = if lower > upper { lower } else { upper };
            let pad = 32.0 * UNIT * (far_out.abs() + way) + of_all;
            reach[0][axis] -= pad;
            reach[1][axis] += pad;
        }
        Self { starts, reach }
    }

    /// Of a node's children those that all rays start in, and those that any may touch, one bit each.
    #[inline(always)]
    pub(super) fn sort<S: Simd>(&self, s: S, node: &Node8) -> (u32, u32) {
        let [mut all, mut some] = self.on_axis(s, node, 0);
        for axis in 1..3 {
            let [holds, touches] = self.on_axis(s, node, axis);
            (all, some) = (s.both(all, holds), s.both(some, touches));
        }
        (s.bits(all) as u32, s.bits(some) as u32 & node.occupied())
    }

    /// As [`sort`](Self::sort), on one axis.
    #[inline(always)]
    fn on_axis<S: Simd>(&self, s: S, node: &Node8, axis: usize) -> [S::Mask; 2] {
        let (lower, upper) = (s.load(&node.planes[axis][0]), s.load(&node.planes[axis][1]));
        let within = |least: f32, most: f32| {
            s.both(s.less_equal(lower, s.splat(least)), s.less_equal(s.splat(most), upper))
        };
        let (starts, reach) = (&self.starts, &self.reach);
        [within(starts[0][axis], starts[1][axis]), within(reach[1][axis], reach[0][axis])]
    }
}

/// How far rays of a group start from their origins, at most, in units of [`SLOPE_SLACK`].
#[inline(always)]
fn way<W: Wide>(w: W, rays: &Rays<'_>, group: usize) -> W::Floats {
    w.mul(w.abs(w.load(&rays.start, group)), w.load(&rays.slope_slack, group))
}

/// Where rays of a group start and end.
#[inline(always)]
fn ends_of<W: Wide>(w: W, rays: &Rays<'_>, group: usize) -> [[W::Floats; 3]; 2] {
    let (origin, direction) = (load_3(w, &rays.origin, group), load_3(w, &rays.direction, group));
    let (start, end) = (w.load(&rays.start, group), w.load(&rays.end, group));
    let mut points = [origin; 2];
    for axis in 0..3 {
        points[0][axis] = w.mul_add(direction[axis], start, origin[axis]);
        points[1][axis] = w.mul_add(direction[axis], end, origin[axis]);
    }
    points
}

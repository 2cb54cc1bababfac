//! Up to 64 rays side by side, with what the conservative tests compute with.
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
//! So it is enough that `P >= (16.01 + 2.01 + 2.1) u m + (3.1 + 2.01 + 1.1) u |o|`, which `21 u m + 7
//! u |o|` exceeds by more than its own rounding. What underflow takes, at most `2^-105` in units of
//! space, is in a constant. Exits and descending rays are mirror images. Nothing overflows, as rays
//! for which something might are left unbounded on that axis.

use super::group::of_group;
use super::simd::{LANES, Simd, Wide};
use crate::geometry::{Aabb, Triangle, Vec3};
use crate::intersect::PreparedRay;
use crate::ray::Ray;

/// Rays of a stream: as many as bits in a word.
pub(super) const STREAM: usize = 64;

const UNIT: f32 = 1.0 / (1u32 << 24) as f32;
const OF_EXTENT: f32 = 21.0 * UNIT;
const OF_ORIGIN: f32 = 7.0 * UNIT;
/// `2^-100`.
const OF_UNDERFLOW: f32 = 1.0 / (1u128 << 100) as f32;

/// Products up to here are far from overflow: `2^124`.
const LARGEST_REACH: f32 = (1u128 << 124) as f32;

/// As [`PreparedRay`] has them.
const SHORTEST: f32 = 1.0 / (1u64 << 40) as f32;
const LONGEST: f32 = (1u64 << 40) as f32;
const SMALLEST_SHARE: f32 = 1.0 / (1u64 << 60) as f32;

/// A place without a ray.
pub(super) const NOBODY: u16 = u16::MAX;

/// One number for each ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Row(pub(super) [f32; STREAM]);

impl Row {
    const ZERO: Self = Self([0.0; STREAM]);

    /// Those of eight rays.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> &[f32; LANES] {
        &self.0.as_chunks::<LANES>().0[group]
    }

    #[inline(always)]
    fn group_mut(&mut self, group: usize) -> &mut [f32; LANES] {
        &mut self.0.as_chunks_mut::<LANES>().0[group]
    }
}

/// The rays of a stream.
pub(super) struct Rays {
    pub(super) reciprocal: [Row; 3],
    /// Subtracted from the products of entry planes and reciprocals.
    pub(super) near: [Row; 3],
    /// Subtracted from those of exit planes.
    pub(super) far: [Row; 3],
    /// Interval of the box test.
    pub(super) t_min: Row,
    pub(super) t_max: Row,
    pub(super) origin: [Row; 3],
    /// NaN for rays that the scalar test alone is to decide on.
    pub(super) direction: [Row; 3],
    /// The interval as given.
    pub(super) start: Row,
    pub(super) end: Row,
    /// Bound on the error of products of unit normals with the direction.
    pub(super) slope_slack: Row,
    /// As in the watertight triangle test.
    pub(super) shear: [Row; 2],
    /// The origin, in the order of the sheared axes.
    pub(super) turned_origin: [Row; 3],
    /// Index of the direction's largest component, as bits.
    pub(super) axis: Row,
    /// For each group the signs of the directions, one bit for each axis.
    pub(super) octants: [u8; STREAM / LANES],
    /// What the differences of corners and origin are multiplied by for the two sheared coordinates.
    pub(super) across: [[Row; 3]; 2],
    /// An edge function of sheared corners that is larger than this times the corners' largest
    /// distance (as a sum of components) has the sign of the exact one, by far.
    ///
    /// A sheared coordinate is off by at most `d = 6.5 u m` (see [`intersect`](crate::intersect)), and
    /// the sum `r` of two of them is at most `4 m`. So products and their difference are off by at
    /// most `2 d r + 2 u r^2 < 22 u m r`. This is 42: then the exact line passes each edge by more
    /// than `20 u m r`, a weight of the opposite corner of at least `1.6 u`. `f64` finds weights to
    /// some `2^-50 m r` over the sum of the edge functions, which is far less.
    pub(super) edge_slack: Row,
    /// The rays as given.
    rays: [Ray; STREAM],
    bounds: Aabb,
    /// One bit for each ray that may hit something.
    pub(super) valid: u64,
}

impl Rays {
    pub(super) const EMPTY: Self = Self {
        reciprocal: [Row::ZERO; 3],
        near: [Row::ZERO; 3],
        far: [Row::ZERO; 3],
        t_min: Row::ZERO,
        t_max: Row::ZERO,
        origin: [Row::ZERO; 3],
        direction: [Row::ZERO; 3],
        start: Row::ZERO,
        end: Row::ZERO,
        slope_slack: Row::ZERO,
        shear: [Row::ZERO; 2],
        turned_origin: [Row::ZERO; 3],
        axis: Row::ZERO,
        octants: [0; STREAM / LANES],
        across: [[Row::ZERO; 3]; 2],
        edge_slack: Row::ZERO,
        rays: [Ray { origin: Vec3::ZERO, t_min: 0.0, direction: Vec3::ZERO, t_max: 0.0 }; STREAM],
        bounds: Aabb::EMPTY,
        valid: 0,
    };

    /// Takes up to 64 of the rays given in the place of those before, by their places among them;
    /// there is none where the place says [`NOBODY`].
    #[inline(always)]
    pub(super) fn fill<S: Simd, W: Wide>(
        &mut self,
        s: S,
        _: W,
        bounds: &Aabb,
        given: &[Ray],
        places: &[u16],
    ) {
        self.bounds = *bounds;
        self.valid = 0;
        for (group, places) in places.as_chunks::<LANES>().0.iter().enumerate() {
            let first = group * LANES;
            if places[0] == NOBODY {
                continue;
            }
            let mut rays = [&given[usize::from(places[0])]; LANES];
            let mut lanes = 0xff;
            if places[LANES - 1] == NOBODY {
                // Lanes without a ray hold another one's, so that all numbers are usable.
                let count = places.iter().take_while(|place| **place != NOBODY).count();
                lanes = (1 << count) - 1;
                for (ray, &place) in rays.iter_mut().zip(&places[..count]) {
                    *ray = &given[usize::from(place)];
                }
            } else {
                for (ray, &place) in rays.iter_mut().zip(places) {
                    *ray = &given[usize::from(place)];
                }
            }
            let kept = &mut self.rays.as_chunks_mut::<LANES>().0[group];
            for lane in 0..LANES {
                kept[lane] = *rays[lane];
            }
            let (valid, odd) = self.fill_group(s, group, rays);
            self.valid |= u64::from(valid & lanes) << first;
            let mut odd = odd & lanes;
            while odd != 0 {
                self.fill_odd(first + odd.trailing_zeros() as usize);
                odd &= odd - 1;
            }
        }
        for group in 0..STREAM / W::GROUP {
            let lanes = of_group::<W>(self.valid, group);
            if lanes != 0 {
                let any = group * W::GROUP + lanes.trailing_zeros() as usize;
                self.octants[group] = s.octant(&self.rays[any]);
            }
        }
    }

    /// Returns which of the rays are valid, and which are to be done one by one.
    #[inline(always)]
    fn fill_group<S: Simd>(&mut self, s: S, group: usize, rays: [&Ray; LANES]) -> (u32, u32) {
        let [ox, oy, oz, t_min, dx, dy, dz, t_max] = s.rays(rays);
        let (origin, direction) = ([ox, oy, oz], [dx, dy, dz]);
        let size = [s.abs(dx), s.abs(dy), s.abs(dz)];
        let largest = s.max(s.max(size[0], size[1]), size[2]);
        let mut extent = s.splat(0.0);
        for (axis, origin) in origin.iter().enumerate() {
            let (lower, upper) = (s.splat(self.bounds.min[axis]), s.splat(self.bounds.max[axis]));
            extent = s.max(s.abs(s.sub(lower, *origin)), extent);
            extent = s.max(s.abs(s.sub(upper, *origin)), extent);
        }
        let scene_pad = s.add(s.mul(extent, s.splat(OF_EXTENT)), s.splat(OF_UNDERFLOW));
        let smallest = s.mul(largest, s.splat(SMALLEST_SHARE));
        // Of NaN and infinity no comparison holds.
        let infinity = s.splat(f32::INFINITY);
        let mut valid = s.both(
            s.both(s.less_equal(t_min, t_max), s.less(s.splat(0.0), largest)),
            s.less(largest, infinity),
        );
        let mut plain = s.both(
            s.less_equal(s.splat(SHORTEST), largest),
            s.less_equal(largest, s.splat(LONGEST)),
        );
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            let clamped = s.copysign(s.max(size[axis], smallest), d);
            let reciprocal = s.div(s.splat(1.0), clamped);
            let far_out = s.abs(o);
            let pad = s.add(s.mul(far_out, s.splat(OF_ORIGIN)), scene_pad);
            let forwards = s.copysign(pad, d);
            s.store(self.origin[axis].group_mut(group), o);
            s.store(self.direction[axis].group_mut(group), d);
            s.store(self.reciprocal[axis].group_mut(group), reciprocal);
            s.store(self.near[axis].group_mut(group), s.mul(s.add(o, forwards), reciprocal));
            s.store(self.far[axis].group_mut(group), s.mul(s.sub(o, forwards), reciprocal));
            let reach = s.abs(s.mul(s.add(far_out, extent), reciprocal));
            plain = s.both(plain, s.less(reach, s.splat(LARGEST_REACH)));
            // The largest component does not show one that is NaN.
            valid = s.both(valid, s.both(s.less(far_out, infinity), s.less(size[axis], infinity)));
        }
        let reach = s.add(s.add(size[0], size[1]), size[2]);
        s.store(self.slope_slack.group_mut(group), s.mul(reach, s.splat(8.0 * UNIT)));
        s.store(self.start.group_mut(group), t_min);
        s.store(self.end.group_mut(group), t_max);
        s.store(self.edge_slack.group_mut(group), s.add(scene_pad, scene_pad));
        let slack = s.div(scene_pad, largest);
        s.store(self.t_min.group_mut(group), s.sub(t_min, slack));
        s.store(self.t_max.group_mut(group), s.add(t_max, slack));

        let x_largest = s.both(s.less_equal(size[1], size[0]), s.less_equal(size[2], size[0]));
        let y_largest = s.less_equal(size[2], size[1]);
        let largest = s.select(x_largest, dx, s.select(y_largest, dy, dz));
        let first = s.div(s.select(x_largest, dy, s.select(y_largest, dz, dx)), largest);
        let second = s.div(s.select(x_largest, dz, s.select(y_largest, dx, dy)), largest);
        s.store(self.shear[0].group_mut(group), first);
        s.store(self.shear[1].group_mut(group), second);
        let (zero, one) = (s.splat(0.0), s.splat(1.0));
        let (first, second) = (s.sub(zero, first), s.sub(zero, second));
        // Which factor belongs to an axis, by which of them is the largest.
        let factors = [
            [[first, one, zero], [zero, first, one], [one, zero, first]],
            [[second, zero, one], [one, second, zero], [zero, one, second]],
        ];
        for (rows, [if_x, if_y, if_z]) in self.across.iter_mut().zip(factors) {
            for axis in 0..3 {
                let other = s.select(y_largest, if_y[axis], if_z[axis]);
                s.store(rows[axis].group_mut(group), s.select(x_largest, if_x[axis], other));
            }
        }

        let first = s.select(x_largest, oy, s.select(y_largest, oz, ox));
        let second = s.select(x_largest, oz, s.select(y_largest, ox, oy));
        let last = s.select(x_largest, ox, s.select(y_largest, oy, oz));
        s.store(self.turned_origin[0].group_mut(group), first);
        s.store(self.turned_origin[1].group_mut(group), second);
        s.store(self.turned_origin[2].group_mut(group), last);
        let index = |axis: u32| s.splat(f32::from_bits(axis));
        let axis = s.select(x_largest, index(0), s.select(y_largest, index(1), index(2)));
        s.store(self.axis.group_mut(group), axis);
        let (valid, plain) = (s.bits(valid), s.bits(plain));
        (valid, valid & !plain)
    }

    /// A ray that is scaled or might overflow, from what it is prepared as.
    #[cold]
    #[inline(never)]
    fn fill_odd(&mut self, index: usize) {
        let prepared = PreparedRay::new(&self.rays[index], &self.bounds).expect("the ray is valid");
        let slabs = prepared.slabs();
        let corners = [self.bounds.min, self.bounds.max];
        for axis in 0..3 {
            let (reciprocal, origin) = (slabs.reciprocal[axis], self.rays[index].origin[axis]);
            let extent = corners.map(|c| (c[axis] - origin).abs()).into_iter().fold(0.0, f32::max);
            // The padding that the planes have already is in `slabs`.
            let pad = (f64::from(extent) + f64::from(origin.abs())) * f64::from(OF_EXTENT)
                + f64::from(OF_UNDERFLOW);
            let forwards = if slabs.descending[axis] { -pad } else { pad };
            let moved = |origin: f32, by: f64| (f64::from(origin) + by) * f64::from(reciprocal);
            let near = moved(slabs.near_origin[axis], forwards) as f32;
            let far = moved(slabs.far_origin[axis], -forwards) as f32;
            let bounded = (extent + origin.abs()) * reciprocal.abs() < LARGEST_REACH;
            self.reciprocal[axis].0[index] = if bounded { reciprocal } else { 0.0 };
            self.near[axis].0[index] = if bounded { near } else { f32::INFINITY };
            self.far[axis].0[index] = if bounded { far } else { f32::NEG_INFINITY };
        }
        (self.t_min.0[index], self.t_max.0[index]) = (slabs.t_min, slabs.t_max);
        self.direction.iter_mut().for_each(|row| row.0[index] = f32::NAN);
        let shear = prepared.shear();
        self.axis.0[index] = f32::from_bits(shear.axes[2] as u32);
        for (row, axis) in self.turned_origin.iter_mut().zip(shear.axes) {
            row.0[index] = shear.origin[axis];
        }
        for (row, factor) in self.shear.iter_mut().zip(shear.factors) {
            row.0[index] = factor;
        }
        for ((rows, factor), one) in self.across.iter_mut().zip(shear.factors).zip(shear.axes) {
            for (axis, row) in rows.iter_mut().enumerate() {
                row.0[index] = match axis {
                    _ if axis == shear.axes[2] => -factor,
                    _ if axis == one => 1.0,
                    _ => 0.0,
                };
            }
        }
    }

    /// Whether a ray hits a triangle that no test here speaks against.
    #[inline(never)]
    pub(super) fn confirm(&self, index: usize, triangle: &Triangle) -> bool {
        let ray = &self.rays[index];
        PreparedRay::new(ray, &self.bounds).is_some_and(|ray| ray.triangle(triangle).is_some())
    }
}

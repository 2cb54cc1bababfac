//! The distances of eight hits at once: lane by lane what [`PreparedRay::triangle`] computes for a
//! triangle that it accepts, operation by operation, so to the same bits.
//!
//! One loop without a branch, for compilers to make vectors of, in functions that are compiled for
//! whatever instructions the caller runs on.

use super::{PADDING, PLAIN, SMALLEST_SHARE};
use crate::geometry::{Aabb, Triangle};
use crate::ray::Ray;
use crate::vectorized::{cross, dot, minus};

/// Hits that are computed at once.
pub(crate) const HIT_LANES: usize = 8;

type Lanes = [f32; HIT_LANES];

/// Rays, each with a triangle that its line passes through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HitLanes {
    origin: [Lanes; 3],
    direction: [Lanes; 3],
    t_min: Lanes,
    t_max: Lanes,
    corners: [[Lanes; 3]; 3],
}

impl HitLanes {
    pub(crate) const ZERO: Self = Self {
        origin: [[0.0; HIT_LANES]; 3],
        direction: [[0.0; HIT_LANES]; 3],
        t_min: [0.0; HIT_LANES],
        t_max: [0.0; HIT_LANES],
        corners: [[[0.0; HIT_LANES]; 3]; 3],
    };

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, ray: &Ray, triangle: &Triangle) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
            for (corners, corner) in self.corners.iter_mut().zip(&triangle.0) {
                corners[axis][lane] = corner[axis];
            }
        }
        (self.t_min[lane], self.t_max[lane]) = (ray.t_min, ray.t_max);
    }

    /// For each lane with a valid ray the distance at which it hits the triangle, `bounds` being those of
    /// the scene; NaN where the scalar test is to be asked.
    #[inline(always)]
    pub(crate) fn distances(&self, bounds: &Aabb) -> Lanes {
        let mut distances = [f32::NAN; HIT_LANES];
        for (lane, distance) in distances.iter_mut().enumerate() {
            let of = |rows: &[Lanes; 3]| [rows[0][lane], rows[1][lane], rows[2][lane]];
            let (o, d) = (of(&self.origin), of(&self.direction));
            let corners = [of(&self.corners[0]), of(&self.corners[1]), of(&self.corners[2])];
            let (t_min, t_max) = (self.t_min[lane], self.t_max[lane]);

            // Where the line meets the plane, and whether in the triangle.
            let [a, b, c] = corners.map(wide);
            let (ab, ac) = (minus(b, a), minus(c, a));
            let (to_plane, direction) = (minus(a, wide(o)), wide(d));
            let normal = cross(ab, ac);
            let slope = dot(normal, direction);
            let t = dot(normal, to_plane) / slope;
            let reciprocal = 1.0 / slope;
            let moment = cross(to_plane, direction).map(|m| m * reciprocal);
            let (v, w) = (dot(ac, moment), -dot(ab, moment));
            let is_inside = (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0);
            let is_within = (t >= f64::from(t_min)) & (t <= f64::from(t_max)) & t.is_finite();

            // Where the ray enters the box around that point.
            let largest = max(max(d[0].abs(), d[1].abs()), d[2].abs());
            let (low, high) = (bounds.min.to_array(), bounds.max.to_array());
            let mut extent = 0.0;
            for axis in 0..3 {
                extent =
                    max(extent, max((low[axis] - o[axis]).abs(), (high[axis] - o[axis]).abs()));
            }
            let pad = max(extent * PADDING, f32::MIN_POSITIVE);
            let slack = pad / largest;
            let (mut entry, mut exit) = (t_min - slack, t_max + slack);
            for axis in 0..3 {
                let (o, d) = (o[axis], d[axis]);
                let clamped = max(d.abs(), largest * SMALLEST_SHARE).copysign(d);
                let reciprocal = 1.0 / clamped;
                let (up, down) = (max(o + pad, o.next_up()), min(o - pad, o.next_down()));
                let [a, b, c] = [corners[0][axis], corners[1][axis], corners[2][axis]];
                let (lower, upper) = (min(min(a, b), c), max(max(a, b), c));
                let point = wide(corners[0])[axis] + ab[axis] * v + ac[axis] * w;
                let nearest = min(max(point as f32, lower), upper);
                let reach = nearest.abs() * Triangle::POINT_REACH + f32::MIN_POSITIVE;
                let (lower, upper) = (max(nearest - reach, lower), min(nearest + reach, upper));
                let descending = d.is_sign_negative();
                let (near, far) = if descending { (upper, lower) } else { (lower, upper) };
                let (near_origin, far_origin) = if descending { (down, up) } else { (up, down) };
                entry = max(entry, (near - near_origin) * reciprocal);
                exit = min(exit, (far - far_origin) * reciprocal);
            }
            let is_plain = (largest >= *PLAIN.start()) & (largest <= *PLAIN.end());
            let is_hit = is_plain & is_inside & is_within & (slope != 0.0) & (entry <= exit);
            *distance = if is_hit { max(t as f32, entry) + 0.0 } else { f32::NAN };
        }
        distances
    }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn wide(a: [f32; 3]) -> [f64; 3] {
    a.map(f64::from)
}

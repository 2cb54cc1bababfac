//! Ray against box and ray against triangle: the two tests that every native kernel shares.
//!
//! Arithmetic is plain `f32` without fused operations, so that every kernel, build and machine
//! gives the same bits.
//!
//! # Why trees cannot change an answer
//!
//! A triangle counts as hit only if the [triangle test](PreparedRay::triangle) accepts it *and* the
//! ray meets `Q` by the same [box test](PreparedRay::enter) that trees use. `Q` is a [tiny
//! box](Triangle::box_around) around a point `q` of the triangle that the ray's line passes; it lies
//! in the triangle's own box. The distance reported is not before `Q` is entered.
//!
//! That box test is monotone: a box that contains a box the ray meets is itself met, and not entered
//! later, because subtraction, multiplication by a constant, `min` and `max` are monotone in
//! floating point. So where boxes hold whole triangles, every ancestor of a hit triangle is met, and
//! no later than the hit: brute force and all such trees agree on every ray.
//!
//! The same holds where a plane splits a triangle's box, at any depth, and each part keeps at least
//! what lies in it of `Q`. Let the ray enter `Q` at `t`. If both parts hold some of `Q`, it leaves
//! the first one's at the plane's padded exit and enters the second one's at the padded entry, which
//! is not later; so `t` lies between entry and exit of one of them, by the box test. If one part
//! holds all of `Q`, of that. So there is a leaf that lists the triangle, and it and all boxes above
//! it are met and entered at `t` or before. Builders that clip triangles owe no more than that, and
//! `build::clip` shows that they pay it.
//!
//! # Why the box costs no hit
//!
//! Where the line passes through the triangle in `f64`, `q` is that point. Else it passes by an edge
//! within the rounding of the sheared `f32` coordinates that the triangle test sees; of those the
//! three edge functions in `f64` have one rounding each (products are exact) and no mixed signs, so
//! that they give weights of the corners to 50 bits, and `q` is the corners so weighted. Sheared, it
//! is off the line by no more than the corners are. The boxes are padded by more than that (see
//! `PADDING`): the ray's *line* meets `Q` whenever the triangle test accepts, and the ray does
//! unless `q` and the distance from the plane lie on two sides of an end of the interval: a line
//! that all but lies in the plane and passes beside the triangle.

//! # Exact mode
//!
//! [`PreparedRay::hits_exactly`] answers for the numbers as given, so its hits need no such box: what is
//! to be shown is that trees lose none. Let the exact ray be at `t` in a box (at a point of a triangle
//! that the box holds, or a cell's part of it). With `q` a plane's distance from the origin on an axis,
//! at most `m`, the entry computed is at most `(q - x)(1 + 3 e) / d` or `(q - x)(1 - 3 e) / d`,
//! where `x` is how far the origin was moved forwards: not after `q / d`, and so not after `t`,
//! if `x >= 3.1 e m`. It is: by `PADDING`, less the rounding of the moved origin, as long as `|o| <= 12 m`,
//! and for larger `|o|` as it is moved by `e |o|` at least. Exits are mirror images. A component of the
//! direction that counts as larger than it is moves a point by `2^-60 m` at most, scaling an extreme
//! direction by less than `2^-126` (its smallest padding), and the ends of the interval only outwards.
//! So every box that the ray is in at `t` is met, every plane is on the right side, and the leaf that
//! holds the point is visited: [`build::clip`](crate::build) keeps, for each point of a triangle, more
//! than the point. The wide kernels' box test accepts what this one accepts.

mod exact;
mod lanes;
mod mode;
mod watertight;

pub use exact::Stage;
pub(crate) use exact::hits as hits_exactly;
pub(crate) use lanes::{HIT_LANES, HitLanes};
pub use mode::{Exact, Fast, Mode, TriangleTest};

use crate::geometry::{Aabb, Triangle};
use crate::ray::{Hit, Ray};
use glam::Vec3;

/// Padding of boxes in units of the scene's extent seen from the ray's origin: 16 half-ulps.
///
/// With `e = 2^-24` and `m` the largest `|vertex - origin|` on any axis, the sheared coordinates of
/// the triangle test carry an absolute error of at most `6.5 e m`, and a plane distance of the box
/// test one of at most `3 e m` (times the reciprocal direction); 16 covers both.
const PADDING: f32 = 16.0 / (1u32 << 24) as f32;

/// In the same units: of an edge function, over the corners' distance across the ray.
///
/// A sheared coordinate is off by at most `d = 6.5 e m`, and the sum `r` of two of them is at most `4
/// m`. So products and their difference are off by at most `2 d r + 2 e r^2 < 22 e m r`.
const EDGE_SLACK: f32 = 24.0 / (1u32 << 24) as f32;

/// The direction's components count as at least this share of the largest: keeps reciprocals
/// finite. Over the scene's extent the ray moves `2^-60` of it along such an axis, far less than
/// the padding.
const SMALLEST_SHARE: f32 = 1.0 / (1u64 << 60) as f32;

/// Reciprocals and slacks stay finite for directions whose largest component is within these bounds.
const PLAIN: std::ops::RangeInclusive<f32> = 1.0 / (1u64 << 40) as f32..=(1u64 << 40) as f32;

/// A ray with everything that its tests can compute once.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Subtracted from the entry planes: the origin, moved forwards by the padding.
    near_origin: Vec3,
    /// Subtracted from the exit planes: the origin, moved backwards by the padding.
    far_origin: Vec3,
    reciprocal: Vec3,
    /// For each axis 1 if the entry plane is the upper one, else 0.
    descending: [usize; 3],
    /// Interval of the box test: the ray's own, padded.
    box_t_min: f32,
    box_t_max: f32,
    shear: watertight::Shear,
    /// An edge function of sheared corners beyond this times the corners' largest distance (as a sum
    /// of components) has the sign of the exact one.
    edge_slack: f32,
    /// The ray, its direction scaled if it is extreme.
    ray: Ray,
    /// The ray as given.
    given: Ray,
    /// Multiplies `t` to undo the scaling of extreme directions; a power of two.
    t_scale: f32,
}

/// What the box test computes with, for kernels that test several rays at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    pub(crate) near_origin: Vec3,
    pub(crate) far_origin: Vec3,
    pub(crate) reciprocal: Vec3,
    pub(crate) descending: [bool; 3],
    /// Infinite rather than NaN, which the box test ignores.
    pub(crate) t_min: f32,
    pub(crate) t_max: f32,
}

impl PreparedRay {
    /// Prepares `ray` for tests against boxes and triangles within `bounds`; `None` if it hits
    /// nothing by definition (see [`Ray`]).
    #[inline]
    pub fn new(ray: &Ray, bounds: &Aabb) -> Option<Self> {
        let length = ray.direction.abs().max_element();
        let valid = ray.origin.is_finite()
            && ray.direction.is_finite()
            && length > 0.0
            && ray.t_min <= ray.t_max;
        if !valid {
            return None;
        }
        if PLAIN.contains(&length) {
            Some(Self::with_scale(*ray, *ray, bounds, 1.0))
        } else {
            Some(Self::rescaled(ray, length, bounds))
        }
    }

    /// Scales an extreme direction by a power of two, which changes no hit.
    #[cold]
    fn rescaled(ray: &Ray, length: f32, bounds: &Aabb) -> Self {
        let exponent = f64::from(length).log2().floor() as i32;
        // Two factors, as 2^-149 and its inverse do not both exist in f32.
        let (half, rest) = (exponent / 2, exponent - exponent / 2);
        let power = |n: i32| (n as f32).exp2();
        let direction = ray.direction * power(-half) * power(-rest);
        let (t_min, t_max) =
            (ray.t_min * power(half) * power(rest), ray.t_max * power(half) * power(rest));
        let scale = power(-exponent.clamp(-126, 126));
        let scaled = Ray { origin: ray.origin, t_min, direction, t_max };
        // What scaling rounded off bounds do not cover.
        Self { edge_slack: f32::INFINITY, ..Self::with_scale(scaled, *ray, bounds, scale) }
    }

    #[inline(always)]
    fn with_scale(ray: Ray, given: Ray, bounds: &Aabb, t_scale: f32) -> Self {
        let Ray { origin, t_min, direction, t_max } = ray;
        let extent = (bounds.min - origin).abs().max((bounds.max - origin).abs()).max_element();
        let pad = (extent * PADDING).max(f32::MIN_POSITIVE);
        let largest = direction.abs().max_element();
        let clamped =
            direction.abs().max(Vec3::splat(largest * SMALLEST_SHARE)).copysign(direction);
        let reciprocal = clamped.recip();
        let descending = [
            direction.x.is_sign_negative(),
            direction.y.is_sign_negative(),
            direction.z.is_sign_negative(),
        ];
        // Far from the world's origin `origin + pad` may round back to `origin`: go at least one
        // representable number on.
        let up = |o: f32| (o + pad).max(o.next_up());
        let down = |o: f32| (o - pad).min(o.next_down());
        let moved = |o: f32, backwards: bool| if backwards { down(o) } else { up(o) };
        let [sx, sy, sz] = descending;
        let near_origin = Vec3::new(moved(origin.x, sx), moved(origin.y, sy), moved(origin.z, sz));
        let far_origin =
            Vec3::new(moved(origin.x, !sx), moved(origin.y, !sy), moved(origin.z, !sz));
        let t_slack = pad / largest;
        Self {
            near_origin,
            far_origin,
            reciprocal,
            descending: descending.map(usize::from),
            box_t_min: t_min - t_slack,
            box_t_max: t_max + t_slack,
            shear: watertight::Shear::new(origin, direction),
            edge_slack: extent * EDGE_SLACK,
            ray,
            given,
            t_scale,
        }
    }

    /// Where the ray enters `bounds` within its interval, cut at `t_max`; `None` if it misses.
    /// Conservative: padded, never too late.
    #[inline(always)]
    fn enter_until(&self, bounds: &Aabb, t_max: f32) -> Option<f32> {
        let [entry, exit] = self.interval_until(bounds, t_max);
        (entry <= exit).then_some(entry)
    }

    #[inline(always)]
    fn interval_until(&self, bounds: &Aabb, t_max: f32) -> [f32; 2] {
        let corners = [bounds.min, bounds.max];
        let [x, y, z] = self.descending;
        let near = Vec3::new(corners[x].x, corners[y].y, corners[z].z);
        let far = Vec3::new(corners[1 - x].x, corners[1 - y].y, corners[1 - z].z);
        let entry = (near - self.near_origin) * self.reciprocal;
        let exit = (far - self.far_origin) * self.reciprocal;
        let entry = entry.x.max(entry.y).max(entry.z.max(self.box_t_min));
        let exit = exit.x.min(exit.y).min(exit.z.min(t_max));
        [entry, exit]
    }

    /// Where the ray is inside `bounds`, from its entry to its exit, within its interval; `None` if
    /// it misses. The entry is that of [`enter`](Self::enter).
    #[inline(always)]
    pub fn interval(&self, bounds: &Aabb) -> Option<[f32; 2]> {
        let [entry, exit] = self.interval_until(bounds, self.box_t_max);
        (entry <= exit).then_some([entry, exit])
    }

    /// The box test's arithmetic on one axis, for trees of single planes.
    #[inline]
    pub fn axis(&self, axis: usize) -> AxisRay {
        AxisRay {
            near_origin: self.near_origin[axis],
            far_origin: self.far_origin[axis],
            reciprocal: self.reciprocal[axis],
            descending: self.descending[axis] == 1,
        }
    }

    /// Where the ray enters `bounds` within its interval; `None` if it misses.
    #[inline(always)]
    pub fn enter(&self, bounds: &Aabb) -> Option<f32> {
        self.enter_until(bounds, self.box_t_max)
    }

    /// As [`enter`](Self::enter), for a ray that already has a hit at `hit_t` (of
    /// [`triangle`](Self::triangle)): `None` also where the box lies beyond it.
    #[inline(always)]
    pub fn enter_before(&self, bounds: &Aabb, hit_t: f32) -> Option<f32> {
        self.enter_until(bounds, self.box_t_max.min(hit_t))
    }

    /// Where the ray hits `triangle`, as an internal distance for
    /// [`enter_before`](Self::enter_before) and [`hit`](Self::hit); `None` if it misses.
    #[inline(always)]
    pub fn triangle(&self, triangle: &Triangle) -> Option<f32> {
        if self.shear.passes_through(triangle) { self.hit_distance(triangle) } else { None }
    }

    /// Whether the ray hits `triangle` in exact arithmetic on the numbers as given, and what settled
    /// that.
    #[inline(always)]
    pub fn hits_exactly(&self, triangle: &Triangle) -> (bool, Stage) {
        if self.shear.surely_passes_by(triangle, self.edge_slack) {
            (false, Stage::Single)
        } else {
            self.hits_by_wider_numbers(triangle)
        }
    }

    #[cold]
    #[inline(never)]
    fn hits_by_wider_numbers(&self, triangle: &Triangle) -> (bool, Stage) {
        exact::hits(&self.given, triangle)
    }

    /// What is left to check once the ray's line passes through the triangle: the interval, and the
    /// second condition of a hit (see the module's text). Lines rarely pass through: out of the way
    /// of the kernels' loops.
    #[cold]
    #[inline(never)]
    fn hit_distance(&self, triangle: &Triangle) -> Option<f32> {
        let crossing = watertight::plane_crossing(&self.ray, triangle)?;
        let t = crossing.t;
        if !(t >= f64::from(self.ray.t_min) && t <= f64::from(self.ray.t_max)) {
            return None;
        }
        let entry = match crossing.inside.and_then(|q| self.enter(&triangle.box_around(q))) {
            Some(entry) => entry,
            None => self.enter_where_passed(triangle)?,
        };
        // Not before the box is entered, so that a hit found earlier cannot hide this one in one
        // tree and not in another. Adding zero turns -0 into 0: ties are told by value.
        Some((t as f32).max(entry) + 0.0)
    }

    /// Where the ray enters `Q` of a triangle that it passes through by the edge tests alone.
    #[cold]
    #[inline(never)]
    fn enter_where_passed(&self, triangle: &Triangle) -> Option<f32> {
        self.enter(&triangle.box_around(self.shear.passed_point(triangle)?))
    }

    /// What the box test computes with.
    #[inline(always)]
    pub(crate) fn slabs(&self) -> Slabs {
        let or = |t: f32, unbounded: f32| if t.is_nan() { unbounded } else { t };
        Slabs {
            near_origin: self.near_origin,
            far_origin: self.far_origin,
            reciprocal: self.reciprocal,
            descending: self.descending.map(|side| side == 1),
            t_min: or(self.box_t_min, f32::NEG_INFINITY),
            t_max: or(self.box_t_max, f32::INFINITY),
        }
    }

    /// What edge functions are held against: see [`hits_exactly`](Self::hits_exactly).
    #[inline(always)]
    pub(crate) fn edge_slack(&self) -> f32 {
        self.edge_slack
    }

    /// What the triangle test computes with.
    #[inline(always)]
    pub(crate) fn shear(&self) -> &watertight::Shear {
        &self.shear
    }

    /// The hit at internal distance `t`, in the caller's units.
    pub fn hit(&self, t: f32, triangle: u32) -> Hit {
        Hit { t: t * self.t_scale, triangle }
    }
}

/// A prepared ray on one axis. [`PreparedRay::interval`] of a box is, bit for bit, the interval from
/// the latest of its entry planes' [`entry`](Self::entry) to the earliest of its exit planes'
/// [`exit`](Self::exit), cut to that of the ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct AxisRay {
    near_origin: f32,
    far_origin: f32,
    reciprocal: f32,
    /// Whether the ray goes towards lower coordinates (by sign bit, for directions of zero).
    pub descending: bool,
}

impl AxisRay {
    /// Where the ray enters what lies behind the plane at `position`; padded, never too late. Never
    /// NaN for a finite `position`, and monotone along the ray.
    #[inline(always)]
    pub fn entry(&self, position: f32) -> f32 {
        (position - self.near_origin) * self.reciprocal
    }

    /// Where the ray leaves what lies before the plane at `position`; padded, never too early, and
    /// never before its [`entry`](Self::entry).
    #[inline(always)]
    pub fn exit(&self, position: f32) -> f32 {
        (position - self.far_origin) * self.reciprocal
    }
}

#[cfg(test)]
mod tests;

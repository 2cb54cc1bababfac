//! Many shadow rays as one body: what it cannot meet stops none of them.
//!
//! A [`Shaft`] is a convex body that holds every ray of a group: all that leave some points for some
//! target, or for their hemispheres. A box or triangle that lies outside of one of its planes meets
//! no ray (Haines and Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", Eurographics
//! Workshop on Rendering 1991). What is told of a group is true of each of its rays in exact
//! arithmetic: planes give way by more than `f64` loses here, and shafts of which that cannot be said
//! are not made.

mod gate;
mod look;
mod trees;

pub(crate) use gate::Gate;
pub use look::{Budget, Entry, Hierarchy, Part, Parts, View, look};
pub use trees::{Cells, WithMesh};

use crate::geometry::{Aabb, Triangle};
use crate::tree::WIDTH;
use crate::vectorized::vectorized;
use glam::{DVec3, Vec3};

/// Planes that bound a shaft besides those of its box.
const MOST_PLANES: usize = 12;
/// Points that span a group of origins, or a target.
const MOST_POINTS: usize = 8;

/// How far planes give way, as a part of the largest coordinate of the shaft's ends.
const SLACK: f64 = 1e-9;
/// Coordinates may be so many times larger than that: a sum of products of theirs is then right to
/// less than the slack (eight roundings of `2^-53`).
const MOST_RATIO: f64 = 1e5;
/// The largest coordinate of a shaft's ends is at least this: directions of smaller ones lose digits
/// when they are rounded to `f32`, whose smallest number is `1.4e-45`.
const LEAST_SCALE: f64 = 1e-30;

/// Where rays end.
#[derive(Clone, Debug)]
pub struct Target {
    /// Ends lie in the hull of balls about these points.
    points: Points,
    /// Radius of the balls.
    radius: f64,
    /// A plane through the points, its unit normal towards the origins, if they lie in one and rays
    /// end in front of it.
    front: Option<DVec3>,
}

impl Target {
    /// All that lies within `radius` of the hull of `points`, at most eight.
    pub fn new(points: &[DVec3], radius: f64) -> Self {
        Self { points: Points::of(points), radius, front: None }
    }

    /// A flat target whose unit normal points to where rays come from: they end in front of it, by
    /// `4 f32::EPSILON` of their height above it at least.
    pub fn flat(points: &[DVec3], radius: f64, normal: DVec3) -> Self {
        Self { front: Some(normal), ..Self::new(points, radius) }
    }
}

/// A few points.
#[derive(Clone, Copy, Debug)]
struct Points {
    points: [DVec3; MOST_POINTS],
    len: usize,
}

impl Points {
    fn of(points: &[DVec3]) -> Self {
        let mut all = [DVec3::ZERO; MOST_POINTS];
        all[..points.len()].copy_from_slice(points);
        Self { points: all, len: points.len() }
    }

    /// One point, or the corners of the box around several.
    fn around(points: &[Vec3]) -> Self {
        if let [point] = points {
            return Self::of(&[point.as_dvec3()]);
        }
        let bounds = Aabb::of_points(points.iter().copied());
        let corner = |i: usize| {
            let pick = |axis: usize| [bounds.min, bounds.max][i >> axis & 1][axis];
            Vec3::new(pick(0), pick(1), pick(2)).as_dvec3()
        };
        Self { points: std::array::from_fn(corner), len: MOST_POINTS }
    }

    fn get(&self) -> &[DVec3] {
        &self.points[..self.len]
    }

    fn bounds(&self) -> [DVec3; 2] {
        let first = [self.points[0]; 2];
        self.get().iter().fold(first, |[low, high], p| [low.min(*p), high.max(*p)])
    }

    /// The least `normal . p`.
    fn least(&self, normal: DVec3) -> f64 {
        self.get().iter().map(|p| normal.dot(*p)).fold(f64::INFINITY, f64::min)
    }
}

/// A convex body around a group of rays.
#[derive(Clone, Debug)]
pub struct Shaft<'a> {
    bounds: [DVec3; 2],
    /// Centre and radius of a ball around all rays, if there is one that is of use.
    ball: Option<(DVec3, f64)>,
    /// Rays lie where `normal . x >= height`.
    planes: [(DVec3, f64); MOST_PLANES],
    plane_count: usize,
    origins: Points,
    target: Option<&'a Target>,
    /// Whether all rays that count go as far as the target. Those that leave for its horizon may be
    /// shortened, to stay above it.
    all_arrive: bool,
    slack: f64,
}

impl<'a> Shaft<'a> {
    /// Around rays that leave `origins` into the half-space above `normal`, if they share one, and
    /// are at most `radius` long, which may be infinite. `scene` holds all that they may meet. `None`
    /// if its coordinates are too large beside those of the rays.
    pub fn hemisphere(
        origins: &[Vec3],
        normal: Option<DVec3>,
        radius: f32,
        scene: &Aabb,
    ) -> Option<Self> {
        let origins = Points::around(origins);
        let bounds @ [low, high] = origins.bounds();
        // Directions are of unit length but for their rounding.
        let radius = f64::from(radius) * (1.0 + 1e-6);
        let reach = if radius.is_finite() { radius } else { 0.0 };
        let mut shaft = Self::new(origins, bounds, reach, scene)?;
        shaft.bounds = [low - radius, high + radius];
        if radius.is_finite() {
            let center = (low + high) * 0.5;
            shaft.ball = Some((center, (radius + (high - center).length()) * (1.0 + 1e-9)));
        }
        shaft.add_horizon(normal, 0.0);
        Some(shaft)
    }

    /// Around rays from `origins` to `target`, likewise; those below the horizon of `normal` do not
    /// count, and those within the target's radius of it may end before the target.
    pub fn to_target(
        origins: &[Vec3],
        normal: Option<DVec3>,
        target: &'a Target,
        scene: &Aabb,
    ) -> Option<Self> {
        let origins = Points::around(origins);
        let near = origins.bounds();
        let far = target.points.bounds();
        let far = [far[0] - target.radius, far[1] + target.radius];
        let bounds = [near[0].min(far[0]), near[1].max(far[1])];
        let mut shaft = Self::new(origins, bounds, 0.0, scene)?;
        let reach = (bounds[1] - bounds[0]).max_element();
        // Directions are rounded to `f32` after the horizon was looked at.
        shaft.add_horizon(normal, reach * f64::from(f32::EPSILON));
        if let Some(front) = target.front {
            shaft.add_front(front, target, reach);
        }
        if origins.len == 1 && target.points.len == 4 {
            shaft.add_pyramid(target);
        } else {
            shaft.add_sides(near, far);
        }
        shaft.target = Some(target);
        shaft.all_arrive = normal.is_some_and(|normal| {
            let most = -shaft.origins.least(-normal);
            target.points.least(normal) - most > target.radius + shaft.slack
        });
        Some(shaft)
    }

    fn new(origins: Points, bounds: [DVec3; 2], reach: f64, scene: &Aabb) -> Option<Self> {
        let largest = |v: [DVec3; 2]| v[0].abs().max(v[1].abs()).max_element();
        let scale = largest(bounds) + reach;
        let of_scene = largest([scene.min.as_dvec3(), scene.max.as_dvec3()]);
        let fits = scale.is_finite() && of_scene <= MOST_RATIO * scale && scale > LEAST_SCALE;
        let slack = SLACK * scale;
        fits.then_some(Self {
            bounds,
            ball: None,
            planes: [(DVec3::ZERO, 0.0); MOST_PLANES],
            plane_count: 0,
            origins,
            target: None,
            all_arrive: false,
            slack,
        })
    }

    /// Rays lie where `normal . x >= height`; `normal` of any length.
    fn add_plane(&mut self, normal: DVec3, height: f64) {
        let length = normal.length();
        if length > 1e-100 && self.plane_count < MOST_PLANES {
            self.planes[self.plane_count] = (normal / length, height / length - self.slack);
            self.plane_count += 1;
        }
    }

    fn add_horizon(&mut self, normal: Option<DVec3>, slack: f64) {
        if let Some(normal) = normal {
            self.add_plane(normal, self.origins.least(normal) - slack);
        }
    }

    /// The plane of a flat target, if no origin is close to it.
    fn add_front(&mut self, normal: DVec3, target: &Target, reach: f64) {
        let plane = normal.dot(target.points.points[0]);
        let height = self.origins.least(normal) - plane;
        if height > 1e-4 * reach {
            self.add_plane(normal, plane + 4.0 * f64::from(f32::EPSILON) * height);
        }
    }

    /// Planes through the origin and each side of a flat target of four corners in turn.
    fn add_pyramid(&mut self, target: &Target) {
        let origin = self.origins.points[0];
        let corners = [0, 1, 2, 3].map(|i| target.points.points[i] - origin);
        let turn = corners[0].cross(corners[1]).dot(corners[2]).signum();
        for side in 0..4 {
            let normal = corners[side].cross(corners[(side + 1) % 4]) * turn;
            let inside = [2, 3].map(|k| normal.dot(corners[(side + k) % 4]));
            if inside[0] > 0.0 && inside[1] > 0.0 {
                let give = target.radius * normal.length();
                self.add_plane(normal, normal.dot(origin) - give);
            }
        }
    }

    /// Planes along one axis each that touch the boxes around both ends.
    fn add_sides(&mut self, near: [DVec3; 2], far: [DVec3; 2]) {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            for (side_a, side_b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let corner = |ends: [DVec3; 2]| [ends[side_a][a], ends[side_b][b]];
                let (p, q) = (corner(near), corner(far));
                let (along_a, along_b) = (q[0] - p[0], q[1] - p[1]);
                // Inwards: up from the lower sides, down from the upper ones.
                let inward = [1.0 - 2.0 * side_a as f64, 1.0 - 2.0 * side_b as f64];
                for [na, nb] in [[-along_b, along_a], [along_b, -along_a]] {
                    if na * inward[0] > 0.0 && nb * inward[1] > 0.0 {
                        let mut normal = DVec3::ZERO;
                        (normal[a], normal[b]) = (na, nb);
                        self.add_plane(normal, na * p[0] + nb * p[1]);
                    }
                }
            }
        }
    }

    /// Whether [`view`](Self::view) may say so of a triangle.
    fn can_be_blocked(&self) -> bool {
        self.all_arrive
    }

    fn planes(&self) -> &[(DVec3, f64)] {
        &self.planes[..self.plane_count]
    }

    /// Which of eight boxes the shaft may meet, one bit each: lower and upper planes for each axis.
    pub fn meets(&self, boxes: &[[[f32; WIDTH]; 2]; 3]) -> u32 {
        vectorized(
            #[inline(always)]
            || self.meets_each(boxes),
        )
    }

    #[inline(always)]
    fn meets_each(&self, boxes: &[[[f32; WIDTH]; 2]; 3]) -> u32 {
        let boxes = boxes.map(|axis| axis.map(|side| side.map(f64::from)));
        // How far each box reaches into the shaft, at most: negative is outside.
        let mut depth = [f64::INFINITY; WIDTH];
        let mut at_most = |lane: usize, value: f64| {
            depth[lane] = if value < depth[lane] { value } else { depth[lane] };
        };
        let [low, high] = self.bounds;
        for axis in 0..3 {
            let [lower, upper] = &boxes[axis];
            for lane in 0..WIDTH {
                at_most(lane, upper[lane] - low[axis]);
                at_most(lane, high[axis] - lower[lane]);
            }
        }
        for (normal, height) in self.planes() {
            let side = |axis: usize| &boxes[axis][usize::from(normal[axis] > 0.0)];
            let (x, y, z) = (side(0), side(1), side(2));
            for lane in 0..WIDTH {
                let dot = normal.x * x[lane] + normal.y * y[lane] + normal.z * z[lane];
                at_most(lane, dot - height);
            }
        }
        if let Some((center, radius)) = self.ball {
            let mut squared = [0.0; WIDTH];
            for axis in 0..3 {
                let [lower, upper] = &boxes[axis];
                for lane in 0..WIDTH {
                    let below = lower[lane] - center[axis];
                    let above = center[axis] - upper[lane];
                    let gap = if below > above { below } else { above };
                    let gap = if gap > 0.0 { gap } else { 0.0 };
                    squared[lane] += gap * gap;
                }
            }
            for (lane, squared) in squared.into_iter().enumerate() {
                at_most(lane, radius * radius - squared);
            }
        }
        (0..WIDTH).fold(0, |mask, lane| mask | u32::from(depth[lane] >= 0.0) << lane)
    }

    /// What a triangle is to the rays.
    pub fn view(&self, triangle: &Triangle) -> View {
        let corners @ [a, b, c] = triangle.0.map(|v| v.as_dvec3());
        let (lower, upper) = (a.min(b).min(c), a.max(b).max(c));
        let [low, high] = self.bounds;
        if upper.cmplt(low).any() || lower.cmpgt(high).any() {
            return View::Open;
        }
        for (normal, height) in self.planes() {
            if corners.iter().all(|corner| normal.dot(*corner) < *height) {
                return View::Open;
            }
        }
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        // What rounding takes of a height above the plane is less.
        let scale = self.slack / SLACK;
        let products = (b - a).length() * (c - a).length();
        let slack = 1e-14 * products * (scale + a.abs().max_element());
        if !(length > 0.0 && length.is_finite()) {
            // Too small or too thin to say anything, or without area.
            return View::Partly;
        }
        if let Some((center, radius)) = self.ball {
            let height = normal.dot(center - a).abs();
            let gap = (lower - center).max(center - upper).max(DVec3::ZERO);
            if gap.length_squared() > radius * radius || height > radius * length + slack {
                return View::Open;
            }
        }
        let Some(target) = self.target else { return View::Partly };
        // Where both ends are, seen along the normal.
        let side = |points: &Points, give: f64| {
            let heights = points.get().iter().map(|p| normal.dot(*p - a));
            let (least, most) =
                heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), h| (l.min(h), m.max(h)));
            i32::from(least > give) - i32::from(most < -give)
        };
        let (from, to) =
            (side(&self.origins, slack), side(&target.points, slack + target.radius * length));
        if from != 0 && from == to {
            return View::Open;
        }
        if self.all_arrive
            && from != 0
            && from == -to
            && self.goes_through(corners, target, f64::from(from))
        {
            return View::Blocked;
        }
        View::Partly
    }

    /// Whether all ways from an origin to the target, which is on the other side of the triangle's
    /// plane, lead through the triangle: those between the points that span both do, and their
    /// crossings span all others. `side`: of the origins, 1 if they see the corners turn left.
    fn goes_through(&self, corners: [DVec3; 3], target: &Target, side: f64) -> bool {
        self.origins.get().iter().all(|origin| {
            (0..3).all(|edge| {
                let [p, q] = [corners[edge] - *origin, corners[(edge + 1) % 3] - *origin];
                let normal = p.cross(q) * -side;
                let give = target.radius * normal.length() + self.slack * p.length() * q.length();
                target.points.get().iter().all(|end| normal.dot(*end - *origin) > give)
            })
        })
    }
}

#[cfg(test)]
mod tests;

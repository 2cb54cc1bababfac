//! Why a ray is hard: how far its answer is from the other one, and what brings it there.

use super::boxes::BoxRay;
use super::exact::{self, Crossing, Rational};
use super::{Arbiter, decided, is_ray};
use crate::geometry::Triangle;
use crate::ray::Ray;
use glam::DVec3;
use serde::Serialize;

/// The true answer for a ray, and how near it is to the other one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The true answer.
    pub occluded: bool,
    /// Least relative change that gives the other answer: of a barycentric weight, which is 1 at a
    /// corner, or of the distance, relative to the larger of it and the end of the interval; for a
    /// line parallel to the plane, of the origin's distance from it. Infinite if no triangle is near.
    pub margin: f64,
    /// What makes it hard.
    pub reason: Reason,
    /// The triangle that decides, by its index in the mesh: the one hit most clearly, else the one
    /// missed most narrowly.
    pub triangle: Option<u32>,
}

/// What makes a ray hard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// It is no ray: not finite, no direction, no interval.
    NotARay,
    /// The triangle has no area, or next to none for its length.
    Degenerate,
    /// The hit is at an end of the interval.
    IntervalEnd,
    /// The ray all but lies in the triangle's plane.
    NearParallel,
    /// Ray or triangle lies so far from the world's origin, or the triangle so far from the ray's,
    /// that coordinates round by much of the triangle's size.
    FarFromOrigin,
    /// It passes by a corner.
    VertexGraze,
    /// It passes by an edge.
    EdgeGraze,
    /// Nothing does.
    Clear,
}

impl Reason {
    /// All of them, the most special first.
    pub const ALL: [Self; 8] = [
        Self::NotARay,
        Self::Degenerate,
        Self::IntervalEnd,
        Self::NearParallel,
        Self::FarFromOrigin,
        Self::VertexGraze,
        Self::EdgeGraze,
        Self::Clear,
    ];

    /// In a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotARay => "not a ray",
            Self::Degenerate => "degenerate",
            Self::IntervalEnd => "interval end",
            Self::NearParallel => "near-parallel",
            Self::FarFromOrigin => "far from origin",
            Self::VertexGraze => "vertex graze",
            Self::EdgeGraze => "edge graze",
            Self::Clear => "clear",
        }
    }
}

/// Triangles within this share of a box's reach from the ray are looked at.
const NEARBY: f64 = 1.0 / 1024.0;
/// A margin below this is a graze.
const GRAZE: f64 = 1e-3;
/// Sines of the angle to the plane, and heights over lengths of triangles, below this are small.
const SMALL_SINE: f64 = 1e-4;
/// Coordinates over a triangle's size, above which they are far.
const FAR: f64 = 1e4;

/// How a triangle stands to a ray.
#[derive(Clone, Copy, Debug)]
struct Standing {
    /// By how much the worst of the conditions of a hit is missed; negative if all hold.
    missed_by: f64,
    at_end: bool,
    /// Weights of the corners.
    weights: [f64; 3],
}

impl Arbiter<'_> {
    /// The true answer with its margin and its reason. Slow: for rays that somebody got wrong.
    pub fn explain(&self, ray: &Ray) -> Verdict {
        if !is_ray(ray) {
            let reason = Reason::NotARay;
            return Verdict { occluded: false, margin: f64::INFINITY, reason, triangle: None };
        }
        let occluded = self.occluded(ray);
        let filter = super::FilterRay::new(ray);
        let mut best: Option<(f64, usize)> = None;
        self.any_slot(&BoxRay::grown(ray, NEARBY), |slot| {
            let triangle = &self.tree.triangles[slot];
            let missed_by = rough(ray, triangle);
            let is_better = best.is_none_or(|(least, _)| missed_by < least);
            if is_better && (!occluded || decided(ray, &filter, triangle)) {
                best = Some((missed_by, slot));
            }
            false
        });
        let Some((_, slot)) = best else {
            let (margin, reason) = (f64::INFINITY, Reason::Clear);
            return Verdict { occluded, margin, reason, triangle: None };
        };
        let triangle = &self.tree.triangles[slot];
        let (margin, reason) = reason(ray, triangle);
        Verdict { occluded, margin, reason, triangle: Some(self.tree.triangle_ids[slot]) }
    }
}

/// By how much the triangle is missed, in `f64`: to choose one.
fn rough(ray: &Ray, triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (direction, ao) = (ray.direction.as_dvec3(), ray.origin.as_dvec3() - a);
    let normal = (b - a).cross(c - a);
    let determinant = direction.dot(normal);
    if determinant == 0.0 {
        return out_of_plane(ray, triangle);
    }
    let t = -ao.dot(normal) / determinant;
    let u = direction.dot(ao.cross(c - a)) / determinant;
    let v = direction.dot((b - a).cross(ao)) / determinant;
    let ends = [f64::from(ray.t_min) - t, t - f64::from(ray.t_max)];
    let scale = |end: f32| t.abs().max(f64::from(end).abs()).max(f64::MIN_POSITIVE);
    standing([1.0 - u - v, u, v], relative(ends, [scale(ray.t_min), scale(ray.t_max)])).missed_by
}

/// The same from the exact solution; `None` if there is none.
fn standing_of(ray: &Ray, triangle: &Triangle) -> Option<Standing> {
    let Crossing { t, u, v } = exact::crossing(ray, triangle)?;
    let w = Rational::ONE - &u - &v;
    // Rounded only now: a difference of 0 is exactly that.
    let beyond = |end: f32, sign: f64| match exact::end(end) {
        Some(end) => (&t - end).to_f64_fast() * sign,
        None if (f64::from(end) < 0.0) == (sign < 0.0) => f64::NEG_INFINITY,
        None => f64::INFINITY,
    };
    let rounded = t.to_f64_fast();
    let scale = |end: f32| rounded.abs().max(f64::from(end).abs()).max(f64::MIN_POSITIVE);
    let ends = relative(
        [beyond(ray.t_min, -1.0), beyond(ray.t_max, 1.0)],
        [scale(ray.t_min), scale(ray.t_max)],
    );
    Some(standing([w, u, v].map(|x| x.to_f64_fast()), ends))
}

/// Infinite ends are never near.
fn relative(beyond: [f64; 2], scale: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| if beyond[i].is_infinite() { beyond[i] } else { beyond[i] / scale[i] })
}

fn standing(weights: [f64; 3], ends: [f64; 2]) -> Standing {
    let outside = weights.into_iter().fold(f64::NEG_INFINITY, |worst, w| worst.max(-w));
    let beyond = ends[0].max(ends[1]);
    Standing { missed_by: outside.max(beyond), at_end: beyond > outside, weights }
}

/// Distance of the ray's origin from the plane of a triangle that it is parallel to, relative to that
/// from its corner; 1 if there is no plane.
fn out_of_plane(ray: &Ray, triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (ao, normal) = (ray.origin.as_dvec3() - a, (b - a).cross(c - a));
    if normal == DVec3::ZERO {
        return 1.0;
    }
    if ao == DVec3::ZERO { 0.0 } else { unit(ao).dot(unit(normal)).abs() }
}

/// The margin of a ray that this triangle decides, and what it comes from.
fn reason(ray: &Ray, triangle: &Triangle) -> (f64, Reason) {
    let standing = standing_of(ray, triangle);
    let margin = match standing {
        Some(standing) => standing.missed_by.abs(),
        None => out_of_plane(ray, triangle),
    };
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let longest = ab.length().max(ac.length()).max((c - b).length());
    let normal = ab.cross(ac);
    if exact::is_degenerate(triangle) || normal.length() < SMALL_SINE * longest * longest {
        return (margin, Reason::Degenerate);
    }
    let is_graze = margin < GRAZE;
    if is_graze && standing.is_some_and(|s| s.at_end) {
        return (margin, Reason::IntervalEnd);
    }
    if unit(ray.direction.as_dvec3()).dot(unit(normal)).abs() < SMALL_SINE {
        return (margin, Reason::NearParallel);
    }
    let origin = ray.origin.as_dvec3();
    let coordinates = [a, b, c, origin, a - origin];
    if coordinates.iter().any(|p| p.abs().max_element() > FAR * longest) {
        return (margin, Reason::FarFromOrigin);
    }
    let Some(standing) = standing.filter(|_| is_graze) else { return (margin, Reason::Clear) };
    let small = standing.weights.iter().filter(|w| w.abs() < GRAZE).count();
    (margin, if small >= 2 { Reason::VertexGraze } else { Reason::EdgeGraze })
}

/// Of unit length, from any that is not zero: those of products of denormals are as good as others.
fn unit(v: DVec3) -> DVec3 {
    let v = v / v.abs().max_element();
    v / v.length()
}

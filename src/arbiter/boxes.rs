//! Boxes that a ray may meet: never too few, so that the true answer needs only their triangles.

use crate::geometry::Aabb;
use crate::ray::Ray;
use glam::DVec3;

/// Relative widening of each plane's distance: `8 u` with `u = 2^-53`. It is the rounded product of a
/// rounded difference and a rounded reciprocal, so its relative error is below `4 u`; none of them
/// underflows or overflows, as all come from `f32`.
const WIDENING: f64 = 8.0 / (1u64 << 53) as f64;

/// What decides whether a ray meets a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxRay {
    origin: DVec3,
    direction: DVec3,
    reciprocal: DVec3,
    t_min: f64,
    t_max: f64,
    /// How much boxes are grown on all sides, relative to their reach from the origin.
    growth: f64,
}

impl BoxRay {
    /// For a ray that [is one](super::is_ray).
    pub(super) fn new(ray: &Ray) -> Self {
        let direction = ray.direction.as_dvec3();
        Self {
            origin: ray.origin.as_dvec3(),
            direction,
            reciprocal: direction.recip(),
            t_min: f64::from(ray.t_min),
            t_max: f64::from(ray.t_max),
            growth: 0.0,
        }
    }

    /// One that meets boxes nearby too, within `growth` of their reach, and up to as much beyond its
    /// interval.
    pub(super) fn grown(ray: &Ray, growth: f64) -> Self {
        let mut grown = Self { growth, ..Self::new(ray) };
        let ends = [grown.t_min, grown.t_max].into_iter().filter(|t| t.is_finite());
        let reach = ends.fold(0.0, |reach: f64, t| reach.max(t.abs())) * growth;
        grown.t_min -= reach;
        grown.t_max += reach;
        grown
    }

    /// Whether the ray may meet `bounds`; true if it does.
    #[inline]
    pub(super) fn may_meet(&self, bounds: &Aabb) -> bool {
        let lower = bounds.min.as_dvec3() - self.origin;
        let upper = bounds.max.as_dvec3() - self.origin;
        let reach = if self.growth > 0.0 {
            self.growth * lower.abs().max(upper.abs()).max_element()
        } else {
            0.0
        };
        let (mut entry, mut exit) = (self.t_min, self.t_max);
        for axis in 0..3 {
            // Rounded differences have the right sign, and 0 is exact.
            let (lower, upper) = (lower[axis] - reach, upper[axis] + reach);
            if self.direction[axis] == 0.0 {
                if lower > 0.0 || upper < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (lower * self.reciprocal[axis], upper * self.reciprocal[axis]);
            let (near, far) = if a <= b { (a, b) } else { (b, a) };
            entry = entry.max(near - near.abs() * WIDENING);
            exit = exit.min(far + far.abs() * WIDENING);
        }
        entry <= exit
    }
}

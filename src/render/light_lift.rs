//! How far before a light rays end, so that they do not meet what touches it.

use super::surface::offset_distance;
use glam::DVec3;

/// How far rays end before the light: as a way off its plane, and as the share of the whole ray that
/// leads as far from the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lift {
    pub(super) away: DVec3,
    pub(super) share: f64,
}

/// The plane of a flat light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) normal: DVec3,
    /// Height of the surface point above it, positive on the emitting side, and one over it.
    pub(super) height: f64,
    pub(super) inverse_height: f64,
    /// Largest coordinate difference between surface point and light.
    pub(super) reach: f64,
}

impl Lift {
    /// By `offset`, or half of the surface point's `height` above the light's tangential plane.
    #[inline(always)]
    pub(super) fn off(normal: DVec3, height: f64, inverse_height: f64, offset: f64) -> Self {
        let offset = offset.min(0.5 * height);
        // Not a number where the light is dark anyway.
        let part = (offset * inverse_height).min(0.5);
        Self { away: normal * offset, share: 1.0 - part }
    }

    /// The `whole` way to the light, lifted, which ends at `height` above the surface; a share of it
    /// if that is below.
    #[inline(always)]
    pub(super) fn shortened(&self, whole: DVec3, height: f64) -> DVec3 {
        // To an end between numbers of f32: the difference is rounded, not the end.
        let lifted = whole + self.away;
        // Right below a large light the lift may lead below the horizon what is above it.
        if height > 0.0 { lifted } else { whole * self.share }
    }
}

impl Plane {
    /// The plane through `points` with unit `normal`, seen from `origin`.
    #[inline(always)]
    pub(super) fn new(normal: DVec3, origin: DVec3, points: &[DVec3]) -> Self {
        let reach = points.iter().map(|&p| reach(p - origin)).fold(0.0, f64::max);
        let height = normal.dot(origin - points[0]);
        Self { normal, height, inverse_height: 1.0 / height, reach }
    }

    /// From `target` on the light towards the surface point: at most half of the way.
    #[inline(always)]
    pub(super) fn lift(&self, target: DVec3) -> Lift {
        // A ceiling that the light is set in may be a triangle much larger than the light.
        let offset = offset_distance(reach(target), 4.0 * self.reach);
        Lift::off(self.normal, self.height, self.inverse_height, offset)
    }
}

/// Largest absolute coordinate.
#[inline(always)]
pub(super) fn reach(v: DVec3) -> f64 {
    v.abs().max_element()
}

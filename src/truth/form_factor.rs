//! Form factors in closed form: the share of the cosine-weighted hemisphere about a point's normal
//! that a shape fills, 0 to 1. Irradiance of a light of radiance 1 is pi times that.
//!
//! They are Lambert's and Nusselt's (see Howell, "A Catalog of Radiation Heat Transfer Configuration
//! Factors"); occlusion between shapes is clipping of polygons.

use crate::scene::LightShape;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Corners of the polygons that stand for circles. They have the circle's area, and its form factor
/// to 1e-6 of it.
const CIRCLE_CORNERS: u32 = 4096;

/// Where light arrives.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point, in scene units.
    pub at: DVec3,
    /// Unit normal; what lies below its horizon does not count.
    pub normal: DVec3,
}

impl Receiver {
    /// The corners as seen from the point.
    pub fn see(&self, corners: &[DVec3]) -> Vec<DVec3> {
        corners.iter().map(|&c| c - self.at).collect()
    }

    /// Form factor of the convex polygon with these corners, clipped at the horizon.
    pub fn polygon(&self, corners: &[DVec3]) -> f64 {
        self.seen(&self.see(corners))
    }

    /// Form factor of what of a convex polygon is not behind convex `blockers`, which lie between it
    /// and the point and may overlap.
    pub fn unblocked(&self, corners: &[DVec3], blockers: &[Vec<DVec3>]) -> f64 {
        let blockers: Vec<_> = blockers.iter().map(|b| self.see(b)).collect();
        self.unblocked_seen(self.see(corners), &blockers)
    }

    /// Form factor of all convex `polygons` together, which may hide each other.
    pub fn union(&self, polygons: &[Vec<DVec3>]) -> f64 {
        // Each brings what those before it do not fill already.
        let before = |i: usize| self.unblocked(&polygons[i], &polygons[..i]);
        (0..polygons.len()).map(before).sum()
    }

    /// By inclusion and exclusion.
    fn unblocked_seen(&self, polygon: Vec<DVec3>, blockers: &[Vec<DVec3>]) -> f64 {
        if polygon.len() < 3 {
            return 0.0;
        }
        let Some((first, rest)) = blockers.split_first() else { return self.seen(&polygon) };
        let hidden = behind(&polygon, first);
        self.unblocked_seen(polygon, rest) - self.unblocked_seen(hidden, rest)
    }

    /// Lambert's sum over the edges: the angle in which each is seen, times the cosine between the
    /// normal and that of the plane through edge and point.
    fn seen(&self, polygon: &[DVec3]) -> f64 {
        let clipped = clip(polygon, self.normal);
        let edges = clipped.iter().zip(clipped.iter().cycle().skip(1));
        let sum: f64 = edges
            .map(|(a, b)| {
                let cross = a.cross(*b);
                let sin = cross.length();
                let angle = sin.atan2(a.dot(*b));
                if sin > 0.0 { angle * (self.normal.dot(cross) / sin) } else { 0.0 }
            })
            .sum();
        sum.abs() / TAU
    }

    /// Irradiance of a light of strength 1 behind convex `blockers`, by polygons; circles are
    /// polygons of many corners.
    pub fn irradiance(&self, light: &LightShape, blockers: &[Vec<DVec3>]) -> f64 {
        match outline(light, self.at) {
            Some((corners, unit)) => unit * self.unblocked(&corners, blockers),
            None => 0.0,
        }
    }

    /// Form factor of the cone about `axis` (of any length) whose half angle has the sine
    /// `sin_half`, clipped at the horizon. Also that of a sphere: `sin_half` is radius over
    /// distance.
    ///
    /// The integral of Lambert's boundary form along the arc above the horizon, and along the
    /// horizon if the cone crosses it.
    pub fn cone(&self, axis: DVec3, sin_half: f64) -> f64 {
        let cos = axis.normalize().dot(self.normal).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let cos_half = (1.0 - sin_half * sin_half).sqrt();
        // Cosine of the arc's end as an angle about the axis, from where the cone is highest.
        let end = -(cos_half * cos) / (sin_half * sin);
        if end <= -1.0 {
            return sin_half * sin_half * cos;
        }
        if end >= 1.0 {
            return 0.0;
        }
        let arc = end.acos();
        let across = sin_half * arc.sin();
        let along = cos_half * sin - sin_half * cos * end;
        let horizon = 2.0 * across.atan2(along);
        let boundary = sin_half * sin_half * cos * 2.0 * arc - 2.0 * cos_half * sin * across;
        (boundary + horizon) / TAU
    }
}

/// Form factor of a disk that faces the receiver's plane at `height` above it, its centre `offset`
/// aside (Howell, B-12).
pub fn parallel_disk(height: f64, offset: f64, radius: f64) -> f64 {
    let [h, a, r] = [height, offset, radius].map(|x| x * x);
    0.5 * (1.0 - (h + a - r) / ((h + a + r).powi(2) - 4.0 * a * r).sqrt())
}

/// Form factor of the wall that stands at `distance` and has this `height`, endless both ways.
pub fn long_wall(distance: f64, height: f64) -> f64 {
    0.5 * (1.0 - distance / distance.hypot(height))
}

/// Form factor of what of an endless wall at `distance` lies within `radius` of the point.
pub fn wall_within(distance: f64, radius: f64) -> f64 {
    let c = (distance / radius).min(1.0);
    FRAC_1_PI * (c.acos() - c * (1.0 - c * c).sqrt())
}

/// Form factor of the opening of a wedge of this interior angle in radians, seen from one of its
/// half-planes.
pub fn wedge_opening(angle: f64) -> f64 {
    0.5 * (1.0 - angle.cos())
}

/// The circle about `center` with this `normal`, as a polygon of the same area.
pub fn circle(center: DVec3, normal: DVec3, radius: f64) -> Vec<DVec3> {
    let (u, v) = normal.normalize().any_orthonormal_pair();
    let step = TAU / f64::from(CIRCLE_CORNERS);
    let radius = radius * (step / step.sin()).sqrt();
    let corner = |i| {
        let at = DVec2::from_angle(step * f64::from(i)) * radius;
        center + u * at.x + v * at.y
    };
    (0..CIRCLE_CORNERS).map(corner).collect()
}

/// The convex polygon that a light fills as seen from a point, and the irradiance of a strength of
/// 1 if it filled the hemisphere. `None` if its bright side is not seen, or it is a point or ray.
fn outline(light: &LightShape, at: DVec3) -> Option<(Vec<DVec3>, f64)> {
    match *light {
        LightShape::Quad { corner, edge_u, edge_v } => {
            let [corner, u, v] = [corner, edge_u, edge_v].map(|v| v.as_dvec3());
            let bright = (at - corner).dot(u.cross(v)) > 0.0;
            bright.then(|| (vec![corner, corner + u, corner + u + v, corner + v], PI))
        }
        LightShape::Disk { center, normal, radius } => {
            let (center, normal) = (center.as_dvec3(), normal.as_dvec3());
            let bright = (at - center).dot(normal) > 0.0;
            bright.then(|| (circle(center, normal, f64::from(radius)), PI))
        }
        LightShape::Sphere { center, radius } => {
            let (to_center, radius) = (center.as_dvec3() - at, f64::from(radius));
            let cos_squared = 1.0 - radius * radius / to_center.length_squared();
            let silhouette =
                || circle(at + to_center * cos_squared, to_center, radius * cos_squared.sqrt());
            (cos_squared > 0.0).then(|| (silhouette(), PI))
        }
        LightShape::Directional { direction, angular_diameter_degrees } => {
            let half = 0.5 * f64::from(angular_diameter_degrees).to_radians();
            let axis = -direction.as_dvec3().normalize();
            // Strength is the irradiance of a surface that faces it.
            let unit = 1.0 / half.sin().powi(2);
            (half > 0.0).then(|| (circle(at + axis, axis, half.tan()), unit))
        }
        LightShape::Point { .. } => None,
    }
}

/// What of `polygon` is seen through `window`, both convex and relative to the eye.
fn behind(polygon: &[DVec3], window: &[DVec3]) -> Vec<DVec3> {
    let inside: DVec3 = window.iter().sum();
    let edges = window.iter().zip(window.iter().cycle().skip(1));
    edges.fold(polygon.to_vec(), |part, (a, b)| {
        let normal = a.cross(*b);
        clip(&part, normal * normal.dot(inside).signum())
    })
}

/// What of a convex polygon lies in front of the plane through the origin (Sutherland and Hodgman,
/// "Reentrant Polygon Clipping", CACM 17(1), 1974).
fn clip(polygon: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (from, to) = (normal.dot(*a), normal.dot(*b));
        if from >= 0.0 {
            part.push(*a);
        }
        if (from >= 0.0) != (to >= 0.0) {
            part.push(*a + (*b - *a) * (from / (from - to)));
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sampler::mix;

    fn close(what: &str, value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{what}: {value} is not {expected}");
    }

    fn floor(x: f64, y: f64) -> Receiver {
        Receiver { at: DVec3::new(x, y, 0.0), normal: DVec3::Z }
    }

    fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Vec<DVec3> {
        let [corner, u, v] = [corner, u, v].map(DVec3::from);
        vec![corner, corner + u, corner + u + v, corner + v]
    }

    /// Coordinates between -1 and 1.
    fn random(state: &mut u64) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| {
            *state = mix(*state);
            (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }))
    }

    /// Numbers that others have computed, to the digits that they are given with.
    #[test]
    fn known_values() {
        close("wedge of 60", wedge_opening(PI / 3.0), 0.25, 1e-15);
        close("wedge of 120", wedge_opening(2.0 * PI / 3.0), 0.75, 1e-15);
        close("long wall", long_wall(1.0, 1.0), 0.146_447, 5e-7);
        for (c, value) in [(0.25, 0.342_519), (0.5, 0.195_501), (0.75, 0.072_147), (1.5, 0.0)] {
            close("wall within a radius", wall_within(c, 1.0), value, 5e-7);
        }
        let above = |corner, u, v| floor(0.0, 0.0).polygon(&rectangle(corner, u, v));
        let square = above([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        close("square", square, 0.554_126, 5e-7);
        let high = above([-1.0, -1.0, 2.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        close("square at height 2", high, 0.239_456, 5e-7);
        // A quarter of it, by arc tangents.
        let q = 2f64.sqrt();
        close("square", square, 4.0 * (2.0 / q * (1.0 / q).atan()) / TAU, 1e-15);
        let half = above([0.0, -1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        close("half of it", half, 0.277_063, 5e-7);
        let part = above([0.2, -1.0, 1.0], [0.8, 0.0, 0.0], [0.0, 2.0, 0.0]);
        close("part of it", part, 0.197_025, 5e-7);
        let upright = above([1.0, -1.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        close("across the horizon", upright, 0.111_468, 5e-7);
        close("round pit", parallel_disk(0.7, 0.0, 1.0), 1.0 / (1.0 + 0.49), 1e-15);
        close("sphere", floor(0.0, 0.0).cone(DVec3::Z * 2.0, 0.5), 0.25, 1e-15);
        let blocker = rectangle([-9.0, -9.0, 0.5], [9.1, 0.0, 0.0], [0.0, 18.0, 0.0]);
        let light = rectangle([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        close("blocked", floor(0.0, 0.0).unblocked(&light, &[blocker]), part, 1e-14);
    }

    /// Lambert's sum against the plain integral over the polygon, tilted and clipped.
    #[test]
    fn polygons_are_integrals() {
        let mut state = 1;
        const N: u32 = 400;
        for case in 0..40 {
            let receiver = Receiver { at: DVec3::ZERO, normal: random(&mut state).normalize() };
            let corner = random(&mut state) + DVec3::new(0.0, 0.0, 2.5);
            let (u, v) = (random(&mut state), random(&mut state));
            let area = u.cross(v);
            let mut sum = 0.0;
            for i in 0..N * N {
                let [s, t] = [i % N, i / N].map(|k| (f64::from(k) + 0.5) / f64::from(N));
                let p = corner + u * s + v * t;
                let squared = p.length_squared();
                sum += receiver.normal.dot(p).max(0.0) * area.dot(p).abs() / (squared * squared);
            }
            let expected = sum * FRAC_1_PI / f64::from(N * N);
            let value = receiver.polygon(&[corner, corner + u, corner + u + v, corner + v]);
            close(&format!("case {case}"), value, expected, 2e-6);
        }
    }

    /// What is seen behind blockers, against looking along many directions.
    #[test]
    fn blocked_polygons_are_integrals() {
        let mut state = 7;
        const N: u32 = 400;
        for case in 0..20 {
            let receiver = Receiver { at: DVec3::ZERO, normal: random(&mut state).normalize() };
            let mut triangle = |z: f64, size: f64| -> Vec<DVec3> {
                (0..3).map(|_| random(&mut state) * size + DVec3::Z * z).collect()
            };
            let (near, middle, light) =
                (triangle(1.2, 0.9), triangle(2.4, 0.9), triangle(6.0, 2.0));
            let meets = |triangle: &[DVec3], p: DVec3| {
                let sides: Vec<f64> =
                    (0..3).map(|i| triangle[i].cross(triangle[(i + 1) % 3]).dot(p)).collect();
                sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
            };
            // Over the light, as a triangle in barycentric coordinates.
            let (u, v) = (light[1] - light[0], light[2] - light[0]);
            let (mut lit, mut any) = (0.0, 0.0);
            for i in 0..N * N {
                let [s, t] = [i % N, i / N].map(|k| (f64::from(k) + 0.5) / f64::from(N));
                let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                let p = light[0] + u * s + v * t;
                let squared = p.length_squared();
                let cosine = receiver.normal.dot(p).max(0.0);
                let weight = cosine * u.cross(v).dot(p).abs() / (squared * squared);
                any += weight;
                if !meets(&near, p) && !meets(&middle, p) {
                    lit += weight;
                }
            }
            let scale = 0.5 * FRAC_1_PI / f64::from(N * N);
            let blockers = [near.clone(), middle.clone()];
            close(&format!("lit {case}"), receiver.unblocked(&light, &blockers), lit * scale, 2e-4);
            let union = receiver.union(&[near, middle, light]);
            let blocked = receiver.union(&blockers);
            close(&format!("union {case}"), union - blocked, lit * scale, 2e-4);
            assert!(any >= lit);
        }
    }

    /// Cones and disks against polygons of many corners, and those against directions.
    #[test]
    fn round_shapes_are_polygons_of_many_corners() {
        for degrees in [0.0, 20.0, 70.0, 85.0, 90.0, 95.0, 110.0, 140.0f64] {
            for half_degrees in [0.25, 5.0, 30.0, 60.0, 80.0f64] {
                let receiver = floor(0.0, 0.0);
                let axis = DVec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
                let half = half_degrees.to_radians();
                let value = receiver.cone(axis * 3.0, half.sin());
                let expected = receiver.polygon(&circle(axis, axis, half.tan()));
                let what = format!("cone of {half_degrees} at {degrees}");
                close(&what, value, expected, 2e-6 * expected + 1e-12);
            }
        }
        for (h, a, r) in [(1.0, 0.0, 1.0), (0.5, 2.0, 1.5), (2.0, 0.3, 0.1), (0.01, 0.5, 1.0)] {
            let expected = floor(0.0, 0.0).polygon(&circle(DVec3::new(a, 0.0, h), DVec3::Z, r));
            close("disk", parallel_disk(h, a, r), expected, 2e-6 * expected);
        }
        // By a ring of directions after the other: height over the horizon is the cosine.
        let receiver = Receiver { at: DVec3::ZERO, normal: DVec3::new(0.8, 0.0, 0.6) };
        let cap = 0.5;
        const N: u32 = 2000;
        let mut sum = 0.0;
        for i in 0..N * N {
            let [s, t] = [i % N, i / N].map(|k| (f64::from(k) + 0.5) / f64::from(N));
            let (z, angle) = (1.0 - s * (1.0 - cap), TAU * t);
            let ring = (1.0 - z * z).sqrt();
            let direction = DVec3::new(ring * angle.cos(), ring * angle.sin(), z);
            sum += receiver.normal.dot(direction).max(0.0);
        }
        let expected = sum * (1.0 - cap) * TAU / f64::from(N * N) * FRAC_1_PI;
        let value = receiver.cone(DVec3::Z, (1.0 - cap * cap).sqrt());
        close("cone across the horizon", value, expected, 1e-6);
    }
}

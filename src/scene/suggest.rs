//! A view, a light and a ray length for geometry that comes with none.

use super::{Camera, Light, LightShape};
use crate::geometry::Aabb;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// The length that everything here is measured in: the diagonal, but never so small beside the
/// coordinates that adding it would round away.
fn scale(bounds: &Aabb) -> f32 {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    bounds.diagonal().max(largest * 1e-5).max(1e-9)
}

/// From the front, above and to the left, with all of the bounding sphere in the picture.
pub(super) fn camera(bounds: &Aabb) -> Camera {
    let look_at = bounds.center();
    let direction = Vec3::new(-0.45, 0.4, 0.8).normalize();
    // A sphere of half the diagonal touches a field of view of 40 degrees: 1 / (2 sin(20 degrees)).
    let distance = 1.462 * scale(bounds);
    Camera { eye: look_at + direction * distance, look_at, up: Vec3::Y, fov_degrees: 40.0 }
}

/// A square above the middle and a little to the front left, shining down.
pub(super) fn light(bounds: &Aabb) -> Light {
    let scale = scale(bounds);
    let (edge_u, edge_v) = (Vec3::X * (0.4 * scale), Vec3::Z * (0.4 * scale));
    let above = bounds.center().with_y(bounds.max.y) + Vec3::new(-0.15, 0.6, 0.15) * scale;
    let corner = above - 0.5 * (edge_u + edge_v);
    let shape = LightShape::Quad { corner, edge_u, edge_v };
    Light { name: "light1".into(), shape, strength: strength(&shape, bounds) }
}

/// A tenth of the diagonal.
pub(super) fn ao_radius(bounds: &Aabb) -> f32 {
    0.1 * scale(bounds)
}

/// The strength with which `shape` alone gives about pi of irradiance, a white surface's radiance
/// of 1, to a surface in the middle of `bounds` that faces it.
pub(super) fn strength(shape: &LightShape, bounds: &Aabb) -> Vec3 {
    let (center, area) = match *shape {
        LightShape::Quad { corner, edge_u, edge_v } => {
            (corner + 0.5 * (edge_u + edge_v), edge_u.as_dvec3().cross(edge_v.as_dvec3()).length())
        }
        LightShape::Disk { center, radius, .. } | LightShape::Sphere { center, radius } => {
            (center, PI * f64::from(radius) * f64::from(radius))
        }
        LightShape::Directional { .. } => return Vec3::splat(PI as f32),
        LightShape::Point { position } => (position, 0.0),
    };
    let distance = center.as_dvec3().distance(bounds.center().as_dvec3());
    let distance2 = distance.max(1e-2 * f64::from(scale(bounds))).powi(2);
    let strength = match shape {
        LightShape::Point { .. } => PI * distance2,
        // Exact for a disk on its axis: E = L A / (d^2 + A / pi).
        _ => PI * distance2 / area + 1.0,
    };
    DVec3::splat(strength.min(1e30)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_bounds_give_usable_suggestions() {
        let boxes = [
            [Vec3::ZERO, Vec3::ONE],
            [Vec3::splat(-1e18), Vec3::splat(1e18)],
            [Vec3::splat(1e18), Vec3::splat(1e18)],
            [Vec3::splat(1e9), Vec3::splat(1e9) + Vec3::X],
            [Vec3::ZERO, Vec3::ZERO],
            [Vec3::ZERO, Vec3::splat(1e-40)],
            [Vec3::ZERO, Vec3::new(100.0, 0.0, 1e-3)],
        ];
        for [min, max] in boxes {
            let bounds = Aabb { min, max };
            assert_eq!(camera(&bounds).check(), Ok(()), "{bounds:?}");
            assert_eq!(light(&bounds).check(), Ok(()), "{bounds:?}");
            assert!(ao_radius(&bounds) > 0.0 && ao_radius(&bounds).is_finite());
        }
    }

    #[test]
    fn a_far_small_light_gives_pi() {
        let shape = LightShape::Quad { corner: Vec3::Y * 100.0, edge_u: Vec3::X, edge_v: Vec3::Z };
        let radiance = strength(&shape, &Aabb { min: -Vec3::ONE, max: Vec3::ONE });
        assert!((radiance.x / (PI as f32 * 1e4) - 1.0).abs() < 1e-3);
    }
}

//! Affine placement of geometry, and of the cameras and lights that come with it.

use super::{Camera, InvalidValue, Light, LightShape};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// `translate * rotate z * rotate y * rotate x * scale`: scaled first, then turned about the x, the
/// y and the z axis (degrees, right-handed), then moved.
pub(super) fn from_parts(translate: DVec3, rotate_degrees: DVec3, scale: DVec3) -> DAffine3 {
    let angle = rotate_degrees.map(f64::to_radians);
    let rotation = DMat3::from_rotation_z(angle.z)
        * DMat3::from_rotation_y(angle.y)
        * DMat3::from_rotation_x(angle.x);
    DAffine3 { matrix3: rotation * DMat3::from_diagonal(scale), translation: translate }
}

/// From 16 numbers, row by row, for column vectors: the last row is 0, 0, 0, 1.
pub(super) fn from_rows(m: &[f64; 16]) -> Result<DAffine3, InvalidValue> {
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(InvalidValue::new("matrix", "the last row must be 0, 0, 0, 1"));
    }
    let column = |c| DVec3::new(m[c], m[4 + c], m[8 + c]);
    Ok(DAffine3::from_mat3_translation(
        DMat3::from_cols(column(0), column(1), column(2)),
        column(3),
    ))
}

/// Whether it is finite and keeps volumes from collapsing; `key` is what to blame. Mirroring is fine.
pub(super) fn check(transform: &DAffine3, key: &str) -> Result<(), InvalidValue> {
    if !transform.is_finite() {
        return Err(InvalidValue::new(key, "must be finite"));
    }
    let m = &transform.matrix3;
    let extent = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let flatness = m.determinant().abs() / extent;
    // False for not-a-number too: a column of zeros, or lengths that overflow.
    if flatness > 1e-12 {
        Ok(())
    } else {
        Err(InvalidValue::new(key, "must not flatten the geometry (it cannot be inverted)"))
    }
}

/// By how much `transform` stretches lengths, averaged over directions.
pub(super) fn mean_scale(transform: &DAffine3) -> f64 {
    transform.matrix3.determinant().abs().cbrt()
}

/// `camera` moved along with what it looks at.
pub(super) fn camera(camera: &Camera, transform: &DAffine3) -> Camera {
    Camera {
        eye: point(transform, camera.eye),
        look_at: point(transform, camera.look_at),
        up: vector(transform, camera.up),
        fov_degrees: camera.fov_degrees,
    }
}

/// `light` moved along with what it lights. Radii take the mean scale, and a point's intensity grows
/// with its square, so that under a uniform scale the picture stays the same.
pub(super) fn light(light: &Light, transform: &DAffine3) -> Light {
    let scale = mean_scale(transform);
    let radius = |radius: f32| (f64::from(radius) * scale) as f32;
    let mut strength = light.strength;
    let shape = match light.shape {
        LightShape::Quad { corner, edge_u, edge_v } => {
            let (mut u, mut v) = (vector(transform, edge_u), vector(transform, edge_v));
            if transform.matrix3.determinant() < 0.0 {
                // Mirrored, the cross product would point to the dark side.
                std::mem::swap(&mut u, &mut v);
            }
            LightShape::Quad { corner: point(transform, corner), edge_u: u, edge_v: v }
        }
        LightShape::Disk { center, normal, radius: r } => {
            let normal = transform.matrix3.inverse().transpose() * normal.as_dvec3();
            LightShape::Disk {
                center: point(transform, center),
                normal: normal.normalize_or_zero().as_vec3(),
                radius: radius(r),
            }
        }
        LightShape::Sphere { center, radius: r } => {
            LightShape::Sphere { center: point(transform, center), radius: radius(r) }
        }
        LightShape::Directional { direction, angular_diameter_degrees } => {
            let direction = transform.transform_vector3(direction.as_dvec3());
            let direction = direction.normalize_or_zero().as_vec3();
            LightShape::Directional { direction, angular_diameter_degrees }
        }
        LightShape::Point { position } => {
            strength = (strength.as_dvec3() * (scale * scale)).as_vec3();
            LightShape::Point { position: point(transform, position) }
        }
    };
    Light { name: light.name.clone(), shape, strength }
}

/// `p` moved, rounded to `f32` once.
pub(super) fn point(transform: &DAffine3, p: Vec3) -> Vec3 {
    transform.transform_point3(p.as_dvec3()).as_vec3()
}

fn vector(transform: &DAffine3, v: Vec3) -> Vec3 {
    transform.transform_vector3(v.as_dvec3()).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-5, "{a} is not {b}");
    }

    #[test]
    fn parts_apply_scale_then_x_y_z_then_translation() {
        let quarter = DVec3::new(90.0, 90.0, 0.0);
        let t = from_parts(DVec3::new(10.0, 0.0, 0.0), quarter, DVec3::new(1.0, 2.0, 1.0));
        // (0, 1, 0) is scaled to (0, 2, 0), turned about x to (0, 0, 2), about y to (2, 0, 0).
        close(point(&t, Vec3::Y), Vec3::new(12.0, 0.0, 0.0));
    }

    #[test]
    fn rows_read_as_written() {
        let mut m = [0.0; 16];
        (m[0], m[5], m[10], m[15], m[3], m[1]) = (1.0, 1.0, 1.0, 1.0, 7.0, 2.0);
        close(point(&from_rows(&m).unwrap(), Vec3::Y), Vec3::new(9.0, 1.0, 0.0));
    }

    #[test]
    fn flat_transforms_are_refused_and_mirrors_are_not() {
        let scale = |x, y, z| from_parts(DVec3::ZERO, DVec3::ZERO, DVec3::new(x, y, z));
        assert!(check(&scale(1.0, 0.0, 1.0), "scale").is_err());
        assert!(check(&scale(1.0, f64::NAN, 1.0), "scale").is_err());
        assert!(check(&scale(1e300, 1e300, 1e300), "scale").is_err());
        let dependent = [1., 2., 3., 0., 4., 5., 6., 0., 7., 8., 9., 0., 0., 0., 0., 1.];
        assert!(check(&from_rows(&dependent).unwrap(), "matrix").is_err());
        assert!(check(&scale(-1.0, 1.0, 1e-5), "scale").is_ok());
    }

    #[test]
    fn a_mirrored_quad_still_shines_into_the_mirrored_scene() {
        let shape = LightShape::Quad { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Z };
        let lamp = Light { name: "lamp".into(), shape, strength: Vec3::ONE };
        let mirror = from_parts(DVec3::ZERO, DVec3::ZERO, DVec3::new(-1.0, 1.0, 1.0));
        let LightShape::Quad { edge_u, edge_v, .. } = light(&lamp, &mirror).shape else { panic!() };
        close(edge_u.cross(edge_v), Vec3::X.cross(Vec3::Z));
    }
}

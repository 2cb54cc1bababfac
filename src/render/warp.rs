//! Maps from the unit square to disks, spheres and cones. All preserve area, so stratified points
//! stay stratified.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Two unit vectors at right angles to the unit vector `n` and to each other; the three are
/// right-handed in the order returned, then `n`.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
pub fn orthonormal_basis(n: DVec3) -> [DVec3; 2] {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// `local` in the frame whose z axis is the unit vector `n`.
pub fn to_world(local: DVec3, n: DVec3) -> DVec3 {
    let [tangent, bitangent] = orthonormal_basis(n);
    tangent * local.x + bitangent * local.y + n * local.z
}

/// Unit direction about +z with density `cos(theta) / pi`. Never in the horizon's plane: for
/// `u < 1` the cosine is positive.
pub fn cosine_hemisphere([u, v]: [f64; 2]) -> DVec3 {
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    DVec3::new(radius * cos, radius * sin, (1.0 - u).sqrt())
}

/// Uniform in the unit disk, with little distortion.
///
/// Shirley and Chiu, "A Low Distortion Map Between Disk and Square", JGT 2(3), 1997.
pub fn concentric_disk([u, v]: [f64; 2]) -> DVec2 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    let (radius, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_4 * (2.0 - a / b)) };
    let (sin, cos) = angle.sin_cos();
    DVec2::new(radius * cos, radius * sin)
}

/// Unit direction, uniform over the sphere.
pub fn uniform_sphere(point: [f64; 2]) -> DVec3 {
    uniform_cone(point, 2.0)
}

/// Unit direction, uniform over the cone about +z whose half angle has the cosine
/// `1 - one_minus_cos`. The cone is given this way round because narrow cones would lose all their
/// digits otherwise. Density: `1 / (2 pi one_minus_cos)`.
pub fn uniform_cone([u, v]: [f64; 2], one_minus_cos: f64) -> DVec3 {
    let depth = u * one_minus_cos;
    let radius = (depth * (2.0 - depth)).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    DVec3::new(radius * cos, radius * sin, 1.0 - depth)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoints of a fine grid: sums over them are integrals.
    fn grid() -> impl Iterator<Item = [f64; 2]> {
        const N: u32 = 256;
        (0..N * N).map(|i| [i % N, i / N].map(|k| (f64::from(k) + 0.5) / f64::from(N)))
    }

    fn mean(f: impl Fn([f64; 2]) -> f64) -> f64 {
        grid().map(f).sum::<f64>() / grid().count() as f64
    }

    #[test]
    fn bases_are_orthonormal_and_right_handed() {
        for p in grid().step_by(37) {
            let mut n = uniform_sphere(p);
            for flip in [DVec3::ONE, DVec3::NEG_ONE] {
                n *= flip;
                let [t, b] = orthonormal_basis(n);
                assert!((t.cross(b) - n).length() < 1e-12, "{n}");
                assert!((t.length() - 1.0).abs() < 1e-12 && t.dot(n).abs() < 1e-12, "{n}");
            }
        }
        for n in [DVec3::Z, DVec3::NEG_Z, DVec3::new(1e-9, -1e-9, -1.0).normalize()] {
            let [t, b] = orthonormal_basis(n);
            assert!((t.cross(b) - n).length() < 1e-12, "{n}");
        }
    }

    /// First and second moments, and the distribution of the height.
    #[test]
    fn moments_are_those_of_the_densities() {
        let close = |value: f64, expected: f64| {
            assert!((value - expected).abs() < 2e-3, "{value} is not {expected}");
        };
        close(mean(|p| cosine_hemisphere(p).z), 2.0 / 3.0);
        close(mean(|p| cosine_hemisphere(p).x.powi(2)), 0.25);
        close(mean(|p| f64::from(cosine_hemisphere(p).z < 0.5)), 0.25);
        close(mean(|p| concentric_disk(p).length_squared()), 0.5);
        close(mean(|p| concentric_disk(p).x.powi(2)), 0.25);
        close(mean(|p| f64::from(concentric_disk(p).length() < 0.5)), 0.25);
        close(mean(|p| concentric_disk(p).x), 0.0);
        close(mean(|p| uniform_sphere(p).z), 0.0);
        close(mean(|p| uniform_sphere(p).y.powi(2)), 1.0 / 3.0);
        close(mean(|p| uniform_cone(p, 0.25).z), 0.875);
        close(mean(|p| f64::from(uniform_cone(p, 0.25).z < 0.9)), 0.6);
    }

    #[test]
    fn directions_have_unit_length_and_stay_inside() {
        for p in grid().chain([[0.0, 0.0], [1.0 - 2f64.powi(-23), 0.0]]) {
            assert!(concentric_disk(p).length() < 1.0 + 1e-12);
            assert!(cosine_hemisphere(p).z > 0.0);
            for w in [cosine_hemisphere(p), uniform_sphere(p), uniform_cone(p, 1e-12)] {
                assert!((w.length() - 1.0).abs() < 1e-12, "{w}");
            }
            assert!(uniform_cone(p, 1e-12).z >= 1.0 - 1.01e-12);
        }
    }
}

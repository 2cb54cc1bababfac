//! Maps from the unit square to disks, spheres and cones. All preserve area, so stratified points
//! stay stratified.

use crate::vectorized::inverse_sqrt;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::FRAC_PI_4;

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

/// Two unit vectors and their normal: see [`orthonormal_basis`].
#[derive(Clone, Copy, Debug)]
pub struct Frame([DVec3; 3]);

impl Frame {
    /// The frame whose z axis is the unit vector `n`.
    pub fn new(n: DVec3) -> Self {
        let [tangent, bitangent] = orthonormal_basis(n);
        Self([tangent, bitangent, n])
    }

    /// Its axes, the normal last.
    pub fn axes(&self) -> [DVec3; 3] {
        self.0
    }

    /// `local` in world coordinates.
    #[inline(always)]
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.0[0] * local.x + self.0[1] * local.y + self.0[2] * local.z
    }
}

/// `local` in the frame whose z axis is the unit vector `n`.
pub fn to_world(local: DVec3, n: DVec3) -> DVec3 {
    Frame::new(n).to_world(local)
}

/// Unit direction about +z with density `cos(theta) / pi`. Never in the horizon's plane: the cosine is
/// at least `2^-11`. In numbers half as wide as elsewhere, as directions are used: vectors hold twice
/// as many.
#[inline(always)]
pub fn cosine_hemisphere([u, v]: [f32; 2]) -> Vec3 {
    const LEAST_SQUARED: f32 = 1.0 / (1 << 22) as f32;
    // As in `concentric_disk`.
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let along_a = a.abs() > b.abs();
    let (radius, other) = if along_a { (a, b) } else { (b, a) };
    let divisor = if radius == 0.0 { 1.0 } else { radius };
    let angle = std::f32::consts::FRAC_PI_4 * (other / divisor);
    let [sin, cos] = small_sin_cos_single(angle).map(|x| x * radius);
    let p = if along_a { Vec2::new(cos, sin) } else { Vec2::new(sin, cos) };
    // From the edge without the rounding of `radius`.
    let longer = if along_a { u } else { v };
    let to_edge = 2.0 * if longer < 0.5 { longer } else { 1.0 - longer };
    let squared = to_edge * (1.0 + radius.abs());
    p.extend(squared.max(LEAST_SQUARED).sqrt())
}

/// Uniform in the unit disk, with little distortion.
///
/// Shirley and Chiu, "A Low Distortion Map Between Disk and Square", JGT 2(3), 1997.
#[inline(always)]
pub fn concentric_disk([u, v]: [f64; 2]) -> DVec2 {
    polar_disk([u, v]).0
}

/// The point of [`concentric_disk`], and its distance from the centre, squared.
#[inline(always)]
pub(super) fn polar_disk([u, v]: [f64; 2]) -> (DVec2, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let along_a = a.abs() > b.abs();
    let (radius, other) = if along_a { (a, b) } else { (b, a) };
    // In the middle 0 over something instead of over 0.
    let divisor = if radius == 0.0 { 1.0 } else { radius };
    let [sin, cos] = small_sin_cos(FRAC_PI_4 * (other / divisor)).map(|x| x * radius);
    let p = if along_a { DVec2::new(cos, sin) } else { DVec2::new(sin, cos) };
    (p, radius * radius)
}

/// Unit direction, uniform over the sphere.
#[inline(always)]
pub fn uniform_sphere(point: [f64; 2]) -> DVec3 {
    uniform_cone(point, 2.0)
}

/// Unit direction, uniform over the cone about +z whose half angle has the cosine
/// `1 - one_minus_cos`. The cone is given this way round because narrow cones would lose all their
/// digits otherwise. Density: `1 / (2 pi one_minus_cos)`.
#[inline(always)]
pub fn uniform_cone(point: [f64; 2], one_minus_cos: f64) -> DVec3 {
    let (p, squared) = polar_disk(point);
    on_cone(p.to_array(), squared, one_minus_cos)
}

/// The direction of [`uniform_cone`] for a point of the disk, and its distance from the centre,
/// squared.
#[inline(always)]
pub(super) fn on_cone(point: [f64; 2], squared: f64, one_minus_cos: f64) -> DVec3 {
    let depth = squared * one_minus_cos;
    let scale = (one_minus_cos * (2.0 - depth)).max(0.0);
    (DVec2::from(point) * (scale * inverse_sqrt(scale))).extend(1.0 - depth)
}

/// Sine and cosine of an angle between `-pi / 4` and `pi / 4`, without branches, to 1e-12: sums of
/// their series.
#[inline(always)]
fn small_sin_cos(angle: f64) -> [f64; 2] {
    // One over the factorials of 3 to 13 and of 2 to 12, signs in turn.
    const SIN: [f64; 6] = series(3);
    const COS: [f64; 6] = series(2);
    let x2 = angle * angle;
    let sum = |terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| (sum + term) * x2);
    [angle + angle * sum(&SIN), 1.0 + sum(&COS)]
}

/// [`small_sin_cos`] in `f32`, to 1e-7.
#[inline(always)]
fn small_sin_cos_single(angle: f32) -> [f32; 2] {
    const SIN: [f32; 4] = [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0];
    const COS: [f32; 4] = [-1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0];
    let x2 = angle * angle;
    let sum = |terms: &[f32]| terms.iter().rev().fold(0.0, |sum, term| (sum + term) * x2);
    [angle + angle * sum(&SIN), 1.0 + sum(&COS)]
}

/// `-1 / first!`, `1 / (first + 2)!` and so on.
const fn series<const N: usize>(first: usize) -> [f64; N] {
    let mut terms = [0.0; N];
    let mut factorial = if first == 3 { 6.0 } else { 2.0 };
    let mut i = 0;
    while i < N {
        terms[i] = if i % 2 == 0 { -1.0 / factorial } else { 1.0 / factorial };
        let n = (first + 2 * i) as f64;
        factorial *= (n + 1.0) * (n + 2.0);
        i += 1;
    }
    terms
}

/// Sine and cosine of an angle of at most a million, without branches, to 1e-12.
#[inline(always)]
pub(super) fn sin_cos(angle: f64) -> [f64; 2] {
    // Added to a number, it leaves the nearest integer in the lowest bits.
    const ROUNDS: f64 = 1.5 * (1u64 << 52) as f64;
    // Pi / 2 in two parts, the first short enough for its products to be exact.
    const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
    let shifted = angle * std::f64::consts::FRAC_2_PI + ROUNDS;
    let quarters = shifted - ROUNDS;
    let bits = shifted.to_bits();
    let rest = (angle - quarters * HALF_PI[0]) - quarters * HALF_PI[1];
    let [sin, cos] = small_sin_cos(rest);
    let (s, c) = if bits & 1 == 0 { (sin, cos) } else { (cos, sin) };
    // Sine is negative in quarters 2 and 3, cosine in 1 and 2.
    let flip = |x: f64, flip: u64| f64::from_bits(x.to_bits() ^ (flip << 63));
    [flip(s, bits >> 1 & 1), flip(c, (bits ^ bits >> 1) & 1)]
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
            let mut n = uniform_sphere(p).normalize();
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

    #[test]
    fn sines_and_cosines() {
        for step in -40_000..40_000 {
            let angle = f64::from(step) * 1e-3;
            let expected = angle.sin_cos();
            let [sin, cos] = sin_cos(angle);
            let error = (sin - expected.0).abs().max((cos - expected.1).abs());
            assert!(error < 1e-12, "{angle}: {sin} {cos} are not {expected:?}");
        }
    }

    /// First and second moments, and the distribution of the height.
    #[test]
    fn moments_are_those_of_the_densities() {
        let close = |value: f64, expected: f64| {
            assert!((value - expected).abs() < 2e-3, "{value} is not {expected}");
        };
        let hemisphere = |p: [f64; 2]| cosine_hemisphere(p.map(|x| x as f32)).as_dvec3();
        close(mean(|p| hemisphere(p).z), 2.0 / 3.0);
        close(mean(|p| hemisphere(p).x.powi(2)), 0.25);
        close(mean(|p| f64::from(hemisphere(p).z < 0.75f64.sqrt())), 0.75);
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
            let single = p.map(|x| x as f32);
            let direction = cosine_hemisphere(single);
            assert!(direction.z > 4e-4);
            assert!((direction.as_dvec3().length() - 1.0).abs() < 3e-7);
            let disk = concentric_disk(single.map(f64::from));
            assert!((direction.as_dvec3().truncate() - disk).length() < 3e-7, "{direction}");
            for w in [uniform_sphere(p), uniform_cone(p, 1e-12)] {
                assert!((w.length() - 1.0).abs() < 1e-11, "{w}");
            }
            assert!(uniform_cone(p, 1e-12).z >= 1.0 - 1.01e-12);
        }
    }
}

//! The same decision in `f64`, where that is certain.
//!
//! With `u = 2^-53`, inputs are exact and each operation has a relative error of at most `u`. A
//! triple product `p . (q x r)` of a direction and two differences is a sum of six terms of three
//! factors. Each term passes at most 7 roundings (two differences, two products, one subtraction, two
//! additions), one more where the first factor is a difference too. So the error is at most
//! `8 u / (1 - 8 u)` times `P`, the sum of the terms' magnitudes, and `P` is computed with no more
//! relative error. Nothing underflows or overflows: with an end of the interval as a fourth factor, the
//! least product that is not 0 is `2^-596`, and the largest magnitude is below `2^520`.
//!
//! The bounds below are several times larger than this and what the sums of two or three such values
//! and their products with an end of the interval (one or two roundings more) need.

use crate::geometry::Triangle;
use crate::ray::Ray;
use glam::{DVec3, Vec3Swizzles};

/// Relative to the sum of the terms' magnitudes: `64 u`.
const BOUND: f64 = 64.0 / (1u64 << 53) as f64;

/// A ray in `f64`, for many triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilterRay {
    origin: DVec3,
    direction: DVec3,
    t_min: f64,
    t_max: f64,
}

/// A value, and the most that it may be off.
#[derive(Clone, Copy, Debug)]
struct Bounded {
    value: f64,
    error: f64,
}

impl Bounded {
    /// The sign where it is certain; a value of 0 never is.
    fn sign(self) -> Option<f64> {
        (self.value.abs() > self.error).then(|| self.value.signum())
    }

    /// Of `self - scale * other`; the scale is exact.
    fn minus_scaled(self, scale: f64, other: Self) -> Self {
        let value = self.value - scale * other.value;
        Self { value, error: self.error + scale.abs() * other.error }
    }
}

/// `p . (q x r)`.
fn triple(p: DVec3, q: DVec3, r: DVec3) -> Bounded {
    let (first, second) = (q.yzx() * r.zxy(), q.zxy() * r.yzx());
    let magnitude = p.abs().dot(first.abs() + second.abs());
    // The bound covers additions of such values too, which round relative to what they add up.
    Bounded { value: p.dot(first - second), error: BOUND * magnitude }
}

impl FilterRay {
    /// For a ray that [is one](super::is_ray).
    pub(super) fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            t_min: f64::from(ray.t_min),
            t_max: f64::from(ray.t_max),
        }
    }

    /// Whether the ray hits `triangle`; `None` if that is not certain.
    pub(super) fn hits(&self, triangle: &Triangle) -> Option<bool> {
        let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
        let (ab, ac, ao) = (b - a, c - a, self.origin - a);
        // Numerators and denominator of Cramer's rule, as in `exact`.
        let determinant = triple(self.direction, ab, ac);
        let u = triple(self.direction, ao, ac);
        let v = triple(self.direction, ab, ao);
        let w = determinant.minus_scaled(1.0, u).minus_scaled(1.0, v);
        let signs = [u.sign(), v.sign(), w.sign()];
        let has = |sign| signs.contains(&Some(sign));
        if has(1.0) && has(-1.0) {
            // Whatever the determinant's sign, one of the weights has the other.
            return Some(false);
        }
        if determinant.error == 0.0 {
            // Every term is 0, so this is exact.
            return Some(false);
        }
        let sign = determinant.sign()?;
        if has(-sign) {
            return Some(false);
        }
        let mut is_certain = signs.iter().all(Option::is_some);
        let negated_t = triple(ao, ab, ac);
        for (end, side) in [(self.t_min, 1.0), (self.t_max, -1.0)] {
            if end.is_infinite() {
                if (end > 0.0) == (side > 0.0) {
                    return Some(false);
                }
                continue;
            }
            // t - end, times the determinant.
            let beyond = negated_t.minus_scaled(-end, determinant);
            match beyond.sign() {
                Some(s) if -s * sign != side => return Some(false),
                Some(_) => {}
                None => is_certain = false,
            }
        }
        is_certain.then_some(true)
    }
}

//! Ray against triangle in rational numbers: no rounding, no case left out.

use crate::geometry::{Triangle, Vec3};
use crate::ray::Ray;

/// A rational number that only takes common powers of two out of its fraction: an `f32` is a whole
/// number times a power of two, and so are sums and products of them.
pub(super) type Rational = dashu_ratio::Relaxed;

type Vector = [Rational; 3];

/// Where a line crosses a triangle's plane, at `o + t d = a + u (b - a) + v (c - a)`.
#[derive(Clone, Debug)]
pub(super) struct Crossing {
    pub(super) t: Rational,
    pub(super) u: Rational,
    pub(super) v: Rational,
}

/// Whether `ray`, which [is one](super::is_ray), hits `triangle`, whose corners are finite.
///
/// There is a `t` in the closed interval with the point in the closed triangle, and the line is not
/// parallel to its plane. Ends of the interval may be infinite; `t` is not.
pub fn hits(ray: &Ray, triangle: &Triangle) -> bool {
    let Some(Crossing { t, u, v }) = crossing(ray, triangle) else { return false };
    let (zero, one) = (Rational::ZERO, Rational::ONE);
    u >= zero
        && v >= zero
        && u + v <= one
        && end(ray.t_min).map_or(ray.t_min < 0.0, |t_min| t_min <= t)
        && end(ray.t_max).map_or(ray.t_max > 0.0, |t_max| t <= t_max)
}

/// The crossing by Cramer's rule; `None` if the triangle is degenerate or the line parallel to it.
pub(super) fn crossing(ray: &Ray, triangle: &Triangle) -> Option<Crossing> {
    let [a, b, c] = triangle.0.map(vector);
    let (origin, direction) = (vector(ray.origin), vector(ray.direction));
    let (ab, ac, ao) = (minus(&b, &a), minus(&c, &a), minus(&origin, &a));
    let normal = cross(&ab, &ac);
    let determinant = dot(&direction, &normal);
    if determinant.is_zero() {
        return None;
    }
    Some(Crossing {
        t: -dot(&ao, &normal) / &determinant,
        u: dot(&direction, &cross(&ao, &ac)) / &determinant,
        v: dot(&direction, &cross(&ab, &ao)) / &determinant,
    })
}

/// Whether the triangle has no area.
pub(super) fn is_degenerate(triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.0.map(vector);
    cross(&minus(&b, &a), &minus(&c, &a)).iter().all(Rational::is_zero)
}

/// An end of an interval; `None` if it is infinite.
pub(super) fn end(t: f32) -> Option<Rational> {
    Rational::try_from(t).ok()
}

fn vector(v: Vec3) -> Vector {
    v.to_array().map(|x| Rational::try_from(x).expect("coordinates are finite"))
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &a[i] * &b[j] - &a[j] * &b[i])
}

fn dot(a: &Vector, b: &Vector) -> Rational {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

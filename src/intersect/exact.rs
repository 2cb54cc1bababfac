//! Whether a ray hits a triangle, without rounding: `f64` with a proven bound on its error where
//! that settles it, else integers of any size.
//!
//! With `C = a - o`, edges `e1 = b - a` and `e2 = c - a` and normal `N = e1 x e2`, Cramer's rule
//! gives the line's parameter `t = T / D` and the weights `U / D`, `V / D` and `W / D` of the
//! corners, where
//!
//! ```text
//! D = N d    T = N C    U = (C x d) e2    V = (d x C) e1    W = D - U - V
//! ```
//!
//! (Moeller and Trumbore, "Fast, Minimum Storage Ray-Triangle Intersection", JGT 2(1), 1997.) The ray
//! hits if `D` is not zero, `U`, `V` and `W` have its sign or are zero, and `t_min <= T / D <= t_max`.
//!
//! # The bound
//!
//! With `e = 2^-53`: differences of `f32` have one rounding in `f64`, and of up to four factors of
//! `f32` size no product overflows or underflows. A component of `C x d` has errors of 1 (`C`), 1
//! (product) and 1 (difference), and a product with `e2` adds 1 (`e2`), 1 (product) and 2 (sum): in
//! all less than `8 e |C| |d| |e2|`, in norms that sum components. Likewise `D` is off by less than
//! `8 e |e1| |e2| |d|`, `T` by `9 e |e1| |e2| |C|`, `W` by the sum of those of `D`, `U` and `V` and `2
//! e` of their sizes, and `T - t D` by `(9 + 2) e |e1| |e2| |C| + (8 + 3) e |t| |e1| |e2| |d|`. The
//! 16 below covers each, and the rounding of the bound itself.

use crate::geometry::Triangle;
use crate::ray::Ray;
use dashu_int::IBig;
use glam::DVec3;
use std::cmp::Ordering;

/// What settled a test: the cheapest arithmetic that was certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// `f32`.
    Single,
    /// `f64`.
    Double,
    /// Integers.
    Exact,
}

/// Whether a valid `ray` (see [`Ray`]) hits `triangle`, and what settled it.
pub(crate) fn hits(ray: &Ray, triangle: &Triangle) -> (bool, Stage) {
    match hits_by_f64(ray, triangle) {
        Some(hit) => (hit, Stage::Double),
        None => (hits_by_integers(ray, triangle), Stage::Exact),
    }
}

fn size(v: DVec3) -> f64 {
    let v = v.abs();
    v.x + v.y + v.z
}

/// `None` where rounding might decide.
fn hits_by_f64(ray: &Ray, triangle: &Triangle) -> Option<bool> {
    const ERROR: f64 = 16.0 / (1u64 << 53) as f64;
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (to_corner, ab, ac) = (a - origin, b - a, c - a);
    let moment = to_corner.cross(direction);
    let (u, v) = (moment.dot(ac), -moment.dot(ab));
    let normal = ab.cross(ac);
    let d = normal.dot(direction);
    let w = d - u - v;
    let line = size(to_corner) * size(direction) * ERROR;
    let (u_error, v_error) = (line * size(ac), line * size(ab));
    let area = size(ab) * size(ac) * ERROR;
    let d_error = area * size(direction);
    let weights = [(u, u_error), (v, v_error), (w, d_error + u_error + v_error)];
    let above = weights.iter().any(|(weight, error)| weight > error);
    let below = weights.iter().any(|(weight, error)| *weight < -error);
    if above && below {
        return Some(false);
    }
    if d.abs() <= d_error {
        return None;
    }
    if if d > 0.0 { below } else { above } {
        return Some(false);
    }
    let mut certain = weights.iter().all(|(weight, error)| weight.abs() > *error);
    let t = normal.dot(to_corner);
    let ends = [(f64::from(ray.t_min), d.signum()), (f64::from(ray.t_max), -d.signum())];
    for (end, inwards) in ends {
        if end.is_infinite() {
            // Beyond all points, or before them.
            if (end > 0.0) == (inwards == d.signum()) {
                return Some(false);
            }
            continue;
        }
        let past = (t - end * d) * inwards;
        let error = area * (size(to_corner) + end.abs() * size(direction));
        if past < -error {
            return Some(false);
        }
        certain &= past > error;
    }
    certain.then_some(true)
}

/// `mantissa * 2^exponent`; a zero has the largest exponent.
#[derive(Clone, Copy)]
struct Scaled {
    mantissa: i32,
    exponent: i32,
}

impl Scaled {
    fn new(value: f32) -> Self {
        let bits = value.to_bits();
        let (field, fraction) = ((bits >> 23 & 0xff) as i32, (bits & 0x7f_ffff) as i32);
        let size = if field == 0 { fraction } else { fraction | 1 << 23 };
        let mantissa = if value.is_sign_negative() { -size } else { size };
        Self { mantissa, exponent: if size == 0 { i32::MAX } else { field.max(1) - 150 } }
    }

    fn times_two_to(self, exponent: i32) -> IBig {
        if self.mantissa == 0 {
            return IBig::ZERO;
        }
        IBig::from(self.mantissa) << (self.exponent - exponent) as usize
    }
}

type Vector = [IBig; 3];

/// Vectors as integers, in units of `2^exponent`, the largest that serves.
fn integers<const N: usize>(vectors: [glam::Vec3; N]) -> ([Vector; N], i32) {
    let scaled = vectors.map(|v| v.to_array().map(Scaled::new));
    let exponent = scaled.iter().flatten().map(|s| s.exponent).min().unwrap_or_default();
    (scaled.map(|v| v.map(|s| s.times_two_to(exponent))), exponent)
}

fn difference(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| &a[i] - &b[i])
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        &a[j] * &b[k] - &a[k] * &b[j]
    })
}

fn dot(a: &Vector, b: &Vector) -> IBig {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn hits_by_integers(ray: &Ray, triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.0;
    let ([origin, a, b, c], unit) = integers([ray.origin, a, b, c]);
    let ([direction], direction_unit) = integers([ray.direction]);
    let (to_corner, ab, ac) = (difference(&a, &origin), difference(&b, &a), difference(&c, &a));
    let normal = cross(&ab, &ac);
    let d = dot(&normal, &direction);
    let side = d.cmp(&IBig::ZERO);
    if side == Ordering::Equal {
        return false;
    }
    let turned = |value: IBig| if side == Ordering::Less { -value } else { value };
    let moment = cross(&to_corner, &direction);
    let (u, v) = (dot(&moment, &ac), -dot(&moment, &ab));
    let w = &d - &u - &v;
    if [u, v, w].into_iter().any(|weight| turned(weight) < IBig::ZERO) {
        return false;
    }
    let t = turned(dot(&normal, &to_corner));
    let d = turned(d);
    // How `t / d` compares with an end of the interval; `t` counts in units of 2^unit more than `d`
    // in those of the direction.
    let compared = |end: f32| {
        if end.is_infinite() {
            return if end > 0.0 { Ordering::Less } else { Ordering::Greater };
        }
        let end = Scaled::new(end);
        if end.mantissa == 0 {
            return t.cmp(&IBig::ZERO);
        }
        let product = &d * end.mantissa;
        let shift = unit - direction_unit - end.exponent;
        let places = shift.unsigned_abs() as usize;
        if shift >= 0 { (&t << places).cmp(&product) } else { t.cmp(&(product << places)) }
    };
    compared(ray.t_min) != Ordering::Less && compared(ray.t_max) != Ordering::Greater
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::test_random::Random;

    fn ray(origin: [f32; 3], direction: [f32; 3], t_min: f32, t_max: f32) -> Ray {
        Ray { origin: origin.into(), t_min, direction: direction.into(), t_max }
    }

    fn both(ray: &Ray, triangle: &Triangle) -> bool {
        let exact = hits_by_integers(ray, triangle);
        if let Some(hit) = hits_by_f64(ray, triangle) {
            assert_eq!(hit, exact, "{ray:?} {triangle:?}");
        }
        assert_eq!(hits(ray, triangle).0, exact);
        exact
    }

    const UNIT: Triangle = Triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);

    #[test]
    fn corners_edges_and_ends_belong_to_it() {
        let down = |x: f32, y: f32, t_min: f32, t_max: f32| {
            both(&ray([x, y, 1.0], [0.0, 0.0, -1.0], t_min, t_max), &UNIT)
        };
        for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.25, 0.0], [0.1, 0.1]] {
            assert!(down(x, y, 0.0, 1.0) && down(x, y, 1.0, f32::INFINITY), "{x} {y}");
            assert!(down(x, y, f32::NEG_INFINITY, f32::INFINITY));
            assert!(!down(x, y, 0.0, 1.0f32.next_down()) && !down(x, y, 1.0f32.next_up(), 2.0));
            assert!(!down(x, y, f32::INFINITY, f32::INFINITY));
            assert!(!down(x, y, f32::NEG_INFINITY, f32::NEG_INFINITY));
        }
        let tiny = f32::from_bits(1);
        assert!(!down(-tiny, 0.5, 0.0, 2.0) && !down(0.5, 0.5f32.next_up(), 0.0, 2.0));
        assert!(down(tiny, 0.5, 0.0, 2.0));
        // In the plane, and a triangle without area.
        assert!(!both(&ray([-1.0, 0.2, 0.0], [1.0, 0.0, 0.0], 0.0, 9.0), &UNIT));
        let line = Triangle([Vec3::ZERO, Vec3::X, Vec3::X * 0.5]);
        assert!(!both(&ray([0.25, 0.0, 1.0], [0.0, 0.0, -1.0], 0.0, 2.0), &line));
    }

    #[test]
    fn numbers_of_any_size() {
        for scale in [1e-45f32, 1e-38, 1e-20, 1e20, 1e38] {
            let triangle = Triangle(UNIT.0.map(|v| v * scale));
            for length in [1e-45f32, 1e-10, 1.0, 1e38] {
                let down = ray([0.0, 0.0, scale], [0.0, 0.0, -length], 0.0, f32::INFINITY);
                assert!(both(&down, &triangle), "{scale} {length}");
                let up = Ray { direction: -down.direction, ..down };
                assert!(!both(&up, &triangle));
                let back = Ray { t_min: f32::NEG_INFINITY, t_max: 0.0, ..up };
                assert!(both(&back, &triangle));
            }
        }
    }

    #[test]
    fn f64_is_right_where_it_is_certain() {
        let mut random = Random::new(0xe8ac7);
        let (mut certain, mut hit) = (0, 0);
        for round in 0..200_000 {
            let grid = |v: Vec3| (v * 4.0).round() * 0.25;
            let mut corners = [random.point(), random.point(), random.point()];
            let mut ray = random.ray();
            match round % 4 {
                0 => {}
                1 => {
                    corners = corners.map(grid);
                    (ray.origin, ray.direction) = (grid(ray.origin), grid(ray.direction));
                    ray.t_max = 1.0;
                }
                2 => ray.direction = corners[0].lerp(corners[1], random.unit()) - ray.origin,
                _ => {
                    let offset = Vec3::new(148_376.0, 1234.0, -223_423.0);
                    corners = corners.map(|v| v + offset);
                    ray.origin += offset;
                    ray.direction = corners[0] - ray.origin;
                }
            }
            if ray.direction == Vec3::ZERO {
                continue;
            }
            let triangle = Triangle(corners);
            certain += u32::from(hits_by_f64(&ray, &triangle).is_some());
            hit += u32::from(both(&ray, &triangle));
        }
        assert!(certain > 100_000 && certain < 190_000 && hit > 20_000, "{certain} {hit}");
    }
}

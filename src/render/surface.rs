//! Where shadow rays start: points on triangles, and how far off them.

use crate::geometry::Triangle;
use crate::ray::Ray;
use glam::{DVec3, Vec3};

/// How far to move off a surface so that neither rounding to `f32` nor a fast intersection test
/// finds that surface again. `coordinate`: the largest absolute coordinate of the point; `extent`:
/// the largest coordinate difference that the test computes with. In scene units, as are offsets.
///
/// The idea is that of Waechter and Binder, "A Fast and Robust Method for Avoiding
/// Self-Intersection" (Ray Tracing Gems, 2019): as many units in the last place as the arithmetic
/// loses. They allow for 256 of them in a hit point computed in `f32`. Here points and planes are
/// computed in `f64`: of 4 units of the coordinate, rounding the point takes one at most, and the
/// rest is for neighbours whose corners were rounded. Of the extent, a test in `f32` loses about a
/// quarter of the 8 units; without them, large triangles near the origin would meet themselves.
pub(super) fn offset_distance(coordinate: f64, extent: f64) -> f64 {
    let unit = f64::from(f32::EPSILON);
    unit * (4.0 * coordinate + 8.0 * extent) + f64::from(f32::MIN_POSITIVE)
}

/// The point that a camera ray sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point of the triangle, in scene units.
    pub position: DVec3,
    /// Where shadow rays start: in front of the triangle's plane by an offset that keeps them from
    /// meeting the triangle again.
    pub origin: Vec3,
    /// Unit geometric normal, on the side that the ray came from: geometry is two-sided.
    pub normal: DVec3,
    /// Distance from the ray's origin, in scene units.
    pub distance: f64,
}

impl SurfacePoint {
    /// The point where `ray` meets `triangle`, which a backend found it to hit.
    ///
    /// Nothing of the backend's arithmetic enters: the point is found again in `f64` from its
    /// barycentric coordinates, so it lies in the triangle whatever the ray's angle and length, and
    /// is the same for all backends.
    pub fn new(triangle: &Triangle, ray: &Ray) -> Self {
        let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (ab, ac) = (b - a, c - a);
        let cross = ab.cross(ac);
        let [u, v] = barycentrics(origin - a, direction, ab, ac);
        let position = a + ab * u + ac * v;
        let normal = match cross.try_normalize() {
            Some(normal) if normal.dot(direction) <= 0.0 => normal,
            Some(normal) => -normal,
            None => -direction.normalize_or_zero(),
        };
        let extent = [a, b, c].map(|v| (v - position).abs().max_element());
        let extent = extent.into_iter().fold(0.0, f64::max);
        let offset = offset_distance(position.abs().max_element(), extent);
        Self {
            position,
            origin: (position + normal * offset).as_vec3(),
            normal,
            distance: (position - origin).length(),
        }
    }
}

/// Weights of the second and third corner where the line `origin + t direction` meets the triangle
/// `0, ab, ac`, forced into the triangle (Moeller and Trumbore, "Fast, Minimum Storage Ray-Triangle
/// Intersection", JGT 2(1), 1997).
fn barycentrics(origin: DVec3, direction: DVec3, ab: DVec3, ac: DVec3) -> [f64; 2] {
    let p = direction.cross(ac);
    let inverse = 1.0 / ab.dot(p);
    let u = origin.dot(p) * inverse;
    let v = direction.dot(origin.cross(ab)) * inverse;
    if !(u.is_finite() && v.is_finite()) {
        return [1.0 / 3.0; 2];
    }
    let (u, v) = (u.max(0.0), v.max(0.0));
    let sum = (u + v).max(1.0);
    [u / sum, v / sum]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sampler::mix;
    use crate::render::warp;

    /// A fast intersection test as a single-precision backend does it.
    fn hit_in_f32(ray: &Ray, triangle: &Triangle) -> bool {
        let [a, b, c] = triangle.0;
        let (ab, ac) = (b - a, c - a);
        let p = ray.direction.cross(ac);
        let inverse = 1.0 / ab.dot(p);
        let s = ray.origin - a;
        let q = s.cross(ab);
        let (u, v) = (s.dot(p) * inverse, ray.direction.dot(q) * inverse);
        let t = ac.dot(q) * inverse;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0
    }

    fn random(state: &mut u64) -> f64 {
        *state = mix(*state);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Every ray into the hemisphere leaves, whatever the scale and the place of the triangle.
    #[test]
    fn no_ray_meets_the_triangle_it_left() {
        let mut state = 1;
        let scales = [1e-6, 1e-3, 1.0, 1e3, 1e6];
        for (case, scale) in (0..40_000).map(|case| (case, scales[case % 5])) {
            let translation = [0.0, 1.0, 1e2, 1e5][case / 5 % 4];
            let mut point = || {
                let p = DVec3::from_array([(); 3].map(|()| random(&mut state) * 2.0 - 1.0));
                (p * scale + DVec3::new(1.0, -0.7, 0.3) * translation).as_vec3()
            };
            let triangle = Triangle([point(), point(), point()]);
            let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
            // Below the spacing of numbers out there it is no triangle, nor is a needle.
            let longest = (b - a).length().max((c - a).length());
            if triangle.area() < 0.01 * longest * longest || longest < 1e-6 * translation {
                continue;
            }
            let [u, v] = [random(&mut state), random(&mut state)].map(|x| x * 0.5);
            let target = a + (b - a) * u + (c - a) * v;
            let eye = target + warp::uniform_sphere([random(&mut state), v * 2.0]) * longest * 3.0;
            let view = Ray::new(eye.as_vec3(), (target - eye).as_vec3(), f32::INFINITY);
            let point = SurfacePoint::new(&triangle, &view);
            let height = point.normal.dot(point.origin.as_dvec3() - a);
            let magnitude = longest + a.abs().max_element();
            assert!(height > 0.0 && height < 2e-6 * magnitude, "case {case}: {height:e}");
            assert!(point.normal.dot(eye - a) > 0.0, "case {case}: looks away from the viewer");
            for k in 0..8 {
                // From straight up to within a quarter of a thousandth of the plane.
                let u = if k == 0 { 1.0 - 2f64.powi(-23) } else { random(&mut state) };
                let local = warp::cosine_hemisphere([u, random(&mut state)].map(|x| x as f32));
                let direction = warp::to_world(local.as_dvec3(), point.normal).as_vec3();
                let ray = Ray::new(point.origin, direction, f32::INFINITY);
                assert!(!hit_in_f32(&ray, &triangle), "case {case}: {ray:?} meets {triangle:?}");
            }
        }
    }

    #[test]
    fn points_lie_in_the_triangle_even_when_seen_edge_on() {
        let triangle = Triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
        for slope in [1e-3, 1e-12, 1e-30, 0.0] {
            let ray = Ray::new(Vec3::new(-5.0, 0.25, 0.0), Vec3::new(1.0, 0.0, -slope), f32::MAX);
            let p = SurfacePoint::new(&triangle, &ray);
            assert!(p.position.min_element() >= 0.0 && p.position.x + p.position.y <= 1.0);
            assert!(p.normal.is_normalized() && p.origin.is_finite());
        }
    }

    #[test]
    fn contacts_stay_tight() {
        // A room of ten units: a gap under a box that stands on the floor is a hundredth of a
        // millimetre where units are metres.
        let floor = Triangle([Vec3::ZERO, Vec3::X * 10.0, Vec3::Z * 10.0]);
        let view = Ray::new(Vec3::new(3.0, 2.0, 3.0), Vec3::NEG_Y, f32::INFINITY);
        let point = SurfacePoint::new(&floor, &view);
        assert!(point.origin.y > 0.0 && point.origin.y < 2e-5, "{}", point.origin.y);
        assert_eq!((point.distance, point.normal), (2.0, DVec3::Y));
    }
}

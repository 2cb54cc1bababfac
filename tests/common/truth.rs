//! A brute force in `f64` that says where `f32` may answer either way.

use sato::geometry::{Triangle, TriangleMesh};
use sato::ray::Ray;

/// What `f64` says of a ray and a triangle, or of all triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    Hit(f64),
    Miss,
    /// So near to an edge or an end of the ray that `f32` may say either.
    Unsure,
}

fn truth_of_triangle(ray: &Ray, triangle: &Triangle) -> Truth {
    const MARGIN: f64 = 1e-4;
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let direction = ray.direction.as_dvec3();
    let (e1, e2, s) = (b - a, c - a, ray.origin.as_dvec3() - a);
    let p = direction.cross(e2);
    let det = e1.dot(p);
    let q = s.cross(e1);
    // Distances inside the edges and the interval; negative is outside.
    let (u, v, t) = (s.dot(p) / det, direction.dot(q) / det, e2.dot(q) / det);
    let inside = u.min(v).min(1.0 - u - v);
    let within = (t - f64::from(ray.t_min)).min(f64::from(ray.t_max) - t);
    let depth = inside.min(within);
    if det == 0.0 || depth < -MARGIN {
        Truth::Miss
    } else if depth > MARGIN {
        Truth::Hit(t)
    } else {
        Truth::Unsure
    }
}

/// Whether anything is in the way, and the closest hit where it is beyond doubt.
pub fn truth(ray: &Ray, mesh: &TriangleMesh) -> (Truth, Option<(f64, u32)>) {
    let mut any = Truth::Miss;
    let mut closest: Option<(f64, u32)> = None;
    let mut unsure = false;
    for index in 0..mesh.len() {
        match truth_of_triangle(ray, &mesh.triangle(index)) {
            Truth::Hit(t) => {
                any = Truth::Hit(t);
                unsure |= closest.is_some_and(|(other, _)| (t - other).abs() < 1e-3);
                if closest.is_none_or(|(other, _)| t < other) {
                    closest = Some((t, index as u32));
                }
            }
            Truth::Unsure => unsure = true,
            Truth::Miss => {}
        }
    }
    match any {
        Truth::Miss if unsure => (Truth::Unsure, None),
        other => (other, closest.filter(|_| !unsure)),
    }
}

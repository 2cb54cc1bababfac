//! The watertight ray-triangle test of Woop, Benthin and Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1), 2013.
//!
//! The scene is moved to the ray's origin and sheared so that the ray runs along its largest axis;
//! what remains are three signs in the plane. Each vertex is moved on its own, so triangles that
//! share an edge see the same two points and no ray slips between them. Rounding is monotone, so a
//! sign that is not zero in `f32` is right for the sheared points; one that is zero is found in
//! `f64`, where the products are exact.
//!
//! Unlike in the paper, the distance does not come from the three edge functions: they cancel in
//! long thin triangles, and a ray that starts on one would meet it again. It comes from the plane,
//! in `f64`, for the few triangles that pass the signs.

use crate::geometry::Triangle;
use crate::ray::Ray;
use glam::{DVec3, Vec3};

/// The shear that turns a ray into the third axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    pub(crate) origin: Vec3,
    /// The last one being the direction's largest.
    pub(crate) axes: [usize; 3],
    /// What the third coordinate is multiplied by, to be subtracted from the first and second.
    pub(crate) factors: [f32; 2],
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let kz = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        let dz = direction[kz];
        Self { origin, axes: [kx, ky, kz], factors: [direction[kx] / dz, direction[ky] / dz] }
    }

    /// The vertex in sheared coordinates, across the ray.
    #[inline(always)]
    fn project(&self, vertex: Vec3) -> [f32; 2] {
        let v = vertex - self.origin;
        let ([kx, ky, kz], [sx, sy]) = (self.axes, self.factors);
        let z = v[kz];
        [v[kx] - sx * z, v[ky] - sy * z]
    }

    /// The corners across the ray, and their edge functions, each opposite its corner.
    #[inline(always)]
    fn edges(&self, triangle: &Triangle) -> ([[f32; 2]; 3], [f32; 3]) {
        let [a, b, c] = triangle.0;
        let [a, b, c] = [self.project(a), self.project(b), self.project(c)];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        ([a, b, c], [u, v, w])
    }

    /// Whether the ray's line passes through the closed triangle, in whatever direction; `false` if
    /// the triangle has no area in the plane across the ray.
    #[inline(always)]
    pub(super) fn passes_through(&self, triangle: &Triangle) -> bool {
        let (corners, [u, v, w]) = self.edges(triangle);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return false;
        }
        // Also true of NaN, from coordinates that overflow.
        let in_doubt = !(u * v * w).is_normal();
        !in_doubt || passes_through_exactly(corners)
    }

    /// Whether two edge functions of unlike signs show that the line misses the triangle, each of them
    /// beyond `slack` times the corners' largest distance: then it is the exact line that does.
    #[inline(always)]
    pub(super) fn surely_passes_by(&self, triangle: &Triangle, slack: f32) -> bool {
        let ([a, b, c], [u, v, w]) = self.edges(triangle);
        let far = |p: [f32; 2]| p[0].abs() + p[1].abs();
        // The last number is more than underflow takes.
        let slack = slack * far(a).max(far(b)).max(far(c)) + f32::MIN_POSITIVE;
        // Of NaN no comparison holds.
        let (below, above) = (u.min(v).min(w) < -slack, u.max(v).max(w) > slack);
        below && above
    }

    /// For a triangle that the line [passes through](Self::passes_through): the point of it that
    /// lies on the line in sheared coordinates. `None` where these overflow.
    pub(super) fn passed_point(&self, triangle: &Triangle) -> Option<DVec3> {
        let edges = edge_functions(triangle.0.map(|v| self.project(v)));
        let sum: f64 = edges.iter().sum();
        let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
        let [u, v, w] = edges.map(|edge| edge / sum);
        sum.is_finite().then(|| a * u + b * v + c * w)
    }
}

/// The edge functions of sheared corners, each opposite its corner. The products are exact, so there
/// is one rounding, and none to zero.
fn edge_functions(corners: [[f32; 2]; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]]
}

/// As [`Shear::passes_through`] decides, in `f64`.
#[cold]
fn passes_through_exactly(corners: [[f32; 2]; 3]) -> bool {
    let [u, v, w] = edge_functions(corners);
    let negative = u < 0.0 || v < 0.0 || w < 0.0;
    let positive = u > 0.0 || v > 0.0 || w > 0.0;
    // All zero is no area; NaN is neither.
    negative != positive && !(u + v + w).is_nan()
}

/// Where a ray's line meets a triangle's plane.
pub(super) struct Crossing {
    /// To about 50 bits.
    pub(super) t: f64,
    /// The point, if it lies in the triangle.
    pub(super) inside: Option<DVec3>,
}

/// Where the ray's line meets the triangle's plane, in `f64`; `None` if it lies in or beside the
/// plane, or the triangle has no plane. Weights of corners as by Moeller and Trumbore, "Fast, Minimum
/// Storage Ray-Triangle Intersection", JGT 2(1), 1997.
pub(super) fn plane_crossing(ray: &Ray, triangle: &Triangle) -> Option<Crossing> {
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let (to_plane, direction) = (a - ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let normal = ab.cross(ac);
    let slope = normal.dot(direction);
    let t = normal.dot(to_plane) / slope;
    if slope == 0.0 || !t.is_finite() {
        return None;
    }
    let moment = to_plane.cross(direction) * slope.recip();
    let (v, w) = (ac.dot(moment), -ab.dot(moment));
    let is_inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    Some(Crossing { t, inside: is_inside.then(|| a + ab * v + ac * w) })
}

//! The watertight ray-triangle test of Woop, Benthin and Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1), 2013.
//!
//! The scene is moved to the ray's origin and sheared so that the ray runs along its largest axis;
//! what remains are three signs in the plane. Each vertex is moved on its own, so triangles that
//! share an edge see the same two points and no ray slips between them. Where a product of rounded
//! coordinates cancels to zero, either side of the edge is taken: rounding is monotone, so a
//! non-zero sign is never wrong for the sheared points, and a closed mesh stays closed without
//! going to higher precision.

use crate::geometry::Triangle;
use glam::Vec3;

/// The shear that turns a ray into the third axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    origin: Vec3,
    /// The axes, the last one being the direction's largest.
    kx: usize,
    ky: usize,
    kz: usize,
    sx: f32,
    sy: f32,
    sz: f32,
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
        Self { origin, kx, ky, kz, sx: direction[kx] / dz, sy: direction[ky] / dz, sz: 1.0 / dz }
    }

    /// The vertex in sheared coordinates: two across the ray, one along it in units of `t`.
    #[inline(always)]
    fn project(&self, vertex: Vec3) -> [f32; 3] {
        let v = vertex - self.origin;
        let z = v[self.kz];
        [v[self.kx] - self.sx * z, v[self.ky] - self.sy * z, self.sz * z]
    }

    /// The `t` at which the ray's line meets the closed triangle; `None` if it does not, or if the
    /// determinant is zero (a degenerate triangle, or a ray in its plane).
    #[inline(always)]
    pub(super) fn intersect(&self, triangle: &Triangle) -> Option<f32> {
        let [a, b, c] = triangle.0.map(|v| self.project(v));
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        // NaN, from coordinates that overflow, is no hit either.
        if determinant == 0.0 || determinant.is_nan() {
            return None;
        }
        Some((u * a[2] + v * b[2] + w * c[2]) / determinant)
    }
}

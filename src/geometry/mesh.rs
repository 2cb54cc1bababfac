//! Indexed triangle meshes.

use super::Aabb;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// Three corners in scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triangle(pub [Vec3; 3]);

impl Triangle {
    /// How far [`box_around`](Self::box_around) reaches, over the point's coordinates: more than a
    /// half-ulp, so that rounding goes to the next number at least. One half-ulp each are for rounding
    /// the point and the end.
    pub(crate) const POINT_REACH: f32 = 1.25 / (1u32 << 24) as f32;

    /// The smallest box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.0)
    }

    /// A tiny box around `point` of the triangle, known in `f64`, within the triangle's own box. With
    /// `e = 2^-24` and `l` the largest coordinate of the triangle on an axis, it holds the point and
    /// reaches no further than `3.5 e l + 1.5 f32::MIN_POSITIVE` from it.
    #[inline]
    pub fn box_around(&self, point: DVec3) -> Aabb {
        // Without a branch, which could not be predicted.
        let bounds = self.bounds();
        let nearest = point.as_vec3().clamp(bounds.min, bounds.max);
        let reach = nearest.abs() * Self::POINT_REACH + Vec3::splat(f32::MIN_POSITIVE);
        Aabb { min: nearest - reach, max: nearest + reach }.overlap(bounds)
    }

    /// Area in scene units squared, computed in `f64`.
    #[inline]
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.0;
        let (ab, ac) = (b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3());
        0.5 * ab.cross(ac).length()
    }

    /// Unit geometric normal by the right-hand rule; zero for a degenerate triangle.
    pub fn normal(&self) -> Vec3 {
        let [a, b, c] = self.0.map(|v| v.as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }
}

/// Shared vertices and triangles that index them: the one copy of the geometry that every backend
/// builds from.
///
/// Every index is in range and every vertex that a triangle uses is finite: the loaders see to it.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// The vertices, then one of padding: Embree reads 16 bytes at each 12-byte vertex.
    padded_vertices: Vec<Vec3>,
    /// Shared by the meshes of a moving scene.
    triangles: Arc<[[u32; 3]]>,
}

impl TriangleMesh {
    /// A mesh from parts.
    ///
    /// # Panics
    /// If an index is out of range: loaders check their input first, with better messages.
    pub fn new(mut vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let count = vertices.len();
        assert!(
            triangles.iter().flatten().all(|&i| (i as usize) < count),
            "triangle index out of range"
        );
        vertices.push(Vec3::ZERO);
        Self { padded_vertices: vertices, triangles: triangles.into() }
    }

    /// The same triangles with their vertices where `place` puts them; it is given the present ones.
    ///
    /// Places are finite, and no further from the origin than those of loaded meshes.
    pub fn moved(&self, place: impl FnOnce(&mut [Vec3])) -> Self {
        let mut moved = self.clone();
        let count = moved.vertices().len();
        place(&mut moved.padded_vertices[..count]);
        moved
    }

    /// The vertices.
    pub fn vertices(&self) -> &[Vec3] {
        &self.padded_vertices[..self.padded_vertices.len().saturating_sub(1)]
    }

    /// The vertices followed by one that nothing refers to, for readers that load 16 bytes.
    pub fn padded_vertices(&self) -> &[Vec3] {
        &self.padded_vertices
    }

    /// Vertex indices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether it has no triangle.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The corners of triangle `index`.
    #[inline]
    pub fn triangle(&self, index: usize) -> Triangle {
        Triangle(self.triangles[index].map(|v| self.padded_vertices[v as usize]))
    }

    /// Box around all triangles (unused vertices do not count).
    pub fn bounds(&self) -> Aabb {
        (0..self.len()).fold(Aabb::EMPTY, |b, i| b.union(self.triangle(i).bounds()))
    }

    /// Bytes of vertices and indices.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.padded_vertices.as_slice()) + size_of_val(&*self.triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn boxes_around_points_hold_them_and_reach_as_far_as_they_say() {
        let mut random = Random::new(91);
        let e = f64::from(f32::EPSILON) / 2.0;
        for round in 0..200_000 {
            let exponent = [-149, -140, -126, -125, -120, -24, 0, 20, 124][round % 9];
            let scale = f64::from(exponent).exp2() as f32;
            let triangle = Triangle([0; 3].map(|_| random.point() * scale));
            let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
            let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
            let own = triangle.bounds();
            let point = a + ((b - a) + (c - b) * v) * u;
            let point = point.clamp(own.min.as_dvec3(), own.max.as_dvec3());
            let around = triangle.box_around(point);
            assert!(own.contains(&around) && !around.is_empty(), "{triangle:?} {point}");
            let (below, above) = (point - around.min.as_dvec3(), around.max.as_dvec3() - point);
            let largest = own.min.abs().max(own.max.abs()).as_dvec3();
            let most = largest * (3.5 * e) + DVec3::splat(1.5 * f64::from(f32::MIN_POSITIVE));
            for distance in [below, above] {
                let holds = distance.cmpge(DVec3::ZERO).all() && distance.cmple(most).all();
                assert!(holds, "{triangle:?} {point} {around:?}");
            }
        }
    }
}

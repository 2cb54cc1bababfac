//! Indexed triangle meshes.

use super::Aabb;
use glam::Vec3;

/// Three corners in scene units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triangle(pub [Vec3; 3]);

impl Triangle {
    /// The smallest box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.0)
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
    triangles: Vec<[u32; 3]>,
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
        Self { padded_vertices: vertices, triangles }
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
        size_of_val(self.padded_vertices.as_slice()) + size_of_val(self.triangles.as_slice())
    }
}

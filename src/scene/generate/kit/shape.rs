//! A growing indexed mesh: the stuff that all models are made of.

use super::math::{Place, V};
use crate::geometry::TriangleMesh;

/// Vertices and triangles in `f64`, a model or a part of one.
#[derive(Clone, Default)]
pub(crate) struct Shape {
    vertices: Vec<V>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Nothing yet.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// What `draw` puts into an empty shape.
    pub(crate) fn of(draw: impl FnOnce(&mut Self)) -> Self {
        let mut shape = Self::new();
        draw(&mut shape);
        shape
    }

    /// Number of triangles.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Adds a vertex and gives its index.
    pub(crate) fn vertex(&mut self, p: V) -> u32 {
        self.vertices.push(p);
        (self.vertices.len() - 1) as u32
    }

    /// The position of vertex `index`.
    pub(crate) fn position(&self, index: u32) -> V {
        self.vertices[index as usize]
    }

    /// Adds a triangle between existing vertices, counter-clockwise seen from outside.
    pub(crate) fn face(&mut self, a: u32, b: u32, c: u32) {
        self.triangles.push([a, b, c]);
    }

    /// Adds two triangles between existing vertices.
    pub(crate) fn face4(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.face(a, b, c);
        self.face(a, c, d);
    }

    /// Adds a triangle.
    pub(crate) fn tri(&mut self, a: V, b: V, c: V) {
        let [a, b, c] = [a, b, c].map(|p| self.vertex(p));
        self.face(a, b, c);
    }

    /// Adds a quadrilateral as two triangles.
    pub(crate) fn quad(&mut self, a: V, b: V, c: V, d: V) {
        let [a, b, c, d] = [a, b, c, d].map(|p| self.vertex(p));
        self.face4(a, b, c, d);
    }

    /// A parametric surface of `nu` by `nv` cells, `2 nu nv` triangles; `f` gets both parameters
    /// from 0 to 1. A direction that is closed shares the vertices of its ends. Seen from outside,
    /// v is to the left of u.
    pub(crate) fn grid(
        &mut self,
        [nu, nv]: [u32; 2],
        [closed_u, closed_v]: [bool; 2],
        mut f: impl FnMut(f64, f64) -> V,
    ) {
        let base = self.vertices.len() as u32;
        let columns = if closed_u { nu } else { nu + 1 };
        let rows = if closed_v { nv } else { nv + 1 };
        for j in 0..rows {
            for i in 0..columns {
                let p = f(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv));
                self.vertices.push(p);
            }
        }
        let index = |i: u32, j: u32| base + (j % rows) * columns + i % columns;
        for j in 0..nv {
            for i in 0..nu {
                self.face4(index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
            }
        }
    }

    /// Adds an instance of `part`.
    pub(crate) fn add(&mut self, part: &Self, place: Place) {
        let base = self.vertices.len() as u32;
        self.vertices.extend(part.vertices.iter().map(|&p| place.transform_point3(p)));
        self.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    }

    /// This shape at another place.
    pub(crate) fn placed(mut self, place: Place) -> Self {
        for p in &mut self.vertices {
            *p = place.transform_point3(*p);
        }
        self
    }

    /// Its vertices and triangles.
    pub(crate) fn into_parts(self) -> (Vec<V>, Vec<[u32; 3]>) {
        (self.vertices, self.triangles)
    }

    /// The mesh, rounded to `f32` once and here only.
    pub(crate) fn into_mesh(self) -> TriangleMesh {
        TriangleMesh::new(self.vertices.iter().map(|p| p.as_vec3()).collect(), self.triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::super::math::v;
    use super::*;

    #[test]
    fn grids_share_vertices() {
        let open = Shape::of(|s| s.grid([3, 2], [false, false], |u, w| v(u, 0.0, w)));
        assert_eq!((open.len(), open.vertices.len()), (12, 12));
        let closed = Shape::of(|s| s.grid([3, 4], [true, true], |u, w| v(u, 0.0, w)));
        assert_eq!((closed.len(), closed.vertices.len()), (24, 12));
    }
}

//! Puts a moving scene together: parts that stand, parts that move, and what moves them.

use super::Shape;
use crate::geometry::{TriangleMesh, Vec3};
use crate::scene::{Motion, Object, Pose};
use std::ops::Range;

/// A moving scene that grows. Its mesh is posed at the end, so that it is the first frame to the bit.
#[derive(Default)]
pub(crate) struct Moving {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    objects: Vec<Object>,
    poses: Vec<(Range<usize>, Box<dyn Pose>)>,
}

impl Moving {
    /// Adds an object that stands.
    pub(crate) fn stand(&mut self, shape: Shape) {
        let (vertices, triangles) = shape.into_parts();
        let first = self.vertices.len();
        self.add(&triangles, vertices.len(), false);
        for (there, v) in self.vertices[first..].iter_mut().zip(vertices) {
            *there = v.as_vec3();
        }
    }

    /// Adds an object that moves: triangles over so many vertices, which [`pose`](Self::pose) will
    /// put somewhere.
    pub(crate) fn add_moving(&mut self, triangles: &[[u32; 3]], vertices: usize) {
        self.add(triangles, vertices, true);
    }

    fn add(&mut self, triangles: &[[u32; 3]], vertices: usize, moves: bool) {
        let (first_vertex, first_triangle) = (self.vertices.len(), self.triangles.len());
        self.vertices.resize(first_vertex + vertices, Vec3::ZERO);
        let first = first_vertex as u32;
        self.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
        self.objects.push(Object {
            vertices: first_vertex..self.vertices.len(),
            triangles: first_triangle..self.triangles.len(),
            moves,
        });
    }

    /// Lets `pose` move the objects that were added last and that no pose moves yet.
    pub(crate) fn pose(&mut self, pose: impl Pose + 'static) {
        let posed = self.poses.last().map_or(0, |(range, _)| range.end);
        let new = self.objects.iter().find(|o| o.moves && o.vertices.start >= posed);
        if let Some(first) = new {
            self.poses.push((first.vertices.start..self.vertices.len(), Box::new(pose)));
        }
    }

    /// The mesh as it is at first, and the motion over `frames`.
    pub(crate) fn finish(mut self, frames: usize) -> (TriangleMesh, Motion) {
        for (range, pose) in &self.poses {
            pose.pose(0.0, &mut self.vertices[range.clone()]);
        }
        let mesh = TriangleMesh::new(self.vertices, self.triangles);
        (mesh, Motion { frames, objects: self.objects, poses: self.poses })
    }
}

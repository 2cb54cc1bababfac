//! How the vertices of a scene move, frame by frame. Triangles stay the same.

use crate::geometry::{TriangleMesh, Vec3};
use std::fmt::Debug;
use std::ops::Range;

/// Where the vertices of a part of a scene are.
pub trait Pose: Debug + Send + Sync {
    /// Puts the vertices of the part where they are at `time`, from 0 at the first frame to 1 at the
    /// last. A function of the time alone, bit for bit; on the current rayon pool.
    fn pose(&self, time: f64, vertices: &mut [Vec3]);
}

/// A part of a moving scene: triangles that belong together, with vertices of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Object {
    /// Indices of its vertices.
    pub vertices: Range<usize>,
    /// Indices of its triangles.
    pub triangles: Range<usize>,
    /// Whether any of its vertices ever moves.
    pub moves: bool,
}

/// The motion of a whole scene.
#[derive(Debug)]
pub struct Motion {
    /// Number of frames: at least 1.
    pub frames: usize,
    /// All triangles of the scene, in order.
    pub objects: Vec<Object>,
    /// What moves vertices, and which of the scene's; without overlap.
    pub poses: Vec<(Range<usize>, Box<dyn Pose>)>,
}

impl Motion {
    /// The time of a frame, from 0 to 1.
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.frames.saturating_sub(1).max(1) as f64
    }

    /// `mesh` as it is in `frame`, counted from 0.
    pub fn mesh_at(&self, mesh: &TriangleMesh, frame: usize) -> TriangleMesh {
        let time = self.time(frame);
        mesh.moved(|vertices| {
            for (range, pose) in &self.poses {
                pose.pose(time, &mut vertices[range.clone()]);
            }
        })
    }
}

//! A scene that moves, made of random triangles.

use super::random::Random;
use super::scene_of;
use sato::geometry::{TriangleMesh, Vec3};
use sato::scene::{Motion, Object, Pose, Scene};
use std::sync::Arc;

/// Turns vertices about the vertical axis and stretches them, each from where it started.
#[derive(Debug)]
pub struct Swirl {
    start: Vec<Vec3>,
    turns: f32,
}

impl Pose for Swirl {
    fn pose(&self, time: f64, vertices: &mut [Vec3]) {
        let time = time as f32;
        for (vertex, start) in vertices.iter_mut().zip(&self.start) {
            let angle = time * self.turns * std::f32::consts::TAU * (1.0 + 0.1 * start.y);
            let (sin, cos) = angle.sin_cos();
            let (x, z) = (start.x * cos - start.z * sin, start.x * sin + start.z * cos);
            *vertex = Vec3::new(x, start.y * (1.0 + 0.5 * time), z);
        }
    }
}

/// Four objects, of which the first and the third move; the fourth is smaller than Embree's leaves.
pub fn moving_scene(random: &mut Random, frames: usize) -> Scene {
    let counts = [70, 90, 60, 3];
    let vertices: Vec<Vec3> = (0..counts.iter().sum())
        .flat_map(|_| {
            let centre = random.point();
            [0; 3].map(|_| centre + random.point() * 0.25)
        })
        .collect();
    let triangles = (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mut objects: Vec<Object> = Vec::new();
    for (index, count) in counts.into_iter().enumerate() {
        let first = objects.last().map_or(0, |o| o.triangles.end);
        let moves = index % 2 == 0;
        let end = first + count;
        objects.push(Object { vertices: 3 * first..3 * end, triangles: first..end, moves });
    }
    let poses = objects
        .iter()
        .filter(|object| object.moves)
        .map(|object| {
            let start = vertices[object.vertices.clone()].to_vec();
            let pose: Box<dyn Pose> = Box::new(Swirl { start, turns: 0.7 });
            (object.vertices.clone(), pose)
        })
        .collect();
    let mut scene = scene_of(TriangleMesh::new(vertices, triangles));
    scene.motion = Some(Arc::new(Motion { frames, objects, poses }));
    scene
}

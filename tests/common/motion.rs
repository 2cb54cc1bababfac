//! Random motions of a mesh for tests.
#![allow(unreachable_pub, dead_code, reason = "also a module of the library's unit tests")]

use super::random::Random;
use glam::{Quat, Vec3};
use sato::geometry::TriangleMesh;

/// A way for triangles to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Rest,
    Rigid,
    Deform,
    Explode,
    Shuffle,
    Collapse,
    Flatten,
    Far,
    Tiny,
}

/// Each of them: also from rest to rest, and back from where everything is one point.
pub const MOTIONS: &[Way] = &[
    Way::Rest,
    Way::Rigid,
    Way::Deform,
    Way::Explode,
    Way::Shuffle,
    Way::Collapse,
    Way::Explode,
    Way::Flatten,
    Way::Far,
    Way::Tiny,
    Way::Rest,
];

/// The mesh as `way` has it.
pub fn moved(mesh: &TriangleMesh, way: Way, seed: u64) -> TriangleMesh {
    let mut random = Random::new(seed);
    let mut point = || Vec3::new(random.unit(), random.unit(), random.unit());
    let (a, b) = (point(), point());
    mesh.moved(|vertices| match way {
        Way::Rest => {}
        Way::Rigid => {
            let turn = Quat::from_scaled_axis(a * 3.0);
            vertices.iter_mut().for_each(|v| *v = turn * *v + b);
        }
        Way::Deform => {
            let wave = |v: Vec3| Vec3::new((v.y + a.x).sin(), (v.z + a.y).cos(), v.x.sin());
            vertices.iter_mut().for_each(|v| *v += wave(*v));
        }
        Way::Explode => {
            for (corners, index) in vertices.chunks_mut(3).zip(0..) {
                let far = if index % 3 == 0 { 30.0 } else { 3.0 };
                let by = (point() - 0.5) * far;
                corners.iter_mut().for_each(|v| *v += by);
            }
        }
        Way::Shuffle => vertices.iter_mut().for_each(|v| *v = point() * 8.0 - 4.0),
        Way::Collapse => vertices.iter_mut().for_each(|v| *v = a),
        Way::Flatten => vertices.iter_mut().for_each(|v| v.y = a.y),
        Way::Far => vertices.iter_mut().for_each(|v| *v = *v * 1e15 + b * 1e16),
        Way::Tiny => vertices.iter_mut().for_each(|v| *v *= 1e-30),
    })
}

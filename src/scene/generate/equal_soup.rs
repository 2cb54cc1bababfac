//! Confetti: equal triangles at random, the control in which no order can help.

use super::kit::{Rng, Shape, V, aimed_quad, camera, light, v};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "equal-soup",
    about: "200k equal triangles in random attitudes: the control in which no order can help",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 200_000;
/// Half the edge of the cube that holds the centres.
const HALF: f64 = 2.0;
/// Edge of every triangle.
const EDGE: f64 = 0.04;

fn generate(seed: u64) -> Generated {
    let mut rng = Rng::new(seed, "confetti");
    let mut shape = Shape::new();
    let radius = EDGE / 3_f64.sqrt();
    for _ in 0..TRIANGLES {
        let mut coordinate = || rng.range(-HALF, HALF);
        let center = v(coordinate(), coordinate(), coordinate());
        // A uniform normal and a uniform direction square to it: a uniform attitude.
        let normal = rng.direction();
        let across = loop {
            let w = normal.cross(rng.direction());
            if w.length_squared() > 0.01 {
                break w / w.length();
            }
        };
        let (p, q) = (across * radius, normal.cross(across) * (EDGE * 0.5));
        shape.tri(center + p, center - p * 0.5 + q, center - p * 0.5 - q);
    }
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(3.3, 2.7, 4.9), v(0.0, 0.0, 0.0), 27.0),
        lights: vec![
            light("sky", aimed_quad(v(-3.0, 6.0, 3.0), V::ZERO, 3.0, 3.0), 60.0, v(1.0, 0.97, 0.9)),
            light("lamp", LightShape::Point { position: glam::vec3(6.0, 2.5, 1.5) }, 120.0, V::ONE),
        ],
        ao_radius: 0.4,
        motion: None,
    }
}

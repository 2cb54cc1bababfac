//! A crowd walks through a town under a low sun: many small things that move among a few large ones
//! that stand.

mod town;
mod walker;

use super::kit::{Moving, Rng, camera, light, v};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;
use walker::{Model, Walker, Walkers};

/// The catalogue's entries.
pub(super) static SMALL_ENTRY: GeneratorEntry = GeneratorEntry {
    name: "crowd-1k",
    about: "703k triangles, moving: 1024 people walk through a town square under a low sun",
    triangles: 703_000,
    generate: |seed| generate(1024, 1, seed),
};

/// Four squares.
pub(super) static MIDDLE_ENTRY: GeneratorEntry = GeneratorEntry {
    name: "crowd-4k",
    about: "2.8M triangles, moving: 4096 people in a town of four squares",
    triangles: 2_810_000,
    generate: |seed| generate(4096, 2, seed),
};

/// Sixteen squares.
pub(super) static LARGE_ENTRY: GeneratorEntry = GeneratorEntry {
    name: "crowd-16k",
    about: "11.0M triangles, moving: 16000 people in a town of 16 squares",
    triangles: 10_950_000,
    generate: |seed| generate(16_000, 4, seed),
};

const FRAMES: usize = 20;
/// From the first frame to the last.
const SECONDS: f64 = 2.0;
/// Width and depth of the part of the ground that holds one person at most.
const ROOM: f64 = 1.4;

/// `agents` people in a town of `squares` by `squares` squares.
fn generate(agents: usize, squares: u32, seed: u64) -> Generated {
    let town = town::Town::new(squares, seed);
    let mut scene = Moving::default();
    let camera = camera(town.view.0, town.view.1, 52.0);
    let models = Model::all(seed);
    let walkers = people(agents, &town, &models, seed);
    scene.stand(town.shape);
    for walker in &walkers {
        let model = &models[walker.model];
        scene.add_moving(&model.triangles, model.vertices.len());
    }
    scene.pose(Walkers { models, walkers });
    let (mesh, motion) = scene.finish(FRAMES);
    Generated {
        mesh,
        camera,
        lights: vec![light(
            "sun",
            LightShape::Directional {
                direction: glam::vec3(0.6, -0.44, -0.62).normalize(),
                angular_diameter_degrees: 1.0,
            },
            3.4,
            v(1.0, 0.88, 0.7),
        )],
        ao_radius: 1.5,
        motion: Some(motion),
    }
}

/// Everybody, each with room of their own at first, and nobody within walls at either end of the way.
fn people(agents: usize, town: &town::Town, models: &[Model], seed: u64) -> Vec<Walker> {
    let mut rng = Rng::new(seed, "people");
    let across = (2.0 * town.half / ROOM) as usize;
    let mut places: Vec<usize> = (0..across * across).collect();
    // Shuffled (Fisher and Yates 1938, Durstenfeld 1964).
    for i in (1..places.len()).rev() {
        places.swap(i, rng.below(i + 1));
    }
    let mut walkers = Vec::with_capacity(agents);
    for place in places.into_iter().cycle() {
        if walkers.len() == agents {
            break;
        }
        let mut coordinate = |i: usize| (i as f64 + rng.range(0.25, 0.75)) * ROOM - town.half;
        let start = v(coordinate(place % across), 0.0, coordinate(place / across));
        let walker = Walker::new(start, models.len(), SECONDS, &mut rng);
        let free = |time: f64| town.is_free(walker.place(time).0);
        if [0.0, 0.5, 1.0].into_iter().all(free) {
            walkers.push(walker);
        }
    }
    walkers
}

//! Scenes made by code, by name: deterministic for a seed.

use super::{Camera, Light};
use crate::geometry::TriangleMesh;

/// A generator and its line in `sato list`.
#[derive(Debug)]
pub struct GeneratorEntry {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// What it makes, in a line.
    pub about: &'static str,
    /// Makes it; equal seeds give equal scenes.
    pub generate: fn(seed: u64) -> Generated,
}

/// What a generator makes.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The triangles.
    pub mesh: TriangleMesh,
    /// A view that shows what the scene is for.
    pub camera: Camera,
    /// The lights.
    pub lights: Vec<Light>,
    /// Length of ambient-occlusion rays that suits the scene, in its units.
    pub ao_radius: f32,
}

/// All generators.
pub static GENERATORS: &[&GeneratorEntry] = &[];

/// The generator called `name`.
pub fn find(name: &str) -> Option<&'static GeneratorEntry> {
    GENERATORS.iter().find(|entry| entry.name == name).copied()
}

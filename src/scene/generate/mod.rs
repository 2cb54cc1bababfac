//! Procedural scenes: counterparts of the paper's six static benchmark scenes, a control, and scenes
//! that move.
//!
//! A scene is a function of its seed and the same bit for bit on every platform. A new one is a
//! file here with its entry, and a line in [`GENERATORS`].

mod atrium;
mod bedroom;
mod carnival;
mod cloth;
mod crowd;
mod equal_soup;
mod explosion;
mod kit;
mod mad_science;
mod shadow_overlap;
mod ship;

use super::{Camera, Light, Motion};
use crate::geometry::TriangleMesh;

/// A scene that can be named in a scene file.
pub struct GeneratorEntry {
    /// The name: lower case, with hyphens.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: &'static str,
    /// About how many triangles it has, within 2 %.
    pub triangles: usize,
    /// Makes it; the seed varies the scattered details.
    pub generate: fn(seed: u64) -> Generated,
}

/// A scene fresh from its generator, in metres with y up.
pub struct Generated {
    /// The triangles.
    pub mesh: TriangleMesh,
    /// A view worth looking at.
    pub camera: Camera,
    /// Lights whose soft shadows fall into the view.
    pub lights: Vec<Light>,
    /// Suggested length of finite ambient-occlusion rays.
    pub ao_radius: f32,
    /// How it moves, if it does; the mesh is its first frame, and no vertex ever gets further than
    /// 100 km from the origin.
    pub motion: Option<Motion>,
}

/// All generators.
pub static GENERATORS: &[&GeneratorEntry] = &[
    &mad_science::ENTRY,
    &carnival::ENTRY,
    &bedroom::ENTRY,
    &atrium::ENTRY,
    &ship::ENTRY,
    &shadow_overlap::ENTRY,
    &equal_soup::ENTRY,
    &crowd::SMALL_ENTRY,
    &crowd::MIDDLE_ENTRY,
    &crowd::LARGE_ENTRY,
    &cloth::ENTRY,
    &explosion::ENTRY,
];

/// A generator of more triangles is left out where all of them are made, as in tests: it takes too long,
/// and too much memory.
pub const MANY_TRIANGLES: usize = 2_500_000;

/// The generator called `name`.
pub fn find(name: &str) -> Option<&'static GeneratorEntry> {
    GENERATORS.iter().copied().find(|entry| entry.name == name)
}

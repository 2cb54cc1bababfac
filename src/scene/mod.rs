//! What is looked at: geometry, camera, lights and the integrators' defaults.

mod camera;
pub mod generate;
mod light;

pub use camera::Camera;
pub use light::{Light, LightShape};

use crate::geometry::TriangleMesh;

/// A loaded scene: checked, finite, ready for backends and renderer.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, from the file or the generator.
    pub name: String,
    /// All triangles, in one index space.
    pub mesh: TriangleMesh,
    /// The view.
    pub camera: Camera,
    /// The lights; may be empty.
    pub lights: Vec<Light>,
    /// What the integrators use unless the command line says otherwise.
    pub defaults: Defaults,
    /// What was repaired or dropped while loading, one line each.
    pub warnings: Vec<String>,
}

/// A scene's own settings for the integrators.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// Length of finite ambient-occlusion rays, in scene units; positive and finite.
    pub ao_radius: f32,
    /// Image width and height in pixels.
    pub size: [u32; 2],
}

//! What is looked at: geometry, camera, lights and the integrators' defaults.

mod camera;
mod check;
mod export;
mod formats;
pub mod generate;
mod info;
mod light;
mod load;
mod mesh_builder;
mod motion;
mod motion_builder;
mod obj;
mod obj_text;
mod pose;
mod sequence;
mod suggest;
mod toml_entries;
mod toml_file;
mod toml_placement;
mod toml_spans;
mod transform;
mod zstd;

pub use camera::{Camera, View};
pub use check::InvalidValue;
pub use export::export;
pub use formats::{FORMATS, Format};
pub use info::{MotionInfo, SceneInfo};
pub use light::{Light, LightShape};
pub use load::load;
pub use motion::{Motion, Object, Pose};

use crate::geometry::TriangleMesh;
use std::collections::HashSet;
use std::sync::Arc;

/// A loaded scene: checked, finite, ready for backends and renderer.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, from the file or the generator.
    pub name: String,
    /// All triangles, in one index space. Shared, so that a backend may keep it without a copy.
    pub mesh: Arc<TriangleMesh>,
    /// The view.
    pub camera: Camera,
    /// The lights; may be empty.
    pub lights: Vec<Light>,
    /// What the integrators use unless the command line says otherwise.
    pub defaults: Defaults,
    /// How the vertices move, if they do; `mesh` is the first frame.
    pub motion: Option<Arc<Motion>>,
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

impl Scene {
    /// The scene as it is in `frame`, counted from 0, standing still; `None` if there is no such frame
    /// or the scene does not move.
    pub fn at_frame(&self, frame: usize) -> Option<Self> {
        let motion = self.motion.as_ref().filter(|motion| frame < motion.frames)?;
        let mesh = motion.mesh_at(&self.mesh, frame).into();
        Some(Self { mesh, motion: None, ..self.clone() })
    }

    /// Whether camera, lights and defaults can be used; the fault names the key, such as
    /// `light[1].radius`.
    pub fn check(&self) -> Result<(), InvalidValue> {
        self.camera.check().map_err(|fault| fault.within("camera"))?;
        let mut names = HashSet::new();
        for (i, light) in self.lights.iter().enumerate() {
            let unique = if names.insert(light.name.as_str()) {
                Ok(())
            } else {
                let message = format!("is the name of an earlier light too: {:?}", light.name);
                Err(InvalidValue::new("name", message))
            };
            light.check().and(unique).map_err(|fault| fault.within(&format!("light[{i}]")))?;
        }
        self.defaults.check()
    }
}

impl Defaults {
    /// The size of an image when nobody says otherwise: 16:9.
    pub const SIZE: [u32; 2] = [1280, 720];

    /// The largest width or height of an image, in pixels.
    pub const MAX_SIDE: u32 = 65_536;

    /// Whether rays of this length and images of this size can be made.
    pub fn check(&self) -> Result<(), InvalidValue> {
        check::positive("ambient_occlusion.radius", self.ao_radius)?;
        let [width, height] = self.size;
        let sides = 1..=Self::MAX_SIDE;
        if sides.contains(&width) && sides.contains(&height) {
            return Ok(());
        }
        let max = Self::MAX_SIDE;
        let message = format!("must be 1 to {max} pixels each way, not {width} x {height}");
        Err(InvalidValue::new("size", message))
    }
}

//! Scenes whose pictures are known: what estimators are held against.
//!
//! Each case is a small scene with a camera that looks at one patch of it, and the value of every
//! pixel as a function of the place that it sees. A new case is a line in [`CASES`] and its entry in
//! the file of its family.

mod ambient;
mod blockers;
pub mod form_factor;
mod polygons;
mod round;
mod stage;

use crate::backend::Accelerator;
use crate::render::{Film, Pass, RenderSettings, SurfacePoint};
use crate::scene::Scene;
use form_factor::Receiver;

/// A case of the catalogue.
pub struct CaseEntry {
    /// A name of lower-case words.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Makes it.
    pub make: fn() -> Case,
}

/// A scene and what its picture is.
pub struct Case {
    /// Geometry, camera, at most one light, of strength 1. Its first two triangles are the patch
    /// that all pixels see.
    pub scene: Scene,
    /// What the value is of: visibility, or irradiance where it is [`Pass::Shadow`].
    pub pass: Pass,
    /// How far the scene as built, which ends somewhere, may be from the value.
    pub slack: f64,
    /// Whether a few thousand points uniform over the light's area say anything: right next to a
    /// light, all of the mean is in very few of them.
    pub by_area: bool,
    value: Box<dyn Fn(&Receiver) -> f64 + Send + Sync>,
}

impl Case {
    /// Settings for its picture: one pass and one camera ray a pixel, through the centre.
    pub fn settings(&self) -> RenderSettings {
        RenderSettings { passes: vec![self.pass], ..RenderSettings::of_scene(&self.scene) }
    }

    /// The values that pixels should have, row by row: those of the points where their shadow rays
    /// start. `accelerator` answers camera rays only.
    ///
    /// # Panics
    /// If a pixel does not see the patch.
    pub fn values(&self, accelerator: &dyn Accelerator) -> Vec<f64> {
        let size @ [width, height] = self.scene.defaults.size;
        let value = |x: u32, y: u32| {
            let [px, py] = [x, y].map(|n| n as f32 + 0.5);
            let ray = self.scene.camera.ray(px, py, size);
            let hit = accelerator.closest_hit(&ray).filter(|hit| hit.triangle < 2);
            let Some(hit) = hit else { panic!("pixel {x}, {y} does not see the patch") };
            let point = SurfacePoint::new(&self.scene.mesh.triangle(hit.triangle as usize), &ray);
            (self.value)(&Receiver { at: point.origin.as_dvec3(), normal: point.normal })
        };
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| value(x, y))
            .collect()
    }

    /// The estimates of the values in a picture of the case, row by row. All are plain means over
    /// samples, so they have no bias.
    ///
    /// # Panics
    /// If the film is not one of [`Case::settings`].
    pub fn estimates<'a>(&self, film: &'a Film) -> &'a [f32] {
        let (layer, channel) = match self.pass {
            Pass::Shadow => ("irradiance", "R"),
            ambient => (ambient.name(), "Y"),
        };
        film.channel(layer, channel).expect("a film of the case's pass")
    }
}

impl std::fmt::Debug for CaseEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// All cases.
pub static CASES: &[&CaseEntry] = &[
    &ambient::WALL,
    &ambient::CORNER,
    &ambient::WEDGE_30,
    &ambient::WEDGE_60,
    &ambient::WEDGE_120,
    &ambient::LONG_WALL,
    &ambient::WALL_WITHIN,
    &ambient::SQUARE_PIT,
    &ambient::ROUND_PIT,
    &ambient::BOX,
    &ambient::BOX_BEYOND,
    &ambient::SPHERE,
    &ambient::SPHERE_SETTING,
    &ambient::CEILING,
    &ambient::SHEETS,
    &polygons::ABOVE,
    &polygons::BESIDE,
    &polygons::TILTED,
    &polygons::TURNED,
    &polygons::BELOW,
    &polygons::SHEARED,
    &polygons::STRIP,
    &polygons::NEAR,
    &polygons::SMALL,
    &polygons::EDGE_ON,
    &polygons::EDGE_ON_FLAT,
    &polygons::EDGE_ON_NEAR,
    &round::DISK,
    &round::DISK_NEAR,
    &round::DISK_SETTING,
    &round::SPHERE,
    &round::SPHERE_SETTING,
    &round::SPHERE_SET,
    &round::SPHERE_NEAR,
    &round::SPHERE_AROUND,
    &round::SUN,
    &round::SUN_SETTING,
    &round::SUN_WIDE,
    &round::SUN_SHARP,
    &round::POINT,
    &blockers::HALF_PLANE,
    &blockers::PENTAGON,
    &blockers::PENTAGON_TILTED,
    &blockers::SHEETS,
    &blockers::SHEARED,
    &blockers::DISK,
    &blockers::SPHERE,
    &blockers::SUN,
    &blockers::POINT,
];

/// The case called `name`.
pub fn find(name: &str) -> Option<&'static CaseEntry> {
    CASES.iter().copied().find(|case| case.name == name)
}

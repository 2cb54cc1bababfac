//! A scene under measurement, with what experiments share.

use super::{Settings, nothing_to_trace};
use crate::Error;
use crate::Result;
use crate::backend::Built;
use crate::build;
use crate::build::Leaves;
use crate::build::kd_sah::Splits;
use crate::lab::Lab;
use crate::order::OrderContext;
use crate::render::{Pass, Recording, RenderSettings, record};
use crate::scene::Scene;
use crate::tree::{Bvh2, KdTree};
use std::cell::OnceCell;
use std::sync::Arc;

/// One scene: its trees, built when first asked for, and its rays, recorded when first asked for.
#[derive(Debug)]
pub struct Subject<'a> {
    lab: Lab<'a>,
    settings: &'a Settings,
    recording: OnceCell<Recording>,
}

impl<'a> Subject<'a> {
    /// Nothing is made yet.
    pub fn new(scene: &'a Scene, settings: &'a Settings) -> Self {
        let lab = Lab::new(scene, settings.seed);
        Self { lab, settings, recording: OnceCell::new() }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.lab.scene()
    }

    /// Where backends are built.
    pub fn lab(&self) -> &Lab<'a> {
        &self.lab
    }

    /// How to measure.
    pub fn settings(&self) -> &'a Settings {
        self.settings
    }

    /// What orders may look at, with rays to learn from.
    pub fn order_context(&self) -> Result<OrderContext<'_>> {
        let (mesh, seed) = (&*self.scene().mesh, self.settings.seed);
        Ok(OrderContext { mesh, seed, training: Some(self.lab.training()?) })
    }

    /// The binary tree of the default builder.
    pub fn bvh2(&self) -> Result<Arc<Built<Bvh2>>> {
        let builder = build::BUILDERS[0];
        self.lab.trees().bvh2(builder, Leaves::Fit).map_err(|message| self.failed("bvh2", message))
    }

    /// The kd-tree with the default splits.
    pub fn kd(&self) -> Result<Arc<Built<KdTree>>> {
        self.lab.trees().kd(Splits::default()).map_err(|message| self.failed("kd", message))
    }

    fn failed(&self, backend: &str, message: String) -> Error {
        Error::Backend { backend: format!("{backend} on {}", self.scene().name), message }
    }

    /// Every shadow ray of the picture.
    ///
    /// # Errors
    /// As [`record`]; also if there is no ray.
    pub fn recording(&self) -> Result<&Recording> {
        if self.recording.get().is_none() {
            let (scene, settings) = (self.scene(), self.settings);
            let picture = RenderSettings {
                size: settings.size,
                spp: settings.spp,
                seed: settings.seed,
                passes: Pass::all_of(scene),
                ..RenderSettings::of_scene(scene)
            };
            picture.check()?;
            let tracer = self.lab.build(&"bvh2".parse()?)?;
            let recording = record(scene, &*tracer, &picture, None)?;
            if recording.passes().iter().all(|pass| pass.rays().is_empty()) {
                return Err(nothing_to_trace(scene));
            }
            self.recording.get_or_init(|| recording);
        }
        Ok(self.recording.get().expect("recorded above"))
    }
}

//! The ray classes that a scene and its settings ask for.

use super::TileCount;
use super::adaptive::Allocation;
use super::layers::{Choice, Content, choose};
use super::settings::{Pass, RayClass, RenderSettings};
use super::skip::Skips;
use super::soft_shadow;
use super::tile::TileGrid;
use crate::backend::Accelerator;
use crate::scene::Scene;
use crate::{Error, Result};
use glam::Vec3;

/// Everything about the image that is known before the first ray of it.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) settings: RenderSettings,
    pub(super) grid: TileGrid,
    pub(super) classes: Vec<ClassPlan>,
    pub(super) choice: Choice,
    /// How many samples each pixel gets, where that is not the same for all.
    pub(super) allocation: Option<Allocation>,
}

#[derive(Clone, Debug)]
pub(super) struct ClassPlan {
    pub(super) class: RayClass,
    /// `ao`, `ao-unbounded` or `shadow.` and the light's name: also the name of its layer.
    pub(super) name: String,
    /// Samples for each camera sample: one for a light whose samples are all the same.
    pub(super) samples: u32,
    /// Whether samples differ, so that the number of them matters.
    pub(super) samples_differ: bool,
    /// RGB strength of the light; one for ambient occlusion.
    pub(super) strength: Vec3,
}

impl Plan {
    pub(super) fn new(scene: &Scene, settings: &RenderSettings) -> Result<Self> {
        settings.check()?;
        let mut classes = Vec::new();
        for pass in Pass::ALL.into_iter().filter(|pass| settings.passes.contains(pass)) {
            let ambient = |class| ClassPlan {
                class,
                name: pass.name().into(),
                samples: settings.spp,
                samples_differ: true,
                strength: Vec3::ONE,
            };
            match pass {
                Pass::AmbientOcclusion => classes.push(ambient(RayClass::AmbientOcclusion)),
                Pass::AmbientOcclusionUnbounded => {
                    classes.push(ambient(RayClass::AmbientOcclusionUnbounded));
                }
                Pass::Shadow => {
                    classes.extend(scene.lights.iter().enumerate().map(|(light, data)| {
                        let samples_differ = !soft_shadow::is_delta(&data.shape);
                        ClassPlan {
                            class: RayClass::Shadow { light },
                            name: format!("{}.{}", pass.name(), data.name),
                            samples: if samples_differ { settings.spp } else { 1 },
                            samples_differ,
                            strength: data.strength,
                        }
                    }));
                }
            }
        }
        if classes.is_empty() {
            let name = &scene.name;
            return Err(Error::Usage(format!(
                "scene {name} has no light: add one or another pass"
            )));
        }
        let asked = settings.layers.as_deref();
        let choice = choose(&mut classes, settings.adaptive.is_some(), asked)?;
        let grid = TileGrid::new(settings.size);
        Ok(Self { settings: settings.clone(), grid, classes, choice, allocation: None })
    }

    /// Samples of a class for each camera sample of the pixel in `slot` of a tile.
    pub(super) fn samples(&self, tile: usize, class: usize, slot: usize) -> u32 {
        let adapted = self.allocation.as_ref().and_then(|a| a.samples(tile, class, slot));
        adapted.unwrap_or(self.classes[class].samples)
    }

    /// Whether such a layer is made.
    pub(super) fn makes(&self, content: Content) -> bool {
        self.choice.layers.iter().any(|layer| layer.content == content)
    }

    pub(super) fn has(&self, pass: Pass) -> bool {
        self.classes.iter().any(|class| class.class.pass() == pass)
    }

    /// Shares samples out among pixels, if that is asked for.
    pub(super) fn adapt(
        &mut self,
        scene: &Scene,
        accelerator: &dyn Accelerator,
        skip: Skips,
        done: &TileCount<'_>,
    ) {
        if self.settings.adaptive.is_some() {
            self.allocation = Some(Allocation::by_pilot(scene, accelerator, self, skip, done));
        }
    }

    /// Tiles that are walked, the pilot's among them.
    pub(super) fn walks(&self) -> usize {
        self.grid.len() * (1 + usize::from(self.settings.adaptive.is_some()))
    }

    /// Number of camera rays, without the pilot's.
    pub(super) fn primary_rays(&self) -> u64 {
        let [width, height] = self.grid.size().map(u64::from);
        width * height * u64::from(self.settings.camera_samples)
    }
}

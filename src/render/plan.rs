//! The ray classes that a scene and its settings ask for.

use super::settings::{Pass, RayClass, RenderSettings};
use super::soft_shadow;
use super::tile::TileGrid;
use crate::scene::Scene;
use crate::{Error, Result};
use glam::Vec3;

/// Everything about the image that is known before the first ray.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) settings: RenderSettings,
    pub(super) grid: TileGrid,
    pub(super) classes: Vec<ClassPlan>,
}

#[derive(Clone, Debug)]
pub(super) struct ClassPlan {
    pub(super) class: RayClass,
    /// `ao`, `ao-unbounded` or `shadow.` and the light's name: also the name of its layer.
    pub(super) name: String,
    /// Samples for each camera sample: one for a light whose samples are all the same.
    pub(super) samples: u32,
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
                strength: Vec3::ONE,
            };
            match pass {
                Pass::AmbientOcclusion => classes.push(ambient(RayClass::AmbientOcclusion)),
                Pass::AmbientOcclusionUnbounded => {
                    classes.push(ambient(RayClass::AmbientOcclusionUnbounded));
                }
                Pass::Shadow => {
                    classes.extend(scene.lights.iter().enumerate().map(|(light, data)| {
                        ClassPlan {
                            class: RayClass::Shadow { light },
                            name: format!("{}.{}", pass.name(), data.name),
                            samples: if soft_shadow::is_delta(&data.shape) {
                                1
                            } else {
                                settings.spp
                            },
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
        Ok(Self { settings: settings.clone(), grid: TileGrid::new(settings.size), classes })
    }

    pub(super) fn has(&self, pass: Pass) -> bool {
        self.classes.iter().any(|class| class.class.pass() == pass)
    }

    /// Number of camera rays.
    pub(super) fn primary_rays(&self) -> u64 {
        let [width, height] = self.grid.size().map(u64::from);
        width * height * u64::from(self.settings.camera_samples)
    }
}

//! Rays for what learns from rays.

use super::{Pass, RenderSettings, record};
use crate::Result;
use crate::backend::Accelerator;
use crate::ray_set::RaySet;
use crate::scene::Scene;

/// Shadow rays of a small picture of the scene, from samples that the real picture does not use:
/// an order that learned from the rays it is measured on would look better than it is.
/// `accelerator` answers the camera rays.
///
/// # Errors
/// As [`record`].
pub fn training_rays(scene: &Scene, accelerator: &dyn Accelerator, seed: u64) -> Result<RaySet> {
    const LONGER_SIDE: u32 = 160;
    let [width, height] = scene.defaults.size;
    let scale = f64::from(LONGER_SIDE) / f64::from(width.max(height));
    let side = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
    let settings = RenderSettings {
        size: [side(width), side(height)],
        spp: 4,
        seed: seed.wrapping_add(1),
        passes: Pass::all_of(scene),
        ..RenderSettings::of_scene(scene)
    };
    let recording = record(scene, accelerator, &settings, None)?;
    let mut all = RaySet::default();
    for batch in recording.passes().iter().flat_map(|pass| pass.rays().batches()) {
        all.push_batch(batch.rays);
    }
    Ok(all)
}

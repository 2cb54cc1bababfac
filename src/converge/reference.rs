//! The image that others are held against, and how far it may be off itself.

use super::cache::{self, Found, Kept, Key};
use super::view::{Planes, View, raw_planes};
use crate::backend::Accelerator;
use crate::measure::convergence::Variance;
use crate::render::{LightSampling, RenderOptions, RenderSettings, SamplerEntry, Skips, render};
use crate::scene::Scene;
use crate::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// Independent parts, at least: their spread says how good their mean is.
const PARTS: u64 = 4;
/// From this seed on, whatever the seeds of the images: none of these is another image's by
/// intention, and references serve runs with any seed.
const SEED: u64 = 0x5ee0_4e0f_7e4c_e000;
/// Samples of the image that stands for the code.
const PROBE_SAMPLES: u32 = 2;

/// Where a reference comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// It was rendered in this run.
    Rendered,
    /// An earlier run had kept it.
    Kept,
    /// It was rendered, since what an earlier run had kept was not whole; why.
    Replaced(String),
}

/// The record of a reference.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceReport {
    /// Independent images of which it is the mean.
    pub parts: u32,
    /// Samples in a pixel of each.
    pub samples_per_part: u32,
    /// Its own root mean squared error, estimated from the spread of its parts.
    pub rmse: f64,
    /// That over the smallest root mean squared error held against it; `None` if that is 0.
    pub part_of_smallest_error: Option<f64>,
    /// What rendering it took, in milliseconds.
    pub ms: f64,
    /// Where it comes from.
    pub origin: Origin,
}

/// A reference.
pub(super) struct Reference {
    pub(super) view: View,
    /// In the unit of the errors.
    pub(super) planes: Planes,
    /// Mean variance of its values: the square of its own error.
    pub(super) variance: f64,
    pub(super) report: ReferenceReport,
}

/// How many parts of how many samples have at least `samples` together; powers of two are best.
pub(super) fn parts(samples: u64) -> [u32; 2] {
    let each = samples.div_ceil(PARTS).next_power_of_two().min(RenderSettings::MAX_SAMPLES);
    [samples.div_ceil(each).max(PARTS) as u32, each as u32]
}

/// The best settings that there are for one part of the reference of a pass.
fn part_settings(like: &RenderSettings, part: u32, samples: u32) -> RenderSettings {
    RenderSettings {
        spp: samples,
        seed: SEED + u64::from(part),
        sampler: SamplerEntry::sobol(),
        light_sampling: LightSampling::SolidAngle,
        ..like.clone()
    }
}

/// The reference for images by `settings`, which have one pass, from at least `samples` samples: kept
/// in `folder` by an earlier run, or rendered and kept there. No work is skipped, so that an error in
/// skipping would show. `step` is told the share that is done.
///
/// # Errors
/// As [`render`]; if no pixel sees anything; if it cannot be kept.
pub(super) fn reference(
    scene: &Scene,
    accelerator: &dyn Accelerator,
    settings: &RenderSettings,
    samples: u64,
    folder: &Path,
    step: &dyn Fn(f64),
) -> Result<Reference> {
    let pass = settings.passes[0];
    let [parts, each] = parts(samples);
    let options = RenderOptions { skip: Skips::NONE, ..RenderOptions::default() };
    let image = |part: u32, samples: u32| {
        let settings = part_settings(settings, part, samples);
        render(scene, accelerator, &settings, &options)
    };
    let probe = image(0, PROBE_SAMPLES)?.film;
    let key = Key::new(scene, &part_settings(settings, 0, each), parts, &probe);
    let path = key.path(folder);
    let (kept, origin) = match cache::read(&path, &key) {
        Found::Whole(kept) => (kept, Origin::Kept),
        other => {
            let alpha = probe.channel("", "A").unwrap_or_default();
            let pixels: Vec<usize> = (0..alpha.len()).filter(|&p| alpha[p] > 0.0).collect();
            if pixels.is_empty() {
                let name = &scene.name;
                return Err(Error::Usage(format!("{name}: no camera ray hits anything")));
            }
            let (mut variance, mut ms) = (Variance::default(), 0.0);
            for part in 0..parts {
                let rendering = image(part, each)?;
                variance.add(&raw_planes(&rendering.film, pass), &pixels);
                ms += rendering.stats.total_ms;
                step(f64::from(part + 1) / f64::from(parts));
            }
            let planes = spread(variance.mean(), &pixels, settings.size);
            let variance = variance.of_mean().expect("several parts");
            let kept = Kept { size: settings.size, planes, pixels, variance, ms };
            cache::write(&path, &key, &kept)?;
            let origin = match other {
                Found::Damaged(why) => Origin::Replaced(why),
                _ => Origin::Rendered,
            };
            (kept, origin)
        }
    };
    step(1.0);
    let view = View::of(kept.size, pass, &kept.planes, kept.pixels);
    let variance = kept.variance * f64::from(view.scale).powi(2);
    let report = ReferenceReport {
        parts,
        samples_per_part: each,
        rmse: variance.sqrt(),
        part_of_smallest_error: None,
        ms: kept.ms,
        origin,
    };
    Ok(Reference { planes: view.scaled(&kept.planes), view, variance, report })
}

/// Values of some pixels, channel by channel, as whole channels.
fn spread(values: &[f64], pixels: &[usize], size: [u32; 2]) -> Planes {
    let plane = |values: &[f64]| {
        let mut plane = vec![0.0; size[0] as usize * size[1] as usize];
        pixels.iter().zip(values).for_each(|(&pixel, &value)| plane[pixel] = value as f32);
        plane
    };
    values.chunks_exact(pixels.len()).map(plane).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_samples_asked_for() {
        for (samples, expected) in [(1, [4, 1]), (64, [4, 16]), (65, [4, 32]), (4096, [4, 1024])] {
            assert_eq!(parts(samples), expected);
        }
        let [parts, each] = parts(1 << 30);
        assert_eq!((u64::from(each), parts), (RenderSettings::MAX_SAMPLES, 64));
    }
}

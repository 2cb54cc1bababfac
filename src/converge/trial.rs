//! One scene and pass: every renderer's images at every number of samples, seed by seed.

use super::Settings;
use super::reference::Reference;
use super::renderer::RendererSpec;
use super::view::{Planes, raw_planes};
use crate::Result;
use crate::backend::Accelerator;
use crate::measure::convergence::{RunPoint, Runs};
use crate::measure::image_error::{
    DEFAULT_PIXELS_PER_DEGREE, Flip, relative_squared_error, squared_error,
};
use crate::render::{RenderOptions, RenderSettings, RenderStats, Rendering, render};
use crate::scene::Scene;

/// A renderer with what it traces with.
pub(super) struct Contender<'a> {
    pub(super) spec: &'a RendererSpec,
    pub(super) accelerator: &'a dyn Accelerator,
}

impl Contender<'_> {
    /// An image by `settings`, but for the samples.
    pub(super) fn render(
        &self,
        scene: &Scene,
        settings: &RenderSettings,
        samples: u32,
        seed: u64,
    ) -> Result<Rendering> {
        let settings = RenderSettings {
            spp: samples,
            seed,
            sampler: self.spec.sampler,
            light_sampling: self.spec.light_sampling,
            ..settings.clone()
        };
        let options = RenderOptions { skip: self.spec.skip, ..RenderOptions::default() };
        render(scene, self.accelerator, &settings, &options)
    }
}

/// What was measured of one renderer.
pub(super) struct Measured {
    /// By rising number of samples.
    pub(super) points: Vec<Point>,
}

/// One number of samples.
pub(super) struct Point {
    pub(super) samples: u32,
    /// One a seed.
    pub(super) images: Vec<ImageRecord>,
    /// Sum over images of the difference from the reference, value by value.
    differences: Vec<f32>,
    /// Pixels in which images are not those of an earlier renderer with the same samples, over all
    /// seeds; `None` if there is no such renderer.
    pub(super) differing_pixels: Option<usize>,
}

/// One image.
pub(super) struct ImageRecord {
    pub(super) squared_error: f64,
    pub(super) relative_squared_error: f64,
    pub(super) flip: f64,
    pub(super) stats: RenderStats,
}

impl Point {
    fn new(samples: u32) -> Self {
        Self { samples, images: Vec::new(), differences: Vec::new(), differing_pixels: None }
    }

    /// Mean variance of an image, from the spread of the images about their mean; `None` of one
    /// image. Of differences, as they need no memory for the images.
    pub(super) fn variance(&self) -> Option<f64> {
        let images = self.images.len() as f64;
        let about_reference: f64 = self.images.iter().map(|i| i.squared_error).sum();
        let spread = about_reference - images * self.squared_mean_difference();
        (self.images.len() > 1).then(|| spread.max(0.0) / (images - 1.0))
    }

    /// How far the mean of the images is from the reference beyond what chance explains, squared:
    /// about 0, above or below, if the renderer is unbiased.
    pub(super) fn squared_bias(&self, reference_variance: f64) -> Option<f64> {
        let by_chance = self.variance()? / self.images.len() as f64 + reference_variance;
        Some(self.squared_mean_difference() - by_chance)
    }

    fn squared_mean_difference(&self) -> f64 {
        let sum: f64 = self.differences.iter().map(|&d| f64::from(d).powi(2)).sum();
        let images = self.images.len().max(1) as f64;
        sum / self.differences.len().max(1) as f64 / (images * images)
    }

    /// One figure of each image.
    pub(super) fn each(&self, figure: impl Fn(&ImageRecord) -> f64) -> Vec<f64> {
        self.images.iter().map(figure).collect()
    }
}

impl Measured {
    /// Errors and times.
    pub(super) fn runs(&self) -> Runs {
        let point = |point: &Point| RunPoint {
            samples: point.samples,
            squared_error: point.each(|i| i.squared_error),
            ms: point.each(|i| i.stats.total_ms),
        };
        Runs { points: self.points.iter().map(point).collect() }
    }
}

/// All images of one scene and pass.
pub(super) struct Trial {
    /// In the order of the contenders.
    pub(super) measured: Vec<Measured>,
    /// Squared error of each pixel, summed over the images of the first contender with most samples:
    /// where it is hard.
    pub(super) noise: Vec<f32>,
}

/// Renders and compares everything for one pass. Renderers take turns, each time from another first,
/// so that what the machine does meanwhile meets all of them; `step` is told after each image how many
/// samples it had.
pub(super) fn run(
    scene: &Scene,
    contenders: &[Contender<'_>],
    settings: &RenderSettings,
    plan: &Settings,
    reference: &Reference,
    step: &dyn Fn(u32),
) -> Result<Trial> {
    let counts = plan.sample_counts();
    let pass = settings.passes[0];
    let view = &reference.view;
    let flip = Flip::new(view.size, &view.shown(&reference.planes), DEFAULT_PIXELS_PER_DEGREE);
    let blank = || Measured { points: counts.iter().map(|&n| Point::new(n)).collect() };
    let mut measured: Vec<Measured> = contenders.iter().map(|_| blank()).collect();
    let mut noise = vec![0.0; view.size[0] as usize * view.size[1] as usize];
    // Not measured: memory and clocks get warm.
    for contender in contenders {
        contender.render(scene, settings, plan.spp.min(16), plan.seed)?;
    }
    for seed in 0..plan.seeds {
        for (index, &samples) in counts.iter().enumerate() {
            let mut renderings: Vec<Option<Rendering>> = contenders.iter().map(|_| None).collect();
            for turn in 0..contenders.len() {
                let which = (turn + seed as usize) % contenders.len();
                let seed = plan.seed.wrapping_add(seed.into());
                let rendering = contenders[which].render(scene, settings, samples, seed)?;
                renderings[which] = Some(rendering);
                step(samples);
            }
            let renderings: Vec<Rendering> = renderings.into_iter().flatten().collect();
            let raw: Vec<Planes> = renderings.iter().map(|r| raw_planes(&r.film, pass)).collect();
            for (which, rendering) in renderings.into_iter().enumerate() {
                let point = &mut measured[which].points[index];
                let twin =
                    (0..which).find(|&i| contenders[i].spec.has_samples_of(contenders[which].spec));
                if let Some(twin) = twin {
                    *point.differing_pixels.get_or_insert(0) += differing(&raw[twin], &raw[which]);
                }
                let planes = view.scaled(&raw[which]);
                add_differences(&mut point.differences, &planes, reference);
                let seen = flip.differences(&view.shown(&planes));
                let flip: f64 = view.pixels.iter().map(|&p| f64::from(seen[p])).sum();
                point.images.push(ImageRecord {
                    squared_error: squared_error(&planes, &reference.planes, &view.pixels),
                    relative_squared_error: relative_squared_error(
                        &planes,
                        &reference.planes,
                        &view.pixels,
                    ),
                    flip: flip / view.pixels.len() as f64,
                    stats: rendering.stats,
                });
                if which == 0 && index + 1 == counts.len() {
                    add_noise(&mut noise, &planes, reference);
                }
            }
        }
    }
    Ok(Trial { measured, noise })
}

/// Pixels that have not the same bits in both.
fn differing(a: &Planes, b: &Planes) -> usize {
    let pixels = 0..a.first().map_or(0, Vec::len);
    let differs = |p: &usize| a.iter().zip(b).any(|(a, b)| a[*p].to_bits() != b[*p].to_bits());
    pixels.filter(differs).count()
}

fn add_differences(sums: &mut Vec<f32>, planes: &Planes, reference: &Reference) {
    let pixels = &reference.view.pixels;
    sums.resize(pixels.len() * planes.len(), 0.0);
    let values = planes.iter().zip(&reference.planes);
    let differences = values.flat_map(|(x, r)| pixels.iter().map(|&p| x[p] - r[p]));
    sums.iter_mut().zip(differences).for_each(|(sum, difference)| *sum += difference);
}

fn add_noise(noise: &mut [f32], planes: &Planes, reference: &Reference) {
    for (x, r) in planes.iter().zip(&reference.planes) {
        for (noise, (x, r)) in noise.iter_mut().zip(x.iter().zip(r)) {
            *noise += (x - r).powi(2);
        }
    }
}

//! What a run finds out, as records.

use super::Settings;
use super::ratios::{Bound, MeanReport, Pair, Ratio, Ratios};
use super::reference::{Reference, ReferenceReport};
use super::renderer::RendererSpec;
use super::trial::{Measured, Point};
use super::view::unit;
use crate::measure::Summary;
use crate::measure::convergence::{Bootstrap, Interval};
use crate::render::{Pass, Skip};
use crate::report::{Provenance, SceneReport};
use serde::Serialize;

/// The whole record.
#[derive(Clone, Debug, Serialize)]
pub struct ConvergeReport {
    /// What made this report.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// How it was measured.
    pub settings: Settings,
    /// The scenes.
    pub scenes: Vec<SceneReport>,
    /// What was compared.
    pub renderers: Vec<RendererSpec>,
    /// One for each scene and pass.
    pub cells: Vec<CellReport>,
    /// Every renderer at every number of samples.
    pub points: Vec<PointRow>,
    /// What left rays out, with most samples.
    pub skipped: Vec<SkippedRow>,
    /// Every renderer against every earlier one, at every number of samples.
    pub ratios: Vec<RatioRow>,
    /// Every renderer against every earlier one, with most samples, in the longest time that both
    /// were given and to the smallest error that both come down to.
    pub at_end: Vec<RatioRow>,
    /// The same over all scenes and passes.
    pub means: Vec<MeanReport>,
    /// Files beside this one.
    pub files: Vec<String>,
}

/// One scene and pass.
#[derive(Clone, Debug, Serialize)]
pub struct CellReport {
    /// The scene's name.
    pub scene: String,
    /// The pass's name.
    pub pass: &'static str,
    /// What the errors are of.
    pub unit: &'static str,
    /// Width and height of the images in pixels.
    pub size: [u32; 2],
    /// Pixels that see a surface, over which errors are means.
    pub pixels: usize,
    /// What the images are held against.
    pub reference: ReferenceReport,
    /// Each renderer's slope.
    pub slopes: Vec<SlopeReport>,
}

/// How fast one renderer's error falls with its samples.
#[derive(Clone, Debug, Serialize)]
pub struct SlopeReport {
    /// The renderer.
    pub renderer: String,
    /// Slope of the logarithm of the root mean squared error over that of the samples; `None`
    /// without errors.
    pub slope: Option<Interval>,
}

/// One renderer at one number of samples.
#[derive(Clone, Debug, Serialize)]
pub struct PointRow {
    /// The scene's name.
    pub scene: String,
    /// The pass's name.
    pub pass: &'static str,
    /// The renderer.
    pub renderer: String,
    /// Samples in a pixel.
    pub samples: u32,
    /// Images, each with a seed of its own.
    pub seeds: u32,
    /// Root of the mean squared error, with the ends of its 95 % interval.
    pub rmse: f64,
    /// Lower end.
    pub rmse_low: f64,
    /// Upper end.
    pub rmse_high: f64,
    /// `mean((x - r)^2 / (r^2 + 0.01))`.
    pub relative_mse: f64,
    /// Mean FLIP, 0 to 1.
    pub flip: f64,
    /// Mean variance among images; absent of a single one.
    pub variance: Option<f64>,
    /// Squared distance of the images' mean from the reference beyond what chance explains.
    pub squared_bias: Option<f64>,
    /// Time of a whole image, without building: median, in milliseconds.
    pub total_ms: f64,
    /// Least time.
    pub total_ms_min: f64,
    /// Most time.
    pub total_ms_max: f64,
    /// Time in camera rays, summed over threads: median.
    pub primary_ms: f64,
    /// Time in shadow rays, summed over threads: median.
    pub shadow_ms: f64,
    /// Share of the threads' time that is spent in shadow rays.
    pub tracing_share: f64,
    /// Shadow rays of an image.
    pub rays: u64,
    /// Shadow rays of an image that were left out.
    pub rays_skipped: u64,
    /// `1 / (variance x seconds)`; absent without variance.
    pub efficiency_per_s: Option<f64>,
    /// Pixels, over all seeds, that have not the same bits as those of an earlier renderer with the
    /// same samples; absent if there is none.
    pub differing_pixels: Option<usize>,
}

/// Shadow rays that one kind of skipping left out of a renderer's images, or spared a part of their way.
#[derive(Clone, Debug, Serialize)]
pub struct SkippedRow {
    /// The scene's name.
    pub scene: String,
    /// The pass's name.
    pub pass: &'static str,
    /// The renderer.
    pub renderer: String,
    /// Samples in a pixel.
    pub samples: u32,
    /// Its name.
    pub skip: &'static str,
    /// Whether these rays were traced all the same: from below the root, or no further than to one
    /// triangle.
    pub is_traced: bool,
    /// Rays of one image that it left out or shortened.
    pub rays: u64,
    /// Their share of the rays that the image had without any skipping.
    pub share: f64,
}

/// One renderer against an earlier one, at one number of samples. Ratios are above 1 where it is
/// better; absent where they have no value.
#[derive(Clone, Debug, Serialize)]
pub struct RatioRow {
    /// The scene's name.
    pub scene: String,
    /// The pass's name.
    pub pass: &'static str,
    /// The renderer.
    pub renderer: String,
    /// The earlier one.
    pub against: String,
    /// Samples in a pixel of the images whose times are compared; of those of the earlier one that
    /// say which time and which error, but in the rows at the end.
    pub samples: u32,
    /// Time of its images over that of the renderer's with the same samples.
    pub same_samples: Option<f64>,
    /// Lower end of the 95 % interval.
    pub same_samples_low: Option<f64>,
    /// Upper end.
    pub same_samples_high: Option<f64>,
    /// The same of the time in shadow rays alone.
    pub same_samples_tracing: f64,
    /// Its squared error over that of the renderer in the same time.
    pub equal_time: Option<f64>,
    /// Lower end.
    pub equal_time_low: Option<f64>,
    /// Upper end.
    pub equal_time_high: Option<f64>,
    /// Whether the curves reach that far.
    pub equal_time_bound: Bound,
    /// Its time over that of the renderer to the same error.
    pub equal_error: Option<f64>,
    /// Lower end.
    pub equal_error_low: Option<f64>,
    /// Upper end.
    pub equal_error_high: Option<f64>,
    /// Whether the curves reach that far.
    pub equal_error_bound: Bound,
}

/// What a scene and pass contributes to the record.
pub(super) struct Cell {
    pub(super) report: CellReport,
    pub(super) points: Vec<PointRow>,
    pub(super) skipped: Vec<SkippedRow>,
    /// Every renderer against every earlier one.
    pub(super) pairs: Vec<Pair>,
}

impl Cell {
    /// `stream` numbers cells, whose draws of seeds are independent.
    pub(super) fn new(
        scene: &str,
        pass: Pass,
        renderers: &[RendererSpec],
        measured: &[Measured],
        reference: &Reference,
        stream: u64,
    ) -> Self {
        let seeds = measured[0].points[0].images.len();
        let bootstrap = Bootstrap::new(seeds, stream);
        let slope = |(spec, measured): (&RendererSpec, &Measured)| SlopeReport {
            renderer: spec.label.clone(),
            slope: {
                let runs = measured.runs();
                bootstrap.values(|draw| runs.curve(draw).slope()).interval()
            },
        };
        let mut points = Vec::new();
        for (spec, measured) in renderers.iter().zip(measured) {
            for point in &measured.points {
                let variance = reference.variance;
                points.push(point_row(scene, pass, spec, point, &bootstrap, variance));
            }
        }
        let smallest = points.iter().map(|p| p.rmse).fold(f64::INFINITY, f64::min);
        let mut pairs = Vec::new();
        for own in 1..renderers.len() {
            for other in 0..own {
                pairs.push(Pair::new([other, own], measured, &bootstrap));
            }
        }
        let mut report = reference.report.clone();
        report.part_of_smallest_error = (smallest > 0.0).then(|| report.rmse / smallest);
        let report = CellReport {
            scene: scene.into(),
            pass: pass.name(),
            unit: unit(pass),
            size: reference.view.size,
            pixels: reference.view.pixels.len(),
            reference: report,
            slopes: renderers.iter().zip(measured).map(slope).collect(),
        };
        let skipped = renderers.iter().zip(measured);
        let skipped =
            skipped.flat_map(|(spec, measured)| skipped_rows(scene, pass, spec, measured));
        Self { report, points, skipped: skipped.collect(), pairs }
    }

    /// Ratios by number of samples as rows.
    pub(super) fn ratio_rows(&self, renderers: &[RendererSpec]) -> Vec<RatioRow> {
        let of_pair = |pair: &Pair| {
            let row = |ratios| self.ratio_row(renderers, pair, ratios);
            pair.by_samples.iter().map(row).collect::<Vec<_>>()
        };
        self.pairs.iter().flat_map(of_pair).collect()
    }

    /// Ratios at the end as rows.
    pub(super) fn end_rows(&self, renderers: &[RendererSpec]) -> Vec<RatioRow> {
        self.pairs.iter().map(|pair| self.ratio_row(renderers, pair, &pair.at_end)).collect()
    }

    fn ratio_row(&self, renderers: &[RendererSpec], pair: &Pair, ratios: &Ratios) -> RatioRow {
        let ends = |ratio: &Ratio| {
            let interval = ratio.interval();
            let end = |part: fn(&Interval) -> f64| interval.as_ref().map(part);
            [end(|i| i.value), end(|i| i.low), end(|i| i.high)]
        };
        let [same_samples, same_samples_low, same_samples_high] = ends(&ratios.same_samples);
        let [equal_time, equal_time_low, equal_time_high] = ends(&ratios.equal_time);
        let [equal_error, equal_error_low, equal_error_high] = ends(&ratios.equal_error);
        RatioRow {
            scene: self.report.scene.clone(),
            pass: self.report.pass,
            renderer: renderers[pair.own].label.clone(),
            against: renderers[pair.other].label.clone(),
            samples: ratios.samples,
            same_samples,
            same_samples_low,
            same_samples_high,
            same_samples_tracing: ratios.same_samples_tracing,
            equal_time,
            equal_time_low,
            equal_time_high,
            equal_time_bound: ratios.equal_time.bound,
            equal_error,
            equal_error_low,
            equal_error_high,
            equal_error_bound: ratios.equal_error.bound,
        }
    }
}

/// Of the first image with most samples; what left out nothing has no row.
fn skipped_rows(
    scene: &str,
    pass: Pass,
    spec: &RendererSpec,
    measured: &Measured,
) -> Vec<SkippedRow> {
    let point = measured.points.last().expect("some samples");
    let classes = &point.images[0].stats.classes;
    let all: u64 = classes.iter().map(|class| class.rays + class.rays_skipped).sum();
    let left_out = |skip: Skip| {
        let skipped = classes.iter().flat_map(|class| &class.skipped);
        skipped.filter(|skipped| skipped.by == skip.name()).map(|skipped| skipped.rays).sum()
    };
    let rays_by = |skip: Skip| match skip {
        Skip::EntryPoints => (true, classes.iter().map(|class| class.rays_from_entries).sum()),
        Skip::LastOccluders => (true, classes.iter().map(|class| class.rays_by_occluders).sum()),
        _ => (false, left_out(skip)),
    };
    let row = |skip: Skip| {
        let (is_traced, rays): (bool, u64) = rays_by(skip);
        SkippedRow {
            scene: scene.into(),
            pass: pass.name(),
            renderer: spec.label.clone(),
            samples: point.samples,
            skip: skip.name(),
            is_traced,
            rays,
            share: rays as f64 / all.max(1) as f64,
        }
    };
    Skip::ALL.into_iter().map(row).filter(|row| row.rays > 0).collect()
}

fn point_row(
    scene: &str,
    pass: Pass,
    spec: &RendererSpec,
    point: &Point,
    bootstrap: &Bootstrap,
    reference_variance: f64,
) -> PointRow {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let squared = point.each(|i| i.squared_error);
    let rmse = bootstrap.values(|draw| {
        let sum: f64 = draw.iter().map(|&seed| squared[seed]).sum();
        Some((sum / draw.len() as f64).sqrt())
    });
    let rmse = rmse.interval().expect("errors are finite");
    let total = Summary::of(&point.each(|i| i.stats.total_ms));
    let shadow_ms = point.each(|i| i.stats.shadow_ms);
    let shares = point.each(|i| i.stats.shadow_ms / (i.stats.total_ms * i.stats.threads as f64));
    let variance = point.variance();
    let stats = &point.images[0].stats;
    PointRow {
        scene: scene.into(),
        pass: pass.name(),
        renderer: spec.label.clone(),
        samples: point.samples,
        seeds: point.images.len() as u32,
        rmse: rmse.value,
        rmse_low: rmse.low,
        rmse_high: rmse.high,
        relative_mse: mean(&point.each(|i| i.relative_squared_error)),
        flip: mean(&point.each(|i| i.flip)),
        variance,
        squared_bias: point.squared_bias(reference_variance),
        total_ms: total.median,
        total_ms_min: total.min,
        total_ms_max: total.max,
        primary_ms: Summary::of(&point.each(|i| i.stats.primary_ms)).median,
        shadow_ms: Summary::of(&shadow_ms).median,
        tracing_share: Summary::of(&shares).median,
        rays: stats.classes.iter().map(|c| c.rays).sum(),
        rays_skipped: stats.classes.iter().map(|c| c.rays_skipped).sum(),
        efficiency_per_s: variance.filter(|v| *v > 0.0).map(|v| 1e3 / (v * total.median)),
        differing_pixels: point.differing_pixels,
    }
}

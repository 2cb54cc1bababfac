//! What rendering took.

use super::plan::Plan;
use super::skip::Skip;
use std::time::Duration;

/// What an image took, for reports.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct RenderStats {
    /// Camera rays; the pilot of adaptive sampling takes as many again.
    pub primary_rays: u64,
    /// Camera rays that see a surface.
    pub primary_hits: u64,
    /// Threads that rendered.
    pub threads: usize,
    /// Wall-clock time of all of it, in milliseconds.
    pub total_ms: f64,
    /// Wall-clock time of the pilot of adaptive sampling, in milliseconds: part of `total_ms`, but of
    /// none of the following.
    pub pilot_ms: f64,
    /// Time in camera rays, in milliseconds, summed over threads.
    pub primary_ms: f64,
    /// Time in shadow rays, in milliseconds, summed over threads; of counting runs no measure of
    /// speed.
    pub shadow_ms: f64,
    /// Each class of shadow rays.
    pub classes: Vec<ClassStats>,
    /// Classes of shadow rays that were not traced, as no layer that was asked for needs them.
    pub classes_left_out: Vec<String>,
    /// Layers that were not asked for, `picture` for the one without a name.
    pub layers_left_out: Vec<String>,
    /// What their values would take, uncompressed: 4 bytes a channel and pixel.
    pub bytes_left_out: u64,
}

/// The rays of one class.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ClassStats {
    /// `ao`, `ao-unbounded` or `shadow.<light>`.
    pub name: String,
    /// Rays that were traced.
    pub rays: u64,
    /// Rays that were left out, as the picture is the same without them.
    pub rays_skipped: u64,
    /// The same by what left them out; what left out none is not listed.
    pub skipped: Vec<Skipped>,
    /// Rays that started below the root of the tree.
    pub rays_from_entries: u64,
    /// Traced rays that an occluder of other rays stopped, so that they did not go through the tree.
    pub rays_by_occluders: u64,
    /// Traced rays that something stops.
    pub rays_occluded: u64,
    /// `rays_occluded` over `rays`; 0 where there are none.
    pub occluded_share: f64,
    /// How samples were shared out, where sampling is adaptive and samples differ.
    pub adaptive: Option<AdaptiveStats>,
    /// Tree nodes visited per ray, in counting runs of backends that count.
    pub nodes_per_ray: Option<f64>,
    /// Triangles tested per ray, in counting runs of backends that count.
    pub triangles_per_ray: Option<f64>,
}

/// How the samples of one class were shared out among the pixels that see a surface.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct AdaptiveStats {
    /// Rays of the pilot that were traced: besides `rays`.
    pub pilot_rays: u64,
    /// Rays of the pilot that were left out, as what they would say is known.
    pub pilot_rays_skipped: u64,
    /// Fewest samples of a pixel.
    pub samples_min: u32,
    /// Mean number of samples.
    pub samples_mean: f64,
    /// Most samples of a pixel.
    pub samples_max: u32,
}

/// Rays that one kind of skipping left out.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Skipped {
    /// Which: [`Skip::name`].
    pub by: &'static str,
    /// How many rays.
    pub rays: u64,
}

/// Rays left out, by what left them out.
pub(super) type SkippedRays = [u64; Skip::ALL.len()];

/// Sums in whole numbers, so that their order does not matter.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub(super) primary_hits: u64,
    pub(super) primary_time: Duration,
    pub(super) shadow_time: Duration,
    pub(super) classes: Vec<ClassTally>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClassTally {
    pub(super) rays: u64,
    pub(super) skipped: SkippedRays,
    pub(super) from_entries: u64,
    pub(super) by_occluders: u64,
    pub(super) occluded: u64,
    pub(super) nodes: u64,
    pub(super) triangles: u64,
}

impl Tally {
    pub(super) fn new(plan: &Plan) -> Self {
        Self { classes: vec![ClassTally::default(); plan.classes.len()], ..Self::default() }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.primary_hits += other.primary_hits;
        self.primary_time += other.primary_time;
        self.shadow_time += other.shadow_time;
        for (class, other) in self.classes.iter_mut().zip(&other.classes) {
            class.rays += other.rays;
            for (skipped, other) in class.skipped.iter_mut().zip(other.skipped) {
                *skipped += other;
            }
            class.from_entries += other.from_entries;
            class.by_occluders += other.by_occluders;
            class.occluded += other.occluded;
            class.nodes += other.nodes;
            class.triangles += other.triangles;
        }
    }

    pub(super) fn stats(&self, plan: &Plan, total: Duration, counted: bool) -> RenderStats {
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let class_stats = |tally: &ClassTally, class: usize| {
            let per_ray = |n: u64| if tally.rays == 0 { 0.0 } else { n as f64 / tally.rays as f64 };
            ClassStats {
                name: plan.classes[class].name.clone(),
                rays: tally.rays,
                rays_skipped: tally.skipped.iter().sum(),
                skipped: Skip::ALL
                    .into_iter()
                    .map(|skip| Skipped { by: skip.name(), rays: tally.skipped[skip as usize] })
                    .filter(|skipped| skipped.rays > 0)
                    .collect(),
                rays_from_entries: tally.from_entries,
                rays_by_occluders: tally.by_occluders,
                rays_occluded: tally.occluded,
                occluded_share: per_ray(tally.occluded),
                adaptive: plan.allocation.as_ref().and_then(|a| a.stats(class)).cloned(),
                nodes_per_ray: counted.then(|| per_ray(tally.nodes)),
                triangles_per_ray: counted.then(|| per_ray(tally.triangles)),
            }
        };
        let [width, height] = plan.grid.size().map(u64::from);
        let choice = &plan.choice;
        RenderStats {
            primary_rays: plan.primary_rays(),
            primary_hits: self.primary_hits,
            threads: rayon::current_num_threads(),
            total_ms: ms(total),
            pilot_ms: plan.allocation.as_ref().map_or(0.0, |a| ms(a.pilot_time)),
            primary_ms: ms(self.primary_time),
            shadow_ms: ms(self.shadow_time),
            classes: self.classes.iter().zip(0..).map(|(t, class)| class_stats(t, class)).collect(),
            classes_left_out: choice.classes_left_out.clone(),
            layers_left_out: choice.left_out.clone(),
            bytes_left_out: 4 * width * height * choice.channels_left_out as u64,
        }
    }
}

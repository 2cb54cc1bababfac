//! Rendering tile by tile: rays live only as long as their tile.

use super::film::{Film, FilmBuilder, TileSums};
use super::plan::Plan;
use super::reused::Reused;
use super::settings::RenderSettings;
use super::skip::Skips;
use super::stats::{RenderStats, Tally};
use super::tile::TileOrder;
use super::walk::{Known, RayBuffer, Scratch, Sink, Walk};
use super::{Progress, TileCount};
use crate::Result;
use crate::backend::Accelerator;
use crate::ray::{RayBatch, VisitCounts, words_for};
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// How to render: nothing here changes the picture, but for the `nodes` layer of counting runs.
#[derive(Clone, Copy)]
pub struct RenderOptions<'a> {
    /// Count what shadow rays visit, if the backend can.
    pub count_visits: bool,
    /// What to leave out; counting runs look through no shafts.
    pub skip: Skips,
    /// In which order tiles are taken.
    pub order: TileOrder,
    /// Told after each tile how many are done, and of how many: each counts twice if there is a
    /// pilot. Called by all threads.
    pub progress: Option<Progress<'a>>,
}

impl Default for RenderOptions<'_> {
    fn default() -> Self {
        Self { count_visits: false, skip: Skips::ALL, order: TileOrder::default(), progress: None }
    }
}

/// A rendered image.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Its layers.
    pub film: Film,
    /// What it took.
    pub stats: RenderStats,
}

/// Renders `scene` with `accelerator` on the threads of the current rayon pool.
///
/// The film is a function of scene and settings: equal bits whatever the threads and the options.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if the settings have no image
/// ([`RenderSettings::check`]), name a layer that there is not, or ask for shadows only and the scene
/// has no light.
pub fn render(
    scene: &Scene,
    accelerator: &dyn Accelerator,
    settings: &RenderSettings,
    options: &RenderOptions<'_>,
) -> Result<Rendering> {
    let start = Instant::now();
    let mut plan = Plan::new(scene, settings)?;
    let done = TileCount::new(plan.walks(), options.progress);
    plan.adapt(scene, accelerator, options.skip, &done);
    let plan = plan;
    let counted = options.count_visits && can_count(accelerator);
    // Heat maps are of the whole tree and of all rays that matter.
    let skip = if counted { options.skip.without_shafts() } else { options.skip };
    let walk = Walk::new(scene, accelerator, &plan, skip);
    let shared = Mutex::new((FilmBuilder::new(&plan, counted), Tally::new(&plan)));
    let order = plan.grid.order(options.order);
    let workers = Reused::<Worker>::default();
    let of_tile = |tile: usize, Worker { scratch, answers }: &mut Worker| {
        let (sums, tally) = (TileSums::new(&plan), Tally::new(&plan));
        let mut tracing = Tracing { accelerator, counted, skip, answers, sums, tally };
        let walked = walk.tile(tile, scratch, &mut tracing);
        let Tracing { sums, mut tally, .. } = tracing;
        for (class, &skipped) in tally.classes.iter_mut().zip(&walked.skipped) {
            class.skipped = skipped;
        }
        tally.primary_hits = walked.primary.hits.iter().map(|&n| u64::from(n)).sum();
        tally.primary_time = walked.primary_time;
        // A panic elsewhere ends the render; what the lock holds is not looked at then.
        let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
        shared.0.set_tile(tile, &walked.primary, &sums);
        shared.1.add(&tally);
        drop(shared);
        done.add_one();
    };
    let tiles = order.par_iter().with_max_len(1);
    tiles.for_each(|&tile| workers.with(|worker| of_tile(tile as usize, worker)));
    let (film, tally) = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(Rendering { film: film.finish(), stats: tally.stats(&plan, start.elapsed(), counted) })
}

/// Whether the backend counts visits: it says so for no rays, too.
fn can_count(accelerator: &dyn Accelerator) -> bool {
    accelerator.occluded_counted(&RayBatch { rays: &[] }, &mut [], &mut [])
}

/// What is used again for one tile after the other.
#[derive(Default)]
struct Worker {
    scratch: Scratch,
    answers: Answers,
}

#[derive(Default)]
struct Answers {
    occluded: Vec<u64>,
    counts: Vec<VisitCounts>,
}

/// Traces what a walk over a tile finds.
struct Tracing<'a> {
    accelerator: &'a dyn Accelerator,
    counted: bool,
    skip: Skips,
    answers: &'a mut Answers,
    sums: TileSums,
    tally: Tally,
}

impl Sink for Tracing<'_> {
    fn trace(&mut self, class: usize, buffer: &RayBuffer) {
        let Self { accelerator, counted, skip, answers, sums, tally } = self;
        let batch = RayBatch { rays: &buffer.rays };
        let occluded = &mut answers.occluded;
        occluded.clear();
        occluded.resize(words_for(buffer.rays.len()), 0);
        let of_class = &mut tally.classes[class];
        let start;
        if *counted {
            answers.counts.clear();
            answers.counts.resize(buffer.rays.len(), VisitCounts::default());
            start = Instant::now();
            accelerator.occluded_counted(&batch, occluded, &mut answers.counts);
        } else {
            start = Instant::now();
            let hints = buffer.hints(class, *skip);
            of_class.by_occluders += accelerator.occluded_with(&hints, &batch, occluded);
            if buffer.entry.parts().is_some() {
                of_class.from_entries += buffer.rays.len() as u64;
            }
        }
        tally.shadow_time += start.elapsed();
        of_class.rays += buffer.rays.len() as u64;
        of_class.occluded += occluded.iter().map(|w| u64::from(w.count_ones())).sum::<u64>();
        sums.add(class, &buffer.slots, &buffer.weights, occluded);
        if *counted {
            of_class.nodes += answers.counts.iter().map(|c| u64::from(c.nodes)).sum::<u64>();
            of_class.triangles +=
                answers.counts.iter().map(|c| u64::from(c.triangles)).sum::<u64>();
            sums.add_visits(&buffer.slots, &answers.counts);
        }
    }

    fn known(&mut self, class: usize, known: &Known<'_>) {
        self.sums.add_known(class, known.slot, known.count, known.weights, known.is_lit);
    }
}

//! Rays recorded once, to be answered by any number of backends.

use super::film::{Film, FilmBuilder, PrimarySums, TileSums};
use super::plan::Plan;
use super::reused::Reused;
use super::settings::{Pass, RayClass, RenderSettings};
use super::skip::{Skip, Skips};
use super::tile::Tile;
use super::walk::{Known, RayBuffer, Scratch, Sink, Walk};
use super::{Progress, TileCount};
use crate::Result;
use crate::backend::Accelerator;
use crate::ray::{VisitCounts, words_for};
use crate::ray_set::RaySet;
use crate::scene::Scene;
use rayon::prelude::*;
use std::time::Duration;

/// Tiles that are walked before their rays are appended: bounds what is held twice.
const TILES_AT_ONCE: usize = 1024;

/// All shadow rays of an image: those, in the batches, that [`render`](super::render) traces.
#[derive(Debug)]
pub struct Recording {
    plan: Plan,
    primary: Vec<PrimarySums>,
    primary_time: Duration,
    passes: Vec<RecordedPass>,
}

/// The rays of one pass, for shadows those to all lights.
#[derive(Debug)]
pub struct RecordedPass {
    pass: Pass,
    set: RaySet,
    /// For each ray its pixel's slot in the tile.
    slots: Vec<u8>,
    /// For each ray its weight; empty where all are 1.
    weights: Vec<f32>,
    batches: Vec<BatchSource>,
    skipped: u64,
}

/// Where a batch comes from.
#[derive(Clone, Copy, Debug)]
struct BatchSource {
    tile: u32,
    /// Index of the class in the plan.
    class: usize,
    first_ray: usize,
}

/// Records the shadow rays of `scene`, on the threads of the current rayon pool. `accelerator`
/// answers camera rays, and those of the pilot of adaptive sampling, only. Takes 33 to 37 bytes a ray.
///
/// # Errors
/// As [`render`](super::render).
pub fn record(
    scene: &Scene,
    accelerator: &dyn Accelerator,
    settings: &RenderSettings,
    progress: Option<Progress<'_>>,
) -> Result<Recording> {
    let mut plan = Plan::new(scene, settings)?;
    // All rays that matter are for others to answer, whatever this backend's tree could tell of them.
    let skip = Skips::NONE.with(Skip::Weightless).with(Skip::DarkLights);
    let done = TileCount::new(plan.walks(), progress);
    plan.adapt(scene, accelerator, Skips::ALL, &done);
    let walk = Walk::new(scene, accelerator, &plan, skip);
    let mut passes: Vec<_> =
        Pass::ALL.into_iter().filter(|&pass| plan.has(pass)).map(RecordedPass::new).collect();
    let pass_of: Vec<usize> = plan
        .classes
        .iter()
        .map(|class| passes.iter().take_while(|p| p.pass != class.class.pass()).count())
        .collect();
    let mut primary = Vec::with_capacity(plan.grid.len());
    let mut primary_time = Duration::ZERO;
    let tiles: Vec<usize> = (0..plan.grid.len()).collect();
    let scratches = Reused::<Scratch>::default();
    for tiles in tiles.chunks(TILES_AT_ONCE) {
        let walked: Vec<_> = tiles
            .par_iter()
            .with_max_len(1)
            .map(|&tile| {
                let mut batches = Batches::default();
                let walked = scratches.with(|scratch| walk.tile(tile, scratch, &mut batches));
                done.add_one();
                (tile as u32, walked, batches.0)
            })
            .collect();
        for (tile, walked, batches) in walked {
            for (class, buffer) in batches {
                passes[pass_of[class]].append(tile, class, &buffer);
            }
            for (class, skipped) in walked.skipped.into_iter().enumerate() {
                passes[pass_of[class]].skipped += skipped.iter().sum::<u64>();
            }
            primary_time += walked.primary_time;
            primary.push(walked.primary);
        }
    }
    Ok(Recording { plan, primary, primary_time, passes })
}

/// Keeps the rays that a walk over a tile finds.
#[derive(Default)]
struct Batches(Vec<(usize, RayBuffer)>);

impl Sink for Batches {
    fn trace(&mut self, class: usize, rays: &RayBuffer) {
        self.0.push((class, rays.clone()));
    }

    fn known(&mut self, _: usize, _: &Known<'_>) {
        unreachable!("only what shafts tell is known, and none are made here");
    }
}

impl Recording {
    /// What was recorded.
    pub fn settings(&self) -> &RenderSettings {
        &self.plan.settings
    }

    /// The passes that have a ray class, in the order of [`Pass::ALL`].
    pub fn passes(&self) -> &[RecordedPass] {
        &self.passes
    }

    /// Number of camera rays.
    pub fn primary_rays(&self) -> u64 {
        self.plan.primary_rays()
    }

    /// Camera rays that see a surface.
    pub fn primary_hits(&self) -> u64 {
        self.primary.iter().flat_map(|p| p.hits).map(u64::from).sum()
    }

    /// Time in camera rays, in milliseconds, summed over threads.
    pub fn primary_ms(&self) -> f64 {
        self.primary_time.as_secs_f64() * 1e3
    }

    /// The film of a backend's answers to each pass, with the `nodes` layer if visits are given.
    /// Equal bits to what [`render`](super::render) makes with that backend.
    ///
    /// # Panics
    /// If answers or counts are not of this recording's shape.
    pub fn film(&self, answers: &[Vec<u64>], counts: Option<&[Vec<VisitCounts>]>) -> Film {
        assert_eq!(answers.len(), self.passes.len(), "answers of another recording");
        let mut film = FilmBuilder::new(&self.plan, counts.is_some());
        let mut batches: Vec<_> = self
            .passes
            .iter()
            .enumerate()
            .map(|(index, pass)| {
                let counts = counts.map(|counts| counts[index].as_slice());
                pass.answered(&answers[index], counts).peekable()
            })
            .collect();
        for (tile, primary) in self.primary.iter().enumerate() {
            let mut sums = TileSums::new(&self.plan);
            for batches in &mut batches {
                while let Some(batch) = batches.next_if(|batch| batch.source.tile == tile as u32) {
                    sums.add(batch.source.class, batch.slots, batch.weights, batch.occluded);
                    sums.add_visits(batch.slots, batch.counts);
                }
            }
            film.set_tile(tile, primary, &sums);
        }
        film.finish()
    }

    /// Column and row of the pixel that a ray of a pass is for.
    ///
    /// # Panics
    /// If there is no such pass or ray.
    pub fn pixel(&self, pass: usize, ray: usize) -> [u32; 2] {
        let pass = &self.passes[pass];
        self.tile(pass.source(ray)).pixel(usize::from(pass.slots[ray]))
    }

    /// The class of a ray of a pass: which light it goes to.
    ///
    /// # Panics
    /// If there is no such pass or ray.
    pub fn class(&self, pass: usize, ray: usize) -> RayClass {
        self.plan.classes[self.passes[pass].source(ray).class].class
    }

    /// For each pixel of the image how many of the given rays of a pass are for it.
    ///
    /// # Panics
    /// If there is no such pass or ray.
    pub fn rays_per_pixel(&self, pass: usize, rays: &[usize]) -> Vec<u32> {
        let [width, height] = self.plan.grid.size().map(|n| n as usize);
        let mut pixels = vec![0; width * height];
        for &ray in rays {
            let [x, y] = self.pixel(pass, ray);
            pixels[y as usize * width + x as usize] += 1;
        }
        pixels
    }

    fn tile(&self, source: &BatchSource) -> Tile {
        self.plan.grid.tile(source.tile as usize)
    }
}

/// A batch with all that is known of it.
struct AnsweredBatch<'a> {
    source: BatchSource,
    slots: &'a [u8],
    weights: &'a [f32],
    occluded: &'a [u64],
    /// Empty where visits were not counted.
    counts: &'a [VisitCounts],
}

impl RecordedPass {
    fn new(pass: Pass) -> Self {
        Self {
            pass,
            set: RaySet::default(),
            slots: Vec::new(),
            weights: Vec::new(),
            batches: Vec::new(),
            skipped: 0,
        }
    }

    fn append(&mut self, tile: u32, class: usize, buffer: &RayBuffer) {
        self.batches.push(BatchSource { tile, class, first_ray: self.set.len() });
        self.set.push_batch(&buffer.rays);
        self.slots.extend_from_slice(&buffer.slots);
        self.weights.extend_from_slice(&buffer.weights);
    }

    /// Which pass it is.
    pub fn pass(&self) -> Pass {
        self.pass
    }

    /// The rays, in batches of one tile and light, and what their answers look like.
    pub fn rays(&self) -> &RaySet {
        &self.set
    }

    /// Rays that were left out, because whatever they met the picture would be the same.
    pub fn rays_skipped(&self) -> u64 {
        self.skipped
    }

    /// What a ray brings if nothing stops it, in units of the light's strength; 1 for ambient
    /// occlusion.
    ///
    /// # Panics
    /// If there is no such ray.
    pub fn weight(&self, ray: usize) -> f32 {
        if self.pass == Pass::Shadow { self.weights[ray] } else { 1.0 }
    }

    fn source(&self, ray: usize) -> &BatchSource {
        assert!(ray < self.set.len(), "ray {ray} of {}", self.set.len());
        &self.batches[self.batches.partition_point(|batch| batch.first_ray <= ray) - 1]
    }

    fn answered<'a>(
        &'a self,
        answers: &'a [u64],
        counts: Option<&'a [VisitCounts]>,
    ) -> impl Iterator<Item = AnsweredBatch<'a>> {
        assert_eq!(answers.len(), self.set.word_count(), "answers of another recording");
        let mut first_word = 0;
        self.batches.iter().zip(self.set.batches()).map(move |(&source, batch)| {
            let rays = source.first_ray..source.first_ray + batch.rays.len();
            let words = first_word..first_word + words_for(rays.len());
            first_word = words.end;
            AnsweredBatch {
                source,
                slots: &self.slots[rays.clone()],
                weights: if self.weights.is_empty() { &[] } else { &self.weights[rays.clone()] },
                occluded: &answers[words],
                counts: counts.map_or(&[], |counts| &counts[rays]),
            }
        })
    }
}

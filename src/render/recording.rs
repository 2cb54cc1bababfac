//! Rays recorded once, to be answered by any number of backends.

use super::film::{Film, FilmBuilder, PrimarySums, TileSums};
use super::plan::Plan;
use super::settings::{RayClass, RenderSettings};
use super::tile::Tile;
use super::walk::{RayBuffer, Scratch, Walk};
use super::{Progress, TileCount};
use crate::Result;
use crate::backend::Accelerator;
use crate::ray::{Ray, RayBatch, VisitCounts, bit, words_for};
use crate::scene::Scene;
use rayon::prelude::*;
use std::ops::Range;
use std::time::{Duration, Instant};

/// Tiles that are walked before their rays are appended: bounds what is held twice.
const TILES_AT_ONCE: usize = 1024;

/// All shadow rays of an image: those, in the batches, that [`render`](super::render) traces.
#[derive(Debug)]
pub struct Recording {
    plan: Plan,
    primary: Vec<PrimarySums>,
    primary_time: Duration,
    classes: Vec<ClassRecording>,
}

/// The rays of one class, batch after batch.
#[derive(Debug)]
pub struct ClassRecording {
    class: RayClass,
    name: String,
    rays: Vec<Ray>,
    slots: Vec<u8>,
    weights: Vec<f32>,
    batches: Vec<Batch>,
    skipped: u64,
}

/// Rays of one tile that are answered in one call.
///
/// Answers of a class are a bit set in which every batch starts a word of its own: threads answer
/// batches side by side without sharing one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The tile's pixels.
    pub tile: Tile,
    tile_index: u32,
    /// Index of the first ray in the class.
    pub first_ray: usize,
    /// Number of rays, at least 1.
    pub rays: usize,
    /// Index of the first word of answers.
    pub first_word: usize,
}

impl Batch {
    /// Its rays.
    pub fn ray_range(&self) -> Range<usize> {
        self.first_ray..self.first_ray + self.rays
    }

    /// Its words of answers.
    pub fn word_range(&self) -> Range<usize> {
        self.first_word..self.first_word + words_for(self.rays)
    }
}

/// What a backend said about the rays of a class.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClassAnswers {
    /// One bit a ray: see [`Batch`].
    pub occluded: Vec<u64>,
    /// What each ray visited; empty if it was not counted.
    pub counts: Vec<VisitCounts>,
}

/// Records the shadow rays of `scene`, on the threads of the current rayon pool. `accelerator`
/// answers camera rays only. Takes about 40 bytes a ray.
///
/// # Errors
/// As [`render`](super::render).
pub fn record(
    scene: &Scene,
    accelerator: &dyn Accelerator,
    settings: &RenderSettings,
    progress: Option<Progress<'_>>,
) -> Result<Recording> {
    let plan = Plan::new(scene, settings)?;
    let walk = Walk { scene, accelerator, plan: &plan, skip: true };
    let done = TileCount::new(plan.grid.len(), progress);
    let mut classes: Vec<_> = plan.classes.iter().map(ClassRecording::new).collect();
    let mut primary = Vec::with_capacity(plan.grid.len());
    let mut primary_time = Duration::ZERO;
    let tiles: Vec<usize> = (0..plan.grid.len()).collect();
    for tiles in tiles.chunks(TILES_AT_ONCE) {
        let walked: Vec<_> = tiles
            .par_iter()
            .with_max_len(1)
            .map_init(Scratch::default, |scratch, &tile| {
                let mut batches: Vec<(usize, RayBuffer)> = Vec::new();
                let walked = walk.tile(tile, scratch, &mut |class, buffer| {
                    batches.push((class, buffer.clone()));
                });
                done.add_one();
                (tile, walked, batches)
            })
            .collect();
        for (tile, walked, batches) in walked {
            for (class, buffer) in batches {
                classes[class].append(plan.grid.tile(tile), tile as u32, &buffer);
            }
            for (class, skipped) in classes.iter_mut().zip(walked.skipped) {
                class.skipped += skipped;
            }
            primary_time += walked.primary_time;
            primary.push(walked.primary);
        }
    }
    Ok(Recording { plan, primary, primary_time, classes })
}

impl Recording {
    /// What was recorded.
    pub fn settings(&self) -> &RenderSettings {
        &self.plan.settings
    }

    /// The classes, in the order of their layers.
    pub fn classes(&self) -> &[ClassRecording] {
        &self.classes
    }

    /// Camera rays, and how many of them see a surface.
    pub fn primary_rays(&self) -> [u64; 2] {
        let [width, height] = self.plan.grid.size().map(u64::from);
        let hits = self.primary.iter().flat_map(|p| p.hits).map(u64::from).sum();
        [width * height * u64::from(self.plan.settings.camera_samples), hits]
    }

    /// Time in camera rays, in milliseconds, summed over threads.
    pub fn primary_ms(&self) -> f64 {
        self.primary_time.as_secs_f64() * 1e3
    }

    /// Asks `accelerator` about all rays, counting visits if asked to and if it can.
    pub fn trace(&self, accelerator: &dyn Accelerator, count_visits: bool) -> Vec<ClassAnswers> {
        let classes = self.classes.iter();
        classes
            .map(|class| {
                let mut answers =
                    ClassAnswers { occluded: vec![0; class.words()], counts: Vec::new() };
                let counted = count_visits && {
                    answers.counts = vec![VisitCounts::default(); class.rays.len()];
                    class.trace_counted(accelerator, &mut answers.occluded, &mut answers.counts)
                };
                if !counted {
                    answers.counts = Vec::new();
                    class.trace(accelerator, &mut answers.occluded);
                }
                answers
            })
            .collect()
    }

    /// The film of a backend's answers, one element a class. Equal bits to what
    /// [`render`](super::render) makes with that backend.
    ///
    /// # Panics
    /// If the answers are not of this recording's shape.
    pub fn film(&self, answers: &[ClassAnswers]) -> Film {
        assert_eq!(answers.len(), self.classes.len(), "one answer set a class");
        let counted = answers.iter().zip(&self.classes).all(|(a, c)| a.counts.len() == c.len());
        let mut film = FilmBuilder::new(&self.plan, counted);
        let mut next_batch = vec![0; self.classes.len()];
        for (tile, primary) in self.primary.iter().enumerate() {
            let mut sums = TileSums::new(&self.plan);
            for (index, (class, answers)) in self.classes.iter().zip(answers).enumerate() {
                let next = &mut next_batch[index];
                while let Some(batch) = class.batches.get(*next)
                    && batch.tile_index as usize == tile
                {
                    let rays = batch.ray_range();
                    let slots = &class.slots[rays.clone()];
                    let weights = class.weights.get(rays.clone()).unwrap_or_default();
                    sums.add(index, slots, weights, &answers.occluded[batch.word_range()]);
                    if counted {
                        sums.add_visits(slots, &answers.counts[rays]);
                    }
                    *next += 1;
                }
            }
            film.set_tile(self.plan.grid.tile(tile), primary, &sums);
        }
        film.finish()
    }
}

impl ClassRecording {
    fn new(plan: &super::plan::ClassPlan) -> Self {
        Self {
            class: plan.class,
            name: plan.name.clone(),
            rays: Vec::new(),
            slots: Vec::new(),
            weights: Vec::new(),
            batches: Vec::new(),
            skipped: 0,
        }
    }

    fn append(&mut self, tile: Tile, tile_index: u32, buffer: &RayBuffer) {
        let (first_ray, first_word) = (self.rays.len(), self.words());
        let rays = buffer.rays.len();
        self.batches.push(Batch { tile, tile_index, first_ray, rays, first_word });
        self.rays.extend_from_slice(&buffer.rays);
        self.slots.extend_from_slice(&buffer.slots);
        self.weights.extend_from_slice(&buffer.weights);
    }

    /// Which rays these are.
    pub fn class(&self) -> RayClass {
        self.class
    }

    /// `ao`, `ao-unbounded` or `shadow.<light>`: also the name of their layer.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// All rays, batch after batch.
    pub fn rays(&self) -> &[Ray] {
        &self.rays
    }

    /// The batches, by tile.
    pub fn batches(&self) -> &[Batch] {
        &self.batches
    }

    /// Rays that were left out, because whatever they met the picture would be the same.
    pub fn rays_skipped(&self) -> u64 {
        self.skipped
    }

    /// Words that hold the answers: see [`Batch`].
    pub fn words(&self) -> usize {
        self.batches.last().map_or(0, |batch| batch.word_range().end)
    }

    /// What ray `ray` brings if nothing stops it, in units of the light's strength; 1 for ambient
    /// occlusion.
    pub fn weight(&self, ray: usize) -> f32 {
        if self.weights.is_empty() { 1.0 } else { self.weights[ray] }
    }

    /// The batch of ray `ray`.
    ///
    /// # Panics
    /// If there is no such ray.
    pub fn batch_of(&self, ray: usize) -> &Batch {
        assert!(ray < self.len(), "ray {ray} of {}", self.len());
        &self.batches[self.batches.partition_point(|batch| batch.first_ray <= ray) - 1]
    }

    /// Column and row of the pixel that ray `ray` is for.
    ///
    /// # Panics
    /// If there is no such ray.
    pub fn pixel(&self, ray: usize) -> [u32; 2] {
        self.batch_of(ray).tile.pixel(usize::from(self.slots[ray]))
    }

    /// The answer of ray `ray` in this class's words.
    ///
    /// # Panics
    /// If there is no such ray.
    pub fn answer(&self, occluded: &[u64], ray: usize) -> bool {
        let batch = self.batch_of(ray);
        bit(&occluded[batch.word_range()], ray - batch.first_ray)
    }

    /// How many rays are occluded.
    pub fn occluded_count(&self, occluded: &[u64]) -> u64 {
        occluded.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The rays whose answers differ, in order.
    pub fn differing(&self, a: &[u64], b: &[u64]) -> Vec<usize> {
        let mut rays = Vec::new();
        for batch in &self.batches {
            let words = batch.word_range();
            if a[words.clone()] != b[words.clone()] {
                let (a, b) = (&a[words.clone()], &b[words]);
                let differs = |&i: &usize| bit(a, i) != bit(b, i);
                rays.extend((0..batch.rays).filter(differs).map(|i| batch.first_ray + i));
            }
        }
        rays
    }

    /// Asks `accelerator` about all rays, on the threads of the current rayon pool; returns the
    /// wall-clock time. Allocates nothing: what is timed is the backend.
    ///
    /// # Panics
    /// If `occluded` does not hold [`words`](Self::words) words.
    pub fn trace(&self, accelerator: &dyn Accelerator, occluded: &mut [u64]) -> Duration {
        assert_eq!(occluded.len(), self.words(), "words of answers");
        let start = Instant::now();
        if !self.batches.is_empty() {
            answer_batches(accelerator, &self.batches, &self.rays, occluded);
        }
        start.elapsed()
    }

    /// As [`trace`](Self::trace), setting what each ray visited; not for timing. Returns `false`,
    /// having done nothing, if the backend cannot count.
    ///
    /// # Panics
    /// If `occluded` or `counts` do not fit the rays.
    pub fn trace_counted(
        &self,
        accelerator: &dyn Accelerator,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        assert_eq!(occluded.len(), self.words(), "words of answers");
        assert_eq!(counts.len(), self.len(), "one count a ray");
        if !super::streaming::can_count(accelerator) {
            return false;
        }
        occluded.fill(0);
        counts.fill(VisitCounts::default());
        let (mut rest, mut rest_counts, mut parts) = (occluded, counts, Vec::new());
        for batch in &self.batches {
            let (words, counts);
            (words, rest) = rest.split_at_mut(words_for(batch.rays));
            (counts, rest_counts) = rest_counts.split_at_mut(batch.rays);
            parts.push((batch, words, counts));
        }
        parts.into_par_iter().all(|(batch, words, counts)| {
            let rays = &self.rays[batch.ray_range()];
            accelerator.occluded_counted(&RayBatch { rays }, words, counts)
        })
    }
}

/// Answers at least one batch, dividing them among threads.
fn answer_batches(
    accelerator: &dyn Accelerator,
    batches: &[Batch],
    rays: &[Ray],
    occluded: &mut [u64],
) {
    if let [batch] = batches {
        occluded.fill(0);
        accelerator.occluded(&RayBatch { rays: &rays[batch.ray_range()] }, occluded);
        return;
    }
    let (left, right) = batches.split_at(batches.len() / 2);
    let (left_words, right_words) = occluded.split_at_mut(right[0].first_word - left[0].first_word);
    rayon::join(
        || answer_batches(accelerator, left, rays, left_words),
        || answer_batches(accelerator, right, rays, right_words),
    );
}

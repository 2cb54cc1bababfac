//! Adaptive sampling: more samples for the pixels that need them, without bias.
//!
//! A rule that stops when the samples so far agree is biased: in a penumbra samples are lit or not,
//! and a few that happen to be all lit look certain (Kirk and Arvo, "Unbiased Sampling Techniques
//! for Image Synthesis", SIGGRAPH 1991). So sampling has two stages. A pilot of a few samples a
//! pixel, from points of its own, says how uncertain each pixel is, and how many samples it gets
//! follows from all pilots; the estimate is that of the second stage alone. Given the pilots it is
//! what it would be with so many samples in any case, so it is unbiased, whatever the pilots say.
//! To add the pilot with weights that know nothing of it would be unbiased too, but the pixels with
//! most samples would suffer from the few of the pilot. (Shares of lights are ratios of two estimates,
//! so with weights that vary they are off by the order of one over the samples, as without.)
//!
//! The variance of one sample, relative to what the light brings without shadows, is `p (1 - p) + p v`,
//! `v` being the relative variance of the weights (0 for ambient occlusion) and `p` the share of rays
//! that nothing stops. The second part is smooth, which points that are spread well take care of, so
//! a quarter of it is counted for the uncertainty of a pixel. `p` is estimated from the `k` lit ones of
//! the `n` pilot samples of the pixel and its neighbours in the tile, as `(k + 2 q) / (n + 2)`, where
//! `q` is `(K + 1) / (N + 2)` of the whole tile: agreement is never taken for certainty, and less so
//! in a tile that does not agree.
//!
//! Where variance falls with the number `n` of samples as `n^-a`, the sum of `s^2 n^-a` over pixels is
//! least for `n` as `s^(2 / (1 + a))`, which is Neyman's rule ("On the Two Different Aspects of the
//! Representative Method", 1934) for `a = 1`, independent samples. Here `a = 3/2`, that of
//! well-spread points where an edge passes (Mitchell, "Consequences of Stratified Sampling in
//! Graphics", SIGGRAPH 1996). Counts are powers of two times the fewest.

use super::TileCount;
use super::layers::Choice;
use super::plan::Plan;
use super::reused::Reused;
use super::sampler::mix;
use super::settings::RenderSettings;
use super::skip::Skips;
use super::stats::AdaptiveStats;
use super::tile::{TILE_PIXELS, TILE_SIZE};
use super::walk::{Known, RayBuffer, Scratch, Sink, Walk};
use crate::backend::Accelerator;
use crate::ray::{RayBatch, bit, words_for};
use crate::scene::Scene;
use crate::{Error, Result};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Pixels get as many samples as they need: a quarter of [`RenderSettings::spp`] at least, `most` at
/// most, and `spp` on the mean, or fewer where `most` leaves nothing to spend them on.
///
/// The mean is over the pixels that see a surface and that the light can reach, those whose rays
/// skipping leaves out among them: the picture does not depend on what is skipped. A pilot of a
/// quarter of `spp`, 4 to 64 samples, comes on top. Lights whose samples are all the same keep
/// their one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Adaptive {
    /// Most samples of a class in a pixel, at least `spp`. Rounded down to a power of two times the
    /// fewest.
    pub most: u32,
}

impl Adaptive {
    /// The fewest samples are `spp` over this.
    const LEAST: u32 = 4;

    /// Refuses settings that cannot be adapted.
    pub(super) fn check(self, settings: &RenderSettings) -> Result<()> {
        let (Self { most }, spp, limit) = (self, settings.spp, RenderSettings::MAX_SAMPLES);
        let refuse = |message| Err(Error::Usage(message));
        if settings.camera_samples != 1 {
            let camera = settings.camera_samples;
            return refuse(format!("adaptive sampling takes 1 camera sample, not {camera}"));
        }
        if !spp.is_multiple_of(Self::LEAST) {
            let least = Self::LEAST;
            return refuse(format!(
                "adaptive sampling takes a multiple of {least} samples, not {spp}"
            ));
        }
        if most < spp || u64::from(most) > limit {
            return refuse(format!(
                "adaptive sampling with up to {most} samples: {spp}, the mean, to {limit}"
            ));
        }
        Ok(())
    }
}

/// Samples of the pilot in each pixel.
fn pilot_samples(spp: u32) -> u32 {
    (spp / 4).clamp(4, 64).next_power_of_two()
}

/// How many samples each pixel gets of each class whose samples differ.
#[derive(Clone, Debug)]
pub(super) struct Allocation {
    least: u32,
    /// For each class of the plan its place among those that are adapted.
    places: Vec<Option<usize>>,
    adapted: usize,
    /// Doublings of `least`, by tile and adapted class.
    levels: Vec<[u8; TILE_PIXELS]>,
    /// Of each adapted class.
    stats: Vec<AdaptiveStats>,
    pub(super) pilot_time: Duration,
}

impl Allocation {
    /// Traces the pilot of `plan`'s picture and shares samples out.
    pub(super) fn by_pilot(
        scene: &Scene,
        accelerator: &dyn Accelerator,
        plan: &Plan,
        skip: Skips,
        done: &TileCount<'_>,
    ) -> Self {
        let start = Instant::now();
        let spp = plan.settings.spp;
        let (pilot, places) = pilot_of(plan);
        let adapted = pilot.classes.len();
        let walk = Walk::new(scene, accelerator, &pilot, skip);
        let scratches = Reused::<Scratch>::default();
        let tiles: Vec<_> = (0..plan.grid.len())
            .into_par_iter()
            .with_max_len(1)
            .map(|tile| {
                let sums = vec![PilotSums::default(); adapted];
                let mut asking = Asking { accelerator, skip, sums, answers: Vec::new() };
                let walked = scratches.with(|scratch| walk.tile(tile, scratch, &mut asking));
                let sees = walked.primary.hits.map(|hits| hits > 0);
                done.add_one();
                asking
                    .sums
                    .iter()
                    .zip(&walked.skipped)
                    .map(|(sums, skipped)| {
                        let codes = sums.codes(
                            &sees,
                            pilot.settings.spp,
                            (tile as u64, pilot.settings.seed),
                        );
                        (codes, [sums.rays, skipped.iter().sum()])
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let least = spp / Adaptive::LEAST;
        let most = plan.settings.adaptive.map_or(spp, |adaptive| adaptive.most);
        let top = (most / least).ilog2();
        let mut levels = vec![[0; TILE_PIXELS]; tiles.len() * adapted];
        let mut stats = Vec::new();
        for class in 0..adapted {
            let codes = || tiles.iter().map(|tile| &tile[class].0);
            let shares = Shares::new(codes().flatten(), top);
            let mut of_class = AdaptiveStats { samples_min: u32::MAX, ..AdaptiveStats::default() };
            let (mut pixels, mut samples) = (0u64, 0u64);
            for (tile, codes) in codes().enumerate() {
                for (level, &code) in levels[tile * adapted + class].iter_mut().zip(codes) {
                    *level = shares.level(code);
                    if code != UNSEEN {
                        let count = least << *level;
                        of_class.samples_min = of_class.samples_min.min(count);
                        of_class.samples_max = of_class.samples_max.max(count);
                        pixels += 1;
                        samples += u64::from(count);
                    }
                }
            }
            of_class.samples_min = of_class.samples_min.min(of_class.samples_max);
            of_class.samples_mean = samples as f64 / pixels.max(1) as f64;
            for tile in &tiles {
                of_class.pilot_rays += tile[class].1[0];
                of_class.pilot_rays_skipped += tile[class].1[1];
            }
            stats.push(of_class);
        }
        Self { least, places, adapted, levels, stats, pilot_time: start.elapsed() }
    }

    /// Samples of a class of the plan, if it is adapted.
    pub(super) fn samples(&self, tile: usize, class: usize, slot: usize) -> Option<u32> {
        let place = self.places[class]?;
        Some(self.least << self.levels[tile * self.adapted + place][slot])
    }

    /// What was shared out of a class of the plan, if it is adapted.
    pub(super) fn stats(&self, class: usize) -> Option<&AdaptiveStats> {
        self.places[class].map(|place| &self.stats[place])
    }
}

/// The pilot's plan, of the classes that are adapted, and the place of each class in it.
fn pilot_of(plan: &Plan) -> (Plan, Vec<Option<usize>>) {
    let spp = pilot_samples(plan.settings.spp);
    // Points of its own: those of another seed.
    let seed = mix(mix(plan.settings.seed) ^ u64::from_be_bytes(*b"pilot\0\0\0"));
    let settings = RenderSettings { spp, seed, adaptive: None, ..plan.settings.clone() };
    let (mut classes, mut places) = (Vec::new(), Vec::new());
    for class in &plan.classes {
        places.push(class.samples_differ.then_some(classes.len()));
        if class.samples_differ {
            let mut class = class.clone();
            class.samples = spp;
            classes.push(class);
        }
    }
    let (grid, choice) = (plan.grid, Choice::default());
    (Plan { settings, grid, classes, choice, allocation: None }, places)
}

/// Traces a pilot's rays.
struct Asking<'a> {
    accelerator: &'a dyn Accelerator,
    skip: Skips,
    sums: Vec<PilotSums>,
    answers: Vec<u64>,
}

/// What the pilot found in a tile, of one class. What is skipped leaves no trace in it.
#[derive(Clone)]
struct PilotSums {
    /// Samples that weigh something, and those of them that nothing stops.
    all: [u32; TILE_PIXELS],
    lit: [u32; TILE_PIXELS],
    weight: [f64; TILE_PIXELS],
    weight_squared: [f64; TILE_PIXELS],
    /// Rays traced.
    rays: u64,
}

impl Default for PilotSums {
    fn default() -> Self {
        Self {
            all: [0; TILE_PIXELS],
            lit: [0; TILE_PIXELS],
            weight: [0.0; TILE_PIXELS],
            weight_squared: [0.0; TILE_PIXELS],
            rays: 0,
        }
    }
}

impl Sink for Asking<'_> {
    fn trace(&mut self, class: usize, buffer: &RayBuffer) {
        self.answers.clear();
        self.answers.resize(words_for(buffer.rays.len()), 0);
        let batch = RayBatch { rays: &buffer.rays };
        let hints = buffer.hints(class, self.skip);
        self.accelerator.occluded_with(&hints, &batch, &mut self.answers);
        let sums = &mut self.sums[class];
        sums.rays += buffer.rays.len() as u64;
        for (ray, &slot) in buffer.slots.iter().enumerate() {
            let weight = buffer.weights.get(ray).copied().unwrap_or(1.0);
            sums.add(slot, weight, !bit(&self.answers, ray));
        }
    }

    fn known(&mut self, class: usize, known: &Known<'_>) {
        for sample in 0..known.count as usize {
            let weight = known.weights.get(sample).copied().unwrap_or(1.0);
            self.sums[class].add(known.slot, weight, known.is_lit);
        }
    }
}

/// How much of the weights' variance counts.
const WEIGHT_SPREAD: f64 = 0.25;
/// Code of pixels that see nothing.
const UNSEEN: u16 = 0;
/// Code of pixels that no sample of the pilot brings anything.
const UNREACHED: u16 = 1;
/// Code for four times the uncertainty, less that for once.
const CODES_PER_FOURFOLD: i32 = 256;
/// Twice the samples for `2^(1 + 3/2)` times the uncertainty.
const CODES_PER_LEVEL: i32 = CODES_PER_FOURFOLD * 5 / 4;

/// The logarithm of an uncertainty: four times as much adds [`CODES_PER_FOURFOLD`]. Straight between
/// powers of two, so that it is the same on every machine: at most 3 % of the samples off.
fn code(uncertainty: f64) -> u16 {
    ((uncertainty as f32).to_bits() >> 16) as u16
}

impl PilotSums {
    fn add(&mut self, slot: u8, weight: f32, is_lit: bool) {
        let (slot, weight) = (usize::from(slot), f64::from(weight));
        if weight > 0.0 {
            self.all[slot] += 1;
            self.lit[slot] += u32::from(is_lit);
            self.weight[slot] += weight;
            self.weight_squared[slot] += weight * weight;
        }
    }

    /// Codes of the pixels' uncertainties. Each is raised by up to a level by chance, so that where
    /// many pixels are alike some of them get the next level.
    fn codes(
        &self,
        sees: &[bool; TILE_PIXELS],
        samples: u32,
        (tile, seed): (u64, u64),
    ) -> [u16; TILE_PIXELS] {
        let [lit, all] = [&self.lit, &self.all].map(|counts| counts.iter().sum::<u32>());
        let prior = f64::from(lit + 1) / f64::from(all + 2);
        std::array::from_fn(|slot| {
            if !sees[slot] {
                return UNSEEN;
            }
            if self.all[slot] == 0 {
                return UNREACHED;
            }
            let chance = mix(mix(seed ^ tile) ^ slot as u64) % CODES_PER_LEVEL as u64;
            code(self.uncertainty(slot, samples, prior)).saturating_add(chance as u16)
        })
    }

    /// How uncertain a sample is: see the module. `prior`: share of rays in the tile that nothing stops.
    fn uncertainty(&self, slot: usize, samples: u32, prior: f64) -> f64 {
        let side = TILE_SIZE as usize;
        let around = |at: usize| at.saturating_sub(1)..(at + 2).min(side);
        let neighbours =
            around(slot / side).flat_map(|y| around(slot % side).map(move |x| y * side + x));
        let (lit, all) = neighbours.fold((0, 0), |(lit, all), neighbour| {
            (lit + self.lit[neighbour], all + self.all[neighbour])
        });
        let p = (f64::from(lit) + 2.0 * prior) / f64::from(all + 2);
        let mean = self.weight[slot] / f64::from(samples);
        let spread = self.weight_squared[slot] / f64::from(samples) / (mean * mean) - 1.0;
        p * (1.0 - p) + WEIGHT_SPREAD * p * spread.max(0.0)
    }
}

/// How samples are shared out among codes.
struct Shares {
    /// What is added to a code before it is cut to a level.
    offset: i32,
    top: u32,
}

impl Shares {
    /// The largest shares that do not exceed the mean, nor give the most to other pixels than those
    /// with uncertainty 1/4 or more, which is that of a coin.
    fn new<'a>(codes: impl Iterator<Item = &'a u16>, top: u32) -> Self {
        let mut counts = vec![0u64; 1 << 16];
        codes.for_each(|&code| counts[usize::from(code)] += 1);
        counts[usize::from(UNSEEN)] = 0;
        counts[usize::from(UNREACHED)] = 0;
        let counts: Vec<_> = (0..=u16::MAX).zip(counts).filter(|&(_, pixels)| pixels > 0).collect();
        let pixels: u64 = counts.iter().map(|(_, pixels)| pixels).sum();
        let fits = |offset: i32| {
            let shares = Self { offset, top };
            let samples = counts.iter().map(|&(code, pixels)| pixels << shares.level(code));
            samples.sum::<u64>() <= pixels * u64::from(Adaptive::LEAST)
        };
        let (mut low, mut high) =
            (-i32::from(u16::MAX), CODES_PER_LEVEL * top as i32 - i32::from(code(0.25)));
        while low < high {
            let middle = low + (high - low + 1) / 2;
            if fits(middle) {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        Self { offset: low, top }
    }

    /// Doublings of the fewest samples.
    fn level(&self, code: u16) -> u8 {
        if code <= UNREACHED {
            return 0;
        }
        let level = (i32::from(code) + self.offset).div_euclid(CODES_PER_LEVEL);
        level.clamp(0, self.top as i32) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: u32 = 4;
    const SEES: [bool; TILE_PIXELS] = [true; TILE_PIXELS];

    /// A tile in which so many samples of each pixel are lit.
    fn codes(lit: impl Fn(usize) -> u32, tile: u64) -> [u16; TILE_PIXELS] {
        let mut sums = PilotSums::default();
        for slot in 0..TILE_PIXELS {
            (0..SAMPLES).for_each(|sample| sums.add(slot as u8, 0.5, sample < lit(slot)));
        }
        sums.codes(&SEES, SAMPLES, (tile, 7))
    }

    fn levels(codes: &[u16], top: u32) -> Vec<u8> {
        let shares = Shares::new(codes.iter(), top);
        codes.iter().map(|&code| shares.level(code)).collect()
    }

    /// Mean in units of the fewest samples.
    fn mean(levels: &[u8]) -> f64 {
        levels.iter().map(|&level| f64::from(1u32 << level)).sum::<f64>() / levels.len() as f64
    }

    #[test]
    fn certain_tiles_get_the_fewest_where_others_need_the_rest() {
        let lit = codes(|_| SAMPLES, 0);
        let dark = codes(|_| 0, 1);
        let between = codes(|slot| 1 + slot as u32 % 3, 2);
        let levels = levels(&[lit, dark, between].concat(), 5);
        assert_eq!(levels[..2 * TILE_PIXELS], [0; 2 * TILE_PIXELS]);
        assert!(mean(&levels[2 * TILE_PIXELS..]) > 7.0, "{levels:?}");
        assert!((3.7..=4.0).contains(&mean(&levels)), "{}", mean(&levels));
    }

    #[test]
    fn pixels_that_are_alike_share_the_mean() {
        for lit in 0..=SAMPLES {
            let codes: Vec<u16> = (0..64).flat_map(|tile| codes(|_| lit, tile)).collect();
            let levels = levels(&codes, 5);
            let mean = mean(&levels);
            assert!(mean <= 4.0 && mean > if lit % SAMPLES == 0 { 1.0 } else { 3.8 }, "{mean}");
        }
    }

    /// Neighbours count, so one lit pixel among dark ones is not taken for certain.
    #[test]
    fn agreement_is_not_certainty() {
        let alone = codes(|slot| if slot == 27 { SAMPLES } else { 0 }, 0);
        let lit = codes(|_| SAMPLES, 0);
        assert!(i32::from(alone[27]) > i32::from(lit[27]) + CODES_PER_LEVEL);
        assert!(i32::from(alone[28]) > i32::from(alone[63]) + CODES_PER_LEVEL);
        assert!(lit.iter().all(|&code| code > UNREACHED));
    }

    #[test]
    fn the_mean_and_the_most_hold() {
        let between = codes(|slot| slot as u32 % (SAMPLES + 1), 0);
        for top in 2..6 {
            let levels = levels(&between, top);
            assert!(mean(&levels) <= 4.0 && levels.iter().all(|&l| u32::from(l) <= top));
        }
        let nothing = PilotSums::default();
        let dark = nothing.codes(&SEES, SAMPLES, (0, 0));
        assert_eq!(dark, [UNREACHED; TILE_PIXELS]);
        assert_eq!(levels(&dark, 5), [0; TILE_PIXELS]);
        let unseen = nothing.codes(&[false; TILE_PIXELS], SAMPLES, (0, 0));
        assert_eq!(unseen, [UNSEEN; TILE_PIXELS]);
    }

    /// The codes follow the logarithm.
    #[test]
    fn codes_are_logarithms() {
        for step in 0..400 {
            let uncertainty = 1e-5 * 1.05f64.powi(step);
            let expected = f64::from(code(1.0)) + 128.0 * uncertainty.log2();
            assert!((f64::from(code(uncertainty)) - expected).abs() <= 12.5, "{uncertainty}");
            assert_eq!(code(4.0 * uncertainty) - code(uncertainty), CODES_PER_FOURFOLD as u16);
        }
    }
}

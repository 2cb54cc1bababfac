//! Where samples come from: point sets of the unit square, one for each pixel and use, and their
//! catalogue.

mod independent;
mod sobol;
mod stratified;

use crate::{Error, Result};
use std::ops::Range;

/// One kind of point sets.
#[derive(Debug)]
pub struct SamplerEntry {
    /// As typed after `--sampler` and as in reports.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Writes the points asked for, both coordinates in `[0, 1)`, and anything in that range behind
    /// them. A function of the request and of nothing else, so images do not depend on the order of
    /// the work.
    fill: fn(&Request, u: &mut [f32], v: &mut [f32]),
    /// As `fill` for whole blocks of few points, at most [`MOST_TOGETHER`] in all, those of each request
    /// right behind those of the one before.
    fill_blocks: fn(&[Request], u: &mut [f32], v: &mut [f32]),
}

/// Most points of several blocks that are asked for together.
pub const MOST_TOGETHER: usize = 64;

/// What points a sampler is asked for: those from `start` on of block `block` of the set that `key`
/// names, each of whose blocks has `count` points.
#[derive(Clone, Copy, Default)]
struct Request {
    key: u64,
    block: u32,
    count: u32,
    start: u32,
}

impl Request {
    /// Index in the set of the first point.
    fn first(&self) -> u32 {
        self.block * self.count + self.start
    }
}

impl PartialEq for SamplerEntry {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// All samplers, the default first.
pub static SAMPLERS: &[&SamplerEntry] = &[&sobol::ENTRY, &stratified::ENTRY, &independent::ENTRY];

impl SamplerEntry {
    /// The default: Owen-scrambled Sobol points.
    pub fn sobol() -> &'static Self {
        &sobol::ENTRY
    }

    /// The sampler called `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] with the names that there are.
    pub fn find(name: &str) -> Result<&'static Self> {
        SAMPLERS.iter().copied().find(|s| s.name == name).ok_or_else(|| {
            let names: Vec<_> = SAMPLERS.iter().map(|s| s.name).collect();
            Error::Usage(format!("no sampler {name:?}: choose from {}", names.join(", ")))
        })
    }
}

/// What a pair of sample coordinates is for. Each user draws from points of its own, so that what
/// one of them does never shows in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Position of the camera ray in its pixel.
    Camera,
    /// Direction of a finite ambient-occlusion ray.
    AmbientOcclusion,
    /// Direction of an unbounded ambient-occlusion ray.
    AmbientOcclusionUnbounded,
    /// Point on the light of this index in the scene.
    Light(usize),
}

impl Dimension {
    fn id(self) -> u64 {
        match self {
            Self::Camera => 0,
            Self::AmbientOcclusion => 1,
            Self::AmbientOcclusionUnbounded => 2,
            Self::Light(light) => 16 + light as u64,
        }
    }
}

/// Points of the unit square, coordinate by coordinate.
///
/// There is room for a multiple of [`Points::LANES`] of them: loops over whole vectors need no
/// remainder. What lies behind the last means nothing.
#[derive(Clone, Debug, Default)]
pub struct Points {
    u: Vec<f32>,
    v: Vec<f32>,
    len: usize,
}

impl Points {
    /// Points come in multiples of so many.
    pub const LANES: usize = 8;

    /// These points.
    pub fn of(points: &[[f32; 2]]) -> Self {
        let mut all = Self::default();
        all.resize(points.len());
        for (index, [u, v]) in points.iter().enumerate() {
            (all.u[index], all.v[index]) = (*u, *v);
        }
        all
    }

    fn resize(&mut self, len: usize) {
        self.resize_in(len, Self::LANES);
    }

    /// With room for a multiple of `lanes`.
    fn resize_in(&mut self, len: usize, lanes: usize) {
        let room = len.next_multiple_of(lanes);
        self.u.resize(room, 0.0);
        self.v.resize(room, 0.0);
        self.len = len;
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Point `index`.
    pub fn get(&self, index: usize) -> [f32; 2] {
        [self.u[index], self.v[index]]
    }

    /// Both coordinates of all points and of what lies behind them.
    #[inline(always)]
    pub(super) fn coordinates(&self) -> (&[f32], &[f32]) {
        (&self.u, &self.v)
    }
}

/// The samples of one pixel: a function of sampler, seed, pixel, dimension and sample index and of
/// nothing else.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    entry: &'static SamplerEntry,
    key: u64,
}

impl PixelSampler {
    /// The sampler of pixel `(x, y)`, counted from the upper left corner.
    pub fn new(entry: &'static SamplerEntry, seed: u64, x: u32, y: u32) -> Self {
        Self { entry, key: mix(mix(seed) ^ (u64::from(y) << 32 | u64::from(x))) }
    }

    /// Makes `points` those of indices `range` in block `block` of a dimension, whose blocks have
    /// `count` points. Points of a block are spread well together; so are those of a power of two of
    /// blocks of Sobol points. In what order they come is the sampler's: the first ones of a block are
    /// spread no better than any.
    pub fn fill(
        &self,
        dimension: Dimension,
        [block, count]: [u32; 2],
        range: Range<u32>,
        points: &mut Points,
    ) {
        points.resize(range.len());
        let key = self.key ^ mix(dimension.id() << 32);
        let request = Request { key, block, count, start: range.start };
        (self.entry.fill)(&request, &mut points.u, &mut points.v);
    }

    /// Makes `points` those of one block of each of several samplers of one kind, [`MOST_TOGETHER`] at
    /// most, those of each right behind those of the one before; with each comes how many points its
    /// blocks have. There is room for all that can be asked for.
    pub(super) fn fill_blocks<'a>(
        samplers: impl Iterator<Item = (&'a Self, u32)>,
        dimension: Dimension,
        block: u32,
        points: &mut Points,
    ) {
        let of_dimension = mix(dimension.id() << 32);
        let (mut requests, mut used) = ([Request::default(); MOST_TOGETHER], 0);
        let (mut len, mut entry) = (0, None);
        for (sampler, count) in samplers.filter(|(_, count)| *count > 0) {
            let key = sampler.key ^ of_dimension;
            requests[used] = Request { key, block, count, start: 0 };
            used += 1;
            len += count as usize;
            entry = Some(sampler.entry);
        }
        assert!(len <= MOST_TOGETHER);
        points.resize_in(len, MOST_TOGETHER);
        if let Some(entry) = entry {
            (entry.fill_blocks)(&requests[..used], &mut points.u[..len], &mut points.v[..len]);
        }
    }

    /// The first `count` points of a dimension.
    pub fn points(&self, dimension: Dimension, count: u32) -> Points {
        let mut points = Points::default();
        self.fill(dimension, [0, count], 0..count, &mut points);
        points
    }
}

/// [`SamplerEntry::fill_blocks`] block by block.
fn block_by_block(
    fill: fn(&Request, &mut [f32], &mut [f32]),
    requests: &[Request],
    mut u: &mut [f32],
    mut v: &mut [f32],
) {
    for request in requests {
        let (own_u, others) = std::mem::take(&mut u).split_at_mut(request.count as usize);
        u = others;
        let (own_v, others) = std::mem::take(&mut v).split_at_mut(request.count as usize);
        v = others;
        fill(request, own_u, own_v);
    }
}

/// A bijection of 64-bit words in which every input bit moves every output bit: the finaliser of
/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
#[inline(always)]
pub(crate) fn mix(word: u64) -> u64 {
    let z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in `[0, 1)` from the 24 highest bits of a word.
#[inline(always)]
fn unit(word: u32) -> f32 {
    (word >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(name: &str, seed: u64, pixel: [u32; 2], dimension: Dimension, count: u32) -> Points {
        let entry = SamplerEntry::find(name).unwrap();
        PixelSampler::new(entry, seed, pixel[0], pixel[1]).points(dimension, count)
    }

    /// How many of the points lie in each cell of a grid.
    fn cells(points: &Points, columns: usize, rows: usize) -> Vec<u32> {
        let mut seen = vec![0; columns * rows];
        for index in 0..points.len() {
            let [u, v] = points.get(index);
            seen[(u * columns as f32) as usize * rows + (v * rows as f32) as usize] += 1;
        }
        seen
    }

    /// Every elementary interval of area 1/n holds exactly one of the first n Sobol points.
    #[test]
    fn sobol_points_are_stratified_in_every_pixel() {
        for pixel in [[0, 0], [1, 0], [0, 1], [1919, 1079]] {
            for dimension in [Dimension::Camera, Dimension::Light(0), Dimension::Light(3)] {
                let points = points("sobol", 7, pixel, dimension, 16);
                for log_columns in 0..=4 {
                    let seen = cells(&points, 1 << log_columns, 1 << (4 - log_columns));
                    assert_eq!(seen, [1; 16], "pixel {pixel:?}, {dimension:?}, {log_columns}");
                }
            }
        }
    }

    #[test]
    fn stratified_points_have_a_cell_each() {
        for (count, columns) in [(1, 1), (4, 2), (6, 2), (7, 1), (16, 4), (48, 6)] {
            let points = points("stratified", 3, [5, 6], Dimension::Light(1), count);
            let seen = cells(&points, columns, count as usize / columns);
            assert_eq!(seen, vec![1; count as usize], "{count}");
        }
    }

    /// Moments of many points, and their correlation.
    #[test]
    fn points_are_uniform() {
        for sampler in SAMPLERS {
            let points = points(sampler.name, 1, [0, 0], Dimension::AmbientOcclusion, 1 << 17);
            let mean = |f: &dyn Fn(f64, f64) -> f64| {
                let of = |i| points.get(i).map(f64::from);
                (0..points.len()).map(|i| f(of(i)[0], of(i)[1])).sum::<f64>() / points.len() as f64
            };
            let name = sampler.name;
            for (value, expected) in [
                (mean(&|u, _| u), 0.5),
                (mean(&|_, v| v), 0.5),
                (mean(&|u, _| u * u), 1.0 / 3.0),
                (mean(&|_, v| v * v), 1.0 / 3.0),
                (mean(&|u, v| u * v), 0.25),
            ] {
                // Five standard deviations of independent points.
                assert!((value - expected).abs() < 5.0 * 0.3 / 362.0, "{name}: {value}");
            }
            let inside = |x: f32| (0.0..1.0).contains(&x);
            assert!((0..points.len()).all(|i| points.get(i).into_iter().all(inside)), "{name}");
        }
    }

    #[test]
    fn keys_are_told_apart() {
        for sampler in SAMPLERS {
            let first = |seed, pixel, d| points(sampler.name, seed, pixel, d, 1).get(0);
            let ao = Dimension::AmbientOcclusion;
            let base = first(1, [2, 3], ao);
            assert_eq!(base, first(1, [2, 3], ao));
            for other in
                [first(2, [2, 3], ao), first(1, [3, 2], ao), first(1, [2, 3], Dimension::Camera)]
            {
                assert_ne!(base, other, "{}", sampler.name);
            }
        }
    }

    #[test]
    fn blocks_together_are_as_blocks_alone() {
        for sampler in SAMPLERS {
            let pixel = |x: u32| PixelSampler::new(sampler, 5, x, 9);
            let counts_of = |all: &[u32]| all.iter().copied().cycle().take(16).collect::<Vec<_>>();
            for counts in [counts_of(&[1]), counts_of(&[4]), counts_of(&[2, 0, 3, 8, 1])] {
                let all: Vec<_> = (0..16).map(pixel).collect();
                for (dimension, block) in [(Dimension::Light(2), 0), (Dimension::Camera, 70_000)] {
                    let (mut together, mut alone) = (Points::default(), Points::default());
                    let asked = all.iter().zip(counts.iter().copied());
                    PixelSampler::fill_blocks(asked.clone(), dimension, block, &mut together);
                    let mut place = 0;
                    for (pixel, count) in asked {
                        pixel.fill(dimension, [block, count], 0..count, &mut alone);
                        for index in 0..count as usize {
                            assert_eq!(together.get(place), alone.get(index), "{}", sampler.name);
                            place += 1;
                        }
                    }
                    assert_eq!(together.len(), place);
                }
            }
        }
    }

    /// Blocks go on where the one before ended, beyond the length of a sequence, too.
    #[test]
    fn blocks_are_parts_of_one_set() {
        let pixel = PixelSampler::new(SamplerEntry::sobol(), 0, 0, 0);
        let all = pixel.points(Dimension::Camera, (1 << 16) + 24);
        let sorted = |points: &Points, range: Range<usize>| {
            let mut points: Vec<_> = range.map(|i| points.get(i).map(f32::to_bits)).collect();
            points.sort_unstable();
            points
        };
        let mut block = Points::default();
        for index in [0, 1, (1 << 13) - 1, 1 << 13, (1 << 13) + 2] {
            pixel.fill(Dimension::Camera, [index, 8], 0..8, &mut block);
            let place = index as usize * 8;
            assert_eq!(sorted(&block, 0..8), sorted(&all, place..place + 8), "block {index}");
        }
        for sampler in SAMPLERS {
            let pixel = PixelSampler::new(sampler, 0, 1, 0);
            let (mut all, mut part) = (Points::default(), Points::default());
            for (count, range) in [(20, 0..7u32), (20, 7..20), (20, 19..20), (16, 3..13)] {
                pixel.fill(Dimension::Camera, [3, count], 0..count, &mut all);
                pixel.fill(Dimension::Camera, [3, count], range.clone(), &mut part);
                let of_all: Vec<_> = range.map(|i| all.get(i as usize)).collect();
                let of_part: Vec<_> = (0..part.len()).map(|i| part.get(i)).collect();
                assert_eq!(of_part, of_all, "{}", sampler.name);
            }
        }
        assert_ne!(all.get(5), all.get((1 << 16) + 5));
    }
}

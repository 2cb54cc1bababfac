//! Samples of a light, many at a time.

use super::sampler::{MOST_TOGETHER, Points};
use crate::ray::Ray;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// What many samples of a light bring, number by number, as [`LightSample`](super::soft_shadow::LightSample)
/// says.
#[derive(Clone, Debug, Default)]
pub struct LightSamples {
    directions: [Vec<f32>; 3],
    weights: Vec<f32>,
}

impl LightSamples {
    /// Weight of each sample, and of what lies behind them: see [`Points`].
    #[inline]
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Direction of sample `index`.
    pub(super) fn direction(&self, index: usize) -> Vec3 {
        let [x, y, z] = &self.directions;
        Vec3::new(x[index], y[index], z[index])
    }

    /// Room for so many samples.
    pub(super) fn resize(&mut self, len: usize) {
        self.directions.iter_mut().for_each(|d| d.resize(len, 0.0));
        self.weights.resize(len, 0.0);
    }

    /// Adds the rays of some samples as `ray` makes them, and their weights; those of weight 0 only
    /// if `weightless`.
    pub fn add_rays(
        &self,
        samples: Range<usize>,
        weightless: bool,
        ray: impl Fn(Vec3) -> Ray,
        rays: &mut Vec<Ray>,
        weights: &mut Vec<f32>,
    ) {
        let (first, first_weight) = (rays.len(), weights.len());
        let [x, y, z] = self.directions.each_ref().map(|d| &d[samples.clone()]);
        rays.extend(x.iter().zip(y).zip(z).map(|((x, y), z)| ray(Vec3::new(*x, *y, *z))));
        let added = &self.weights[samples.clone()];
        weights.extend_from_slice(added);
        if weightless || !added.contains(&0.0) {
            return;
        }
        let (own, own_weights) = (&mut rays[first..], &mut weights[first_weight..]);
        let mut kept = 0;
        for index in 0..samples.len() {
            (own[kept], own_weights[kept]) = (own[index], own_weights[index]);
            kept += usize::from(own_weights[kept] != 0.0);
        }
        rays.truncate(first + kept);
        weights.truncate(first_weight + kept);
    }

    /// Sets direction and weight of each point, by a function that does not branch.
    #[inline(always)]
    pub(super) fn set(&mut self, points: &Points, of: impl Fn([f64; 2]) -> (DVec3, f32)) {
        let (u, v) = points.coordinates();
        let all = self.directions.each_mut().map(Vec::as_mut_slice);
        set(
            u.len().min(v.len()),
            all,
            &mut self.weights,
            #[inline(always)]
            |i| of([f64::from(u[i]), f64::from(v[i])]),
        );
    }

    /// As [`set`](Self::set), in steps: each hands its numbers to the next, for some points at a time.
    /// What takes long for one point is then many short loops, whose turns processors overlap. Each
    /// step is told a point's place in its block of [`BLOCK`].
    #[inline(always)]
    pub(super) fn set_in_steps(
        &mut self,
        points: &Points,
        first: impl Fn(usize, [f64; 2]) -> Numbers,
        steps: impl Fn(&mut Steps),
        last: impl Fn(usize, Numbers) -> (DVec3, f32),
    ) {
        let (u, v) = points.coordinates();
        // Closures may read memory: what is written meanwhile is plainly none of it, or no loop would
        // become vector code.
        let mut block = Steps::default();
        let (mut directions, mut weights) = ([[0.0; BLOCK]; 3], [0.0; BLOCK]);
        in_blocks(
            u.len(),
            #[inline(always)]
            |range, len| {
                block.len = len;
                let (u, v) = (&u[range.clone()], &v[range.clone()]);
                block.next(
                    #[inline(always)]
                    |i, _| first(i, [f64::from(u[i]), f64::from(v[i])]),
                );
                steps(&mut block);
                let [x, y, z] = &mut directions;
                set(
                    len,
                    [&mut x[..len], &mut y[..len], &mut z[..len]],
                    &mut weights[..len],
                    #[inline(always)]
                    |i| last(i, block.get(i)),
                );
                for (all, own) in self.directions.iter_mut().zip(&directions) {
                    all[range.clone()].copy_from_slice(&own[..len]);
                }
                self.weights[range].copy_from_slice(&weights[..len]);
            },
        );
    }
}

/// Does `work` for blocks of [`BLOCK`], and for what is left: of so many, those of a range, as many as it
/// is also told. Compiled once for whole blocks, in which no index can be out of bounds.
#[inline(always)]
pub(super) fn in_blocks(count: usize, mut work: impl FnMut(Range<usize>, usize)) {
    let whole = count - count % BLOCK;
    for start in (0..whole).step_by(BLOCK) {
        work(start..start + BLOCK, BLOCK);
    }
    if whole < count {
        work(whole..count, (count - whole).min(BLOCK));
    }
}

/// Direction and weight of each index.
#[inline(always)]
fn set(
    len: usize,
    [x, y, z]: [&mut [f32]; 3],
    weights: &mut [f32],
    of: impl Fn(usize) -> (DVec3, f32),
) {
    let (x, y, z, weights) = (&mut x[..len], &mut y[..len], &mut z[..len], &mut weights[..len]);
    for i in 0..len {
        let (direction, weight) = of(i);
        (x[i], y[i], z[i]) = (direction.x as f32, direction.y as f32, direction.z as f32);
        weights[i] = weight;
    }
}

/// Points that take a step together: their numbers stay in the nearest cache.
pub(super) const BLOCK: usize = MOST_TOGETHER;

/// What a point has from one step to the next.
pub(super) type Numbers = [f64; 4];

/// Points between steps.
#[derive(Clone, Debug)]
pub(super) struct Steps {
    rows: [[f64; BLOCK]; 4],
    len: usize,
}

impl Default for Steps {
    fn default() -> Self {
        Self { rows: [[0.0; BLOCK]; 4], len: 0 }
    }
}

impl Steps {
    /// Does the next step for all points.
    #[inline(always)]
    pub(super) fn next(&mut self, of: impl Fn(usize, Numbers) -> Numbers) {
        let len = self.len.min(BLOCK);
        let [a, b, c, d] = &mut self.rows;
        let (a, b, c, d) = (&mut a[..len], &mut b[..len], &mut c[..len], &mut d[..len]);
        for i in 0..len {
            [a[i], b[i], c[i], d[i]] = of(i, [a[i], b[i], c[i], d[i]]);
        }
    }

    #[inline(always)]
    fn get(&self, index: usize) -> Numbers {
        let [a, b, c, d] = &self.rows;
        [a[index], b[index], c[index], d[index]]
    }
}

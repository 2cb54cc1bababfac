//! Triangles that have lately stopped many rays, tried before the tree.
//!
//! Neighbouring tiles see the same large occluders. A triangle is tested against a group of rays at
//! once, at a fraction of what one of them costs in the tree, so it pays to try a few first as long
//! as they keep stopping some: each has a score, the share of rays that it stopped lately, and goes
//! when that falls. Occluders are kept for each stratum of rays, such as those of one light, and each
//! octant of directions. What is tried first changes no answer.

use super::recent::Recent;
use crate::tree::ChildRef;

/// Occluders that are tried for each octant.
const TRIED: usize = 4;

/// Testing a triangle costs a hundredth of what its rays cost in the tree, but those that it stops would
/// often have met something soon: with a third of this, some pictures took longer than without.
const LEAST_SCORE: f32 = 0.06;

/// Rays of one group that a triangle must stop at once to be remembered.
const LEAST_HITS: u32 = 2;

/// One over each number of rays: quotients take long.
static ONE_OVER: [f32; 65] = {
    let mut all = [0.0; 65];
    let mut number = 1;
    while number < 65 {
        all[number] = 1.0 / number as f32;
        number += 1;
    }
    all
};

/// A triangle, by its place in a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Occluder {
    /// The number of the tree, and its leaf.
    leaf: (u32, ChildRef),
    triangle: usize,
    /// Share of the rays tested lately that it stopped; negative for an empty place.
    score: f32,
}

/// Those of one tree, or of several that belong together.
pub(super) struct Occluders {
    of_octants: [[Occluder; TRIED]; 8],
    /// Likewise, of rays that come alone.
    recent: [Recent; 8],
    /// Of which tree: see [`Bvh8::id`](crate::tree::Bvh8).
    tree: u64,
    /// Whether any are kept.
    is_kept: bool,
    /// Rays stopped.
    stopped: u64,
}

impl Occluders {
    const NONE: Occluder = Occluder { leaf: (0, ChildRef::UNUSED), triangle: 0, score: -1.0 };

    /// None yet; nor later, unless they are to be kept.
    pub(super) const fn new(is_kept: bool) -> Self {
        Self {
            of_octants: [[Self::NONE; TRIED]; 8],
            recent: [const { Recent::NONE }; 8],
            tree: 0,
            is_kept,
            stopped: 0,
        }
    }

    /// Forgets those of another tree.
    pub(super) fn of_tree(&mut self, tree: u64) -> &mut Self {
        if self.tree != tree {
            *self = Self { tree, ..Self::new(self.is_kept) };
        }
        self
    }

    /// Rays that they have stopped since this was asked last.
    pub(super) fn stopped_since(&mut self) -> u64 {
        std::mem::take(&mut self.stopped)
    }

    /// What is tried first on a ray of that octant which comes alone, if it pays.
    #[inline(always)]
    pub(super) fn recent(&mut self, octant: u8) -> Option<&mut Recent> {
        let recent = &mut self.recent[usize::from(octant & 7)];
        (self.is_kept && recent.are_worth_it()).then_some(recent)
    }

    /// Tries all on some rays, a bit each, and returns those that are stopped. `stops` tells which
    /// rays a triangle stops.
    #[inline(always)]
    pub(super) fn stopped(
        &mut self,
        octant: u8,
        rays: u64,
        mut stops: impl FnMut((u32, ChildRef), usize, u64) -> u64,
    ) -> u64 {
        let mut left = rays;
        for occluder in &mut self.of_octants[usize::from(octant & 7)] {
            if occluder.score < 0.0 || left == 0 {
                continue;
            }
            let hits = stops(occluder.leaf, occluder.triangle, left);
            let share = hits.count_ones() as f32 * ONE_OVER[left.count_ones() as usize];
            occluder.score += (share - occluder.score) * 0.125;
            if occluder.score < LEAST_SCORE {
                *occluder = Self::NONE;
            }
            left &= !hits;
        }
        self.stopped += u64::from((rays & !left).count_ones());
        rays & !left
    }

    /// A triangle stopped `hits` of a group of rays, which the occluders had let pass.
    #[inline(always)]
    pub(super) fn note(&mut self, octant: u8, leaf: (u32, ChildRef), triangle: usize, hits: u64) {
        let hits = hits.count_ones();
        if hits >= LEAST_HITS && self.is_kept {
            self.remember(octant, Occluder { leaf, triangle, score: hits as f32 / 32.0 });
        }
    }

    #[inline(never)]
    fn remember(&mut self, octant: u8, new: Occluder) {
        let known = &mut self.of_octants[usize::from(octant & 7)];
        let same =
            |o: &Occluder| (o.leaf, o.triangle) == (new.leaf, new.triangle) && o.score >= 0.0;
        if known.iter().any(same) {
            return;
        }
        let least = known.iter_mut().min_by(|a, b| a.score.total_cmp(&b.score));
        if let Some(least) = least.filter(|least| least.score < new.score) {
            *least = new;
        }
    }
}

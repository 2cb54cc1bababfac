//! Triangles that have lately stopped single rays, tried before the tree.
//!
//! As [`occluders`](super::occluders) for rays that come alone: eight triangles are tested at once, which takes
//! as long as a leaf, so it pays where they stop one ray in ten. How many they do is measured all the
//! time, and from time to time where they are not tried.

use super::leaf::{Facets, Lines, test};
use super::simd::{LANES, Simd};
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS};

/// They are tried as long as they stop so many.
const LEAST_SHARE: f32 = 0.1;

/// One ray in so many is tried and learned from in any case.
const PROBE: u32 = 32;

/// Triangles of one octant of directions, as they lie in a leaf of eight.
#[derive(Clone)]
pub(super) struct Recent {
    rows: [[f32; LANES]; LEAF_ROWS],
    /// How many there are.
    known: usize,
    /// Whose place the next one takes.
    next: usize,
    /// Share of the rays tried lately that one of them stopped.
    share: f32,
    /// Rays that have come by.
    rays: u32,
}

impl Recent {
    /// None are known. Of NaN no comparison holds.
    pub(super) const NONE: Self =
        Self { rows: [[f32::NAN; LANES]; LEAF_ROWS], known: 0, next: 0, share: 0.5, rays: 0 };

    /// Whether they are to be tried on the next ray, and learn from it.
    #[inline(always)]
    pub(super) fn are_worth_it(&mut self) -> bool {
        self.rays = self.rays.wrapping_add(1);
        self.share > LEAST_SHARE || self.rays.is_multiple_of(PROBE)
    }

    /// How many there are.
    pub(super) fn known(&self) -> usize {
        self.known
    }

    /// Whether one of them stops a ray for certain.
    #[inline(always)]
    pub(super) fn stop<S: Simd>(&mut self, s: S, lines: &Lines<S>) -> bool {
        let rows = &self.rows;
        let facets = Facets {
            corner: [s.load(&rows[0]), s.load(&rows[1]), s.load(&rows[2])],
            first: [s.load(&rows[3]), s.load(&rows[4]), s.load(&rows[5])],
            second: [s.load(&rows[6]), s.load(&rows[7]), s.load(&rows[8])],
            normal: [s.load(&rows[9]), s.load(&rows[10]), s.load(&rows[11])],
            height: s.load(&rows[12]),
        };
        let hit = test(s, &facets, lines).hits & ((1 << LANES) - 1) != 0;
        self.share += (f32::from(u8::from(hit)) - self.share) * (1.0 / 32.0);
        hit
    }

    /// A triangle of a leaf has stopped a ray that they let pass.
    #[inline(always)]
    pub(super) fn remember(&mut self, tree: &Bvh8, leaf: ChildRef, triangle: usize) {
        let slots = leaf.leaf_slots();
        let block = &tree.leaves[slots.start * LEAF_ROWS + triangle..];
        for (row, numbers) in self.rows.iter_mut().zip(block.iter().step_by(slots.len())) {
            row[self.next] = *numbers;
        }
        self.next = (self.next + 1) % LANES;
        self.known = (self.known + 1).min(LANES);
    }
}

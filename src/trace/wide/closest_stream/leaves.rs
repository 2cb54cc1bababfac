//! What rays do in leaves: test triangles, or go on through the tree of a part.

use super::best::Best;
use super::{Stream, TwoLevel};
use crate::trace::wide::group::{facet_of, groups_of, lines_of, of_group};
use crate::trace::wide::leaf::{crossings, facets_of, one_of};
use crate::trace::wide::rays::Bits;
use crate::trace::wide::simd::{LANES, Simd, Wide};
use crate::tree::{Bvh8, ChildRef};

/// A tree, and what is done in its leaves.
pub(super) trait Leaves {
    fn tree(&self) -> &Bvh8;

    /// What rays meet in a leaf at this depth.
    fn visit<S: Simd, W: Wide>(
        &self,
        s: S,
        w: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        here: Bits,
        level: u16,
    );

    /// What one ray meets in a leaf.
    fn visit_alone<S: Simd, W: Wide>(
        &self,
        s: S,
        w: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        index: usize,
    );
}

/// Triangles are in the leaves.
pub(super) struct InLeaf<'a>(pub(super) &'a Bvh8);

impl Leaves for InLeaf<'_> {
    #[inline(always)]
    fn tree(&self) -> &Bvh8 {
        self.0
    }

    #[inline(always)]
    fn visit<S: Simd, W: Wide>(
        &self,
        s: S,
        w: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        here: Bits,
        _: u16,
    ) {
        stream.leaf(s, w, self.0, leaf, here);
    }

    #[inline(always)]
    fn visit_alone<S: Simd, W: Wide>(
        &self,
        s: S,
        _: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        index: usize,
    ) {
        stream.leaf_of_ray(s, self.0, leaf, index);
    }
}

/// Trees are in the leaves.
pub(super) struct InPart<'a>(pub(super) &'a dyn TwoLevel);

impl Leaves for InPart<'_> {
    #[inline(always)]
    fn tree(&self) -> &Bvh8 {
        self.0.top()
    }

    #[inline(always)]
    fn visit<S: Simd, W: Wide>(
        &self,
        s: S,
        w: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        here: Bits,
        level: u16,
    ) {
        for slot in leaf.leaf_slots() {
            let part = self.0.part(self.0.top().triangle_ids[slot] as usize);
            stream.visit_part(s, w, part, here, level);
        }
    }

    #[inline(always)]
    fn visit_alone<S: Simd, W: Wide>(
        &self,
        s: S,
        w: W,
        stream: &mut Stream<'_, '_>,
        leaf: ChildRef,
        index: usize,
    ) {
        for slot in leaf.leaf_slots() {
            let part = self.0.part(self.0.top().triangle_ids[slot] as usize);
            stream.visit_part_alone(s, w, part, index);
        }
    }
}

impl Stream<'_, '_> {
    #[inline(always)]
    fn leaf<S: Simd, W: Wide>(&mut self, s: S, w: W, tree: &Bvh8, leaf: ChildRef, mut here: Bits) {
        let triangles = leaf.leaf_slots().len() as u32;
        if here.count_ones() > w.groups(here).count_ones() * triangles {
            for group in groups_of(w, here) {
                self.leaf_of_group(w, tree, leaf, group, of_group::<W>(here, group));
            }
            return;
        }
        while here != 0 {
            let index = here.trailing_zeros() as usize;
            here &= here - 1;
            self.leaf_of_ray(s, tree, leaf, index);
        }
    }

    #[inline(always)]
    fn leaf_of_group<W: Wide>(
        &mut self,
        w: W,
        tree: &Bvh8,
        leaf: ChildRef,
        group: usize,
        here: u64,
    ) {
        let slots = leaf.leaf_slots();
        for triangle in 0..slots.len() {
            let lines = lines_of(w, self.rays, group);
            let crossings = crossings(w, &facet_of(w, tree, leaf, triangle), &lines);
            let mut left = crossings.certain.not_misses & here;
            if left == 0 {
                continue;
            }
            let ([lower, upper], bounded) = crossings.distances(w, &lines);
            let [lowers, uppers] = &mut self.memory.bounds;
            w.store(lowers, group, lower);
            w.store(uppers, group, upper);
            let certain = crossings.certain.hits & bounded;
            let id = tree.triangle_ids[slots.start + triangle];
            while left != 0 {
                let lane = left.trailing_zeros();
                left &= left - 1;
                let index = group * W::GROUP + lane as usize;
                let [lowers, uppers] = &self.memory.bounds;
                let candidate =
                    Best { triangle: id, lower: lowers.0[index], upper: uppers.0[index] };
                self.consider(index, candidate, certain >> lane & 1 != 0);
            }
        }
    }

    #[inline(always)]
    fn leaf_of_ray<S: Simd>(&mut self, s: S, tree: &Bvh8, leaf: ChildRef, index: usize) {
        let lines = one_of(s, self.rays, index);
        let crossings = crossings(s, &facets_of(s, tree, leaf), &lines);
        let ids = &tree.triangle_ids[leaf.leaf_slots()];
        let mut left = crossings.certain.not_misses & ((1 << ids.len()) - 1);
        if left == 0 {
            return;
        }
        let ([lower, upper], bounded) = crossings.distances(s, &lines);
        let (mut lowers, mut uppers) = ([0.0; LANES], [0.0; LANES]);
        s.store(&mut lowers, lower);
        s.store(&mut uppers, upper);
        let certain = crossings.certain.hits & bounded;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let candidate = Best { triangle: ids[lane], lower: lowers[lane], upper: uppers[lane] };
            self.consider(index, candidate, certain >> lane & 1 != 0);
        }
    }
}

//! The closest hits of up to 128 rays, which go through the tree together.
//!
//! Each node is visited once for all rays that meet it, its children in the order in which the first of
//! these rays enters them; a ray sits out a subtree that it enters beyond the hit that it has.
//!
//! # Answers are those of [`closest`]
//!
//! What is a hit, and at which distance, [`PreparedRay::triangle`] says. It is asked late: of most
//! triangles the vector test knows that they are hit, and between which bounds the distance lies, and
//! that is enough to drop what lies beyond. So a ray's best triangle is one that is certain to be no
//! farther than its upper bound, the scalar test is asked where bounds of two triangles overlap or the
//! vector test doubts, and of the best one in the end.
//!
//! Nothing is dropped that may be the answer. The lower bound is one of the distance in the plane,
//! rounded or not, and the scalar test reports no earlier one; so a triangle that is dropped, whose lower
//! bound lies beyond the best one's upper, or whose box is entered beyond it, is farther than the best
//! one, if that is what it was taken for. This is looked at when the scalar test is asked of it: a ray
//! whose best triangle is no hit, or one beyond its bound, starts again on its own. A best triangle
//! that was replaced unasked needs no such look, as what it made to be dropped lies beyond its own lower
//! bound and so beyond its successor's upper one. Of the same distance nothing is dropped, so ties go
//! to the lower index.

mod best;
mod leaves;

use super::closest;
use super::group::{entries_by_group, groups_of, of_group};
use super::one_ray::OneRay;
use super::rays::{Bits, Rays, Row, STREAM};
use super::simd::{LANES, Simd, Wide};
use super::stream::{ACTIVE_IN_NODE, prefetch};
use super::{Structure, TwoLevel};
use crate::intersect::HitLanes;
use crate::ray::Hit;
use crate::tree::{Bvh8, ChildRef, MAX_WIDE_DEPTH, Node8, WIDTH};
use best::Best;
use leaves::{InLeaf, InPart, Leaves};

/// A subtree to visit.
#[derive(Clone, Copy)]
struct Pending {
    child: ChildRef,
    /// Its depth, and its place in the node above: where rays enter its box is in that row.
    level: u16,
    slot: u16,
    /// The rays that meet its box, the lower half and the upper one: it is moved about.
    rays: [u64; 2],
    /// Where one of them enters it.
    entry: f32,
}

/// Memory of a stream at work.
pub(super) struct Memory {
    pending: Vec<Pending>,
    /// For each depth and place among siblings where rays enter the box: nodes on the way down are
    /// visited one at each depth.
    entries: Vec<[Row; WIDTH]>,
    best: [Best; STREAM],
    /// Rays to start again, one bit each.
    misled: Bits,
    /// Of the rays of a group.
    bounds: [Row; 2],
    /// Hits to be confirmed.
    lanes: HitLanes,
    /// Of one ray.
    path: Vec<(ChildRef, f32)>,
}

impl Memory {
    pub(super) const EMPTY: Self = Self {
        pending: Vec::new(),
        entries: Vec::new(),
        best: [Best::NONE; STREAM],
        misled: 0,
        bounds: [Row::ZERO; 2],
        lanes: HitLanes::ZERO,
        path: Vec::new(),
    };
}

/// Hands the hit of each ray that has one to `found`, with its number in the stream.
#[inline(always)]
pub(super) fn closest_hits<S: Simd, W: Wide>(
    s: S,
    w: W,
    structure: Structure<'_>,
    rays: &mut Rays<'_>,
    memory: &mut Memory,
    mut found: impl FnMut(usize, Hit),
) {
    memory.best = [Best::NONE; STREAM];
    memory.misled = 0;
    memory.pending.clear();
    memory.path.clear();
    let all = rays.valid;
    let mut stream = Stream { structure, rays, memory };
    match structure {
        Structure::Tree(tree) => stream.descend(s, w, &InLeaf(tree), all, 0),
        Structure::TwoLevel(levels) => stream.descend(s, w, &InPart(levels), all, 0),
    }
    stream.confirm(s, &mut found);
}

struct Stream<'a, 'b> {
    structure: Structure<'a>,
    rays: &'a mut Rays<'b>,
    memory: &'a mut Memory,
}

impl Stream<'_, '_> {
    /// Takes rays through a tree whose root is at this depth.
    #[inline(always)]
    fn descend<L: Leaves, S: Simd, W: Wide>(
        &mut self,
        s: S,
        w: W,
        leaves: &L,
        rays: Bits,
        level: u16,
    ) {
        let Some(root) = leaves.tree().root else { return };
        let base = self.memory.pending.len();
        let (mut current, mut here, mut level) = (root, rays, level);
        loop {
            if here & here.wrapping_sub(1) == 0 {
                if here != 0 {
                    self.one_ray(s, w, leaves, here.trailing_zeros() as usize, current);
                }
            } else if current.is_leaf() {
                leaves.visit(s, w, self, current, here, level);
            } else {
                self.node(s, w, leaves.tree(), current, here, level);
            }
            if self.memory.pending.len() == base {
                return;
            }
            let Some(next) = self.memory.pending.pop() else { return };
            current = next.child;
            level = next.level;
            here = self.not_beyond(w, &next);
        }
    }

    /// Takes rays through the tree of a part, in a function of its own.
    #[inline(never)]
    fn visit_part<S: Simd, W: Wide>(&mut self, s: S, w: W, part: &Bvh8, rays: Bits, level: u16) {
        w.run(
            #[inline(always)]
            || self.descend(s, w, &InLeaf(part), rays, level),
        );
    }

    /// Takes one ray through the tree of a part, likewise.
    #[inline(never)]
    fn visit_part_alone<S: Simd, W: Wide>(&mut self, s: S, w: W, part: &Bvh8, index: usize) {
        let Some(root) = part.root else { return };
        w.run(
            #[inline(always)]
            || self.one_ray(s, w, &InLeaf(part), index, root),
        );
    }

    /// The rays that still have to visit a subtree.
    #[inline(always)]
    fn not_beyond<W: Wide>(&self, w: W, pending: &Pending) -> Bits {
        let entries =
            &self.memory.entries[usize::from(pending.level - 1)][usize::from(pending.slot) % WIDTH];
        let [lower, upper] = pending.rays.map(Bits::from);
        let (met, mut rays) = (lower | upper << 64, 0);
        for group in groups_of(w, met) {
            let here = of_group::<W>(met, group);
            let reached = w.less_equal(w.load(entries, group), w.load(&self.rays.t_max, group));
            rays |= Bits::from(w.bits(reached) & here) << (group * W::GROUP);
        }
        rays
    }

    #[inline(always)]
    fn node<S: Simd, W: Wide>(
        &mut self,
        s: S,
        w: W,
        tree: &Bvh8,
        node: ChildRef,
        here: Bits,
        level: u16,
    ) {
        let node = &tree.nodes[node.node_index()];
        let Memory { pending, entries, .. } = &mut *self.memory;
        if entries.len() <= usize::from(level) {
            entries.push([Row::ZERO; WIDTH]);
        }
        let entries = &mut entries[usize::from(level)];
        let (met, mut children) =
            if here.count_ones() > w.groups(here).count_ones() * ACTIVE_IN_NODE {
                entries_by_group(w, node, node.occupied(), self.rays, here, entries)
            } else {
                entries_by_ray::<S, W>(s, node, self.rays, here, entries)
            };
        let above = pending.len();
        while children != 0 {
            let slot = children.trailing_zeros() as usize % WIDTH;
            children &= children - 1;
            let rays = met[slot];
            let first =
                if rays[0] != 0 { rays[0].trailing_zeros() } else { 64 + rays[1].trailing_zeros() };
            let entry = entries[slot].0[first as usize % STREAM];
            let child = node.children[slot];
            if tree.is_large() {
                prefetch(s, tree, child);
            }
            let new = Pending { child, level: level + 1, slot: slot as u16, rays, entry };
            // The nearest comes last.
            pending.push(new);
            let mut place = pending.len() - 1;
            while place > above && pending[place - 1].entry < entry {
                pending[place] = pending[place - 1];
                place -= 1;
            }
            pending[place] = new;
        }
    }

    /// Takes one ray through a subtree.
    #[inline(always)]
    fn one_ray<L: Leaves, S: Simd, W: Wide>(
        &mut self,
        s: S,
        w: W,
        leaves: &L,
        index: usize,
        child: ChildRef,
    ) {
        let tree = leaves.tree();
        let base = self.memory.path.len();
        let mut ray = OneRay::new(s, self.rays, index, self.rays.octants[index / W::GROUP]);
        let mut current = child;
        loop {
            if current.is_leaf() {
                leaves.visit_alone(s, w, self, current, index);
                ray.shorten(s, self.rays.t_max.0[index]);
            } else {
                let node = &tree.nodes[current.node_index()];
                let (mut met, entry) = ray.enters(s, node);
                let mut entries = [0.0; LANES];
                s.store(&mut entries, entry);
                let path = &mut self.memory.path;
                let above = path.len();
                while met != 0 {
                    let slot = met.trailing_zeros() as usize % WIDTH;
                    met &= met - 1;
                    let new = (node.children[slot], entries[slot]);
                    path.push(new);
                    let mut place = path.len() - 1;
                    while place > above && path[place - 1].1 < new.1 {
                        path[place] = path[place - 1];
                        place -= 1;
                    }
                    path[place] = new;
                }
            }
            loop {
                if self.memory.path.len() == base {
                    return;
                }
                let Some((child, entered)) = self.memory.path.pop() else { return };
                if entered <= self.rays.t_max.0[index] {
                    current = child;
                    break;
                }
            }
        }
    }
}

/// As [`entries_by_group`], ray by ray.
#[inline(always)]
fn entries_by_ray<S: Simd, W: Wide>(
    s: S,
    node: &Node8,
    rays: &Rays<'_>,
    mut active: Bits,
    entries: &mut [Row; WIDTH],
) -> ([[u64; 2]; WIDTH], u32) {
    let mut met = [[0; 2]; WIDTH];
    let mut any = 0;
    while active != 0 {
        let index = active.trailing_zeros() as usize;
        active &= active - 1;
        let ray = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]);
        let (mut children, entry) = ray.enters(s, node);
        any |= children;
        let mut of_ray = [0.0; LANES];
        s.store(&mut of_ray, entry);
        while children != 0 {
            let slot = children.trailing_zeros() as usize % WIDTH;
            children &= children - 1;
            met[slot][index / 64 % 2] |= 1 << (index % 64);
            entries[slot].0[index] = of_ray[slot];
        }
    }
    (met, any)
}

const _: () = assert!(MAX_WIDE_DEPTH < u16::MAX as usize);

//! Better trees by reinsertion (Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of Bounding
//! Volume Hierarchies", Computer Graphics Forum 32(1), 2013): subtrees are taken out, the largest first,
//! and put where they add least to the areas of all boxes, found by branch and bound. Pass follows pass
//! while the last one gained enough to pay for its time. On one thread, after [`binned`].

use super::{BuilderEntry, Leaves, binned};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::{Bvh2, ChildRef, MAX_DEPTH, Node2};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "reinsertion",
    about: "as binned, then subtrees go where they cost least while that pays: slow, better trees",
    build,
    in_parts: None,
};

/// Of all subtrees, the largest that a pass takes out: one in so many, but all if there are few.
const ONE_IN: usize = 8;
const FEW: usize = 2000;

/// The part of the areas of all boxes that a pass must gain for another to follow.
const LEAST_GAIN: f64 = 0.004;

const MOST_PASSES: usize = 16;

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    let tree = binned::build(mesh, leaves);
    optimised(tree)
}

/// The tree with subtrees in better places.
fn optimised(tree: Bvh2) -> Bvh2 {
    if tree.nodes.len() < 3 {
        return tree;
    }
    let mut best = Subtrees::of(&tree);
    for _ in 0..MOST_PASSES {
        let mut next = best.clone();
        next.pass();
        let (before, after) = (best.inner_areas(), next.inner_areas());
        // Stacks of traversals have room for so many levels.
        let is_better = after < before && next.depth() <= MAX_DEPTH;
        if !is_better {
            break;
        }
        best = next;
        if after > before * (1.0 - LEAST_GAIN) {
            break;
        }
    }
    best.tree(tree)
}

/// What is not there.
const NONE: u32 = u32::MAX;

/// All subtrees of a tree: first those with an inner node at the root, then leaves. Their roots are called
/// by the same numbers.
#[derive(Clone)]
struct Subtrees {
    bounds: Vec<Aabb>,
    /// Half of the surface of each box.
    areas: Vec<f64>,
    parents: Vec<u32>,
    /// Of inner nodes.
    children: Vec<[u32; 2]>,
    leaves: Vec<ChildRef>,
    root: u32,
}

/// A place that is yet to be looked at: beside a subtree, which makes the boxes above larger by so much.
struct Place {
    induced: f64,
    subtree: u32,
}

impl PartialEq for Place {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Place {}

impl PartialOrd for Place {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The least first out of a heap.
impl Ord for Place {
    fn cmp(&self, other: &Self) -> Ordering {
        other.induced.total_cmp(&self.induced).then(other.subtree.cmp(&self.subtree))
    }
}

impl Subtrees {
    /// Of a tree of one node at least.
    fn of(tree: &Bvh2) -> Self {
        let inner = tree.nodes.len();
        let count = 2 * inner + 1;
        let mut all = Self {
            bounds: vec![tree.bounds; count],
            areas: Vec::new(),
            parents: vec![NONE; count],
            children: vec![[NONE; 2]; inner],
            leaves: Vec::with_capacity(inner + 1),
            root: tree.root.expect("there are nodes").node_index() as u32,
        };
        for (index, node) in tree.nodes.iter().enumerate() {
            for (side, child) in node.children.into_iter().enumerate() {
                let subtree = if child.is_leaf() {
                    all.leaves.push(child);
                    inner + all.leaves.len() - 1
                } else {
                    child.node_index()
                };
                all.bounds[subtree] = node.bounds[side];
                all.parents[subtree] = index as u32;
                all.children[index][side] = subtree as u32;
            }
        }
        all.areas = all.bounds.iter().map(Aabb::half_area).collect();
        all
    }

    fn is_inner(&self, subtree: u32) -> bool {
        (subtree as usize) < self.children.len()
    }

    /// The sum of the areas of inner nodes' boxes: what reinsertion makes smaller.
    fn inner_areas(&self) -> f64 {
        self.areas[..self.children.len()].iter().sum()
    }

    /// Takes out and puts back the largest subtrees, one after the other.
    fn pass(&mut self) {
        let mut largest: Vec<u32> = (0..self.bounds.len() as u32).collect();
        let order = |a: &u32, b: &u32| {
            let (x, y) = (self.areas[*a as usize], self.areas[*b as usize]);
            y.total_cmp(&x).then(a.cmp(b))
        };
        let kept = (largest.len() / ONE_IN).max(FEW);
        if kept < largest.len() {
            largest.select_nth_unstable_by(kept, order);
            largest.truncate(kept);
        }
        largest.sort_unstable_by(order);
        let mut places = BinaryHeap::new();
        for subtree in largest {
            let parent = self.parents[subtree as usize];
            // The root has no other place, and its children none without another root.
            if parent != NONE && parent != self.root {
                self.take_out(subtree);
                let beside = self.best_place(subtree, &mut places);
                self.put_beside(subtree, beside);
            }
        }
    }

    /// Puts a subtree's sibling in their parent's place, which stays the subtree's.
    fn take_out(&mut self, subtree: u32) {
        let parent = self.parents[subtree as usize];
        let [a, b] = self.children[parent as usize];
        let sibling = if a == subtree { b } else { a };
        self.replace(parent, sibling);
        self.refit_from(self.parents[sibling as usize]);
    }

    /// Puts a subtree that was taken out beside another one, with its parent above both.
    fn put_beside(&mut self, subtree: u32, other: u32) {
        let parent = self.parents[subtree as usize];
        self.replace(other, parent);
        self.children[parent as usize] = [other, subtree];
        self.parents[other as usize] = parent;
        let bounds = self.bounds[other as usize].union(self.bounds[subtree as usize]);
        self.bounds[parent as usize] = bounds;
        self.areas[parent as usize] = bounds.half_area();
        // Even if that is the box that the parent had elsewhere.
        self.refit_from(self.parents[parent as usize]);
    }

    /// Gives `new` the place of `old`, which is not the root.
    fn replace(&mut self, old: u32, new: u32) {
        let above = self.parents[old as usize];
        let children = &mut self.children[above as usize];
        let side = usize::from(children[1] == old);
        children[side] = new;
        self.parents[new as usize] = above;
    }

    /// Brings boxes up to date from `subtree` up, as far as they change.
    fn refit_from(&mut self, mut subtree: u32) {
        while subtree != NONE {
            let [a, b] = self.children[subtree as usize];
            let bounds = self.bounds[a as usize].union(self.bounds[b as usize]);
            let own = &mut self.bounds[subtree as usize];
            if *own == bounds {
                return;
            }
            *own = bounds;
            self.areas[subtree as usize] = bounds.half_area();
            subtree = self.parents[subtree as usize];
        }
    }

    /// Beside which subtree, not the root, one that was taken out adds least to the areas of all boxes.
    fn best_place(&self, subtree: u32, places: &mut BinaryHeap<Place>) -> u32 {
        let (bounds, area) = (self.bounds[subtree as usize], self.areas[subtree as usize]);
        let grown = |other: u32| self.bounds[other as usize].union(bounds).half_area();
        places.clear();
        let induced = grown(self.root) - self.areas[self.root as usize];
        let below_root = self.children[self.root as usize];
        places.extend(below_root.map(|subtree| Place { induced, subtree }));
        let mut best = (f64::INFINITY, below_root[0]);
        while let Some(Place { induced, subtree: other }) = places.pop() {
            if induced + area >= best.0 {
                break;
            }
            let cost = induced + grown(other);
            if cost < best.0 {
                best = (cost, other);
            }
            let induced = cost - self.areas[other as usize];
            if self.is_inner(other) && induced + area < best.0 {
                let below = self.children[other as usize];
                places.extend(below.map(|subtree| Place { induced, subtree }));
            }
        }
        best.1
    }

    /// Most inner nodes on a way from the root to a leaf.
    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut pending = vec![(self.root, 1)];
        while let Some((subtree, depth)) = pending.pop() {
            if self.is_inner(subtree) {
                deepest = deepest.max(depth);
                let below = self.children[subtree as usize];
                pending.extend(below.map(|child| (child, depth + 1)));
            }
        }
        deepest
    }

    /// The tree, whose triangles are those of `old`.
    fn tree(&self, old: Bvh2) -> Bvh2 {
        let inner = self.children.len();
        let child = |subtree: u32| {
            let index = subtree as usize;
            if index < inner { ChildRef::inner(index) } else { self.leaves[index - inner] }
        };
        let counts = self.counts();
        let nodes = self.children.iter().map(|children| Node2 {
            bounds: children.map(|subtree| self.bounds[subtree as usize]),
            children: children.map(child),
            counts: children.map(|subtree| counts[subtree as usize]),
        });
        let Bvh2 { bounds, triangles, triangle_ids, .. } = old;
        let root = Some(child(self.root));
        Bvh2::new(nodes.collect(), root, bounds, triangles, triangle_ids).in_depth_first_order().0
    }

    /// Triangles below each root.
    fn counts(&self) -> Vec<u32> {
        let inner = self.children.len();
        let mut counts = vec![0; self.bounds.len()];
        for (count, leaf) in counts[inner..].iter_mut().zip(&self.leaves) {
            *count = leaf.leaf_slots().len() as u32;
        }
        let mut order = vec![self.root];
        let mut next = 0;
        while let Some(&subtree) = order.get(next) {
            next += 1;
            let below = self.children[subtree as usize];
            order.extend(below.into_iter().filter(|child| self.is_inner(*child)));
        }
        for &subtree in order.iter().rev() {
            let below = self.children[subtree as usize];
            counts[subtree as usize] = below.iter().map(|child| counts[*child as usize]).sum();
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn it_costs_less_than_before() {
        for (seed, count) in [(0x2e1, 500), (0x2e2, 3000), (0x2e3, 20_000)] {
            let mesh = Random::new(seed).mesh(count);
            let before = binned::build(&mesh, Leaves::Single);
            let after = build(&mesh, Leaves::Single);
            after.validate(&mesh).unwrap();
            let (before, after) = (before.sah_cost(), after.sah_cost());
            assert!(after < 0.98 * before, "{count}: {after} {before}");
        }
    }

    /// The place that is found is the best of all, tried one by one.
    #[test]
    fn the_best_place_is_found() {
        for seed in 0..20 {
            let mesh = Random::new(0x2f0 + seed).mesh(60);
            let tree = binned::build(&mesh, Leaves::Single);
            let start = Subtrees::of(&tree);
            for subtree in 0..start.bounds.len() as u32 {
                let parent = start.parents[subtree as usize];
                if parent == NONE || parent == start.root {
                    continue;
                }
                let mut all = start.clone();
                all.take_out(subtree);
                let with = |other: u32| {
                    let mut all = all.clone();
                    all.put_beside(subtree, other);
                    all.inner_areas()
                };
                let found = with(all.best_place(subtree, &mut BinaryHeap::new()));
                // Not those in the subtree itself, nor its parent, which is out as well.
                let mut pending = all.children[all.root as usize].to_vec();
                let mut least = f64::INFINITY;
                while let Some(other) = pending.pop() {
                    least = least.min(with(other));
                    if all.is_inner(other) {
                        pending.extend(all.children[other as usize]);
                    }
                }
                assert!(found <= least * (1.0 + 1e-12), "{seed} {subtree}: {found} {least}");
                assert!(found <= start.inner_areas() * (1.0 + 1e-12), "{seed} {subtree}");
            }
        }
    }
}

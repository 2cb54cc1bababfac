//! A tree whose subtrees are taken out and put where they add least to the areas of all boxes, found by
//! branch and bound (Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of Bounding Volume
//! Hierarchies", Computer Graphics Forum 32(1), 2013).

use crate::geometry::Aabb;
use crate::tree::{Bvh2, ChildRef, Node2};
use glam::{Vec3A, Vec3Swizzles};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What is not there.
const NONE: u32 = u32::MAX;

/// All subtrees of a tree: first those with an inner node at the root, then leaves. Their roots are called
/// by the same numbers.
#[derive(Clone)]
pub(super) struct Subtrees {
    boxes: Vec<VectorBox>,
    /// Half of the surface of each box, in units of its own.
    areas: Vec<f32>,
    /// What lengths are multiplied by, as areas of large scenes overflow, and those of small ones vanish.
    unit: f32,
    parents: Vec<u32>,
    /// Of inner nodes.
    children: Vec<[u32; 2]>,
    leaves: Vec<ChildRef>,
    root: u32,
}

/// A box in two registers.
#[derive(Clone, Copy, PartialEq)]
struct VectorBox {
    min: Vec3A,
    max: Vec3A,
}

impl VectorBox {
    fn of(bounds: &Aabb) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into() }
    }

    #[inline]
    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline]
    fn half_area(self, unit: f32) -> f32 {
        let size = (self.max - self.min) * unit;
        size.dot(size.yzx())
    }
}

/// A place that is yet to be looked at: beside a subtree, which makes the boxes above larger by so much.
struct Place {
    induced: f32,
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
    /// Of a tree of one node at least, within these bounds.
    pub(super) fn of(nodes: &[Node2], root: ChildRef, bounds: &Aabb) -> Self {
        let inner = nodes.len();
        let count = 2 * inner + 1;
        let mut all = Self {
            boxes: vec![VectorBox::of(bounds); count],
            areas: Vec::new(),
            unit: 1.0 / bounds.size().max_element().max(f32::MIN_POSITIVE),
            parents: vec![NONE; count],
            children: vec![[NONE; 2]; inner],
            leaves: Vec::with_capacity(inner + 1),
            root: root.node_index() as u32,
        };
        for (index, node) in nodes.iter().enumerate() {
            for (side, child) in node.children.into_iter().enumerate() {
                let subtree = if child.is_leaf() {
                    all.leaves.push(child);
                    inner + all.leaves.len() - 1
                } else {
                    child.node_index()
                };
                all.boxes[subtree] = VectorBox::of(&node.bounds[side]);
                all.parents[subtree] = index as u32;
                all.children[index][side] = subtree as u32;
            }
        }
        all.areas = all.boxes.iter().map(|own| own.half_area(all.unit)).collect();
        all
    }

    pub(super) fn is_inner(&self, subtree: u32) -> bool {
        (subtree as usize) < self.children.len()
    }

    /// Number of subtrees.
    pub(super) fn len(&self) -> usize {
        self.boxes.len()
    }

    /// The whole.
    pub(super) fn root(&self) -> u32 {
        self.root
    }

    /// What is below a subtree's root: two others, or a leaf of the tree.
    pub(super) fn below(&self, subtree: u32) -> Result<[u32; 2], ChildRef> {
        let index = subtree as usize;
        let inner = self.children.len();
        if index < inner { Ok(self.children[index]) } else { Err(self.leaves[index - inner]) }
    }

    /// The box around a subtree.
    pub(super) fn bounds(&self, subtree: u32) -> Aabb {
        let VectorBox { min, max } = self.boxes[subtree as usize];
        Aabb { min: min.into(), max: max.into() }
    }

    /// The sum of the areas of inner nodes' boxes, in units of its own: what reinsertion makes smaller.
    pub(super) fn inner_areas(&self) -> f64 {
        self.areas[..self.children.len()].iter().map(|area| f64::from(*area)).sum()
    }

    /// Takes out and puts back so many of the largest subtrees, one after the other.
    pub(super) fn move_largest(&mut self, count: usize) {
        let mut largest: Vec<u32> = (0..self.len() as u32).collect();
        let order = |a: &u32, b: &u32| {
            let (x, y) = (self.areas[*a as usize], self.areas[*b as usize]);
            y.total_cmp(&x).then(a.cmp(b))
        };
        if count < largest.len() {
            largest.select_nth_unstable_by(count, order);
            largest.truncate(count);
        }
        largest.sort_unstable_by(order);
        let mut places = BinaryHeap::new();
        for subtree in largest {
            let parent = self.parents[subtree as usize];
            // The root has no other place, and its children none without another root.
            if parent != NONE && parent != self.root {
                let sibling = self.take_out(subtree);
                let beside = self.best_place(subtree, sibling, &mut places);
                self.put_beside(subtree, beside);
            }
        }
    }

    /// Puts a subtree's sibling in their parent's place, which stays the subtree's, and returns it.
    fn take_out(&mut self, subtree: u32) -> u32 {
        let parent = self.parents[subtree as usize];
        let [a, b] = self.children[parent as usize];
        let sibling = if a == subtree { b } else { a };
        self.replace(parent, sibling);
        self.refit_from(self.parents[sibling as usize]);
        sibling
    }

    /// Puts a subtree that was taken out beside another one, with its parent above both.
    fn put_beside(&mut self, subtree: u32, other: u32) {
        let parent = self.parents[subtree as usize];
        self.replace(other, parent);
        self.children[parent as usize] = [other, subtree];
        self.parents[other as usize] = parent;
        let around = self.boxes[other as usize].union(self.boxes[subtree as usize]);
        self.boxes[parent as usize] = around;
        self.areas[parent as usize] = around.half_area(self.unit);
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
            let around = self.boxes[a as usize].union(self.boxes[b as usize]);
            let own = &mut self.boxes[subtree as usize];
            if *own == around {
                return;
            }
            *own = around;
            self.areas[subtree as usize] = around.half_area(self.unit);
            subtree = self.parents[subtree as usize];
        }
    }

    /// Beside which subtree, not the root, one that was taken out adds least to the areas of all boxes: its
    /// old `sibling` if no other is better.
    fn best_place(&self, subtree: u32, sibling: u32, places: &mut BinaryHeap<Place>) -> u32 {
        let (own, area) = (self.boxes[subtree as usize], self.areas[subtree as usize]);
        let grown = |other: u32| self.boxes[other as usize].union(own).half_area(self.unit);
        let growth = |other: u32| grown(other) - self.areas[other as usize];
        let mut best = (grown(sibling), sibling);
        let mut above = self.parents[sibling as usize];
        while above != NONE {
            best.0 += growth(above);
            above = self.parents[above as usize];
        }
        places.clear();
        let induced = growth(self.root);
        let below_root = self.children[self.root as usize];
        places.extend(below_root.map(|subtree| Place { induced, subtree }));
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
    pub(super) fn depth(&self) -> usize {
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
    pub(super) fn tree(&self, old: Bvh2) -> Bvh2 {
        let child = |subtree: u32| match self.below(subtree) {
            Ok(_) => ChildRef::inner(subtree as usize),
            Err(leaf) => leaf,
        };
        let counts = self.counts();
        let nodes = self.children.iter().map(|children| Node2 {
            bounds: children.map(|subtree| self.bounds(subtree)),
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
        let mut counts = vec![0; self.len()];
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
    use crate::build::{Leaves, binned};
    use crate::test_random::Random;

    /// The place that is found is the best of all, tried one by one.
    #[test]
    fn the_best_place_is_found() {
        for seed in 0..20 {
            let mesh = Random::new(0x2f0 + seed).mesh(60);
            let tree = binned::build(&mesh, Leaves::Single);
            let start = Subtrees::of(&tree.nodes, tree.root.unwrap(), &tree.bounds);
            for subtree in 0..start.len() as u32 {
                let parent = start.parents[subtree as usize];
                if parent == NONE || parent == start.root {
                    continue;
                }
                let mut all = start.clone();
                let sibling = all.take_out(subtree);
                let with = |other: u32| {
                    let mut all = all.clone();
                    all.put_beside(subtree, other);
                    all.inner_areas()
                };
                let found = with(all.best_place(subtree, sibling, &mut BinaryHeap::new()));
                // Not those in the subtree itself, nor its parent, which is out as well.
                let mut pending = all.children[all.root as usize].to_vec();
                let mut least = f64::INFINITY;
                while let Some(other) = pending.pop() {
                    least = least.min(with(other));
                    if all.is_inner(other) {
                        pending.extend(all.children[other as usize]);
                    }
                }
                assert!(found <= least * (1.0 + 1e-5), "{seed} {subtree}: {found} {least}");
                assert!(found <= start.inner_areas() * (1.0 + 1e-5), "{seed} {subtree}");
            }
        }
    }
}

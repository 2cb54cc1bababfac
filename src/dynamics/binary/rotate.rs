//! Tree rotations (Kensler, "Tree Rotations for Improving Bounding Volume Hierarchies", IEEE Symposium
//! on Interactive Ray Tracing, 2008), done while boxes are brought up to date (Kopta, Ize, Spjut,
//! Brunvand, Davis and Kensler, "Fast, Effective BVH Updates for Animated Scenes", ACM Symposium on
//! Interactive 3D Graphics and Games, 2012).
//!
//! At each node, from the leaves up, a child may change places with a child of its sibling, or two of
//! its grandchildren with each other: six ways. Nothing below those that move changes, nor does the
//! node's own box, so what a way gains by the surface-area heuristic is what the boxes of the nodes
//! in between lose in area.

use super::super::LEAST_GAIN;
use super::half_area;
use super::refit::Part;
use crate::geometry::Aabb;
use crate::tree::{MAX_DEPTH, Node2, Step};

/// A place for a subtree: a node and a side of it.
type Place = (usize, usize);

/// Two places whose subtrees change, and the boxes that the children of the node then have, where
/// they are other ones.
#[derive(Clone, Copy, Debug)]
struct Rotation {
    places: [Place; 2],
    bounds: [Option<Aabb>; 2],
}

impl Part<'_> {
    /// Does what gains most at a node, if anything does, and returns the children between whose
    /// own children changed.
    #[inline]
    pub(super) fn rotate(&mut self, step: Step) -> [Option<usize>; 2] {
        let index = step.index as usize;
        let node = self.nodes[index - self.first];
        let open = node.children.map(|child| self.open(child));
        if open == [None; 2] {
            return open;
        }
        let Some(rotation) = self.best_rotation(step, &node, open) else { return [None; 2] };
        let mut change = 0.0;
        let mut between = [None; 2];
        for (side, between) in between.iter_mut().enumerate() {
            if let Some(bounds) = rotation.bounds[side] {
                change += bounds.half_area() - node.bounds[side].half_area();
                *between = open[side];
            }
        }
        // Where `f32` has run out of digits.
        if change.is_nan() || change >= 0.0 {
            return [None; 2];
        }
        self.cost += change;
        self.exchange(rotation.places);
        for (side, child) in between.into_iter().enumerate() {
            if let (Some(bounds), Some(child)) = (rotation.bounds[side], child) {
                let counts = self.nodes[child - self.first].counts;
                let node = &mut self.nodes[index - self.first];
                node.bounds[side] = bounds;
                node.counts[side] = counts[0] + counts[1];
            }
        }
        between
    }

    fn best_rotation(
        &self,
        step: Step,
        node: &Node2,
        open: [Option<usize>; 2],
    ) -> Option<Rotation> {
        let index = step.index as usize;
        let areas = node.bounds.map(|bounds| half_area(&bounds));
        let mut best = None;
        let mut most = 0.0;
        let mut consider = |before: f64, after: f64, rotation: Rotation| {
            let gain = before - after;
            if gain > most && gain > before * LEAST_GAIN {
                (best, most) = (Some(rotation), gain);
            }
        };
        for side in 0..2 {
            let Some(child) = open[side] else { continue };
            let other = 1 - side;
            // The other child goes down by a level.
            let depth =
                usize::from(step.depth) + 2 + usize::from(self.height(node.children[other]));
            if depth > MAX_DEPTH {
                continue;
            }
            let below = &self.nodes[child - self.first];
            for grandchild in 0..2 {
                let after = node.bounds[other].union(below.bounds[1 - grandchild]);
                let mut bounds = [None; 2];
                bounds[side] = Some(after);
                let places = [(index, other), (child, grandchild)];
                consider(areas[side], half_area(&after), Rotation { places, bounds });
            }
        }
        if let [Some(first), Some(second)] = open {
            let [lower, upper] = [first, second].map(|child| &self.nodes[child - self.first]);
            for grandchild in 0..2 {
                let after = [
                    upper.bounds[grandchild].union(lower.bounds[1]),
                    lower.bounds[0].union(upper.bounds[1 - grandchild]),
                ];
                let places = [(first, 0), (second, grandchild)];
                let rotation = Rotation { places, bounds: after.map(Some) };
                let [before, after] = [areas, after.map(|b| half_area(&b))].map(|a| a[0] + a[1]);
                consider(before, after, rotation);
            }
        }
        best
    }

    /// Lets the subtrees in two places change places: a second time, it puts them back.
    pub(super) fn exchange(&mut self, places: [Place; 2]) {
        let [a, b] = places.map(|(index, side)| (index - self.first, side));
        let taken =
            |node: &Node2, side: usize| (node.children[side], node.bounds[side], node.counts[side]);
        let put = |node: &mut Node2, side: usize, subtree| {
            (node.children[side], node.bounds[side], node.counts[side]) = subtree;
        };
        let (from_a, from_b) = (taken(&self.nodes[a.0], a.1), taken(&self.nodes[b.0], b.1));
        put(&mut self.nodes[a.0], a.1, from_b);
        put(&mut self.nodes[b.0], b.1, from_a);
    }
}

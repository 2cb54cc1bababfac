//! A part of a binary tree, from its leaves up.

use super::super::{SECOND, Touched};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::tree::{ChildRef, Node2, Pieces, Step};

/// Nodes that one thread brings up to date: a subtree, or those above all subtrees.
pub(super) struct Part<'a> {
    pub(super) mesh: &'a TriangleMesh,
    /// Of all slots of the tree.
    pub(super) ids: &'a [u32],
    pub(super) nodes: &'a mut [Node2],
    /// The index of the first of the nodes.
    pub(super) first: usize,
    pub(super) triangles: &'a mut [Triangle],
    pub(super) first_slot: usize,
    pub(super) heights: &'a mut [u8],
    /// Empty if that is not kept.
    pub(super) disturbed: &'a mut [bool],
    /// Subtrees that may be put elsewhere as a whole only.
    pub(super) closed: Option<&'a Pieces>,
    pub(super) touched: &'a mut Touched,
    /// Whether child 1 of a node is to come first.
    pub(super) second: Option<fn(&Node2) -> bool>,
    /// The areas of the children of all settled nodes, each times the cost of a visit.
    pub(super) cost: f64,
}

/// Copies the triangles of a leaf, whose first slot is `first`, and returns the box around them.
#[inline]
pub(super) fn leaf(
    mesh: &TriangleMesh,
    ids: &[u32],
    triangles: &mut [Triangle],
    first: usize,
) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for (triangle, &id) in triangles.iter_mut().zip(&ids[first..]) {
        *triangle = mesh.triangle(id as usize);
        bounds = bounds.union(triangle.bounds());
    }
    bounds
}

impl Part<'_> {
    /// Brings the leaves of a node up to date.
    #[inline]
    pub(super) fn refit_leaves(&mut self, index: usize) {
        let node = &mut self.nodes[index - self.first];
        for (child, bounds) in node.children.iter().zip(&mut node.bounds) {
            if child.is_leaf() {
                let slots = child.leaf_slots();
                let own = slots.start - self.first_slot..slots.end - self.first_slot;
                *bounds = leaf(self.mesh, self.ids, &mut self.triangles[own], slots.start);
            }
        }
    }

    /// Brings a node up to date, all below it being so.
    #[inline]
    pub(super) fn settle(&mut self, step: Step, rotates: bool) {
        let place = step.index as usize - self.first;
        for side in 0..2 {
            let child = self.nodes[place].children[side];
            let visit = if child.is_leaf() {
                child.leaf_slots().len() as f64
            } else {
                let below = &self.nodes[child.node_index() - self.first];
                self.nodes[place].bounds[side] = below.bounds[0].union(below.bounds[1]);
                1.0
            };
            self.cost += visit * self.nodes[place].bounds[side].half_area();
        }
        let between = if rotates { self.rotate(step) } else { [None; 2] };
        let is_rotated = between != [None; 2];
        for index in between.into_iter().flatten() {
            self.heights[index - self.first] = self.height_of(index);
            self.note_exchanged(index as u32);
        }
        if is_rotated {
            self.note_exchanged(step.index);
            self.touched.rotations += 1;
        }
        if rotates {
            self.heights[place] = self.height_of(step.index as usize);
        }
        if !self.disturbed.is_empty() {
            self.note_disturbed(step.index, between);
        }
    }

    pub(super) fn note_exchanged(&mut self, index: u32) {
        let node = &self.nodes[index as usize - self.first];
        let second = self.second.is_some_and(|second| second(node));
        self.touched.exchanged.push(index | if second { SECOND } else { 0 });
    }

    /// Lists what is to be looked at again by those who sum up all that lies below: children before
    /// their parents, some more than once.
    fn note_disturbed(&mut self, index: u32, between: [Option<usize>; 2]) {
        let children = self.nodes[index as usize - self.first].children;
        let is_disturbed =
            |child: ChildRef| !child.is_leaf() && self.disturbed[child.node_index() - self.first];
        let any = between != [None; 2] || children.into_iter().any(is_disturbed);
        for index in between.into_iter().flatten() {
            self.disturbed[index - self.first] = true;
            self.touched.disturbed.push(index as u32);
        }
        self.disturbed[index as usize - self.first] = any;
        if any {
            self.touched.disturbed.push(index);
        }
    }

    /// Most inner nodes on a way from a child to a leaf.
    #[inline(always)]
    pub(super) fn height(&self, child: ChildRef) -> u8 {
        if child.is_leaf() { 0 } else { self.heights[child.node_index() - self.first] }
    }

    #[inline(always)]
    fn height_of(&self, index: usize) -> u8 {
        let [a, b] = self.nodes[index - self.first].children.map(|child| self.height(child));
        1 + a.max(b)
    }

    /// The node that a child is, if its children may change places with others.
    #[inline(always)]
    pub(super) fn open(&self, child: ChildRef) -> Option<usize> {
        let is_open = !child.is_leaf()
            && self.closed.is_none_or(|pieces| pieces.subtree_at(child.node_index()).is_none());
        is_open.then(|| child.node_index())
    }
}

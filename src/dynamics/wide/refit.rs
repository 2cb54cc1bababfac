//! A part of an eight-wide tree, from its leaves up.

use super::super::Touched;
use super::slots_in;
use crate::build::{WideCosts, WideScores};
use crate::geometry::TriangleMesh;
use crate::tree::{ChildRef, LEAF_ROWS, Node8, Pieces, Step, refit_leaf};

/// Nodes that one thread brings up to date: a subtree, or those above all subtrees.
pub(super) struct Part<'a> {
    pub(super) mesh: &'a TriangleMesh,
    /// Of all slots of the tree.
    pub(super) ids: &'a [u32],
    pub(super) costs: WideCosts,
    pub(super) nodes: &'a mut [Node8],
    /// The index of the first of the nodes.
    pub(super) first: usize,
    pub(super) leaves: &'a mut [f32],
    pub(super) first_slot: usize,
    pub(super) heights: &'a mut [u8],
    /// Empty if boxes give them.
    pub(super) scores: &'a mut [WideScores],
    /// Subtrees that may be put elsewhere as a whole only.
    pub(super) closed: Option<&'a Pieces>,
    pub(super) touched: &'a mut Touched,
    /// The areas of the children of all settled nodes, each times the cost of a visit.
    pub(super) cost: f64,
}

impl Part<'_> {
    /// Brings the leaves of a node up to date.
    #[inline(always)]
    pub(super) fn refit_leaves(&mut self, index: usize) {
        let node = &mut self.nodes[index - self.first];
        for slot in slots_in(node) {
            let child = node.children[slot];
            if child.is_leaf() {
                let slots = child.leaf_slots();
                let own = slots.start - self.first_slot..slots.end - self.first_slot;
                let block = &mut self.leaves[own.start * LEAF_ROWS..own.end * LEAF_ROWS];
                node.set_bounds(slot, &refit_leaf(self.mesh, &self.ids[slots], block));
            }
        }
    }

    /// Brings a node up to date, all below it being so.
    pub(super) fn settle(&mut self, step: Step, rotates: bool) {
        let place = step.index as usize - self.first;
        for slot in slots_in(&self.nodes[place]) {
            let child = self.nodes[place].children[slot];
            let (bounds, visit) = if child.is_leaf() {
                let triangles = child.leaf_slots().len();
                (self.nodes[place].bounds(slot), f64::from(self.costs.leaf(triangles)))
            } else {
                let bounds = self.nodes[child.node_index() - self.first].all_bounds();
                self.nodes[place].set_bounds(slot, &bounds);
                (bounds, 1.0)
            };
            self.cost += visit * bounds.half_area();
        }
        if !rotates {
            return;
        }
        let between = self.rotate(step);
        for index in between.into_iter().flatten() {
            self.heights[index - self.first] = self.height_of(index);
            self.touched.exchanged.push(index as u32);
        }
        if between != [None; 2] {
            self.touched.exchanged.push(step.index);
            self.touched.rotations += 1;
        }
        self.heights[place] = self.height_of(step.index as usize);
    }

    /// Most inner nodes on a way from a child to a leaf.
    #[inline(always)]
    pub(super) fn height(&self, child: ChildRef) -> u8 {
        if child.is_leaf() { 0 } else { self.heights[child.node_index() - self.first] }
    }

    fn height_of(&self, index: usize) -> u8 {
        let node = &self.nodes[index - self.first];
        let children = node.children[slots_in(node)].iter();
        1 + children.map(|child| self.height(*child)).max().unwrap_or(0)
    }

    /// The node that a child is, if its children may change places with others.
    #[inline(always)]
    pub(super) fn open(&self, child: ChildRef) -> Option<usize> {
        let is_open = !child.is_leaf()
            && self.closed.is_none_or(|pieces| pieces.subtree_at(child.node_index()).is_none());
        is_open.then(|| child.node_index())
    }
}

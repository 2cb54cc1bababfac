//! An eight-wide tree that follows its triangles.

mod refit;
mod rotate;
mod sort;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod validate;

pub(crate) use sort::Ranking;

use super::{Touched, Updated};
use crate::build::{WideCosts, WideScores};
use crate::geometry::TriangleMesh;
use crate::tree::{
    Bvh8, LEAF_ROWS, Node8, Pieces, Step, downwards, heights_of, refit_leaf, slots_of, split_by,
};
use crate::vectorized::vectorized;
use rayon::prelude::*;
use refit::Part;
use std::ops::Range;

/// What is kept beside an eight-wide tree: as [`BinaryFollower`](super::BinaryFollower) does, with the
/// scores that its children are sorted by, where boxes do not give them.
#[derive(Debug)]
pub(crate) struct WideFollower {
    pieces: Pieces,
    /// The slots of each subtree's triangles.
    slots: Vec<Range<usize>>,
    /// Those slots' numbers in leaves.
    numbers: Vec<Range<usize>>,
    /// For each node, the most inner nodes on a way from it to a leaf, itself one of them.
    heights: Vec<u8>,
    /// For each node its children's scores; empty where boxes give them. A child that goes elsewhere
    /// takes its score along; one whose children are exchanged keeps its own.
    scores: Vec<WideScores>,
    costs: WideCosts,
    /// Of each subtree, and of the nodes above them.
    touched: Vec<Touched>,
}

impl WideFollower {
    /// Of a tree whose nodes lie in depth-first order and the slots of each subtree together, and its
    /// nodes' scores, if they are kept.
    pub(crate) fn of(tree: &Bvh8, scores: Vec<WideScores>, costs: WideCosts) -> Self {
        let pieces = Pieces::of_wide(tree);
        let slots = slots_of(&tree.nodes, &pieces);
        let of_slots = |slots: &Range<usize>| slots.start * LEAF_ROWS..slots.end * LEAF_ROWS;
        let numbers = slots.iter().map(of_slots).collect();
        let mut touched = Vec::new();
        touched.resize_with(pieces.subtrees.len() + 1, Touched::default);
        Self { numbers, slots, heights: heights_of(&tree.nodes), scores, costs, touched, pieces }
    }

    /// Brings boxes and leaves to where triangles are in `mesh`, with rotations on the way if
    /// `rotates`: as [`BinaryFollower::update`](super::BinaryFollower::update). Children stay in their
    /// slots, or take those of others: see [`sort`].
    pub(crate) fn update(
        &mut self,
        tree: &mut Bvh8,
        mesh: &TriangleMesh,
        rotates: bool,
    ) -> Updated {
        self.touched.iter_mut().for_each(Touched::clear);
        tree.id = Bvh8::new_id();
        let Some(root) = tree.root else { return Updated::default() };
        let (ids, costs) = (&tree.triangle_ids, self.costs);
        if root.is_leaf() {
            let slots = root.leaf_slots();
            let block = &mut tree.leaves[..slots.len() * LEAF_ROWS];
            tree.bounds = refit_leaf(mesh, &ids[slots], block);
            return Updated { sah_cost: costs.sah_cost(tree), rotations: 0 };
        }
        let (top, depths) = self.pieces.downwards(&tree.nodes);
        let (of_top, of_subtrees) = self.touched.split_last_mut().expect("one for the top");
        let scores = split_if_any(&self.pieces, &mut self.scores);
        let parts = self.pieces.split(&mut tree.nodes).into_iter();
        let parts: Vec<_> = parts
            .zip(split_by(&self.numbers, &mut tree.leaves))
            .zip(self.pieces.split(&mut self.heights))
            .zip(scores)
            .zip(of_subtrees)
            .zip(self.pieces.subtrees.iter().zip(&self.slots))
            .map(|(((((nodes, leaves), heights), scores), touched), (own, slots))| Part {
                mesh,
                ids,
                costs,
                nodes,
                first: own.start,
                leaves,
                first_slot: slots.start,
                heights,
                scores,
                closed: None,
                touched,
                cost: 0.0,
            })
            .collect();
        let of_part = |steps: &mut Vec<Step>, (index, mut part): (usize, Part<'_>)| {
            let first = part.first;
            downwards(part.nodes, first, depths[index], steps);
            vectorized(
                #[inline(always)]
                || (first..first + part.nodes.len()).for_each(|index| part.refit_leaves(index)),
            );
            steps.iter().rev().for_each(|step| part.settle(*step, rotates));
            (part.cost, part.touched.rotations)
        };
        let of_parts: Vec<(f64, u64)> =
            parts.into_par_iter().enumerate().map_init(Vec::new, of_part).collect();
        let mut part = Part {
            mesh,
            ids,
            costs,
            nodes: &mut tree.nodes,
            first: 0,
            leaves: &mut tree.leaves,
            first_slot: 0,
            heights: &mut self.heights,
            scores: &mut self.scores,
            closed: Some(&self.pieces),
            touched: of_top,
            cost: of_parts.iter().map(|part| part.0).sum(),
        };
        for step in top.iter().rev() {
            part.refit_leaves(step.index as usize);
            part.settle(*step, rotates);
        }
        let below = part.cost;
        tree.bounds = tree.nodes[0].all_bounds();
        let area = tree.bounds.half_area();
        Updated {
            sah_cost: 1.0 + if area > 0.0 { below / area } else { 0.0 },
            rotations: self.touched.iter().map(|touched| touched.rotations).sum(),
        }
    }

    /// Bytes of all arrays.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let lists: usize = self.touched.iter().map(Touched::memory_bytes).sum();
        let ranges = 2 * size_of_val(self.slots.as_slice());
        (lists + ranges + self.heights.len() + size_of_val(self.scores.as_slice())) as u64
            + self.pieces.memory_bytes()
    }
}

/// For each subtree its part of the scores; empty ones where none are kept.
fn split_if_any<'a>(pieces: &Pieces, scores: &'a mut [WideScores]) -> Vec<&'a mut [WideScores]> {
    if scores.is_empty() {
        pieces.subtrees.iter().map(|_| Default::default()).collect()
    } else {
        pieces.split(scores)
    }
}

/// The children of a node, by slot.
fn slots_in(node: &Node8) -> Range<usize> {
    0..node.len as usize
}

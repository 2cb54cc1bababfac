//! A binary tree that follows its triangles.

mod refit;
mod rotate;
#[cfg(test)]
mod tests;
mod upkeep;
#[cfg(test)]
mod validate;

pub(crate) use upkeep::PlanUpkeep;

use super::{Touched, Updated};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::{
    Bvh2, Node2, Pieces, SplitNotes, Step, downwards, heights_of, slots_of, split_by,
};
use rayon::prelude::*;
use refit::Part;

/// What is kept beside a binary tree, so that it can follow its triangles on all threads: each of
/// its [`Pieces`] is one thread's, the nodes above them come last. Rotations stay within a piece, or
/// above all of them, so that pieces stay what they are.
#[derive(Debug)]
pub(crate) struct BinaryFollower {
    pieces: Pieces,
    /// The slots of each subtree's triangles.
    slots: Vec<std::ops::Range<usize>>,
    /// For each node, the most inner nodes on a way from it to a leaf, itself one of them.
    heights: Vec<u8>,
    /// For each node whether it or one below it was touched by the last update; empty unless
    /// ancestors are asked for.
    disturbed: Vec<bool>,
    /// Of each subtree, and of the nodes above them.
    touched: Vec<Touched>,
}

impl BinaryFollower {
    /// Of a tree whose nodes and leaves lie in depth-first order. `lists_ancestors`: whether the
    /// nodes above those touched will be asked for.
    pub(crate) fn of(tree: &Bvh2, lists_ancestors: bool) -> Self {
        let pieces = Pieces::of(tree);
        let slots = slots_of(&tree.nodes, &pieces);
        let mut touched = Vec::new();
        touched.resize_with(pieces.subtrees.len() + 1, Touched::default);
        let disturbed = vec![false; if lists_ancestors { tree.nodes.len() } else { 0 }];
        Self { slots, heights: heights_of(&tree.nodes), disturbed, touched, pieces }
    }

    /// Brings boxes and triangles to where they are in `mesh`, from the leaves up: each box is the
    /// smallest around the whole triangles below (Wald, Boulos and Shirley, "Ray Tracing Deformable
    /// Scenes Using Dynamic Bounding Volume Hierarchies", ACM Transactions on Graphics 26(1), 2007),
    /// also where the builder had cut them. With `rotates`, subtrees change places on the way where
    /// that makes the tree better (see [`rotate`]).
    ///
    /// Where children were exchanged, `second` says at once whether child 1 is to come first, while the
    /// node is at hand: that is all that NodeSATO asks.
    ///
    /// The same on any number of threads of the current rayon pool. The tree's notes are void
    /// afterwards, and dropped.
    pub(crate) fn update(
        &mut self,
        tree: &mut Bvh2,
        mesh: &TriangleMesh,
        rotates: bool,
        second: Option<fn(&Node2) -> bool>,
    ) -> Updated {
        tree.notes = SplitNotes::default();
        self.touched.iter_mut().for_each(Touched::clear);
        let Some(root) = tree.root else { return Updated::default() };
        let ids = &tree.triangle_ids;
        if root.is_leaf() {
            let slots = root.leaf_slots();
            tree.bounds = refit::leaf(mesh, ids, &mut tree.triangles[slots.clone()], slots.start);
            return Updated { sah_cost: tree.sah_cost(), rotations: 0 };
        }
        let (top, depths) = self.pieces.downwards(&tree.nodes);
        let (of_top, of_subtrees) = self.touched.split_last_mut().expect("one for the top");
        let disturbed = if self.disturbed.is_empty() {
            self.pieces.subtrees.iter().map(|_| Default::default()).collect()
        } else {
            self.pieces.split(&mut self.disturbed)
        };
        let parts = self.pieces.split(&mut tree.nodes).into_iter();
        let parts: Vec<_> = parts
            .zip(split_by(&self.slots, &mut tree.triangles))
            .zip(self.pieces.split(&mut self.heights))
            .zip(disturbed)
            .zip(of_subtrees)
            .zip(self.pieces.subtrees.iter().zip(&self.slots))
            .map(|(((((nodes, triangles), heights), disturbed), touched), (own, slots))| Part {
                mesh,
                ids,
                nodes,
                first: own.start,
                triangles,
                first_slot: slots.start,
                heights,
                disturbed,
                closed: None,
                touched,
                second,
                cost: 0.0,
            })
            .collect();
        let of_part = |steps: &mut Vec<Step>, (index, mut part): (usize, Part<'_>)| {
            let first = part.first;
            downwards(part.nodes, first, depths[index], steps);
            (first..first + part.nodes.len()).for_each(|index| part.refit_leaves(index));
            steps.iter().rev().for_each(|step| part.settle(*step, rotates));
            (part.cost, part.touched.rotations)
        };
        let of_parts: Vec<(f64, u64)> =
            parts.into_par_iter().enumerate().map_init(Vec::new, of_part).collect();
        let mut part = Part {
            mesh,
            ids,
            nodes: &mut tree.nodes,
            first: 0,
            triangles: &mut tree.triangles,
            first_slot: 0,
            heights: &mut self.heights,
            disturbed: &mut self.disturbed,
            closed: Some(&self.pieces),
            touched: of_top,
            second,
            cost: of_parts.iter().map(|part| part.0).sum(),
        };
        for step in top.iter().rev() {
            part.refit_leaves(step.index as usize);
            part.settle(*step, rotates);
        }
        let below = part.cost;
        tree.bounds = tree.nodes[0].bounds[0].union(tree.nodes[0].bounds[1]);
        let area = tree.bounds.half_area();
        Updated {
            sah_cost: 1.0 + if area > 0.0 { below / area } else { 0.0 },
            rotations: self.touched.iter().map(|touched| touched.rotations).sum(),
        }
    }

    /// Bytes of all arrays.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let lists: usize = self.touched.iter().map(Touched::memory_bytes).sum();
        (lists + self.heights.len() + self.disturbed.len() + size_of_val(self.slots.as_slice()))
            as u64
            + self.pieces.memory_bytes()
    }
}

/// Of lengths in `f32`, and without asking whether the box is empty: to tell what is worth a closer
/// look.
#[inline(always)]
fn half_area(bounds: &Aabb) -> f64 {
    let d = bounds.size().as_dvec3();
    d.x * d.y + d.y * d.z + d.z * d.x
}

//! Tree layouts, each with its validator, and the plan by which any-hit kernels walk them.

mod bits;
mod bvh2;
mod bvh8;
mod kd;
mod notes;
mod pieces;

pub use bits::NodeBits;
pub use bvh2::{Bvh2, ChildRef, MAX_DEPTH, MAX_LEAF_TRIANGLES, Node2};
pub use bvh8::{Bvh8, MAX_WIDE_DEPTH, MAX_WIDE_LEAF, Node8, WIDTH};
pub(crate) use bvh8::{LEAF_ROWS, refit_leaf, write_leaf_in_lanes};
pub use kd::{KD_INTERSECTION_COST, KD_MAX_DEPTH, KD_MAX_NODES, KD_TRAVERSAL_COST, KdNode, KdTree};
pub use notes::SplitNotes;
pub(crate) use pieces::{Pieces, Step, downwards, heights_of, slots_of, split_by};

use crate::geometry::{Aabb, TriangleMesh};

/// The score of a child by what is known when its parent is split, its box and its triangles: those
/// with larger scores come first.
pub type ScoreAtSplit = fn(&TriangleMesh, &Aabb, &mut dyn ExactSizeIterator<Item = u32>) -> f64;

/// What an order knows of a part of a tree when it goes on with what lies above: numbers that mean
/// something to that order alone.
pub type PartSummary = [f64; 2];

/// Sets for each node of a part of a binary tree the scores of its two children, on one thread, and
/// returns what to know of the part. Where summaries are given the part is the top of a tree: each of
/// its leaves stands for a part below, and its slot is the index of that part's summary.
pub type ScorePart = fn(&Bvh2, Option<&[PartSummary]>, &mut Vec<[f64; 2]>) -> PartSummary;

/// How an any-hit kernel chooses between two children that the ray meets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Child 1 (the upper one) where the node's bit is set, child 0 elsewhere, whatever the ray.
    Fixed(NodeBits),
    /// The child that the ray enters first.
    Near,
    /// The child that the ray enters last.
    Far,
}

impl Plan {
    /// Bytes that it takes beside the tree.
    pub fn memory_bytes(&self) -> u64 {
        match self {
            Self::Fixed(bits) => bits.memory_bytes(),
            Self::Near | Self::Far => 0,
        }
    }
}

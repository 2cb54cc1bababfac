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

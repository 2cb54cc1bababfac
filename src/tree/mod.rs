//! Tree layouts, each with its validator, and the plan by which any-hit kernels walk them.

mod bvh2;
mod bvh8;
mod kd;

pub use bvh2::{Bvh2, ChildRef, MAX_DEPTH, MAX_LEAF_TRIANGLES, Node2};
pub(crate) use bvh8::LEAF_ROWS;
pub use bvh8::{Bvh8, MAX_WIDE_DEPTH, MAX_WIDE_LEAF, Node8, WIDTH, unit_normal};
pub use kd::{KD_INTERSECTION_COST, KD_MAX_DEPTH, KD_MAX_NODES, KD_TRAVERSAL_COST, KdNode, KdTree};

/// How an any-hit kernel chooses between two children that the ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// The order that the tree itself holds, whatever the ray: child 0 first, or as each node's bit
    /// says.
    Slots,
    /// The child that the ray enters first.
    Near,
    /// The child that the ray enters last.
    Far,
}

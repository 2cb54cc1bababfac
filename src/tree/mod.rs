//! Tree layouts, each with its validator, and the plan by which any-hit kernels walk them.

mod bvh2;

pub use bvh2::{Bvh2, ChildRef, MAX_DEPTH, MAX_LEAF_TRIANGLES, Node2};

/// How an any-hit kernel chooses between two children that the ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Child 0 first, whatever the ray.
    Slots,
    /// The child that the ray enters first.
    Near,
    /// The child that the ray enters last.
    Far,
}

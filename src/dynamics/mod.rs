//! Trees that follow moving triangles: boxes brought up to date, subtrees put elsewhere, traversal
//! orders kept right, and when to build anew instead.

mod binary;
mod policy;
mod strategy;
mod wide;

pub(crate) use binary::{BinaryFollower, PlanUpkeep};
pub use policy::SkiRental;
pub use strategy::{Strategy, Upkeep};
pub(crate) use wide::{Ranking, WideFollower};

/// A rotation must make the boxes in between smaller by this share at least: less is not worth the
/// order that has to be found again, and two rotations that undo each other cannot alternate by
/// rounding.
const LEAST_GAIN: f64 = 1e-3;

/// What an update found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Updated {
    /// The tree's cost by the surface-area heuristic.
    pub(crate) sah_cost: f64,
    /// Nodes at which subtrees below changed places.
    pub(crate) rotations: u64,
}

/// Nodes that rotations changed.
#[derive(Debug, Default)]
struct Touched {
    /// Nodes whose children were exchanged, or whose children's children were; in no order, some
    /// more than once.
    exchanged: Vec<u32>,
    /// These and all above them, children before parents, some more than once: the last time counts.
    disturbed: Vec<u32>,
    rotations: u64,
}

impl Touched {
    fn clear(&mut self) {
        self.exchanged.clear();
        self.disturbed.clear();
        self.rotations = 0;
    }

    fn memory_bytes(&self) -> usize {
        4 * (self.exchanged.capacity() + self.disturbed.capacity()) + size_of::<Self>()
    }
}

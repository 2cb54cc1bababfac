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

/// A rotation must make the boxes in between smaller by this share at least. Walking people offer
/// rotations at a tenth of all nodes in every frame for gains that the next frame takes back; with this
/// share, trees trace as fast, and the order has to be found again at about a third of those nodes.
const LEAST_GAIN: f64 = 0.1;

/// What an update found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Updated {
    /// The tree's cost by the surface-area heuristic.
    pub(crate) sah_cost: f64,
    /// Nodes at which subtrees below changed places.
    pub(crate) rotations: u64,
}

/// In a list of nodes: that child 1 is to come first.
const SECOND: u32 = 1 << 31;

/// Nodes that rotations changed.
#[derive(Debug, Default)]
struct Touched {
    /// Nodes whose children were exchanged, or whose children's children were; some more than once:
    /// the last time counts. With [`SECOND`] where child 1 is to come first, if that was asked for.
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

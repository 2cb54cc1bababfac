//! Traversal kernels. They know plans, not heuristics; counting is a type parameter, so that timed
//! runs do not count.

pub mod kd;
pub mod packet;
pub mod shaft;
pub mod single;
pub mod wide;

use crate::intersect::Stage;
use crate::ray::VisitCounts;
use crate::tree::ChildRef;

/// What a kernel tells of its visits.
pub trait Counter {
    /// An inner node or leaf was entered.
    fn node(&mut self);
    /// So many triangles were tested.
    fn triangles(&mut self, count: usize);
    /// A test was settled by this arithmetic.
    #[inline(always)]
    fn settled(&mut self, _by: Stage) {}
    /// As [`node`](Self::node), for those who want to know which one.
    #[inline(always)]
    fn enter(&mut self, _child: ChildRef) {
        self.node();
    }
}

/// Counts nothing, at no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCount;

impl Counter for NoCount {
    #[inline(always)]
    fn node(&mut self) {}
    #[inline(always)]
    fn triangles(&mut self, _count: usize) {}
}

impl Counter for VisitCounts {
    fn node(&mut self) {
        self.nodes += 1;
    }
    fn triangles(&mut self, count: usize) {
        self.triangles += count as u32;
    }
    fn settled(&mut self, by: Stage) {
        match by {
            Stage::Single => {}
            Stage::Double => self.double_tests += 1,
            Stage::Exact => self.exact_tests += 1,
        }
    }
}

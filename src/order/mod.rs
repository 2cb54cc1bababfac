//! Any-hit traversal orders, and their catalogue.
//!
//! An order is data, not code: it compiles a tree into a [`Plan`], a bit for each node that says
//! which child to visit first, or the name of a rule that the ray decides. Kernels know plans, not
//! heuristics, and one tree serves any number of orders. Where an order cannot tell two children
//! apart, child 0 comes first.

mod bottom_up;
mod far;
pub mod kd;
pub mod nary;
mod near;
mod node_sato;
mod p_over_c;
mod prim_num;
mod prim_sato;
mod random;
mod rtsah;
mod score;
mod trained;

pub use rtsah::line_probability::lines_through_both;
pub use score::{SCORED, ScoredOrder, Scores, find_scored};

use crate::geometry::TriangleMesh;
use crate::ray_set::RaySet;
use crate::tree::{Bvh2, KdTree, Node2, NodeBits, Plan};

/// One traversal order.
#[derive(Debug)]
pub struct OrderEntry {
    /// As typed after `order=`.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Whether it learns from recorded rays: its context must have some.
    pub needs_training: bool,
    /// The plan for a binary tree, on the current rayon pool. Same for any number of threads.
    pub plan_bvh2: fn(&Bvh2, &OrderContext<'_>) -> Plan,
    /// The plan for a kd-tree likewise; `None` where the order means nothing for one.
    pub plan_kd: Option<fn(&KdTree, &OrderContext<'_>) -> Plan>,
}

/// What an order may look at besides the tree.
#[derive(Clone, Copy, Debug)]
pub struct OrderContext<'a> {
    /// The mesh that the tree was built over.
    pub mesh: &'a TriangleMesh,
    /// Seed of random orders.
    pub seed: u64,
    /// Recorded rays, representative of those to come.
    pub training: Option<&'a RaySet>,
}

impl<'a> OrderContext<'a> {
    /// Of a mesh alone: seed 0 and no recorded rays.
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        Self { mesh, seed: 0, training: None }
    }
}

/// All orders.
pub static ORDERS: &[&OrderEntry] = &[
    &near::ENTRY,
    &far::ENTRY,
    &random::ENTRY,
    &node_sato::ENTRY,
    &prim_sato::MEAN,
    &prim_sato::LARGEST,
    &prim_num::FEWEST,
    &prim_num::MOST,
    &rtsah::EXACT,
    &rtsah::PAPER,
    &rtsah::LEAF,
    &rtsah::APPROXIMATE,
    &rtsah::CLAMPED,
    &p_over_c::ENTRY,
    &trained::EXACT,
    &trained::BY_RATIO,
];

/// The order called `name`.
pub fn find(name: &str) -> Option<&'static OrderEntry> {
    ORDERS.iter().copied().find(|o| o.name == name)
}

/// Child 1 first wherever `second_first` says so of a node (with its index).
fn second_where(tree: &Bvh2, second_first: impl Fn(usize, &Node2) -> bool + Sync) -> Plan {
    let nodes = &tree.nodes;
    Plan::Fixed(NodeBits::from_fn(nodes.len(), |index| second_first(index, &nodes[index])))
}

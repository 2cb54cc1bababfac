//! Any-hit traversal orders, and their catalogue.
//!
//! An order is data, not code: it compiles a tree into a [`Plan`], by swapping the children of
//! nodes so that the one to visit first is child 0, or by naming a rule that the ray decides.
//! Kernels know plans, not heuristics. Where an order cannot tell two children apart, it keeps
//! them as they are.

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
use crate::tree::{Bvh2, KdTree, Node2, Plan};
use rayon::prelude::*;

/// One traversal order.
#[derive(Debug)]
pub struct OrderEntry {
    /// As typed after `order=`.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Whether it learns from recorded rays: its context must have some.
    pub needs_training: bool,
    /// Prepares a binary tree on the current rayon pool. Same result for any number of threads.
    pub plan_bvh2: fn(&mut Bvh2, &OrderContext<'_>) -> Plan,
    /// Prepares a kd-tree likewise; `None` where the order means nothing for one.
    pub plan_kd: Option<fn(&mut KdTree, &OrderContext<'_>) -> Plan>,
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

/// Puts child 1 first wherever `second_first` says so of a node (with its index).
fn swap_where(tree: &mut Bvh2, second_first: impl Fn(usize, &Node2) -> bool + Sync) -> Plan {
    // Nodes are first listed, then swapped, as no processor foresees which ones.
    const LIST: usize = 256;
    // Below a few thousand nodes threads cost more than they bring.
    let lists = tree.nodes.par_chunks_mut(LIST).with_min_len(32).enumerate();
    lists.for_each(|(list, nodes)| {
        let mut to_swap = [0u8; LIST];
        let mut count = 0;
        for (index, node) in nodes.iter().enumerate() {
            to_swap[count] = index as u8;
            count += usize::from(second_first(list * LIST + index, node));
        }
        for &index in &to_swap[..count] {
            nodes[usize::from(index)].swap_children();
        }
    });
    Plan::Slots
}

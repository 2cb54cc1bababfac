//! Any-hit traversal orders, and their catalogue.
//!
//! An order is data, not code: it compiles a tree into a [`Plan`], by swapping the children of
//! nodes so that the one to visit first is child 0, or by naming a rule that the ray decides.
//! Kernels know plans, not heuristics.

mod far;
mod near;
mod node_sato;
mod random;

use crate::geometry::TriangleMesh;
use crate::tree::{Bvh2, Node2, Plan};
use rayon::prelude::*;

/// One traversal order.
#[derive(Debug)]
pub struct OrderEntry {
    /// As typed after `order=`.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Prepares a binary tree on the current rayon pool. Same result for any number of threads.
    pub plan_bvh2: fn(&mut Bvh2, &OrderContext<'_>) -> Plan,
}

/// What an order may look at besides the tree.
#[derive(Clone, Copy, Debug)]
pub struct OrderContext<'a> {
    /// The mesh that the tree was built over.
    pub mesh: &'a TriangleMesh,
    /// Seed of random orders.
    pub seed: u64,
}

/// All orders.
pub static ORDERS: &[&OrderEntry] = &[&near::ENTRY, &far::ENTRY, &random::ENTRY, &node_sato::ENTRY];

/// The order called `name`.
pub fn find(name: &str) -> Option<&'static OrderEntry> {
    ORDERS.iter().copied().find(|o| o.name == name)
}

/// Puts child 1 first wherever `second_first` says so of a node (with its index). Below a few
/// thousand nodes threads cost more than they bring.
fn swap_where(tree: &mut Bvh2, second_first: impl Fn(usize, &Node2) -> bool + Sync) -> Plan {
    tree.nodes.par_iter_mut().with_min_len(8192).enumerate().for_each(|(index, node)| {
        if second_first(index, node) {
            node.bounds.swap(0, 1);
            node.children.swap(0, 1);
            node.counts.swap(0, 1);
        }
    });
    Plan::Slots
}

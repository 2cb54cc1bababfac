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
mod trained;
mod upkeep;

pub use rtsah::line_probability::lines_through_both;
pub(crate) use upkeep::{DependsOn, KeptOrder};

use crate::geometry::{Aabb, TriangleMesh};
use crate::ray_set::RaySet;
use crate::tree::{Bvh2, KdTree, Node2, NodeBits, PartSummary, Plan, ScoreAtSplit, ScorePart};
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
    /// The plan for a binary tree, on the current rayon pool. Same for any number of threads.
    pub plan_bvh2: fn(&Bvh2, &OrderContext<'_>) -> Plan,
    /// What its bits for a binary tree depend on.
    pub(crate) depends_on: DependsOn,
    /// The score of a child by its box, where that is all that its score depends on.
    pub(crate) box_score: Option<fn(&Aabb) -> f64>,
    /// The plan for a kd-tree likewise; `None` where the order means nothing for one.
    pub plan_kd: Option<fn(&KdTree, &OrderContext<'_>) -> Plan>,
    /// For trees with more than two children, collapsed from a binary one: a score of each child of
    /// each of its nodes, the largest of siblings to come first; `None` where the order is none
    /// between more than two.
    pub scores: Option<fn(&Bvh2, &OrderContext<'_>) -> Scores>,
    /// The same scores part by part, for trees of which the whole is never there; `None` where they
    /// depend on more than what lies below.
    pub score_part: Option<ScorePart>,
    /// The score of a child by what is known when its parent is split, its box and its triangles: for
    /// trees that are built where rays come by, where nothing is known of what lies below.
    pub at_split: Option<ScoreAtSplit>,
}

/// For each node of a binary tree the scores of its two children.
pub type Scores = Vec<[f64; 2]>;

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

/// The score of each child (with the index of its node and its side).
fn score_each(tree: &Bvh2, score: impl Fn(usize, &Node2, usize) -> f64 + Sync) -> Scores {
    let nodes = tree.nodes.par_iter().with_min_len(8192).enumerate();
    nodes.map(|(index, node)| [0, 1].map(|side| score(index, node, side))).collect()
}

/// As [`score_each`], of a part: see [`ScorePart`].
fn score_each_of_part(
    tree: &Bvh2,
    scores: &mut Vec<[f64; 2]>,
    score: impl Fn(&Node2, usize) -> f64,
) -> PartSummary {
    scores.clear();
    scores.extend(tree.nodes.iter().map(|node| [0, 1].map(|side| score(node, side))));
    PartSummary::default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::test_random::Random;

    /// Of two children, the one with the larger score is the one that the plan has first.
    #[test]
    fn scores_say_what_plans_do() {
        let mesh = Random::new(61).mesh(4000);
        let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
        let context = OrderContext::new(&mesh);
        let mut scored = 0;
        for order in ORDERS.iter().filter(|o| o.name != "random") {
            let Some(scores) = order.scores else { continue };
            let Plan::Fixed(second_first) = (order.plan_bvh2)(&tree, &context) else {
                panic!("{} is a fixed order", order.name);
            };
            for (index, [first, second]) in scores(&tree, &context).into_iter().enumerate() {
                // Keys may be compared crosswise, which rounds otherwise.
                let is_tie = (first - second).abs() <= 1e-12 * second.abs();
                let name = order.name;
                assert!(is_tie || second_first.get(index) == (second > first), "{name} {index}");
            }
            scored += 1;
        }
        assert!(scored >= 5, "{scored}");
    }
}

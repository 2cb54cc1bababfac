//! Orders of kd-trees: each sets one bit in every inner node with two children. An empty side is
//! never first under any order, and never visited at all.

mod prim_num;
mod prim_sato;
mod rtsah;
mod summary;

pub use prim_num::{prim_num, prim_num_most};
pub use prim_sato::{prim_sato_average, prim_sato_max};
pub use rtsah::rtsah;
pub use summary::{SubtreeSummary, summaries};

use crate::tree::{KdNode, KdTree, Plan};
use rayon::prelude::*;

/// Puts the upper child first where `upper_first` says so of a node (with its index), and the lower
/// one elsewhere; what it says of nodes without two children is ignored. Below some ten thousand
/// nodes threads cost more than they bring.
pub(super) fn set_where(
    tree: &mut KdTree,
    upper_first: impl Fn(usize, KdNode) -> bool + Sync,
) -> Plan {
    const CHUNK: usize = 1 << 14;
    tree.nodes.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, nodes)| {
        for (index, node) in (chunk * CHUNK..).zip(nodes) {
            node.set_upper_first(upper_first(index, *node));
        }
    });
    Plan::Slots
}

/// NodeSATO: the side with the larger surface first. Both cells share the plane's cross-section, so
/// the longer one is the larger one, which the builder noted when it cut them.
pub(super) fn node_sato(tree: &mut KdTree) -> Plan {
    set_where(tree, |_, node| node.upper_larger())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::order::{ORDERS, OrderContext};
    use crate::test_random::Random;

    #[test]
    fn node_sato_is_a_comparison_of_areas() {
        let mesh = Random::new(41).mesh(3000);
        let mut tree = build(&mesh, Splits::Perfect).unwrap();
        assert_eq!(node_sato(&mut tree), Plan::Slots);
        let mut compared = 0;
        tree.walk(|index, cell, _| {
            let node = tree.nodes[index];
            if node.has_two() {
                let [lower, upper] = KdTree::split_cell(cell, node).map(|c| c.half_area());
                let tie = (lower - upper).abs() <= 1e-12 * (lower + upper);
                assert!(tie || (upper > lower) == node.upper_first(), "node {index}");
                compared += usize::from(!tie);
            }
        });
        assert!(compared > 1000, "{compared}");
    }

    #[test]
    fn orders_change_bits_of_nodes_with_two_children_only() {
        let mesh = Random::new(42).mesh(2000);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext { seed: 5, ..OrderContext::new(&mesh) };
        let more: [fn(&mut KdTree, &OrderContext<'_>) -> Plan; 5] =
            [prim_num, prim_num_most, prim_sato_average, prim_sato_max, rtsah];
        let plans = ORDERS.iter().filter_map(|o| o.plan_kd).chain(more);
        for plan in plans {
            let mut ordered = tree.clone();
            plan(&mut ordered, &context);
            ordered.validate(&mesh).unwrap();
            for (index, (a, b)) in tree.nodes.iter().zip(&ordered.nodes).enumerate() {
                let mut b = *b;
                b.set_upper_first(a.upper_first());
                assert_eq!(*a, b, "node {index}");
            }
        }
    }
}

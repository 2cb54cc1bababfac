//! Orders of kd-trees: a bit for every node with two children. An empty side is never first under
//! any order, and never visited at all.

mod prim_num;
mod prim_sato;
mod rtsah;
mod summary;

pub use prim_num::{prim_num, prim_num_most};
pub use prim_sato::{prim_sato_average, prim_sato_max};
pub use rtsah::rtsah;
pub use summary::{SubtreeSummary, summaries};

use crate::order::OrderContext;
use crate::tree::{KdNode, KdTree, NodeBits, Plan};

/// The upper child first where `upper_first` says so of a node with two children (with its index).
pub(super) fn upper_where(
    tree: &KdTree,
    upper_first: impl Fn(usize, KdNode) -> bool + Sync,
) -> Plan {
    let nodes = &tree.nodes;
    Plan::Fixed(NodeBits::from_fn(nodes.len(), |index| {
        nodes[index].has_two() && upper_first(index, nodes[index])
    }))
}

/// NodeSATO: the side with the larger surface first, which the builder noted.
pub fn node_sato(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    Plan::Fixed(tree.notes.second_larger.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::order::ORDERS;
    use crate::test_random::Random;

    #[test]
    fn node_sato_is_a_comparison_of_areas() {
        let mesh = Random::new(41).mesh(3000);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let Plan::Fixed(bits) = node_sato(&tree, &OrderContext::new(&mesh)) else {
            panic!("a fixed order");
        };
        let mut compared = 0;
        tree.walk(|index, cell, _| {
            let node = tree.nodes[index];
            if node.has_two() {
                let [lower, upper] = KdTree::split_cell(cell, node).map(|c| c.half_area());
                let tie = (lower - upper).abs() <= 1e-12 * (lower + upper);
                assert!(tie || (upper > lower) == bits.get(index), "node {index}");
                compared += usize::from(!tie);
            }
        });
        assert!(compared > 1000, "{compared}");
    }

    #[test]
    fn orders_set_bits_of_nodes_with_two_children_only() {
        let mesh = Random::new(42).mesh(2000);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext { seed: 5, ..OrderContext::new(&mesh) };
        let mut fixed = 0;
        for order in ORDERS {
            let Some(plan) = order.plan_kd.map(|plan| plan(&tree, &context)) else { continue };
            let Plan::Fixed(bits) = plan else { continue };
            assert_eq!(bits.len(), tree.nodes.len(), "{}", order.name);
            for (index, node) in tree.nodes.iter().enumerate() {
                assert!(node.has_two() || !bits.get(index), "{}: node {index}", order.name);
            }
            assert!(bits.count_ones() > 0, "{}", order.name);
            fixed += 1;
        }
        assert!(fixed >= 7, "{fixed}");
    }
}

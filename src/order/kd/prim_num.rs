//! Orders by number of triangles, from the builder's lists (Nah and Manocha, "SATO", 2014).

use super::set_where;
use crate::order::OrderContext;
use crate::tree::{KdTree, Plan};

/// The side with fewer triangles first: under the surface-area heuristic it tends to be the larger.
/// The builder noted it when it dealt them out.
pub fn prim_num(tree: &mut KdTree, _: &OrderContext<'_>) -> Plan {
    set_where(tree, |_, node| node.upper_fewer())
}

/// The side with more triangles first: the control of [`prim_num`].
pub fn prim_num_most(tree: &mut KdTree, _: &OrderContext<'_>) -> Plan {
    let counts = std::mem::take(&mut tree.counts);
    let plan = set_where(tree, |index, node| {
        node.has_two() && counts[node.upper_child()] > counts[index + 1]
    });
    tree.counts = counts;
    plan
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::test_random::Random;

    #[test]
    fn fewest_and_most_are_opposites_but_for_ties() {
        let mesh = Random::new(43).mesh(2000);
        let mut tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext { seed: 0, ..OrderContext::new(&mesh) };
        prim_num(&mut tree, &context);
        let fewest = tree.clone();
        prim_num_most(&mut tree, &context);
        for (index, node) in tree.nodes.iter().enumerate() {
            if !node.has_two() {
                continue;
            }
            let (lower, upper) = (tree.counts[index + 1], tree.counts[node.upper_child()]);
            assert_eq!(node.upper_first(), upper > lower);
            assert_eq!(fewest.nodes[index].upper_first(), upper < lower);
        }
    }
}

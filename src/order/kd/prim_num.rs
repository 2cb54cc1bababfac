//! Orders by number of triangles, from the builder's lists (Nah and Manocha, "SATO", 2014).

use super::upper_where;
use crate::order::OrderContext;
use crate::tree::{KdTree, Plan};

/// The side with fewer triangles first: under the surface-area heuristic it tends to be the larger.
/// The builder noted it when it dealt them out.
pub fn prim_num(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    Plan::Fixed(tree.notes.second_fewer.clone())
}

/// The side with more triangles first: the control of [`prim_num`].
pub fn prim_num_most(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    let counts = &tree.counts;
    upper_where(tree, |index, node| counts[node.upper_child()] > counts[index + 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::test_random::Random;

    #[test]
    fn fewest_and_most_are_opposites_but_for_ties() {
        let mesh = Random::new(43).mesh(2000);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext::new(&mesh);
        let (Plan::Fixed(fewest), Plan::Fixed(most)) =
            (prim_num(&tree, &context), prim_num_most(&tree, &context))
        else {
            panic!("fixed orders");
        };
        for (index, node) in tree.nodes.iter().enumerate() {
            if !node.has_two() {
                continue;
            }
            let (lower, upper) = (tree.counts[index + 1], tree.counts[node.upper_child()]);
            assert_eq!((most.get(index), fewest.get(index)), (upper > lower, upper < lower));
        }
    }
}

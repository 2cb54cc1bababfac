//! PrimSATO (Nah and Manocha, "SATO", 2014): the side with the larger triangles first, by their
//! mean area or by the largest one. Areas are of whole triangles, not of their parts in the cell.

use super::summary::{SubtreeSummary, for_each_pair};
use crate::order::OrderContext;
use crate::tree::{KdTree, NodeBits, Plan};

/// The side whose triangles have the larger mean area first.
pub fn prim_sato_average(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    // Crosswise, so that no division is needed.
    upper_where::<true, false>(tree, |[lower, upper]| {
        upper.area_sum * f64::from(lower.count) > lower.area_sum * f64::from(upper.count)
    })
}

/// The side with the largest triangle first.
pub fn prim_sato_max(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    upper_where::<false, true>(tree, |[lower, upper]| upper.area_max > lower.area_max)
}

fn upper_where<const SUMS: bool, const MAXIMA: bool>(
    tree: &KdTree,
    upper_first: impl Fn([SubtreeSummary; 2]) -> bool,
) -> Plan {
    let mut bits = NodeBits::none(tree.nodes.len());
    for_each_pair::<SUMS, MAXIMA>(tree, |index, sides| bits.set(index, upper_first(sides)));
    Plan::Fixed(bits)
}

#[cfg(test)]
mod tests {
    use super::super::summaries;
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::test_random::Random;

    #[test]
    fn larger_means_and_maxima_come_first() {
        let mesh = Random::new(44).mesh(1500);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext::new(&mesh);
        let summaries = summaries(&tree);
        let (Plan::Fixed(average), Plan::Fixed(largest)) =
            (prim_sato_average(&tree, &context), prim_sato_max(&tree, &context))
        else {
            panic!("fixed orders");
        };
        let mut seen = 0;
        for (index, summary) in summaries.iter().enumerate() {
            if !tree.nodes[index].has_two() {
                continue;
            }
            let [lower, upper] = summary.map(|s| s.area_sum / f64::from(s.count));
            if (lower - upper).abs() > 1e-12 * (lower + upper) {
                assert_eq!(average.get(index), upper > lower, "node {index}");
                seen += 1;
            }
            let [lower, upper] = summary.map(|s| s.area_max);
            assert_eq!(largest.get(index), upper > lower, "node {index}");
        }
        assert!(seen > 500, "{seen}");
    }
}

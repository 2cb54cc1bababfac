//! PrimSATO (Nah and Manocha, "SATO", 2014): the side with the larger triangles first, by their
//! mean area or by the largest one. Areas are of whole triangles, not of their parts in the cell.

use super::summary::for_each_inner;
use crate::order::OrderContext;
use crate::tree::{KdTree, Plan};

/// The side whose triangles have the larger mean area first.
pub fn prim_sato_average(tree: &mut KdTree, _: &OrderContext<'_>) -> Plan {
    for_each_inner(tree, |_, node, [lower, upper]| {
        // Crosswise, so that no division is needed.
        let (lower_count, upper_count) = (f64::from(lower.count), f64::from(upper.count));
        node.set_upper_first(upper.area_sum * lower_count > lower.area_sum * upper_count);
    });
    Plan::Slots
}

/// The side with the largest triangle first.
pub fn prim_sato_max(tree: &mut KdTree, _: &OrderContext<'_>) -> Plan {
    for_each_inner(tree, |_, node, [lower, upper]| {
        node.set_upper_first(upper.area_max > lower.area_max);
    });
    Plan::Slots
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
        let mut tree = build(&mesh, Splits::Perfect).unwrap();
        let context = OrderContext { seed: 0, ..OrderContext::new(&mesh) };
        let summaries = summaries(&tree);
        let mut average = tree.clone();
        prim_sato_average(&mut average, &context);
        prim_sato_max(&mut tree, &context);
        let mut seen = 0;
        for (index, summary) in summaries.iter().enumerate() {
            let node = tree.nodes[index];
            if !node.has_two() {
                continue;
            }
            let [lower, upper] = summary.map(|s| s.area_sum / f64::from(s.count));
            if (lower - upper).abs() > 1e-12 * (lower + upper) {
                assert_eq!(average.nodes[index].upper_first(), upper > lower, "node {index}");
                seen += 1;
            }
            let [lower, upper] = summary.map(|s| s.area_max);
            assert_eq!(node.upper_first(), upper > lower, "node {index}");
        }
        assert!(seen > 500, "{seen}");
    }
}

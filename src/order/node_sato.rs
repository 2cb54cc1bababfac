//! NodeSATO (Nah and Manocha, "SATO: Surface-Area Traversal Order for Shadow Ray Tracing",
//! Computer Graphics Forum 33(6), 2014): the child with the larger surface area first. In trees
//! built by the surface-area heuristic it is the likelier one to hold large occluders.

use super::{DependsOn, OrderEntry, kd, score_each, score_each_of_part};
use crate::geometry::Aabb;
use crate::tree::{Node2, Plan};

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "node-sato",
    about: "surface-area traversal order: the child with the larger box or cell first",
    needs_training: false,
    plan_bvh2: |tree, _| Plan::Fixed(tree.notes.second_larger.clone()),
    depends_on: DependsOn::Children(Node2::second_is_larger),
    box_score: Some(Aabb::half_area),
    plan_kd: Some(kd::node_sato),
    scores: Some(|tree, _| score_each(tree, |_, node, side| node.bounds[side].half_area())),
    score_part: Some(|tree, _, scores| {
        score_each_of_part(tree, scores, |node, side| node.bounds[side].half_area())
    }),
    at_split: Some(|_, bounds, _| bounds.half_area()),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::order::OrderContext;
    use crate::test_random::Random;

    #[test]
    fn the_larger_box_comes_first() {
        let mesh = Random::new(1).mesh(5000);
        let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
        let Plan::Fixed(bits) = (ENTRY.plan_bvh2)(&tree, &OrderContext::new(&mesh)) else {
            panic!("a fixed order");
        };
        for (index, node) in tree.nodes.iter().enumerate() {
            let [a, b] = node.bounds.map(|b| b.half_area());
            assert_eq!(bits.get(index), b > a, "node {index}");
        }
    }
}

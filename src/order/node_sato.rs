//! NodeSATO (Nah and Manocha, "SATO: Surface-Area Traversal Order for Shadow Ray Tracing",
//! Computer Graphics Forum 33(6), 2014): the child with the larger surface area first. In trees
//! built by the surface-area heuristic it is the likelier one to hold large occluders.

use super::{OrderEntry, kd, swap_where};
use crate::tree::Node2;

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "node-sato",
    about: "surface-area traversal order: the child with the larger box or cell first",
    needs_training: false,
    plan_bvh2: |tree, _| swap_where(tree, |_, node| second_is_larger(node)),
    plan_kd: Some(|tree, _| kd::node_sato(tree)),
};

/// Strictly larger: ties keep child 0.
fn second_is_larger(node: &Node2) -> bool {
    node.bounds[1].half_area() > node.bounds[0].half_area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::order::{OrderContext, find};
    use crate::test_random::Random;
    use crate::tree::Plan;

    #[test]
    fn child_0_is_never_the_smaller_one() {
        let mesh = Random::new(1).mesh(5000);
        let mut tree = (build::find("binned").unwrap().build)(&mesh);
        let context = OrderContext::new(&mesh);
        (find("random").unwrap().plan_bvh2)(&mut tree, &context);
        assert!(tree.nodes.iter().any(second_is_larger));
        assert_eq!((ENTRY.plan_bvh2)(&mut tree, &context), Plan::Slots);
        assert!(!tree.nodes.iter().any(second_is_larger));
        tree.validate(&mesh).unwrap();
    }
}

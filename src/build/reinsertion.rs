//! Better trees by reinsertion: subtrees are taken out, the largest first, and put where they cost least.
//! Pass follows pass while the last one gained enough to pay for its time. On one thread, after
//! [`binned`]. How: see [`Subtrees`].

use super::subtrees::Subtrees;
use super::{BuilderEntry, Leaves, binned};
use crate::geometry::TriangleMesh;
use crate::tree::{Bvh2, MAX_DEPTH};

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "reinsertion",
    about: "as binned, then subtrees go where they cost least while that pays: slow, better trees",
    build,
    in_parts: None,
};

/// Of all subtrees, the largest that a pass takes out: one in so many, but all if there are few.
const ONE_IN: usize = 8;
const FEW: usize = 2000;

/// The part of the areas of all boxes that a pass must gain for another to follow.
const LEAST_GAIN: f64 = 0.004;

const MOST_PASSES: usize = 16;

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    let tree = binned::build(mesh, leaves);
    optimised(tree)
}

/// The tree with subtrees in better places.
fn optimised(tree: Bvh2) -> Bvh2 {
    if tree.nodes.len() < 3 {
        return tree;
    }
    let root = tree.root.expect("there are nodes");
    let mut best = Subtrees::of(&tree.nodes, root, &tree.bounds);
    for _ in 0..MOST_PASSES {
        let mut next = best.clone();
        next.move_largest((next.len() / ONE_IN).max(FEW));
        let (before, after) = (best.inner_areas(), next.inner_areas());
        // Stacks of traversals have room for so many levels.
        let is_better = after < before && next.depth() <= MAX_DEPTH;
        if !is_better {
            break;
        }
        best = next;
        if after > before * (1.0 - LEAST_GAIN) {
            break;
        }
    }
    best.tree(tree)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn it_costs_less_than_before() {
        for (seed, count) in [(0x2e1, 500), (0x2e2, 3000), (0x2e3, 20_000)] {
            let mesh = Random::new(seed).mesh(count);
            let before = binned::build(&mesh, Leaves::Single);
            let after = build(&mesh, Leaves::Single);
            after.validate(&mesh).unwrap();
            let (before, after) = (before.sah_cost(), after.sah_cost());
            assert!(after < 0.98 * before, "{count}: {after} {before}");
        }
    }
}

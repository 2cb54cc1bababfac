//! Orders brought up to date where a tree has changed.

use super::bottom_up::BottomUp;
use crate::tree::{Bvh2, ChildRef, Node2, NodeBits, Pieces, downwards};
use rayon::prelude::*;
use std::fmt::Debug;

/// What an order's bits depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DependsOn {
    /// On no children: what is said of a node holds, whatever comes below it.
    Nothing,
    /// On the two children as their node has them; whether child 1 comes first.
    Children(fn(&Node2) -> bool),
    /// On all that lies below; what keeps its summaries.
    AllBelow(fn() -> Box<dyn KeptOrder>),
    /// On what is known of the whole tree only.
    Everything,
}

/// An order that depends on all that lies below, with its summary of each node.
pub(crate) trait KeptOrder: Debug + Send + Sync {
    /// The bits of all nodes, and their summaries from scratch. Nodes need not lie in depth-first
    /// order.
    fn find_all(&mut self, tree: &Bvh2, pieces: &Pieces) -> NodeBits;

    /// Sets the bits and summaries of some nodes: those of each subtree, and of those above all
    /// subtrees. Children come before their parents; a node may come several times. What is below
    /// them is as it was when last looked at.
    fn find_some(
        &mut self,
        tree: &Bvh2,
        pieces: &Pieces,
        subtrees: &[&[u32]],
        top: &[u32],
        bits: &mut NodeBits,
    );

    /// Bytes of the summaries.
    fn memory_bytes(&self) -> u64;
}

/// Keeps the summaries of an order.
pub(super) fn keep<B: BottomUp + Send + 'static>(order: B) -> Box<dyn KeptOrder> {
    Box::new(Kept { order, summaries: Vec::new() })
}

struct Kept<B: BottomUp> {
    order: B,
    /// None before the first pass.
    summaries: Vec<B::Summary>,
}

impl<B: BottomUp> Debug for Kept<B> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} summaries", self.summaries.len())
    }
}

/// In a list of nodes: that child 1 is to come first.
const SECOND: u32 = 1 << 31;

impl<B: BottomUp + Send> KeptOrder for Kept<B> {
    fn find_all(&mut self, tree: &Bvh2, pieces: &Pieces) -> NodeBits {
        let mut bits = NodeBits::none(tree.nodes.len());
        let upwards = |nodes: std::ops::Range<usize>| {
            let mut steps = Vec::new();
            downwards(&tree.nodes[nodes.clone()], nodes.start, 0, &mut steps);
            steps.iter().rev().map(|step| step.index).collect::<Vec<u32>>()
        };
        let subtrees: Vec<Vec<u32>> = pieces.subtrees.par_iter().cloned().map(upwards).collect();
        let lists: Vec<&[u32]> = subtrees.iter().map(Vec::as_slice).collect();
        let top: Vec<u32> =
            pieces.downwards(&tree.nodes).0.iter().rev().map(|step| step.index).collect();
        self.summaries = vec![B::Summary::default(); tree.nodes.len()];
        self.find_some(tree, pieces, &lists, &top, &mut bits);
        bits
    }

    fn find_some(
        &mut self,
        tree: &Bvh2,
        pieces: &Pieces,
        subtrees: &[&[u32]],
        top: &[u32],
        bits: &mut NodeBits,
    ) {
        let Self { order, summaries } = self;
        let look = |summaries: &mut [B::Summary], first: usize, index: u32| {
            let node = &tree.nodes[index as usize];
            let below = |side: usize| {
                let child: ChildRef = node.children[side];
                if child.is_leaf() {
                    order.leaf(&tree.triangles[child.leaf_slots()], &node.bounds[side])
                } else {
                    summaries[child.node_index() - first]
                }
            };
            let below = [below(0), below(1)];
            let (summary, second) = order.node(node, &order.own(node), &below);
            summaries[index as usize - first] = summary;
            index | if second { SECOND } else { 0 }
        };
        let parts = pieces.split(summaries).into_par_iter().zip(&pieces.subtrees).zip(subtrees);
        let found: Vec<Vec<u32>> = parts
            .map(|((summaries, nodes), list)| {
                list.iter().map(|&index| look(summaries, nodes.start, index)).collect()
            })
            .collect();
        let of_top = top.iter().map(|&index| look(summaries, 0, index));
        for entry in found.into_iter().flatten().chain(of_top) {
            bits.set((entry & !SECOND) as usize, entry & SECOND != 0);
        }
    }

    fn memory_bytes(&self) -> u64 {
        size_of_val(self.summaries.as_slice()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{self, Leaves};
    use crate::order::{ORDERS, OrderContext};
    use crate::test_random::Random;
    use crate::tree::Plan;

    /// On trees as they are built, what is found node by node is what the plan says.
    #[test]
    fn nodes_are_found_as_by_the_plan() {
        let mesh = Random::new(0x71).mesh(20_000);
        let context = OrderContext::new(&mesh);
        let mut found = 0;
        for builder in build::BUILDERS {
            let tree = (builder.build)(&mesh, Leaves::Fit);
            let pieces = Pieces::of(&tree);
            for order in ORDERS {
                let bits = match order.depends_on {
                    DependsOn::Nothing | DependsOn::Everything => continue,
                    DependsOn::Children(second) => {
                        NodeBits::from_fn(tree.nodes.len(), |index| second(&tree.nodes[index]))
                    }
                    DependsOn::AllBelow(keep) => keep().find_all(&tree, &pieces),
                };
                let plan = (order.plan_bvh2)(&tree, &context);
                assert_eq!(plan, Plan::Fixed(bits), "{} {}", builder.name, order.name);
                found += 1;
            }
        }
        assert!(found >= 10 * build::BUILDERS.len(), "{found}");
    }
}

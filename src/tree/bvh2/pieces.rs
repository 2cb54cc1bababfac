//! A binary tree in pieces, for passes from the leaves to the root on several threads.

use super::{Bvh2, ChildRef};
use std::ops::Range;

/// Most nodes of a subtree that one thread goes through: enough to be worth a thread's while, few
/// enough to stay in its cache.
const SUBTREE_NODES: usize = 4096;

/// The nodes of a tree: whole subtrees, independent of each other, and those above them.
#[derive(Debug)]
pub(crate) struct Pieces {
    /// Indices of the nodes of each subtree, its root the first: in order, without overlap.
    pub(crate) subtrees: Vec<Range<usize>>,
    /// Indices of all other nodes, in order.
    pub(crate) top: Vec<usize>,
}

impl Pieces {
    /// Of a tree whose nodes lie in depth-first order. The same for any number of threads.
    pub(crate) fn of(tree: &Bvh2) -> Self {
        let mut pieces = Self { subtrees: Vec::new(), top: Vec::new() };
        if tree.root.is_some_and(|root| !root.is_leaf()) {
            pieces.add(tree, 0..tree.nodes.len());
        }
        pieces
    }

    fn add(&mut self, tree: &Bvh2, nodes: Range<usize>) {
        if nodes.len() <= SUBTREE_NODES {
            self.subtrees.push(nodes);
            return;
        }
        let root = nodes.start;
        self.top.push(root);
        let inner = |child: ChildRef| (!child.is_leaf()).then(|| child.node_index());
        let [lower, upper] = tree.nodes[root].children.map(inner);
        // The lower child's nodes come first, and reach as far as the upper one's begin.
        if let Some(lower) = lower {
            self.add(tree, lower..upper.unwrap_or(nodes.end));
        }
        if let Some(upper) = upper {
            self.add(tree, upper..nodes.end);
        }
    }

    /// For each subtree its part of `items`, one for each node of the tree.
    pub(crate) fn split<'a, T>(&self, mut items: &'a mut [T]) -> Vec<&'a mut [T]> {
        let mut first = 0;
        let mut part = |nodes: &Range<usize>| {
            let (_, rest) = std::mem::take(&mut items).split_at_mut(nodes.start - first);
            let (part, rest) = rest.split_at_mut(nodes.len());
            (items, first) = (rest, nodes.end);
            part
        };
        self.subtrees.iter().map(&mut part).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{BUILDERS, Leaves};
    use crate::test_random::Random;

    #[test]
    fn every_node_is_in_one_piece_and_subtrees_are_closed() {
        let mesh = Random::new(23).mesh(40_000);
        for builder in BUILDERS {
            let tree = (builder.build)(&mesh, Leaves::Fit);
            let pieces = Pieces::of(&tree);
            assert!(pieces.subtrees.len() > 3, "{}", builder.name);
            let mut nodes: Vec<usize> = pieces.subtrees.iter().cloned().flatten().collect();
            assert!(nodes.is_sorted());
            for subtree in &pieces.subtrees {
                for index in subtree.clone() {
                    for child in tree.nodes[index].children {
                        assert!(child.is_leaf() || subtree.contains(&child.node_index()));
                    }
                }
            }
            nodes.extend(&pieces.top);
            nodes.sort_unstable();
            assert_eq!(nodes, (0..tree.nodes.len()).collect::<Vec<_>>());
            let mut items: Vec<usize> = (0..tree.nodes.len()).collect();
            for (part, subtree) in pieces.split(&mut items).into_iter().zip(&pieces.subtrees) {
                assert!(part.iter().copied().eq(subtree.clone()));
            }
        }
    }
}

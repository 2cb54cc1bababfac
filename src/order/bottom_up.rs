//! Orders that need a summary of everything below a node: one pass from the leaves to the root.

use super::Scores;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2, NodeBits, Pieces};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// What a bottom-up order computes.
pub(super) trait BottomUp: Sync {
    /// The summary of a subtree.
    type Summary: Copy + Default + Send + Sync;
    /// What a node contributes apart from what lies below its inner children: the part that
    /// threads compute independently, and the expensive one.
    type Own: Copy + Default + Send + Sync;

    /// The summary of a leaf of these triangles in this box.
    fn leaf(&self, triangles: &[Triangle], bounds: &Aabb) -> Self::Summary;

    /// A node's own part.
    fn own(&self, node: &Node2) -> Self::Own;

    /// The summary of a node from those of its children, and whether child 1 is to come first.
    fn node(
        &self,
        node: &Node2,
        own: &Self::Own,
        below: &[Self::Summary; 2],
    ) -> (Self::Summary, bool);
}

/// For each node whether child 1 is to come first, found on the current rayon pool, and the summary
/// of the whole tree, `None` for an empty one. Relies on the tree's depth-first order.
pub(super) fn bottom_up<B: BottomUp>(tree: &Bvh2, order: &B) -> (NodeBits, Option<B::Summary>) {
    let mut second_first = vec![false; tree.nodes.len()];
    let summary = walk(tree, order, &mut second_first, |_, _, second| second);
    (NodeBits::from_fn(second_first.len(), |index| second_first[index]), summary)
}

/// For each node the scores of its children by what lies below them.
pub(super) fn scores<B: BottomUp>(
    tree: &Bvh2,
    order: &B,
    score: impl Fn(&Node2, usize, &B::Summary) -> f64 + Sync,
) -> Scores {
    let mut scores = vec![[0.0; 2]; tree.nodes.len()];
    walk(tree, order, &mut scores, |node, below, _| {
        [0, 1].map(|side| score(node, side, &below[side]))
    });
    scores
}

/// Sets for each node what `find` makes of it, of the summaries of its children and of whether child
/// 1 is to come first, and returns the summary of the whole tree.
#[inline]
fn walk<B: BottomUp, F: Send>(
    tree: &Bvh2,
    order: &B,
    found: &mut [F],
    find: impl Fn(&Node2, &[B::Summary; 2], bool) -> F + Sync,
) -> Option<B::Summary> {
    let (nodes, triangles) = (&tree.nodes, &tree.triangles);
    let root = tree.root?;
    if root.is_leaf() {
        return Some(order.leaf(&triangles[root.leaf_slots()], &tree.bounds));
    }
    let prepare = |node: &Node2| {
        let mut leaves = [B::Summary::default(); 2];
        for (side, child) in node.children.iter().enumerate() {
            if child.is_leaf() {
                leaves[side] = order.leaf(&triangles[child.leaf_slots()], &node.bounds[side]);
            }
        }
        (order.own(node), leaves)
    };
    let pieces = Pieces::of(tree);
    let parts = pieces.split(found).into_par_iter().zip(&pieces.subtrees);
    let of_root = |(found, range): (&mut [F], &Range<usize>)| {
        let first = range.start;
        let nodes = &nodes[range.clone()];
        // Apart from what follows, as one of these does not wait for another.
        let prepared: Vec<_> = nodes.iter().map(prepare).collect();
        let mut summaries = vec![B::Summary::default(); nodes.len()];
        for (index, (node, (own, leaves))) in nodes.iter().zip(&prepared).enumerate().rev() {
            // Loads are selected: no processor foresees which.
            let below = |side: usize| {
                let child = node.children[side];
                let index = if child.is_leaf() { 0 } else { child.node_index() - first };
                let inner = summaries[index];
                if child.is_leaf() { leaves[side] } else { inner }
            };
            let below = [below(0), below(1)];
            let (summary, second) = order.node(node, own, &below);
            summaries[index] = summary;
            found[index] = find(node, &below, second);
        }
        (first, summaries[0])
    };
    let mut of_roots: HashMap<usize, B::Summary> = parts.map(of_root).collect();
    for &index in pieces.top.iter().rev() {
        let node = &nodes[index];
        let (own, leaves) = prepare(node);
        let below = [0, 1].map(|side| {
            let child = node.children[side];
            if child.is_leaf() { leaves[side] } else { of_roots[&child.node_index()] }
        });
        let (summary, second) = order.node(node, &own, &below);
        of_roots.insert(index, summary);
        found[index] = find(node, &below, second);
    }
    of_roots.get(&0).copied()
}

//! Orders that need a summary of everything below a node: one pass from the leaves to the root.

use super::Scores;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2, NodeBits};
use rayon::prelude::*;

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

/// Nodes that threads prepare together before their summaries are folded in sequence: few enough to
/// stay in cache, enough to be worth a start of threads.
const BLOCK: usize = 1 << 12;

/// For each node whether child 1 is to come first, found on the current rayon pool, and the summary
/// of the whole tree, `None` for an empty one. Relies on parents coming before their children.
pub(super) fn bottom_up<B: BottomUp>(tree: &Bvh2, order: &B) -> (NodeBits, Option<B::Summary>) {
    let mut second_first = NodeBits::none(tree.nodes.len());
    let summary = walk(tree, order, |index, _, second| second_first.set(index, second));
    (second_first, summary)
}

/// For each node the scores of its children by what lies below them.
pub(super) fn scores<B: BottomUp>(
    tree: &Bvh2,
    order: &B,
    score: impl Fn(&Node2, usize, &B::Summary) -> f64,
) -> Scores {
    let mut scores = vec![[0.0; 2]; tree.nodes.len()];
    walk(tree, order, |index, below, _| {
        scores[index] = [0, 1].map(|side| score(&tree.nodes[index], side, &below[side]));
    });
    scores
}

/// Tells `found` of each node its index, the summaries of its children and whether child 1 is to
/// come first, children before parents, and returns the summary of the whole tree.
#[inline]
fn walk<B: BottomUp>(
    tree: &Bvh2,
    order: &B,
    mut found: impl FnMut(usize, &[B::Summary; 2], bool),
) -> Option<B::Summary> {
    let (nodes, triangles) = (&tree.nodes, &tree.triangles);
    let root = tree.root?;
    if root.is_leaf() {
        return Some(order.leaf(&triangles[root.leaf_slots()], &tree.bounds));
    }
    let mut summaries = vec![B::Summary::default(); nodes.len()];
    let mut prepared = vec![<(B::Own, [B::Summary; 2])>::default(); BLOCK.min(nodes.len())];
    for block in (0..nodes.len().div_ceil(BLOCK)).rev() {
        let first = block * BLOCK;
        let end = nodes.len().min(first + BLOCK);
        let nodes = &nodes[first..end];
        let prepared = &mut prepared[..nodes.len()];
        nodes.par_iter().zip(&mut *prepared).with_min_len(256).for_each(|(node, prepared)| {
            prepared.0 = order.own(node);
            for (side, child) in node.children.iter().enumerate() {
                if child.is_leaf() {
                    let triangles = &triangles[child.leaf_slots()];
                    prepared.1[side] = order.leaf(triangles, &node.bounds[side]);
                }
            }
        });
        // Loads are selected: no processor foresees which.
        for (index, (node, (own, leaves))) in nodes.iter().zip(&*prepared).enumerate().rev() {
            let below = |side: usize| {
                let child = node.children[side];
                let index = if child.is_leaf() { 0 } else { child.node_index() };
                let inner = summaries[index];
                if child.is_leaf() { leaves[side] } else { inner }
            };
            let below = [below(0), below(1)];
            let (summary, second) = order.node(node, own, &below);
            summaries[first + index] = summary;
            found(first + index, &below, second);
        }
    }
    Some(summaries[root.node_index()])
}

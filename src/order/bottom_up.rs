//! Orders that need a summary of everything below a node: one pass from the leaves to the root.

use super::Scores;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, ChildRef, Node2, NodeBits, PartSummary, Pieces};
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

/// As [`scores`], of a part of a tree on one thread: see [`ScorePart`](crate::tree::ScorePart).
pub(super) fn score_part<B: BottomUp>(
    tree: &Bvh2,
    below: Option<&[PartSummary]>,
    order: &B,
    score: impl Fn(&Node2, usize, &B::Summary) -> f64,
    scores: &mut Vec<[f64; 2]>,
) -> PartSummary
where
    B::Summary: From<PartSummary> + Into<PartSummary>,
{
    let leaf = |leaf: ChildRef, bounds: &Aabb| match below {
        Some(summaries) => summaries[leaf.leaf_slots().start].into(),
        None => order.leaf(&tree.triangles[leaf.leaf_slots()], bounds),
    };
    scores.resize(tree.nodes.len(), [0.0; 2]);
    let Some(root) = tree.root else { return PartSummary::default() };
    if root.is_leaf() {
        return leaf(root, &tree.bounds).into();
    }
    let find = |node: &Node2, below: &[B::Summary; 2], _| {
        [0, 1].map(|side| score(node, side, &below[side]))
    };
    walk_nodes(&tree.nodes, 0, order, leaf, scores, find).into()
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
    let pieces = Pieces::of(tree);
    let parts = pieces.split(found).into_par_iter().zip(&pieces.subtrees);
    let leaf = |leaf: ChildRef, bounds: &Aabb| order.leaf(&triangles[leaf.leaf_slots()], bounds);
    let of_root = |(found, range): (&mut [F], &Range<usize>)| {
        let first = range.start;
        (first, walk_nodes(&nodes[range.clone()], first, order, leaf, found, &find))
    };
    let mut of_roots: HashMap<usize, B::Summary> = parts.map(of_root).collect();
    for &index in pieces.top.iter().rev() {
        let node = &nodes[index];
        let (own, leaves) = (order.own(node), of_leaves::<B>(node, leaf));
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

/// The summaries of those children that are leaves.
#[inline(always)]
fn of_leaves<B: BottomUp>(
    node: &Node2,
    leaf: impl Fn(ChildRef, &Aabb) -> B::Summary,
) -> [B::Summary; 2] {
    let mut leaves = [B::Summary::default(); 2];
    for (side, child) in node.children.iter().enumerate() {
        if child.is_leaf() {
            leaves[side] = leaf(*child, &node.bounds[side]);
        }
    }
    leaves
}

/// The same for the nodes of a subtree, whose root is the first and has the index `first`, on one
/// thread.
#[inline]
fn walk_nodes<B: BottomUp, F>(
    nodes: &[Node2],
    first: usize,
    order: &B,
    leaf: impl Fn(ChildRef, &Aabb) -> B::Summary,
    found: &mut [F],
    find: impl Fn(&Node2, &[B::Summary; 2], bool) -> F,
) -> B::Summary {
    // Apart from what follows, as one of these does not wait for another.
    let prepared: Vec<_> =
        nodes.iter().map(|node| (order.own(node), of_leaves::<B>(node, &leaf))).collect();
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
    summaries[0]
}

//! Orders that need a summary of everything below a node: one pass from the leaves to the root.

use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2};
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

/// Sorts the children of all nodes on the current rayon pool and returns the summary of the whole
/// tree, `None` for an empty one. Relies on parents coming before their children.
pub(super) fn sort_bottom_up<B: BottomUp>(tree: &mut Bvh2, order: &B) -> Option<B::Summary> {
    let root = tree.root?;
    let (nodes, triangles) = (&mut tree.nodes, &tree.triangles);
    if root.is_leaf() {
        return Some(order.leaf(&triangles[root.leaf_slots()], &tree.bounds));
    }
    let mut summaries = vec![B::Summary::default(); nodes.len()];
    let mut prepared = vec![<(B::Own, [B::Summary; 2])>::default(); BLOCK.min(nodes.len())];
    let mut to_swap = vec![0u16; prepared.len() + 1];
    for block in (0..nodes.len().div_ceil(BLOCK)).rev() {
        let first = block * BLOCK;
        let end = nodes.len().min(first + BLOCK);
        let nodes = &mut nodes[first..end];
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
        // Nodes are first listed, then swapped, and loads are selected: no processor foresees which.
        let mut count = 0;
        for (index, (node, (own, leaves))) in nodes.iter().zip(&*prepared).enumerate().rev() {
            let below = |side: usize| {
                let child = node.children[side];
                let index = if child.is_leaf() { 0 } else { child.node_index() };
                let inner = summaries[index];
                if child.is_leaf() { leaves[side] } else { inner }
            };
            let (summary, second_first) = order.node(node, own, &[below(0), below(1)]);
            summaries[first + index] = summary;
            to_swap[count] = index as u16;
            count += usize::from(second_first);
        }
        for &index in &to_swap[..count] {
            nodes[usize::from(index)].swap_children();
        }
    }
    Some(summaries[root.node_index()])
}

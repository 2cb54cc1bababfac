//! A tree in pieces, for passes from the leaves to the root on several threads.

use super::{Bvh2, Bvh8, ChildRef, Node2, Node8};
use rayon::prelude::*;
use std::ops::Range;

/// Most nodes of a subtree that one thread goes through: enough to be worth a thread's while, few
/// enough to stay in its cache.
const SUBTREE_NODES: usize = 4096;

/// Likewise of an eight-wide tree, whose nodes are larger and have more below them.
const WIDE_SUBTREE_NODES: usize = 512;

/// A node with children.
pub(crate) trait Inner: Sync {
    /// The children.
    fn children(&self) -> &[ChildRef];
}

impl Inner for Node2 {
    fn children(&self) -> &[ChildRef] {
        &self.children
    }
}

impl Inner for Node8 {
    fn children(&self) -> &[ChildRef] {
        &self.children[..self.len as usize]
    }
}

/// The nodes of a tree: whole subtrees, independent of each other, and those above them.
///
/// Found while nodes lie in depth-first order. Nodes may then change places within their subtree, if
/// its root stays the first, and whole subtrees and the nodes above them may change places with each
/// other.
#[derive(Debug)]
pub(crate) struct Pieces {
    /// Indices of the nodes of each subtree, its root the first: in order, without overlap.
    pub(crate) subtrees: Vec<Range<usize>>,
    /// Indices of all other nodes, in order.
    pub(crate) top: Vec<usize>,
}

/// A node of a tree by its index, and the number of nodes above it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    pub(crate) index: u32,
    pub(crate) depth: u8,
}

impl Pieces {
    /// Of a tree whose nodes lie in depth-first order. The same for any number of threads.
    pub(crate) fn of(tree: &Bvh2) -> Self {
        Self::of_nodes(&tree.nodes, SUBTREE_NODES)
    }

    /// Likewise of an eight-wide one.
    pub(crate) fn of_wide(tree: &Bvh8) -> Self {
        Self::of_nodes(&tree.nodes, WIDE_SUBTREE_NODES)
    }

    fn of_nodes(nodes: &[impl Inner], most: usize) -> Self {
        let mut pieces = Self { subtrees: Vec::new(), top: Vec::new() };
        if !nodes.is_empty() {
            pieces.add(nodes, 0..nodes.len(), most);
        }
        pieces
    }

    fn add(&mut self, nodes: &[impl Inner], range: Range<usize>, most: usize) {
        if range.len() <= most {
            self.subtrees.push(range);
            return;
        }
        let root = range.start;
        self.top.push(root);
        // A child's nodes reach as far as the next one's begin.
        let mut firsts = inner_children(&nodes[root]).peekable();
        while let Some(first) = firsts.next() {
            let end = firsts.peek().copied().unwrap_or(range.end);
            self.add(nodes, first..end, most);
        }
    }

    /// For each subtree its part of `items`, one for each node of the tree.
    pub(crate) fn split<'a, T>(&self, items: &'a mut [T]) -> Vec<&'a mut [T]> {
        split_by(&self.subtrees, items)
    }

    /// Bytes of all arrays.
    pub(crate) fn memory_bytes(&self) -> u64 {
        (size_of_val(self.subtrees.as_slice()) + size_of_val(self.top.as_slice())) as u64
    }

    /// The subtree with its root at `index`, if there is one.
    pub(crate) fn subtree_at(&self, index: usize) -> Option<usize> {
        self.subtrees.binary_search_by_key(&index, |nodes| nodes.start).ok()
    }

    /// All nodes above the subtrees, each before its children, and for each subtree the number of
    /// nodes above it.
    pub(crate) fn downwards(&self, nodes: &[impl Inner]) -> (Vec<Step>, Vec<u8>) {
        let mut steps = Vec::with_capacity(self.top.len());
        let mut depths = vec![0; self.subtrees.len()];
        let mut pending: Vec<_> = nodes.first().map(|_| (0, 0)).into_iter().collect();
        while let Some((index, depth)) = pending.pop() {
            if let Some(subtree) = self.subtree_at(index) {
                depths[subtree] = depth;
                continue;
            }
            steps.push(Step { index: index as u32, depth });
            pending.extend(inner_children(&nodes[index]).map(|child| (child, depth + 1)));
        }
        (steps, depths)
    }
}

/// For each of `ranges`, which do not overlap, its part of `items`.
pub(crate) fn split_by<'a, T>(ranges: &[Range<usize>], mut items: &'a mut [T]) -> Vec<&'a mut [T]> {
    let mut in_order: Vec<usize> = (0..ranges.len()).collect();
    in_order.sort_by_key(|&index| ranges[index].start);
    let mut parts: Vec<&'a mut [T]> = ranges.iter().map(|_| Default::default()).collect();
    let mut first = 0;
    for index in in_order {
        let range = &ranges[index];
        let (_, rest) = std::mem::take(&mut items).split_at_mut(range.start - first);
        (parts[index], items) = rest.split_at_mut(range.len());
        first = range.end;
    }
    parts
}

/// Sets `steps` to the nodes of a subtree whose root has `depth` nodes above it, each before its
/// children. `nodes` are those of the subtree, whose first has the index `first`.
pub(crate) fn downwards(nodes: &[impl Inner], first: usize, depth: u8, steps: &mut Vec<Step>) {
    steps.clear();
    steps.push(Step { index: first as u32, depth });
    // Breadth first: what is done is the list of what is to be done.
    let mut next = 0;
    while let Some(&Step { index, depth }) = steps.get(next) {
        next += 1;
        let children = inner_children(&nodes[index as usize - first]);
        steps.extend(children.map(|child| Step { index: child as u32, depth: depth + 1 }));
    }
}

/// For each subtree the slots of its triangles, of a tree where those lie together.
pub(crate) fn slots_of(nodes: &[impl Inner], pieces: &Pieces) -> Vec<Range<usize>> {
    let slots = |subtree: &Range<usize>| {
        let children = nodes[subtree.clone()].iter().flat_map(Inner::children);
        let leaves = children.filter(|child| child.is_leaf()).map(|leaf| leaf.leaf_slots());
        // There is one below any node.
        leaves.reduce(|all, leaf| all.start.min(leaf.start)..all.end.max(leaf.end))
    };
    pieces.subtrees.par_iter().filter_map(slots).collect()
}

/// For each node, the most inner nodes on a way from it to a leaf, itself one of them. Of a tree
/// whose nodes lie in depth-first order.
pub(crate) fn heights_of(nodes: &[impl Inner]) -> Vec<u8> {
    let mut heights = vec![0; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        heights[index] = 1 + inner_children(node).map(|child| heights[child]).max().unwrap_or(0);
    }
    heights
}

fn inner_children(node: &impl Inner) -> impl Iterator<Item = usize> + '_ {
    let inner = |child: &ChildRef| (!child.is_leaf()).then(|| child.node_index());
    node.children().iter().filter_map(inner)
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
                let mut steps = Vec::new();
                downwards(&tree.nodes[subtree.clone()], subtree.start, 7, &mut steps);
                assert_eq!(steps[0], Step { index: subtree.start as u32, depth: 7 });
                assert_eq!(steps.len(), subtree.len());
                for index in subtree.clone() {
                    for child in tree.nodes[index].children {
                        assert!(child.is_leaf() || subtree.contains(&child.node_index()));
                    }
                }
            }
            let (top, depths) = pieces.downwards(&tree.nodes);
            let mut above: Vec<_> = top.iter().map(|step| step.index as usize).collect();
            above.sort_unstable();
            assert_eq!((above, depths.len()), (pieces.top.clone(), pieces.subtrees.len()));
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

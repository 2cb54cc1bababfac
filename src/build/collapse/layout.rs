//! Wide nodes and leaves from a binary tree and the plans of its nodes.

use super::WideScores;
use super::plan::Plan;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, ChildRef, LEAF_ROWS, MAX_WIDE_LEAF, Node8, WIDTH, write_leaf_in_lanes};
use crate::vectorized::vectorized;

/// Where a wide tree, or a part of it, goes.
pub(in crate::build) struct Output<'a> {
    pub(in crate::build) nodes: &'a mut Vec<Node8>,
    /// Of the nodes, if they are kept.
    pub(in crate::build) scores: &'a mut Vec<WideScores>,
    pub(in crate::build) leaves: &'a mut [f32],
    pub(in crate::build) triangle_ids: &'a mut [u32],
    pub(in crate::build) first_slot: usize,
    /// Of the slots from the first one on.
    pub(in crate::build) used: usize,
}

/// A binary tree, its plans, and `priority`: the score of a child of a node, by the node's index and
/// the child's side.
pub(in crate::build) struct Layout<'a, P> {
    pub(in crate::build) tree: &'a Bvh2,
    pub(in crate::build) plans: &'a [Plan],
    pub(in crate::build) priority: P,
    pub(in crate::build) keeps_scores: bool,
}

impl<P: Fn(usize, usize) -> f64> Layout<'_, P> {
    /// Adds what `binary` becomes, a node with all below it or a leaf.
    pub(in crate::build) fn emit(&self, binary: ChildRef, output: &mut Output<'_>) -> ChildRef {
        let Some(children) = self.children(binary) else { return self.emit_leaf(binary, output) };
        let index = output.nodes.len();
        output.nodes.push(children.node());
        if self.keeps_scores {
            output.scores.push(children.scores());
        }
        for (slot, child) in children.iter().enumerate() {
            output.nodes[index].children[slot] = self.emit(child.binary, output);
        }
        ChildRef::inner(index)
    }

    fn emit_leaf(&self, binary: ChildRef, output: &mut Output<'_>) -> ChildRef {
        let mut slots = [0; MAX_WIDE_LEAF];
        let count = self.slots_below(binary, &mut slots, 0);
        let first = output.used;
        output.used += count;
        let ids = &mut output.triangle_ids[first..output.used];
        let block = &mut output.leaves[first * LEAF_ROWS..output.used * LEAF_ROWS];
        let Bvh2 { triangles, triangle_ids, .. } = self.tree;
        let run = slots[0]..slots[0] + count;
        let mut gathered = [Triangle::default(); MAX_WIDE_LEAF];
        // As they mostly are.
        let triangles = if run.clone().eq(slots[..count].iter().copied()) {
            ids.copy_from_slice(&triangle_ids[run.clone()]);
            &triangles[run]
        } else {
            for ((triangle, id), &slot) in gathered.iter_mut().zip(ids).zip(&slots) {
                (*triangle, *id) = (triangles[slot], triangle_ids[slot]);
            }
            &gathered[..count]
        };
        vectorized(
            #[inline(always)]
            || write_leaf_in_lanes(block, triangles),
        );
        ChildRef::leaf(output.first_slot + first, count)
    }

    /// Adds the slots of the triangles below to the first `count`, and returns how many there are.
    fn slots_below(
        &self,
        binary: ChildRef,
        slots: &mut [usize; MAX_WIDE_LEAF],
        count: usize,
    ) -> usize {
        if binary.is_leaf() {
            let own = binary.leaf_slots();
            let end = count + own.len();
            assert!(end <= MAX_WIDE_LEAF, "{end} triangles in a leaf");
            slots[count..end].iter_mut().zip(own).for_each(|(slot, own)| *slot = own);
            return end;
        }
        let children = self.tree.nodes[binary.node_index()].children;
        children.into_iter().fold(count, |count, child| self.slots_below(child, slots, count))
    }

    pub(super) fn triangles(&self, binary: ChildRef) -> usize {
        if binary.is_leaf() {
            return binary.leaf_slots().len();
        }
        let [lower, upper] = self.tree.nodes[binary.node_index()].counts;
        (lower + upper) as usize
    }

    /// The children in their order, if it becomes a node; `None` for a leaf.
    pub(in crate::build) fn children(&self, binary: ChildRef) -> Option<Children> {
        if binary.is_leaf() {
            return None;
        }
        let first = self.plans[binary.node_index()].as_node()?;
        let mut children = Children::default();
        self.share(binary.node_index(), first, WIDTH, &mut children);
        Some(children)
    }

    /// What becomes of `binary` in `slots` of its parent: itself, with `score`, or what is below it.
    pub(in crate::build) fn in_slots(
        &self,
        binary: ChildRef,
        slots: usize,
        score: f64,
    ) -> Children {
        let mut children = Children::default();
        let inner = (!binary.is_leaf()).then(|| binary.node_index());
        match inner.and_then(|node| Some((node, self.plans[node].shared(slots)?))) {
            Some((node, (first, slots))) => self.share(node, first, slots, &mut children),
            None => children.insert(Child { binary, bounds: self.tree.bounds, score }),
        }
        children
    }

    /// Fills slots with the two children of a binary node, `first` of them with the first one.
    fn share(&self, node: usize, first: usize, slots: usize, children: &mut Children) {
        let binary = &self.tree.nodes[node];
        for (side, slots) in [first, slots - first].into_iter().enumerate() {
            let child = binary.children[side];
            let shared =
                if child.is_leaf() { None } else { self.plans[child.node_index()].shared(slots) };
            match shared {
                Some((first, slots)) => self.share(child.node_index(), first, slots, children),
                None => children.insert(Child {
                    binary: child,
                    bounds: binary.bounds[side],
                    score: (self.priority)(node, side),
                }),
            }
        }
    }
}

/// A child of a wide node to be.
#[derive(Clone, Copy)]
pub(in crate::build) struct Child {
    pub(in crate::build) binary: ChildRef,
    pub(in crate::build) bounds: Aabb,
    pub(in crate::build) score: f64,
}

/// The children of a wide node to be, those with larger scores first; ties stay as they came.
#[derive(Clone, Copy)]
pub(in crate::build) struct Children {
    all: [Child; WIDTH],
    len: usize,
}

impl Default for Children {
    fn default() -> Self {
        let none = Child { binary: ChildRef::UNUSED, bounds: Aabb::EMPTY, score: 0.0 };
        Self { all: [none; WIDTH], len: 0 }
    }
}

impl Children {
    pub(in crate::build) fn insert(&mut self, child: Child) {
        let mut slot = self.len;
        while slot > 0 && self.all[slot - 1].score.total_cmp(&child.score).is_lt() {
            self.all[slot] = self.all[slot - 1];
            slot -= 1;
        }
        self.all[slot] = child;
        self.len += 1;
    }

    pub(in crate::build) fn iter(&self) -> std::slice::Iter<'_, Child> {
        self.all[..self.len].iter()
    }

    pub(in crate::build) fn scores(&self) -> WideScores {
        let mut scores = [f32::NEG_INFINITY; WIDTH];
        let all = scores.iter_mut().zip(self.iter());
        all.for_each(|(score, child)| *score = child.score as f32);
        scores
    }

    /// The node, without references to its children.
    pub(in crate::build) fn node(&self) -> Node8 {
        let placed = self.all.map(|child| (ChildRef::UNUSED, child.bounds));
        Node8::new(&placed[..self.len])
    }
}

//! The kd-tree.

mod validate;

use super::SplitNotes;
use crate::geometry::{Aabb, Triangle};

/// Most inner nodes on a way from the root to a leaf; stacks of traversals have this size. The
/// builder's own bound of `8 + 1.3 log2 N` stays below it for every mesh that fits.
pub const KD_MAX_DEPTH: usize = 48;

/// Most nodes of a tree: what the index of an upper child can tell.
pub const KD_MAX_NODES: usize = 1 << 28;

/// An inner node or a leaf, in eight bytes (after Wald, "Realtime Ray Tracing and Interactive
/// Global Illumination", 2004).
///
/// An inner node has a plane and two sides. Empty leaves are not stored: an inner node with one of
/// them says which side the other child is on. Nodes lie in depth-first order, the lower child (or
/// the only one) right behind its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct KdNode {
    /// Inner: the plane's position, as bits. Leaf: its first entry in the reference list.
    payload: u32,
    /// Bits 0-1: axis, 3 for a leaf, of which the rest is the number of triangles. Inner: then
    /// `SINGLE`, `ONLY_UPPER`, and the index of the upper child if there are two.
    word: u32,
}

impl KdNode {
    const LEAF: u32 = 3;
    const SINGLE: u32 = 1 << 2;
    const ONLY_UPPER: u32 = 1 << 3;
    const INDEX_SHIFT: u32 = 4;
    const COUNT_SHIFT: u32 = 2;
    /// Most triangles in a leaf.
    pub const MAX_LEAF_TRIANGLES: usize = (1 << (32 - Self::COUNT_SHIFT)) - 1;

    /// A leaf of `count` triangles whose list begins at `first`.
    pub fn leaf(first: usize, count: usize) -> Self {
        debug_assert!(count <= Self::MAX_LEAF_TRIANGLES && first <= u32::MAX as usize);
        Self { payload: first as u32, word: Self::LEAF | (count as u32) << Self::COUNT_SHIFT }
    }

    /// An inner node split at `split` on `axis`. Both sides have children until `set_single` says
    /// otherwise.
    pub fn inner(axis: usize, split: f32) -> Self {
        debug_assert!(axis < 3);
        Self { payload: split.to_bits(), word: axis as u32 }
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.word & 3 == Self::LEAF
    }

    /// A leaf's part of the reference list.
    #[inline(always)]
    pub fn leaf_range(self) -> std::ops::Range<usize> {
        let first = self.payload as usize;
        first..first + (self.word >> Self::COUNT_SHIFT) as usize
    }

    /// The axis that an inner node splits: 0 to 2, and 3 for a leaf.
    #[inline(always)]
    pub fn axis(self) -> usize {
        (self.word & 3) as usize
    }

    /// Where an inner node splits.
    #[inline(always)]
    pub fn split(self) -> f32 {
        f32::from_bits(self.payload)
    }

    /// Whether one side of an inner node is empty. Its only child lies right behind it.
    #[inline(always)]
    pub fn is_single(self) -> bool {
        self.word & Self::SINGLE != 0
    }

    /// Of a node with one child: whether that is the upper one.
    #[inline(always)]
    pub fn only_upper(self) -> bool {
        self.word & Self::ONLY_UPPER != 0
    }

    /// The index of the upper child of an inner node with two children.
    #[inline(always)]
    pub fn upper_child(self) -> usize {
        (self.word >> Self::INDEX_SHIFT) as usize
    }

    /// Whether it is an inner node with two children.
    #[inline(always)]
    pub fn has_two(self) -> bool {
        !self.is_leaf() && !self.is_single()
    }

    /// Makes it a node with one child, on the given side.
    pub(crate) fn set_single(&mut self, upper: bool) {
        self.word |= Self::SINGLE | if upper { Self::ONLY_UPPER } else { 0 };
    }

    /// Sets the upper child of a node with two children.
    pub(crate) fn set_upper_child(&mut self, index: usize) {
        debug_assert!(!self.is_leaf() && !self.is_single() && index < KD_MAX_NODES);
        self.word =
            self.word & ((1 << Self::INDEX_SHIFT) - 1) | (index as u32) << Self::INDEX_SHIFT;
    }

    /// Moves it `nodes` on in the node array and `references` on in the reference list.
    pub(crate) fn relocate(&mut self, nodes: usize, references: usize) {
        if self.is_leaf() {
            self.payload += references as u32;
        } else if !self.is_single() {
            self.set_upper_child(self.upper_child() + nodes);
        }
    }
}

/// A kd-tree over the triangles of a mesh: planes cut space into cells, and a triangle is listed in
/// the leaf of every cell that it reaches into.
#[derive(Clone, Debug, PartialEq)]
pub struct KdTree {
    /// Inner nodes and leaves in depth-first order, the root first; none for an empty mesh.
    pub nodes: Vec<KdNode>,
    /// For each node, the triangles in its cell: the length of the builder's list.
    pub counts: Vec<u32>,
    /// The leaves' lists: slots of `triangles`.
    pub references: Vec<u32>,
    /// The triangles' corners, in the order in which leaves first refer to them: neighbours in
    /// space are neighbours in memory.
    pub triangles: Vec<Triangle>,
    /// For each slot of `triangles`, its index in the mesh.
    pub triangle_ids: Vec<u32>,
    /// The root's cell: the box around all triangles.
    pub bounds: Aabb,
    /// What the builder noted of each split, child 1 being the upper one; of nodes with two
    /// children only.
    pub notes: SplitNotes,
}

/// The constants of the surface-area heuristic for this tree, those of the Manta ray tracer, in
/// which the orders were first measured.
pub const KD_TRAVERSAL_COST: f64 = 1.5;
/// Cost of a triangle test, in the same unit as [`KD_TRAVERSAL_COST`].
pub const KD_INTERSECTION_COST: f64 = 2.0;

impl KdTree {
    /// The lower and the upper child of the inner node at `index`; `None` for an empty leaf.
    #[inline]
    pub fn children(&self, index: usize) -> [Option<usize>; 2] {
        let node = self.nodes[index];
        debug_assert!(!node.is_leaf());
        match (node.is_single(), node.only_upper()) {
            (false, _) => [Some(index + 1), Some(node.upper_child())],
            (true, false) => [Some(index + 1), None],
            (true, true) => [None, Some(index + 1)],
        }
    }

    /// The cells on both sides of an inner node's plane, the lower one first.
    pub fn split_cell(cell: &Aabb, node: KdNode) -> [Aabb; 2] {
        let (mut lower, mut upper) = (*cell, *cell);
        lower.max[node.axis()] = node.split();
        upper.min[node.axis()] = node.split();
        [lower, upper]
    }

    /// Calls `visit` with every node in depth-first order: its index, cell and depth.
    pub fn walk(&self, mut visit: impl FnMut(usize, &Aabb, usize)) {
        let mut stack = Vec::new();
        if !self.nodes.is_empty() {
            stack.push((0, self.bounds, 0));
        }
        while let Some((index, cell, depth)) = stack.pop() {
            visit(index, &cell, depth);
            if !self.nodes[index].is_leaf() {
                let cells = Self::split_cell(&cell, self.nodes[index]);
                let children = self.children(index);
                // The lower child lies next in memory: it goes on top.
                for side in [1, 0] {
                    stack.extend(children[side].map(|child| (child, cells[side], depth + 1)));
                }
            }
        }
    }

    /// Bytes of all arrays.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice())
            + size_of_val(self.counts.as_slice())
            + size_of_val(self.references.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.triangle_ids.as_slice())) as u64
            + self.notes.memory_bytes()
    }

    /// Number of inner nodes.
    pub fn inner_count(&self) -> usize {
        self.nodes.iter().filter(|n| !n.is_leaf()).count()
    }

    /// Number of leaves that hold triangles.
    pub fn leaf_count(&self) -> usize {
        self.nodes.len() - self.inner_count()
    }

    /// Number of empty leaves; they take no memory.
    pub fn empty_leaf_count(&self) -> usize {
        self.nodes.iter().filter(|n| !n.is_leaf() && n.is_single()).count()
    }

    /// Expected cost of a random line through the root's cell (MacDonald and Booth, "Heuristics for
    /// Ray Tracing Using Space Subdivision", 1990), with this tree's constants; empty leaves are
    /// free.
    pub fn sah_cost(&self) -> f64 {
        let mut below = 0.0;
        self.walk(|index, cell, _| {
            let node = self.nodes[index];
            let cost = if node.is_leaf() {
                KD_INTERSECTION_COST * node.leaf_range().len() as f64
            } else {
                KD_TRAVERSAL_COST
            };
            below += cell.half_area() * cost;
        });
        let area = self.bounds.half_area();
        if area > 0.0 { below / area } else { 0.0 }
    }
}

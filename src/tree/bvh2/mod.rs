//! The binary bounding volume hierarchy.

mod validate;

use super::SplitNotes;
use crate::geometry::{Aabb, Triangle};
use bytemuck::Zeroable;

/// Most inner nodes on a way from the root to a leaf; stacks of traversals have this size.
pub const MAX_DEPTH: usize = 64;

/// Most triangles in a leaf.
pub const MAX_LEAF_TRIANGLES: usize = 16;

/// An inner node's index, or a leaf's range of triangles.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Zeroable)]
pub struct ChildRef(u32);

impl ChildRef {
    const LEAF: u32 = 1 << 31;
    const COUNT_SHIFT: u32 = 27;
    /// A node slot that holds nothing yet; never part of a finished tree.
    pub(crate) const UNUSED: Self = Self(u32::MAX);
    /// Most triangles that a tree can refer to.
    pub const MAX_TRIANGLES: usize = 1 << Self::COUNT_SHIFT;

    /// A leaf of `count` triangles, 1 to [`MAX_LEAF_TRIANGLES`], from slot `first` on.
    pub fn leaf(first: usize, count: usize) -> Self {
        debug_assert!((1..=MAX_LEAF_TRIANGLES).contains(&count) && first < Self::MAX_TRIANGLES);
        Self(Self::LEAF | ((count - 1) as u32) << Self::COUNT_SHIFT | first as u32)
    }

    /// The inner node at `index`.
    pub fn inner(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32)
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The slots of a leaf's triangles.
    #[inline(always)]
    pub fn leaf_slots(self) -> std::ops::Range<usize> {
        let first = (self.0 & ((1 << Self::COUNT_SHIFT) - 1)) as usize;
        let count = ((self.0 & !Self::LEAF) >> Self::COUNT_SHIFT) as usize + 1;
        first..first + count
    }

    /// The index of an inner node.
    #[inline(always)]
    pub fn node_index(self) -> usize {
        self.0 as usize
    }
}

/// An inner node: its two children with their boxes, in one cache line.
///
/// Which child any-hit traversal visits first is no part of it: see [`Plan`](super::Plan).
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Zeroable)]
pub struct Node2 {
    /// The children's boxes.
    pub bounds: [Aabb; 2],
    /// The children.
    pub children: [ChildRef; 2],
    /// Triangles below each child; those in several leaves count in each.
    pub counts: [u32; 2],
}

impl Node2 {
    /// Whether the surface of child 1's box is the larger one.
    #[inline]
    pub fn second_is_larger(&self) -> bool {
        // An empty box has no area, in `f64` as in `f32`, and no child has one.
        let area = |b: &Aabb| {
            let d = b.max - b.min;
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        let [a, b] = [area(&self.bounds[0]), area(&self.bounds[1])];
        // Each of them is right to a few half-ulps, so what is clear here need not be found again;
        // infinity and NaN are not clear.
        let (difference, doubt) = (b - a, (a + b) * (16.0 * f32::EPSILON));
        if difference.abs() > doubt && doubt >= f32::MIN_POSITIVE {
            return difference > 0.0;
        }
        self.bounds[1].half_area() > self.bounds[0].half_area()
    }
}

/// A binary tree over the triangles of a mesh.
///
/// Nodes lie in depth-first order, a parent before its children, until some change places as their
/// triangles move. Each triangle lies in one leaf, or, where the builder splits triangles, in one or
/// several.
#[derive(Clone, Debug)]
pub struct Bvh2 {
    /// Inner nodes.
    pub nodes: Vec<Node2>,
    /// Where traversal starts; `None` for an empty mesh.
    pub root: Option<ChildRef>,
    /// Box around all triangles.
    pub bounds: Aabb,
    /// The triangles' corners, in leaf order: a leaf's triangles are neighbours in memory.
    pub triangles: Vec<Triangle>,
    /// For each slot of `triangles`, its index in the mesh.
    pub triangle_ids: Vec<u32>,
    /// What the builder noted of each split; nothing where triangles have moved since.
    pub notes: SplitNotes,
}

impl Bvh2 {
    /// A tree from its parts, with its notes.
    pub fn new(
        nodes: Vec<Node2>,
        root: Option<ChildRef>,
        bounds: Aabb,
        triangles: Vec<Triangle>,
        triangle_ids: Vec<u32>,
    ) -> Self {
        let notes = SplitNotes::of(&nodes);
        Self { nodes, root, bounds, triangles, triangle_ids, notes }
    }

    /// The same tree with nodes and leaves in depth-first order, with its notes, and for each of its
    /// nodes the index here.
    pub fn in_depth_first_order(&self) -> (Self, Vec<u32>) {
        let mut places = Vec::with_capacity(self.nodes.len());
        let mut nodes: Vec<Node2> = Vec::with_capacity(self.nodes.len());
        let mut slots = Vec::with_capacity(self.triangles.len());
        // With the node that it is a child of, and on which side.
        let mut pending: Vec<_> = self.root.map(|root| (root, None)).into_iter().collect();
        let mut new_root = None;
        while let Some((child, parent)) = pending.pop() {
            let moved = if child.is_leaf() {
                let first = slots.len();
                slots.extend(child.leaf_slots());
                ChildRef::leaf(first, child.leaf_slots().len())
            } else {
                let (old, new) = (child.node_index(), nodes.len());
                places.push(old as u32);
                nodes.push(self.nodes[old]);
                let [lower, upper] = self.nodes[old].children;
                pending.push((upper, Some((new, 1))));
                pending.push((lower, Some((new, 0))));
                ChildRef::inner(new)
            };
            match parent {
                Some((index, side)) => nodes[index].children[side] = moved,
                None => new_root = Some(moved),
            }
        }
        let triangles = slots.iter().map(|&slot| self.triangles[slot]).collect();
        let triangle_ids = slots.iter().map(|&slot| self.triangle_ids[slot]).collect();
        (Self::new(nodes, new_root, self.bounds, triangles, triangle_ids), places)
    }

    /// Bytes of all arrays.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.triangle_ids.as_slice())) as u64
            + self.notes.memory_bytes()
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.root.map_or(0, |_| self.nodes.len() + 1)
    }

    /// Expected cost of a random line through the root's box (MacDonald and Booth, "Heuristics for
    /// Ray Tracing Using Space Subdivision", 1990): 1 for each inner node entered and 1 for each
    /// triangle tested.
    pub fn sah_cost(&self) -> f64 {
        let Some(root) = self.root else { return 0.0 };
        let child_cost = |child: ChildRef| {
            if child.is_leaf() { child.leaf_slots().len() as f64 } else { 1.0 }
        };
        let below: f64 = self
            .nodes
            .iter()
            .flat_map(|n| n.children.iter().zip(&n.bounds))
            .map(|(child, bounds)| bounds.half_area() * child_cost(*child))
            .sum();
        let area = self.bounds.half_area();
        child_cost(root) + if area > 0.0 { below / area } else { 0.0 }
    }
}

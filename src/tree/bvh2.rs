//! The binary bounding volume hierarchy.

use super::SplitNotes;
use crate::geometry::{Aabb, Triangle, TriangleMesh};

/// Most inner nodes on a way from the root to a leaf; stacks of traversals have this size.
pub const MAX_DEPTH: usize = 64;

/// Most triangles in a leaf.
pub const MAX_LEAF_TRIANGLES: usize = 16;

/// An inner node's index, or a leaf's range of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node2 {
    /// The children's boxes.
    pub bounds: [Aabb; 2],
    /// The children.
    pub children: [ChildRef; 2],
    /// Triangles below each child.
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
/// Nodes lie in depth-first order, a parent before its children. Each triangle lies in exactly one
/// leaf.
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
    /// What the builder noted of each split.
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

    /// Checks everything that traversal relies on: every triangle of `mesh` in one leaf, with its
    /// corners; boxes that are exactly those of what lies below; counts; depth; node order.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub fn validate(&self, mesh: &TriangleMesh) -> Result<(), String> {
        if self.triangles.len() != mesh.len() || self.triangle_ids.len() != mesh.len() {
            return Err(format!("{} of {} triangles", self.triangles.len(), mesh.len()));
        }
        let mut seen = vec![false; mesh.len()];
        for (slot, &id) in self.triangle_ids.iter().enumerate() {
            let first_time = seen.get_mut(id as usize).is_some_and(|s| !std::mem::replace(s, true));
            if !first_time || mesh.triangle(id as usize) != self.triangles[slot] {
                return Err(format!("slot {slot} holds triangle {id} wrongly or twice"));
            }
        }
        let mut next_node = 0;
        let mut slots = vec![false; mesh.len()];
        match self.root {
            None if mesh.is_empty() => {}
            None => return Err("no root".into()),
            Some(root) => {
                let (bounds, count) = self.validate_child(root, 0, &mut next_node, &mut slots)?;
                if bounds != self.bounds || count != mesh.len() {
                    return Err(format!("root: {count} triangles in {bounds:?}"));
                }
            }
        }
        if next_node != self.nodes.len() {
            return Err(format!("{next_node} of {} nodes are reached", self.nodes.len()));
        }
        if self.notes.len() != self.nodes.len() {
            return Err(format!("notes of {} of {} nodes", self.notes.len(), self.nodes.len()));
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let larger = node.bounds[1].half_area() > node.bounds[0].half_area();
            let fewer = node.counts[1] < node.counts[0];
            let notes = [&self.notes.second_larger, &self.notes.second_fewer];
            if notes.map(|note| note.get(index)) != [larger, fewer] {
                return Err(format!("node {index}: wrong notes of its children"));
            }
        }
        Ok(())
    }

    fn validate_child(
        &self,
        child: ChildRef,
        depth: usize,
        reached: &mut usize,
        slots: &mut [bool],
    ) -> Result<(Aabb, usize), String> {
        if child.is_leaf() {
            let range = child.leaf_slots();
            let mut bounds = Aabb::EMPTY;
            for slot in range.clone() {
                if slots.get(slot).is_none_or(|&taken| taken) {
                    return Err(format!("leaf {range:?}: slot {slot} is out of range or shared"));
                }
                slots[slot] = true;
                bounds = bounds.union(self.triangles[slot].bounds());
            }
            return Ok((bounds, range.len()));
        }
        let index = child.node_index();
        if depth >= MAX_DEPTH {
            return Err(format!("node {index} is too deep"));
        }
        *reached += 1;
        let node = self.nodes.get(index).ok_or_else(|| format!("no node {index}"))?;
        let mut all = (Aabb::EMPTY, 0);
        for side in 0..2 {
            let child = node.children[side];
            if !child.is_leaf() && child.node_index() <= index {
                return Err(format!("node {index}: a child before its parent"));
            }
            let (bounds, count) = self.validate_child(child, depth + 1, reached, slots)?;
            if bounds != node.bounds[side] || count != node.counts[side] as usize {
                return Err(format!("node {index}: child {side} has other bounds or count"));
            }
            all = (all.0.union(bounds), all.1 + count);
        }
        Ok(all)
    }
}

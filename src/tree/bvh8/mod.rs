//! The eight-wide bounding volume hierarchy (Wald, Benthin and Boulos, "Getting Rid of Packets:
//! Efficient SIMD Single-Ray Traversal using Multi-branching BVHs", IEEE Symposium on Interactive
//! Ray Tracing, 2008).

mod leaf;
mod validate;

pub(crate) use leaf::{refit_leaf, write_leaf, write_leaf_in_lanes};

use super::{ChildRef, MAX_DEPTH};
use crate::geometry::{Aabb, Vec3};
use bytemuck::Zeroable;
use std::sync::atomic::{AtomicU64, Ordering};

/// Children of a node, and lanes of the tests against them.
pub const WIDTH: usize = 8;

/// Most triangles in a leaf: those that are tested at once.
pub const MAX_WIDE_LEAF: usize = WIDTH;

/// Most nodes on a way from the root to a leaf: each level takes up one at least of the binary
/// tree's, whose leaves of 16 triangles may be split up to 15 times more.
pub const MAX_WIDE_DEPTH: usize = MAX_DEPTH + 15;

/// Numbers of a triangle in a leaf's block.
pub(crate) const LEAF_ROWS: usize = 13;

/// An inner node: up to eight children with their boxes.
///
/// Children fill the slots from 0 on, in the order in which any-hit rays visit them.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Zeroable)]
pub struct Node8 {
    /// For each axis the lower and the upper planes of the children's boxes.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// The children.
    pub children: [ChildRef; WIDTH],
    /// Number of children: two at least.
    pub len: u32,
}

impl Node8 {
    /// A node of these children, at most eight.
    pub fn new(children: &[(ChildRef, Aabb)]) -> Self {
        // Finite, so that no product with a reciprocal is NaN, and inside out, so that few rays meet
        // what is not there; those that do are turned away by `occupied`.
        let mut node = Self {
            planes: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3],
            children: [ChildRef::UNUSED; WIDTH],
            len: children.len() as u32,
        };
        for (slot, (child, bounds)) in children.iter().enumerate() {
            node.children[slot] = *child;
            node.set_bounds(slot, bounds);
        }
        node
    }

    /// The box around all children.
    #[inline]
    pub fn all_bounds(&self) -> Aabb {
        // Empty slots are inside out.
        let least = |planes: &[f32; WIDTH]| planes.iter().copied().fold(f32::MAX, f32::min);
        let most = |planes: &[f32; WIDTH]| planes.iter().copied().fold(f32::MIN, f32::max);
        let [min, max] = [self.planes.map(|p| least(&p[0])), self.planes.map(|p| most(&p[1]))];
        Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) }
    }

    /// Sets the box of the child in `slot`.
    #[inline]
    pub fn set_bounds(&mut self, slot: usize, bounds: &Aabb) {
        for (axis, planes) in self.planes.iter_mut().enumerate() {
            planes[0][slot] = bounds.min[axis];
            planes[1][slot] = bounds.max[axis];
        }
    }

    /// The box of the child in `slot`.
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| Vec3::from_array(self.planes.map(|axis| axis[side][slot]));
        Aabb { min: corner(0), max: corner(1) }
    }

    /// Its children, by slot.
    #[inline]
    pub(crate) fn children_mut(&mut self) -> &mut [ChildRef] {
        &mut self.children[..self.len as usize]
    }

    /// One bit for each child, from the lowest on.
    #[inline(always)]
    pub fn occupied(&self) -> u32 {
        (1 << self.len) - 1
    }
}

/// An eight-wide tree over the triangles of a mesh.
///
/// Nodes lie in depth-first order, a parent before its children, until some change places as their
/// triangles move. Each triangle lies in exactly one leaf.
#[derive(Clone, Debug)]
pub struct Bvh8 {
    /// Inner nodes.
    pub nodes: Vec<Node8>,
    /// Where traversal starts; `None` for an empty mesh.
    pub root: Option<ChildRef>,
    /// Box around all triangles.
    pub bounds: Aabb,
    /// The triangles, leaf by leaf: a leaf of `n` triangles from slot `s` on has a block of thirteen
    /// rows of `n` numbers from `13 s` on. With the corners `a`, `b` and `c` and a power of two `l` no
    /// smaller than the largest component of `b - a` and `c - a`: x, y and z of `a`, of `(a - b) / l`,
    /// of `(c - a) / l` and of the unit normal, and the length of `(b - a) x (c - a)` over `l`. Ends
    /// with padding for kernels that read eight numbers of the last row.
    pub leaves: Vec<f32>,
    /// For each slot, the triangle's index in the mesh.
    pub triangle_ids: Vec<u32>,
    /// Unlike that of any other tree, but for copies; not 0. Another one whenever triangles have moved: what
    /// is remembered of leaves and triangles holds as long as this is the same, so whoever writes to
    /// [`leaves`](Self::leaves) gives the tree a [new one](Self::new_id).
    pub id: u64,
}

impl Bvh8 {
    /// An [`id`](Self::id) that no tree has.
    pub fn new_id() -> u64 {
        static LAST: AtomicU64 = AtomicU64::new(0);
        LAST.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Bytes of all arrays.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice())
            + size_of_val(self.leaves.as_slice())
            + size_of_val(self.triangle_ids.as_slice())) as u64
    }

    /// Whether it is larger than the caches that a core has for itself, so that fetching what will be
    /// visited ahead of time pays.
    #[inline]
    pub fn is_large(&self) -> bool {
        const CACHE_BYTES: usize = 8 << 20;
        self.nodes.len() > CACHE_BYTES / size_of::<Node8>()
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        let children: usize = self.nodes.iter().map(|node| node.len as usize).sum();
        self.root.map_or(0, |_| children + 1 - self.nodes.len())
    }
}

//! The eight-wide bounding volume hierarchy (Wald, Benthin and Boulos, "Getting Rid of Packets:
//! Efficient SIMD Single-Ray Traversal using Multi-branching BVHs", IEEE Symposium on Interactive
//! Ray Tracing, 2008).

use super::{ChildRef, MAX_DEPTH};
use crate::geometry::{Aabb, Triangle, TriangleMesh, Vec3};
use glam::DVec3;
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Sets the box of the child in `slot`.
    #[inline(always)]
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

    /// One bit for each child, from the lowest on.
    #[inline(always)]
    pub fn occupied(&self) -> u32 {
        (1 << self.len) - 1
    }
}

/// A triangle's numbers in a leaf: see [`Bvh8::leaves`].
///
/// Edges and normals are rounded once from numbers that are off by less than `2^-30`. Where a normal
/// would be less certain it is zero, and so are the last number and all that follows from them, which
/// then is in doubt. A triangle that has no area for certain is one that lines miss: its last number
/// is far below zero.
fn leaf_numbers(triangle: &Triangle) -> [f32; LEAF_ROWS] {
    const NO_AREA: f64 = -1e30;
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let cross = ab.cross(ac);
    let largest = ab.abs().max(ac.abs()).max_element();
    // A power of two that is no smaller, so that scaling rounds nothing.
    let scale = f64::from_bits(((largest.to_bits() >> 52) + 1) << 52);
    // Products of two edges lose at most 2^-51 of their lengths.
    let squared = cross.length_squared();
    let lengths = ab.length_squared() * ac.length_squared();
    let shrink = scale.recip();
    let (ab, ac) = (ab * -shrink, ac * shrink);
    let (ab, ac, normal, height) =
        if squared > lengths / f64::from(1 << 20).powi(2) && squared > 1e-290 {
            let length = squared.sqrt();
            (ab, ac, cross * length.recip(), length * shrink)
        } else if is_difference(a, b) && is_difference(a, c) && are_parallel(b - a, c - a) {
            (DVec3::ZERO, DVec3::ZERO, DVec3::splat(3f64.sqrt().recip()), NO_AREA)
        } else {
            (ab, ac, DVec3::ZERO, 0.0)
        };
    let [first, second, normal] = [ab, ac, normal].map(|v| v.as_vec3().to_array());
    let [a, b, c] = triangle.0[0].to_array();
    let [d, e, f] = first;
    let [g, h, i] = second;
    let [j, k, l] = normal;
    [a, b, c, d, e, f, g, h, i, j, k, l, height as f32]
}

/// Whether the difference of the two is exact: then both can be had back from it.
fn is_difference(from: DVec3, to: DVec3) -> bool {
    let difference = to - from;
    from + difference == to && to - difference == from
}

/// Whether the cross product is zero without rounding.
fn are_parallel(a: DVec3, b: DVec3) -> bool {
    // Rounded, and what that took.
    let product = |a: f64, b: f64| (a * b, a.mul_add(b, -(a * b)));
    product(a.x, b.y) == product(a.y, b.x)
        && product(a.y, b.z) == product(a.z, b.y)
        && product(a.z, b.x) == product(a.x, b.z)
}

/// Writes a leaf of these triangles, at most [`MAX_WIDE_LEAF`], into its block of [`LEAF_ROWS`]
/// numbers for each: see [`Bvh8::leaves`].
pub(crate) fn write_leaf(block: &mut [f32], triangles: &[Triangle]) {
    let count = triangles.len();
    debug_assert_eq!(block.len(), count * LEAF_ROWS);
    for (index, triangle) in triangles.iter().enumerate() {
        for (row, number) in leaf_numbers(triangle).into_iter().enumerate() {
            block[row * count + index] = number;
        }
    }
}

/// An eight-wide tree over the triangles of a mesh.
///
/// Nodes lie in depth-first order, a parent before its children. Each triangle lies in exactly one
/// leaf.
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
    /// Unlike that of any other tree, but for copies; not 0.
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

    /// Checks everything that traversal relies on: every triangle of `mesh` in one leaf, with its
    /// corners; boxes that are exactly those of what lies below; depth; node order; padding.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub fn validate(&self, mesh: &TriangleMesh) -> Result<(), String> {
        if self.triangle_ids.len() != mesh.len() {
            return Err(format!("{} of {} triangles", self.triangle_ids.len(), mesh.len()));
        }
        if self.leaves.len() != mesh.len() * LEAF_ROWS + WIDTH {
            return Err(format!("{} numbers in leaves", self.leaves.len()));
        }
        let mut seen = vec![false; mesh.len()];
        let Some(root) = self.root else {
            return if mesh.is_empty() { Ok(()) } else { Err("no root".into()) };
        };
        let mut reached = 0;
        let bounds = self.validate_child(root, 0, mesh, &mut reached, &mut seen)?;
        if bounds != self.bounds {
            return Err("the root's box is another".into());
        }
        if reached != self.nodes.len() {
            return Err(format!("{reached} of {} nodes reached", self.nodes.len()));
        }
        match seen.iter().position(|seen| !seen) {
            Some(id) => Err(format!("triangle {id} is in no leaf")),
            None => Ok(()),
        }
    }

    fn validate_child(
        &self,
        child: ChildRef,
        depth: usize,
        mesh: &TriangleMesh,
        reached: &mut usize,
        seen: &mut [bool],
    ) -> Result<Aabb, String> {
        if child.is_leaf() {
            let slots = child.leaf_slots();
            if slots.len() > MAX_WIDE_LEAF {
                return Err(format!("leaf {slots:?} is too large"));
            }
            let mut bounds = Aabb::EMPTY;
            let mut triangles = Vec::with_capacity(slots.len());
            for slot in slots.clone() {
                let id = self.triangle_ids.get(slot).map_or(usize::MAX, |&id| id as usize);
                if seen.get(id).is_none_or(|&seen| seen) {
                    return Err(format!("leaf {slots:?}: slot {slot} is out of range or shared"));
                }
                seen[id] = true;
                triangles.push(mesh.triangle(id));
                bounds = bounds.union(mesh.triangle(id).bounds());
            }
            let mut expected = vec![0.0; slots.len() * LEAF_ROWS];
            write_leaf(&mut expected, &triangles);
            let block = self.leaves.get(slots.start * LEAF_ROWS..slots.end * LEAF_ROWS);
            if block.is_none_or(|block| *block != *expected) {
                return Err(format!("leaf {slots:?} has other corners than its triangles"));
            }
            return Ok(bounds);
        }
        let index = child.node_index();
        if depth >= MAX_WIDE_DEPTH {
            return Err(format!("node {index} is too deep"));
        }
        *reached += 1;
        let node = self.nodes.get(index).ok_or_else(|| format!("no node {index}"))?;
        let len = node.len as usize;
        if !(2..=WIDTH).contains(&len) {
            return Err(format!("node {index} has {len} children"));
        }
        let mut all = Aabb::EMPTY;
        for slot in 0..len {
            let child = node.children[slot];
            if !child.is_leaf() && child.node_index() <= index {
                return Err(format!("node {index}: a child before its parent"));
            }
            let bounds = self.validate_child(child, depth + 1, mesh, reached, seen)?;
            if bounds != node.bounds(slot) {
                return Err(format!("node {index}: child {slot} has another box"));
            }
            all = all.union(bounds);
        }
        if node.children[len..].iter().any(|child| *child != ChildRef::UNUSED) {
            return Err(format!("node {index}: children beyond the last"));
        }
        Ok(all)
    }
}

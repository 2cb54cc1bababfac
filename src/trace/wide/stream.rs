//! Up to 64 rays through the tree together: each node is visited once for all of them.

use super::group::{groups, leaf_by_group, node_by_group, stopped_by_occluders};
use super::leaf::hits_leaf;
use super::occluders::Occluders;
use super::one_ray::OneRay;
use super::rays::{Rays, STREAM};
use super::simd::{LANES, Simd, Wide};
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, MAX_WIDE_DEPTH, Node8, WIDTH};

/// A subtree to visit, with the rays that meet its box.
#[derive(Clone, Copy)]
struct Pending {
    child: ChildRef,
    rays: u64,
}

/// What is still to visit: of each node on the way all children but the current one.
pub(super) struct Stack {
    pending: [Pending; MAX_WIDE_DEPTH * (WIDTH - 1) + 1],
    len: usize,
}

impl Stack {
    pub(super) const EMPTY: Self = Self {
        pending: [Pending { child: ChildRef::UNUSED, rays: 0 }; MAX_WIDE_DEPTH * (WIDTH - 1) + 1],
        len: 0,
    };

    #[inline(always)]
    fn push(&mut self, child: ChildRef, rays: u64) {
        self.pending[self.len] = Pending { child, rays };
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Pending> {
        self.len = self.len.checked_sub(1)?;
        Some(self.pending[self.len])
    }
}

/// Rays of a group that must be active for testing the group to be worth it: fewer are tested one by
/// one against all children, or all triangles, at once.
pub(super) const ACTIVE_IN_NODE: u32 = 3;
pub(super) const ACTIVE_IN_LEAF: u32 = 1;

/// Has a child brought near that is visited later.
#[inline(always)]
pub(super) fn prefetch<S: Simd>(s: S, tree: &Bvh8, child: ChildRef) {
    if child.is_leaf() {
        let block = &tree.leaves[child.leaf_slots().start * LEAF_ROWS..];
        // The shortest block ends in the first line or the next one.
        s.prefetch(&block[0]);
        s.prefetch(&block[LEAF_ROWS - 1]);
    } else {
        let node = &tree.nodes[child.node_index()];
        node.planes.iter().for_each(|planes| s.prefetch(planes));
        s.prefetch(&node.children);
    }
}

/// A tree, and the node to start at in place of its root.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) tree: &'a Bvh8,
    pub(super) entry: Option<&'a Node8>,
}

/// The rays that something is in the way of.
#[inline(always)]
pub(super) fn any_hit<S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    start: Start<'_>,
    rays: &Rays<'_>,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let Start { tree, entry } = start;
    let Some(root) = tree.root else { return 0 };
    let mut alive = rays.valid;
    alive &= !stopped_by_occluders(w, tree, rays, alive, occluders, counter);
    stack.len = 0;
    // Where there is a node to start at, as if it had been found on the stack.
    let mut first = entry;
    if entry.is_none() {
        stack.push(root, alive);
    }
    loop {
        let (node, here) = if let Some(entry) = first.take() {
            (entry, alive)
        } else {
            let Some(Pending { child, rays: here }) = stack.pop() else { break };
            let here = here & alive;
            if here == 0 {
                continue;
            }
            if here & (here - 1) == 0 {
                let index = here.trailing_zeros() as usize;
                if one_ray::<S, W, C>(s, tree, rays, index, child, stack, counter) {
                    alive &= !here;
                }
                continue;
            }
            counter.node(here);
            if child.is_leaf() {
                for _ in child.leaf_slots() {
                    counter.triangle(here);
                }
                alive &= !leaf_hits(s, w, tree, child, rays, here, occluders, counter);
                continue;
            }
            (&tree.nodes[child.node_index()], here)
        };
        let (met, mut children) = if here.count_ones() > groups::<W>(here) * ACTIVE_IN_NODE {
            node_by_group(w, node, rays, here)
        } else {
            node_by_ray::<S, W>(s, node, rays, here)
        };
        children &= node.occupied();
        while children != 0 {
            let slot = children.ilog2();
            let child = node.children[slot as usize];
            if tree.is_large() {
                prefetch(s, tree, child);
            }
            stack.push(child, met[slot as usize]);
            children &= !(1 << slot);
        }
    }
    rays.valid & !alive
}

/// As [`any_hit`], each ray on its own.
#[inline(always)]
pub(super) fn any_hit_one_by_one<S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    _: W,
    start: Start<'_>,
    rays: &Rays<'_>,
    stack: &mut Stack,
    counter: &mut C,
) -> u64 {
    let Start { tree, entry } = start;
    let Some(root) = tree.root else { return 0 };
    let whole = [root];
    let starts = entry.map_or(&whole[..], |node| &node.children[..node.len as usize]);
    let (mut left, mut hits) = (rays.valid, 0);
    stack.len = 0;
    while left != 0 {
        let index = left.trailing_zeros() as usize;
        left &= left - 1;
        for start in starts {
            if one_ray::<S, W, C>(s, tree, rays, index, *start, stack, counter) {
                hits |= 1 << index;
                break;
            }
        }
    }
    hits
}

/// For each child the rays that meet it, and which children any meet.
#[inline(always)]
fn node_by_ray<S: Simd, W: Wide>(
    s: S,
    node: &Node8,
    rays: &Rays<'_>,
    mut active: u64,
) -> ([u64; LANES], u32) {
    let mut met = [0u8; STREAM];
    let mut any = 0;
    while active != 0 {
        let index = active.trailing_zeros() as usize;
        let children = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]).meets(s, node);
        met[index] = children as u8;
        any |= children;
        active &= active - 1;
    }
    (s.transpose(&met), any)
}

/// Those of the active rays that a triangle of a leaf stops.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
fn leaf_hits<S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays<'_>,
    mut active: u64,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let triangles = leaf.leaf_slots().len() as u32;
    if active.count_ones() > groups::<W>(active) * triangles * ACTIVE_IN_LEAF {
        return leaf_by_group(w, tree, leaf, rays, active, occluders, counter);
    }
    let mut hits = 0;
    while active != 0 {
        let index = active.trailing_zeros() as usize;
        hits |= u64::from(hits_leaf(s, tree, leaf, rays, index, counter)) << index;
        active &= active - 1;
    }
    hits
}

/// Whether anything below `child` is in the way of one ray.
#[inline(always)]
fn one_ray<S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    tree: &Bvh8,
    rays: &Rays<'_>,
    index: usize,
    child: ChildRef,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    let ray = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]);
    let base = stack.len;
    let mut current = child;
    loop {
        counter.node(1 << index);
        if current.is_leaf() {
            for _ in current.leaf_slots() {
                counter.triangle(1 << index);
            }
            if hits_leaf(s, tree, current, rays, index, counter) {
                stack.len = base;
                return true;
            }
        } else {
            let node = &tree.nodes[current.node_index()];
            let mut met = ray.meets(s, node);
            if met != 0 {
                let first = met.trailing_zeros();
                met &= met - 1;
                while met != 0 {
                    let slot = met.ilog2();
                    let child = node.children[slot as usize];
                    if tree.is_large() {
                        prefetch(s, tree, child);
                    }
                    stack.push(child, 0);
                    met &= !(1 << slot);
                }
                current = node.children[first as usize];
                continue;
            }
        }
        if stack.len == base {
            return false;
        }
        stack.len -= 1;
        current = stack.pending[stack.len].child;
    }
}

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
    pending: [Pending; Self::ROOM],
    len: usize,
    /// Leaves to visit last, with the rays that meet them, and how many have been visited.
    put_off: Vec<Pending>,
    made_up: usize,
}

impl Stack {
    /// For a tree, and another one in a leaf of it.
    const ROOM: usize = 2 * (MAX_WIDE_DEPTH * (WIDTH - 1) + 1);

    pub(super) const EMPTY: Self = Self {
        pending: [Pending { child: ChildRef::UNUSED, rays: 0 }; Self::ROOM],
        len: 0,
        put_off: Vec::new(),
        made_up: 0,
    };

    fn begin(&mut self) {
        self.len = 0;
        self.put_off.clear();
        self.made_up = 0;
    }

    /// How much is still to visit.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Has `rays` visit a leaf when all else is done.
    pub(super) fn put_off(&mut self, leaf: ChildRef, rays: u64) {
        self.put_off.push(Pending { child: leaf, rays });
    }

    /// The next leaf that was put off, and its rays.
    pub(super) fn make_up(&mut self) -> Option<(ChildRef, u64)> {
        let Pending { child, rays } = *self.put_off.get(self.made_up)?;
        self.made_up += 1;
        Some((child, rays))
    }

    #[inline(always)]
    pub(super) fn push(&mut self, child: ChildRef, rays: u64) {
        self.pending[self.len] = Pending { child, rays };
        self.len += 1;
    }

    #[inline(always)]
    fn pop_above(&mut self, base: usize) -> Option<Pending> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
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

/// A tree whose nodes rays go through, and what is in its leaves.
pub(super) trait Trees: Copy {
    /// Whether leaves may be put off: see [`Stack::put_off`].
    const PUTS_OFF: bool;

    /// The tree that rays go through.
    fn tree(&self) -> &Bvh8;

    /// The tree that an occluder is a triangle of, by its number; `None` if that is not to be had
    /// without work.
    fn of_occluder(&self, number: u32) -> Option<&Bvh8>;

    /// Those of the rays that something in a leaf stops.
    #[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
    fn stopped_in_leaf<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        leaf: ChildRef,
        rays: &Rays<'_>,
        here: u64,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> u64;

    /// Whether something in a leaf stops one ray.
    #[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
    fn stops_in_leaf<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        leaf: ChildRef,
        rays: &Rays<'_>,
        index: usize,
        stack: &mut Stack,
        counter: &mut C,
    ) -> bool;

    /// Visits what was put off, for the rays that are still alive, and returns those that are stopped.
    #[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
    fn make_up<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        rays: &Rays<'_>,
        alive: u64,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> u64;
}

/// A tree with triangles in its leaves, and its number among several.
#[derive(Clone, Copy)]
pub(super) struct Triangles<'a> {
    pub(super) tree: &'a Bvh8,
    pub(super) number: u32,
}

impl Trees for Triangles<'_> {
    const PUTS_OFF: bool = false;

    #[inline(always)]
    fn tree(&self) -> &Bvh8 {
        self.tree
    }

    #[inline(always)]
    fn of_occluder(&self, _: u32) -> Option<&Bvh8> {
        Some(self.tree)
    }

    #[inline(always)]
    fn stopped_in_leaf<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        leaf: ChildRef,
        rays: &Rays<'_>,
        here: u64,
        _: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> u64 {
        for _ in leaf.leaf_slots() {
            counter.triangle(here);
        }
        leaf_hits(s, w, *self, leaf, rays, here, occluders, counter)
    }

    #[inline(always)]
    fn stops_in_leaf<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        _: W,
        leaf: ChildRef,
        rays: &Rays<'_>,
        index: usize,
        _: &mut Stack,
        counter: &mut C,
    ) -> bool {
        for _ in leaf.leaf_slots() {
            counter.triangle(1 << index);
        }
        hits_leaf(s, self.tree, leaf, rays, index, counter)
    }

    #[inline(always)]
    fn make_up<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        _: S,
        _: W,
        _: &Rays<'_>,
        _: u64,
        _: &mut Stack,
        _: &mut Occluders,
        _: &mut C,
    ) -> u64 {
        0
    }
}

/// Trees, and the node to start at in place of the root.
#[derive(Clone, Copy)]
pub(super) struct Start<'a, T> {
    pub(super) trees: T,
    pub(super) entry: Option<&'a Node8>,
}

/// The rays that something is in the way of.
#[inline(always)]
pub(super) fn any_hit<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    start: Start<'_, T>,
    rays: &Rays<'_>,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let Start { trees, entry } = start;
    let Some(root) = trees.tree().root else { return 0 };
    let mut alive = rays.valid;
    alive &= !stopped_by_occluders(w, trees, rays, alive, occluders, counter);
    stack.begin();
    // Where there is a node to start at, as if it had been found on the stack.
    if entry.is_none() {
        stack.push(root, alive);
    }
    alive &= !descend(s, w, trees, entry, rays, alive, 0, stack, occluders, counter);
    if T::PUTS_OFF {
        alive &= !trees.make_up(s, w, rays, alive, stack, occluders, counter);
    }
    rays.valid & !alive
}

/// Takes `alive` rays through `first`, if it is there, and all that lies on the stack above `base`;
/// returns those that something is in the way of.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
pub(super) fn descend<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    trees: T,
    mut first: Option<&Node8>,
    rays: &Rays<'_>,
    mut alive: u64,
    base: usize,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let all = alive;
    let tree = trees.tree();
    loop {
        let (node, here) = if let Some(entry) = first.take() {
            (entry, alive)
        } else {
            let Some(Pending { child, rays: here }) = stack.pop_above(base) else { break };
            let here = here & alive;
            if here == 0 {
                continue;
            }
            if here & (here - 1) == 0 {
                let index = here.trailing_zeros() as usize;
                if one_ray::<T, S, W, C>(s, w, trees, rays, index, child, stack, counter) {
                    alive &= !here;
                }
                continue;
            }
            counter.node(here);
            if child.is_leaf() {
                let stopped =
                    trees.stopped_in_leaf(s, w, child, rays, here, stack, occluders, counter);
                alive &= !stopped;
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
    all & !alive
}

/// As [`any_hit`], each ray on its own.
#[inline(always)]
pub(super) fn any_hit_one_by_one<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    start: Start<'_, T>,
    rays: &Rays<'_>,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let Start { trees, entry } = start;
    let Some(root) = trees.tree().root else { return 0 };
    let whole = [root];
    let starts = entry.map_or(&whole[..], |node| &node.children[..node.len as usize]);
    let (mut left, mut hits) = (rays.valid, 0);
    while left != 0 {
        let index = left.trailing_zeros() as usize;
        left &= left - 1;
        stack.begin();
        let mut hit = starts
            .iter()
            .any(|start| one_ray::<T, S, W, C>(s, w, trees, rays, index, *start, stack, counter));
        if T::PUTS_OFF && !hit {
            hit = trees.make_up(s, w, rays, 1 << index, stack, occluders, counter) != 0;
        }
        hits |= u64::from(hit) << index;
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
    trees: Triangles<'_>,
    leaf: ChildRef,
    rays: &Rays<'_>,
    mut active: u64,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let triangles = leaf.leaf_slots().len() as u32;
    if active.count_ones() > groups::<W>(active) * triangles * ACTIVE_IN_LEAF {
        return leaf_by_group(w, trees, leaf, rays, active, occluders, counter);
    }
    let mut hits = 0;
    while active != 0 {
        let index = active.trailing_zeros() as usize;
        hits |= u64::from(hits_leaf(s, trees.tree, leaf, rays, index, counter)) << index;
        active &= active - 1;
    }
    hits
}

/// Whether anything below `child` is in the way of one ray.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
pub(super) fn one_ray<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    trees: T,
    rays: &Rays<'_>,
    index: usize,
    child: ChildRef,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    let ray = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]);
    let tree = trees.tree();
    let base = stack.len;
    let mut current = child;
    loop {
        counter.node(1 << index);
        if current.is_leaf() {
            if trees.stops_in_leaf(s, w, current, rays, index, stack, counter) {
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

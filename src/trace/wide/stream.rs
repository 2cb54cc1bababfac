//! Up to 128 rays through the tree together: each node is visited once for all of them.

use super::alone;
use super::group::{leaf_by_group, node_by_group, of_group, stopped_by_occluders};
use super::leaf::{Lines, hits_leaf, one_of};
use super::occluders::Occluders;
use super::one_ray::OneRay;
use super::quads::{self, leaf_by_quads};
use super::rays::{Bits, Rays, STREAM};
use super::recent::Recent;
use super::simd::{Simd, Wide};
use super::single::{self, Single, one_ray};
use super::stack::{Pending, Stack};
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, Node8, WIDTH};

/// Rays of a group that must be active for testing the group to be worth it: fewer are tested one by
/// one against all children at once.
pub(super) const ACTIVE_IN_NODE: u32 = 3;

/// Has a child brought near that is visited later.
#[inline(always)]
pub(super) fn prefetch<S: Simd>(s: S, tree: &Bvh8, child: ChildRef) {
    if child.is_leaf() {
        let slots = child.leaf_slots();
        let block = &tree.leaves[slots.start * LEAF_ROWS..][..slots.len() * LEAF_ROWS];
        block.chunks(16).for_each(|line| s.prefetch(&line[0]));
        s.prefetch(&block[block.len() - 1]);
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
        here: Bits,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> Bits;

    /// Whether something in a leaf stops one ray.
    #[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
    fn stops_in_leaf<S: Simd, W: Wide, L: Fn() -> Lines<S> + Copy, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        leaf: ChildRef,
        single: Single<S, L>,
        stack: &mut Stack,
        recent: Option<&mut Recent>,
        counter: &mut C,
    ) -> bool;

    /// The tree that stands for a leaf that was put off.
    fn put_off(&self, leaf: ChildRef) -> Triangles<'_>;

    /// Visits what was put off, for the rays that are still alive, and returns those that are stopped.
    #[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
    fn make_up<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        rays: &Rays<'_>,
        alive: Bits,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> Bits;
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
        here: Bits,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> Bits {
        for _ in leaf.leaf_slots() {
            counter.triangle(here);
        }
        leaf_hits(s, w, *self, leaf, rays, here, stack, occluders)
    }

    #[inline(always)]
    fn stops_in_leaf<S: Simd, W: Wide, L: Fn() -> Lines<S> + Copy, C: PacketCounter>(
        &self,
        s: S,
        _: W,
        leaf: ChildRef,
        single: Single<S, L>,
        stack: &mut Stack,
        recent: Option<&mut Recent>,
        counter: &mut C,
    ) -> bool {
        single::stops_in_leaf(s, self.tree, leaf, single, stack, recent, counter)
    }

    #[inline(always)]
    fn put_off(&self, _: ChildRef) -> Triangles<'_> {
        *self
    }

    #[inline(always)]
    fn make_up<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        _: S,
        _: W,
        _: &Rays<'_>,
        _: Bits,
        _: &mut Stack,
        _: &mut Occluders,
        _: &mut C,
    ) -> Bits {
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
) -> Bits {
    let Start { trees, entry } = start;
    let Some(root) = trees.tree().root else { return 0 };
    let mut alive = rays.valid;
    stack.begin();
    alive &= !stopped_by_occluders(w, trees, rays, alive, stack, occluders, counter);
    // Where there is a node to start at, as if it had been found on the stack.
    if entry.is_none() {
        stack.push(root, alive);
    }
    alive &= !descend(s, w, trees, entry, rays, alive, 0, stack, occluders, counter);
    alive &= !rays.settle(s, alive, stack, counter);
    if T::PUTS_OFF {
        alive &= !trees.make_up(s, w, rays, alive, stack, occluders, counter);
        alive &= !rays.settle(s, alive, stack, counter);
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
    mut alive: Bits,
    base: usize,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> Bits {
    let all = alive;
    let tree = trees.tree();
    let sets_aside = !T::PUTS_OFF && stack.alone.is_wanted && tree.is_large();
    loop {
        let (node, here) = if let Some(entry) = first.take() {
            (entry, alive)
        } else {
            let Some(Pending { child, rays: here }) = stack.pop_above(base) else { break };
            let here = here & alive;
            if here == 0 {
                continue;
            }
            // What comes next is fetched meanwhile.
            if let Some(next) = stack.top_above(base) {
                prefetch(s, tree, next);
            }
            if here & (here - 1) == 0 {
                if sets_aside {
                    prefetch(s, tree, child);
                    stack.alone.set_aside(here.trailing_zeros() as usize, child);
                    continue;
                }
                let single = single::of_stream::<S, W>(s, rays, here.trailing_zeros() as usize);
                if one_ray::<T, S, W, _, C>(s, w, trees, single, child, stack, None, counter) {
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
        let groups = w.groups(here);
        let words = if here.count_ones() > groups.count_ones() * ACTIVE_IN_NODE {
            node_by_group(s, w, node, rays, rays.around(w), groups)
        } else {
            node_by_ray::<S, W>(s, w, node, rays, here)
        };
        // Without a branch for each child, as no processor foresees them.
        let met = w.unload(words, here, &node.children, node.occupied(), stack.next());
        stack.added(met);
    }
    if sets_aside {
        alive &= !alone::any_hit(s, w, trees, rays, alive, stack, counter);
    }
    all & !alive
}

/// For each child the rays that meet it.
#[inline(always)]
fn node_by_ray<S: Simd, W: Wide>(
    s: S,
    w: W,
    node: &Node8,
    rays: &Rays<'_>,
    mut active: Bits,
) -> W::Words {
    let mut words = w.words([[0; WIDTH]; 2], 0);
    while active != 0 {
        let index = active.trailing_zeros() as usize;
        let children = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]).meets(s, node);
        words = w.with_ray(words, children, index);
        active &= active - 1;
    }
    words
}

/// Those of the active rays that a triangle of a leaf stops.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
fn leaf_hits<S: Simd, W: Wide>(
    s: S,
    w: W,
    trees: Triangles<'_>,
    leaf: ChildRef,
    rays: &Rays<'_>,
    active: Bits,
    stack: &mut Stack,
    occluders: &mut Occluders,
) -> Bits {
    let triangles = leaf.leaf_slots().len() as u32;
    let (mut left, mut hits) = (w.groups(active), 0);
    while left != 0 {
        let group = left.trailing_zeros() as usize % (STREAM / W::GROUP);
        let first = group * W::GROUP;
        let here = of_group::<W>(active, group);
        left &= left - 1;
        let stopped = if here.count_ones() > triangles {
            leaf_by_group(w, trees, leaf, rays, group, here, stack, occluders)
        } else if quads::are_quicker::<W>() {
            leaf_by_quads(w, trees.tree, leaf, rays, group, here, stack)
        } else {
            leaf_by_ray(s, trees.tree, leaf, rays, first, here, stack)
        };
        hits |= Bits::from(stopped) << first;
    }
    hits
}

/// Those of the rays `here`, counted from the `first` of a group, that a triangle of a leaf stops for certain.
#[inline(always)]
pub(super) fn leaf_by_ray<S: Simd>(
    s: S,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays<'_>,
    first: usize,
    mut here: u64,
    stack: &mut Stack,
) -> u64 {
    let mut stopped = 0;
    while here != 0 {
        let lane = here.trailing_zeros() as usize;
        let lines = one_of(s, rays, first + lane);
        let by = hits_leaf(s, tree, leaf, &lines, first + lane, stack);
        stopped |= u64::from(by.is_some()) << lane;
        here &= here - 1;
    }
    stopped
}

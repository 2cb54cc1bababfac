//! One ray through a tree by itself: one that a call was made for, or what is left of a stream.

use super::leaf::{Lines, hits_leaf, one_of};
use super::numbers::{Given, Target, prepare};
use super::octants::Picked;
use super::one_ray::OneRay;
use super::rays::{Numbers, Rays};
use super::recent::Recent;
use super::simd::{LANES, Simd, Wide, numbers};
use super::stack::Stack;
use super::stream::{Start, Trees, Triangles, prefetch};
use crate::ray::Ray;
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef};

/// What a ray is tested with.
#[derive(Clone, Copy)]
pub(super) struct Single<S: Simd, L: Fn() -> Lines<S> + Copy> {
    pub(super) boxes: OneRay<S>,
    /// Against triangles: read where there are some.
    pub(super) lines: L,
    /// Its number in the stream.
    pub(super) index: usize,
}

/// Ray `index` of a stream.
#[inline(always)]
pub(super) fn of_stream<'a, S: Simd + 'a, W: Wide>(
    s: S,
    rays: &'a Rays<'_>,
    index: usize,
) -> Single<S, impl Fn() -> Lines<S> + Copy + 'a> {
    let boxes = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]);
    single(
        boxes,
        #[inline(always)]
        move || one_of(s, rays, index),
        index,
    )
}

#[inline(always)]
fn single<S: Simd, L: Fn() -> Lines<S> + Copy>(
    boxes: OneRay<S>,
    lines: L,
    index: usize,
) -> Single<S, L> {
    Single { boxes, lines, index }
}

/// How a ray fared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// Nothing is in its way.
    Free,
    /// A triangle stops it that stopped others lately.
    StoppedEarly,
    /// A triangle of the tree stops it.
    Stopped,
}

impl End {
    #[inline(always)]
    pub(super) fn is_occluded(self) -> bool {
        self != Self::Free
    }
}

/// Whether anything is in the way of a ray. Triangles that are given are tried first.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the batch has at hand")]
pub(super) fn any_hit<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    start: Start<'_, T>,
    ray: &Ray,
    target: Target<'_>,
    numbers: &mut Numbers,
    stack: &mut Stack,
    mut recent: Option<&mut Recent>,
    counter: &mut C,
) -> End {
    let Start { trees, entry } = start;
    let Some(root) = trees.tree().root else { return End::Free };
    let Some((boxes, lines)) = plain(s, ray, target).or_else(
        #[inline(always)]
        || odd(s, w, ray, target, numbers),
    ) else {
        return End::Free;
    };
    if let Some(recent) = &mut recent {
        (0..recent.known()).for_each(|_| counter.triangle(1));
        if recent.stop(s, &lines) {
            return End::StoppedEarly;
        }
    }
    let single = single(
        boxes,
        #[inline(always)]
        || lines,
        0,
    );
    stack.begin();
    let whole = [root];
    let starts = entry.map_or(&whole[..], |node| &node.children[..node.len as usize]);
    for child in starts {
        let recent = recent.as_deref_mut();
        if one_ray::<T, S, W, _, C>(s, w, trees, single, *child, stack, recent, counter) {
            return End::Stopped;
        }
    }
    let mut is_stopped = stack.settle(s, target, |_| ray, 1, counter) != 0;
    if T::PUTS_OFF && !is_stopped {
        while let Some((leaf, _)) = stack.make_up() {
            let part = trees.put_off(leaf);
            if visit::<S, W, _, C>(s, w, part, single, stack, recent.as_deref_mut(), counter) {
                return End::Stopped;
            }
        }
        is_stopped = stack.settle(s, target, |_| ray, 1, counter) != 0;
    }
    if is_stopped { End::Stopped } else { End::Free }
}

/// What a ray is tested with that is not odd: all is known in registers.
#[inline(always)]
fn plain<S: Simd>(s: S, ray: &Ray, target: Target<'_>) -> Option<(OneRay<S>, Lines<S>)> {
    let [ox, oy, oz, t_min, dx, dy, dz, t_max] = numbers(ray);
    let given = Given {
        origin: [s.splat(ox), s.splat(oy), s.splat(oz)],
        direction: [s.splat(dx), s.splat(dy), s.splat(dz)],
        t_min: s.splat(t_min),
        t_max: s.splat(t_max),
    };
    let (slabs, lines, plain) = prepare(s, &given, target);
    (plain & 1 != 0).then(
        #[inline(always)]
        || (OneRay::of(slabs, s.octant(ray)), lines),
    )
}

/// As [`plain`], for any ray; `None` if it hits nothing by definition.
#[cold]
#[inline(never)]
fn odd<S: Simd, W: Wide>(
    s: S,
    w: W,
    ray: &Ray,
    target: Target<'_>,
    numbers: &mut Numbers,
) -> Option<(OneRay<S>, Lines<S>)> {
    w.run(
        #[inline(always)]
        || {
            // All of a group are the same.
            let places = &[0; MOST_IN_GROUP][..W::GROUP];
            let picked = Picked::one(std::slice::from_ref(ray), places);
            let rays = Rays::new(s, w, numbers, target, picked);
            let octant = rays.octants[0];
            (rays.valid != 0).then(
                #[inline(always)]
                || (OneRay::new(s, &rays, 0, octant), one_of(s, &rays, 0)),
            )
        },
    )
}

/// Rays of a group with any instructions.
const MOST_IN_GROUP: usize = 2 * LANES;

/// Whether anything below `child` is in the way of a ray.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
pub(super) fn one_ray<T, S, W, L, C>(
    s: S,
    w: W,
    trees: T,
    single: Single<S, L>,
    child: ChildRef,
    stack: &mut Stack,
    mut recent: Option<&mut Recent>,
    counter: &mut C,
) -> bool
where
    T: Trees,
    S: Simd,
    W: Wide,
    L: Fn() -> Lines<S> + Copy,
    C: PacketCounter,
{
    let tree = trees.tree();
    let base = stack.len();
    let mut current = child;
    loop {
        counter.node(1 << single.index);
        stack.alone.steps += 1;
        if current.is_leaf() {
            let recent = recent.as_deref_mut();
            if trees.stops_in_leaf::<S, W, L, C>(s, w, current, single, stack, recent, counter) {
                stack.cut(base);
                return true;
            }
        } else {
            let node = &tree.nodes[current.node_index()];
            let mut met = single.boxes.meets(s, node);
            if met != 0 {
                let first = met.trailing_zeros();
                met &= met - 1;
                s.pick(&node.children, met, stack.next().0);
                stack.added(met.count_ones() as usize);
                if let Some(next) = stack.top_above(base).filter(|_| tree.is_large()) {
                    prefetch(s, tree, next);
                }
                current = node.children[first as usize];
                continue;
            }
        }
        let Some(next) = stack.pop_above(base) else { return false };
        current = next.child;
    }
}

/// Whether a triangle of a leaf is in the way of a ray.
#[inline(always)]
pub(super) fn stops_in_leaf<S: Simd, L: Fn() -> Lines<S> + Copy, C: PacketCounter>(
    s: S,
    tree: &Bvh8,
    leaf: ChildRef,
    single: Single<S, L>,
    stack: &mut Stack,
    recent: Option<&mut Recent>,
    counter: &mut C,
) -> bool {
    for _ in leaf.leaf_slots() {
        counter.triangle(1 << single.index);
    }
    let by = hits_leaf(s, tree, leaf, &(single.lines)(), single.index, stack);
    if let Some((recent, triangle)) = recent.zip(by) {
        recent.remember(tree, leaf, triangle);
    }
    by.is_some()
}

/// Whether anything in the tree of a part is in the way of a ray. A function of its own, or each place
/// that calls it would have a kernel inside.
#[inline(never)]
pub(super) fn visit<S: Simd, W: Wide, L: Fn() -> Lines<S> + Copy, C: PacketCounter>(
    s: S,
    w: W,
    trees: Triangles<'_>,
    single: Single<S, L>,
    stack: &mut Stack,
    recent: Option<&mut Recent>,
    counter: &mut C,
) -> bool {
    let Some(root) = trees.tree.root else { return false };
    w.run(
        #[inline(always)]
        || one_ray::<_, S, W, L, C>(s, w, trees, single, root, stack, recent, counter),
    )
}

//! Trees in the leaves of a tree: rays go from one level to the next as they are, so that answers are
//! those of one tree over all triangles.

use super::leaf::Lines;
use super::occluders::Occluders;
use super::rays::{Bits, Rays};
use super::recent::Recent;
use super::simd::{Simd, Wide};
use super::single::{self, Single};
use super::stack::Stack;
use super::stream::{Trees, Triangles, descend};
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef};

/// A tree over parts of a mesh, each of which has a tree of its own that may be made when it is first
/// needed.
pub trait TwoLevel: Sync {
    /// The tree over the parts: its slots name parts in place of triangles, and its box is that of all
    /// triangles.
    fn top(&self) -> &Bvh8;

    /// The tree of a part, whose slots name triangles of the whole mesh. Made now if need be; does not
    /// wait for other threads.
    fn part(&self, part: usize) -> &Bvh8;

    /// The tree of a part if it has been made.
    fn ready(&self, part: usize) -> Option<&Bvh8>;
}

/// Two levels, for rays that ask whether anything is in their way: parts whose trees have been made
/// come first, as one of them may spare making another.
#[derive(Clone, Copy)]
pub(super) struct Levels<'a>(pub(super) &'a dyn TwoLevel);

impl Levels<'_> {
    fn number(&self, slot: usize) -> u32 {
        self.0.top().triangle_ids[slot]
    }
}

impl Trees for Levels<'_> {
    const PUTS_OFF: bool = true;

    #[inline(always)]
    fn tree(&self) -> &Bvh8 {
        self.0.top()
    }

    #[inline(always)]
    fn of_occluder(&self, number: u32) -> Option<&Bvh8> {
        self.0.ready(number as usize)
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
        let mut left = here;
        for slot in leaf.leaf_slots() {
            if left == 0 {
                break;
            }
            let number = self.number(slot);
            let Some(tree) = self.0.ready(number as usize) else {
                stack.put_off(ChildRef::leaf(slot, 1), left);
                continue;
            };
            left &= !visit(s, w, Triangles { tree, number }, rays, left, stack, occluders, counter);
        }
        here & !left
    }

    #[inline(always)]
    fn stops_in_leaf<S: Simd, W: Wide, L: Fn() -> Lines<S> + Copy, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        leaf: ChildRef,
        single: Single<S, L>,
        stack: &mut Stack,
        mut recent: Option<&mut Recent>,
        counter: &mut C,
    ) -> bool {
        for slot in leaf.leaf_slots() {
            let number = self.number(slot);
            let Some(tree) = self.0.ready(number as usize) else {
                stack.put_off(ChildRef::leaf(slot, 1), 1 << single.index);
                continue;
            };
            let (trees, recent) = (Triangles { tree, number }, recent.as_deref_mut());
            if single::visit::<S, W, L, C>(s, w, trees, single, stack, recent, counter) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn put_off(&self, leaf: ChildRef) -> Triangles<'_> {
        let number = self.number(leaf.leaf_slots().start);
        Triangles { tree: self.0.part(number as usize), number }
    }

    #[inline(always)]
    fn make_up<S: Simd, W: Wide, C: PacketCounter>(
        &self,
        s: S,
        w: W,
        rays: &Rays<'_>,
        alive: Bits,
        stack: &mut Stack,
        occluders: &mut Occluders,
        counter: &mut C,
    ) -> Bits {
        let mut left = alive;
        while let Some((leaf, here)) = stack.make_up() {
            let here = here & left;
            if here == 0 {
                continue;
            }
            let trees = self.put_off(leaf);
            left &= !visit(s, w, trees, rays, here, stack, occluders, counter);
        }
        alive & !left
    }
}

/// Takes rays through the tree of a part, and returns those that are stopped. A function of its own,
/// or each place that calls it would have a kernel inside.
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
fn visit<S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    trees: Triangles<'_>,
    rays: &Rays<'_>,
    here: Bits,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> Bits {
    let Some(root) = trees.tree.root else { return 0 };
    let base = stack.len();
    stack.push(root, here);
    w.run(
        #[inline(always)]
        || descend(s, w, trees, None, rays, here, base, stack, occluders, counter),
    )
}

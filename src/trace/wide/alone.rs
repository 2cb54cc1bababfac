//! Rays that are alone below a child, several at a time: while what one of them visits next is fetched from
//! memory, others go on.
//!
//! That pays where most of it comes from memory: in trees that caches do not hold, and for rays with little in
//! common, as others have just been where they go. How many nodes and leaves rays visited alone lately tells
//! them apart. Where it does not pay it costs, as some would have been stopped elsewhere in the meantime.

use super::one_ray::OneRay;
use super::rays::{Bits, Rays};
use super::simd::{Simd, Wide};
use super::single;
use super::stack::Stack;
use super::stream::{Trees, prefetch};
use crate::trace::packet::PacketCounter;
use crate::tree::{ChildRef, MAX_WIDE_DEPTH, WIDTH};

/// Rays under way at once: enough to be busy for as long as memory takes.
const AT_ONCE: usize = 8;

/// Children that one ray has still to visit: of each node on the way all but the current one.
const ROOM: usize = MAX_WIDE_DEPTH * (WIDTH - 1) + 1 + WIDTH;

/// Nodes and leaves that rays of a kind visit alone, for each ray, from which on they are set aside.
const LEAST_STEPS: f32 = 1.5;

/// What is known of rays of one kind.
#[derive(Clone, Copy, Default)]
pub(super) struct Habit {
    /// Nodes and leaves that each visited alone lately.
    steps: f32,
}

/// Rays set aside, and what those under way have still to visit.
pub(super) struct Alone {
    /// Whether rays are to be set aside.
    pub(super) is_wanted: bool,
    /// Nodes and leaves that this stream's rays visited alone.
    pub(super) steps: u32,
    /// Each with the child that it is alone below.
    aside: Vec<(u32, ChildRef)>,
    rooms: [[ChildRef; ROOM]; AT_ONCE],
}

impl Alone {
    pub(super) const EMPTY: Self = Self {
        is_wanted: false,
        steps: 0,
        aside: Vec::new(),
        rooms: [[ChildRef::UNUSED; ROOM]; AT_ONCE],
    };

    /// Before a stream of rays of a kind.
    pub(super) fn expect(&mut self, habit: Habit) {
        self.is_wanted = habit.steps > LEAST_STEPS;
    }

    /// After that.
    pub(super) fn learn(&self, habit: &mut Habit, rays: u32) {
        let steps = self.steps as f32 / rays.max(1) as f32;
        habit.steps += (steps - habit.steps) * 0.125;
    }

    /// Has a ray go through a subtree later.
    #[inline(always)]
    pub(super) fn set_aside(&mut self, index: usize, child: ChildRef) {
        self.aside.push((index as u32, child));
    }
}

/// A ray under way.
#[derive(Clone, Copy)]
struct Walker {
    index: usize,
    current: ChildRef,
    /// Where it keeps what it has still to visit, and how much that is.
    room: usize,
    len: usize,
}

/// Takes all that were set aside through their subtrees, as long as they are alive; returns those of the
/// alive that something is in the way of. A function of its own, as kernels without it are quicker.
#[inline(never)]
pub(super) fn any_hit<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    trees: T,
    rays: &Rays<'_>,
    alive: Bits,
    stack: &mut Stack,
    counter: &mut C,
) -> Bits {
    w.run(
        #[inline(always)]
        || {
            let mut left = alive;
            let mut walkers = std::array::from_fn::<_, AT_ONCE, _>(|room| Walker {
                index: 0,
                current: ChildRef::UNUSED,
                room,
                len: 0,
            });
            let (mut begun, mut count) = (0, 0);
            loop {
                // As many as there are places for.
                while count < AT_ONCE && begun < stack.alone.aside.len() {
                    let (index, child) = stack.alone.aside[begun];
                    begun += 1;
                    let walker = &mut walkers[count];
                    (walker.index, walker.current, walker.len) = (index as usize, child, 0);
                    count += 1;
                }
                if count == 0 {
                    break;
                }
                let mut place = 0;
                while place < count {
                    let walker = &mut walkers[place];
                    if step(s, w, trees, rays, walker, &mut left, stack, counter) {
                        place += 1;
                    } else {
                        count -= 1;
                        walkers.swap(place, count);
                    }
                }
            }
            stack.alone.aside.clear();
            alive & !left
        },
    )
}

/// One node or leaf further; returns whether there is more to visit.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
fn step<T: Trees, S: Simd, W: Wide, C: PacketCounter>(
    s: S,
    w: W,
    trees: T,
    rays: &Rays<'_>,
    walker: &mut Walker,
    left: &mut Bits,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    let Walker { index, current, room, len } = *walker;
    if *left >> index & 1 == 0 {
        return false;
    }
    counter.node(1 << index);
    stack.alone.steps += 1;
    let tree = trees.tree();
    if current.is_leaf() {
        let single = single::of_stream::<S, W>(s, rays, index);
        if trees.stops_in_leaf::<S, W, _, C>(s, w, current, single, stack, None, counter) {
            *left &= !(1 << index);
            return false;
        }
    } else {
        let node = &tree.nodes[current.node_index()];
        let ray = OneRay::new(s, rays, index, rays.octants[index / W::GROUP]);
        let mut met = ray.meets(s, node);
        if met != 0 {
            let first = met.trailing_zeros();
            met &= met - 1;
            let to = &mut stack.alone.rooms[room][len..len + WIDTH];
            s.pick(&node.children, met, to.try_into().expect("eight places"));
            walker.len += met.count_ones() as usize;
            walker.current = node.children[first as usize];
            prefetch(s, tree, walker.current);
            return true;
        }
    }
    if len == 0 {
        return false;
    }
    walker.len -= 1;
    walker.current = stack.alone.rooms[room][len - 1];
    prefetch(s, tree, walker.current);
    true
}

#[cfg(test)]
mod tests {
    use super::super::{
        Instructions, NoCount, Query, Scratch, Structure, VisitCounts, Way, any_hit,
        any_hit_counted,
    };
    use super::LEAST_STEPS;
    use crate::build::{self, WideCosts};
    use crate::geometry::{TriangleMesh, Vec3};
    use crate::intersect::{Exact, Fast, TriangleTest};
    use crate::ray::{Ray, words_for};
    use crate::test_random::Random;
    use crate::trace::shaft::Entry;
    use crate::trace::single;
    use crate::tree::{Bvh2, Bvh8, Plan};

    /// Answers to rays as the binary tree gives them, and to one after the other.
    fn check<T: TriangleTest>(
        mesh: &TriangleMesh,
        (binary, wide): (&Bvh2, &Bvh8),
        rays: &[Ray],
        test: T,
    ) {
        let expected: Vec<bool> = rays
            .iter()
            .map(|ray| single::any_hit(binary, binary.root, &Plan::Near, test, ray, &mut NoCount))
            .collect();
        let hits = expected.iter().filter(|hit| **hit).count();
        assert!((rays.len() / 20..rays.len() * 19 / 20).contains(&hits), "{hits} hits");
        for set in Instructions::all() {
            let mut scratch = Scratch::default();
            let query = Query {
                structure: Structure::Tree(wide),
                mesh,
                way: Way::Stream,
                mode: T::MODE,
                entry: &Entry::WHOLE,
                stratum: Some(3),
            };
            for round in ["kept together", "set aside"] {
                let mut occluded = vec![0; words_for(rays.len())];
                any_hit(set, &query, rays, &mut occluded, &mut scratch);
                for (index, (ray, expected)) in rays.iter().zip(&expected).enumerate() {
                    let answer = occluded[index / 64] >> (index % 64) & 1 != 0;
                    assert_eq!(answer, *expected, "{} {round}: {ray:?}", set.name());
                }
                assert!(scratch.habits[3].steps > LEAST_STEPS, "{}", scratch.habits[3].steps);
                assert_eq!(scratch.habits[4].steps, 0.0);
            }
            // With all set aside, what is counted is what was visited, and somebody's.
            let mut occluded = vec![0; words_for(rays.len())];
            let mut counts = vec![VisitCounts::default(); rays.len()];
            any_hit_counted(set, &query, rays, &mut occluded, &mut scratch, &mut counts);
            assert!(scratch.stack.alone.is_wanted && scratch.stack.alone.aside.is_empty());
            assert!(counts.iter().all(|count| count.nodes > 0), "a ray without a visit");
        }
    }

    #[test]
    fn rays_set_aside_are_answered_as_all_others() {
        let mut random = Random::new(0xa10e);
        let mut vertices = Vec::new();
        for _ in 0..600_000 {
            let a = random.point();
            let mut near = || a + Vec3::new(random.unit(), random.unit(), random.unit()) * 0.03;
            vertices.extend([a, near(), near()]);
        }
        let triangles = (0..vertices.len() as u32 / 3).map(|t| [0, 1, 2].map(|k| 3 * t + k));
        let mesh = TriangleMesh::new(vertices, triangles.collect());
        let binary = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Wide);
        let costs = WideCosts { leaf: 0.1, triangle: 4.0 };
        let wide = build::collapse(&binary, costs, |node, side| (node % 7 + side) as f64);
        assert!(wide.is_large(), "{} nodes", wide.nodes.len());
        let rays: Vec<Ray> = (0..3000).map(|_| random.ray()).collect();
        check(&mesh, (&binary, &wide), &rays, Fast);
        check(&mesh, (&binary, &wide), &rays, Exact);
    }
}

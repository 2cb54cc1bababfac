//! Packets of up to 64 rays, one after the other through a binary tree (Wald, Boulos and Shirley,
//! "Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG 26(1), 2007).
//!
//! A packet remembers its first active ray, the lowest that may still hit something below. At a
//! box that ray is tested first: if it meets the box, the whole packet goes on without another test
//! (speculative descent). Else the box is tested against `Interval`s around
//! all rays, which rejects it for all at once; else the other rays are tested up to the first that
//! meets it, which is the first active one below. Rays that have hit are masked from then on, which
//! also trims them from both ends: the first active ray moves on over them, and a packet without
//! any is finished.
//!
//! The answers are those of [`single`](super::single), ray for ray. A ray is tested against the
//! triangles of a leaf if it meets the leaf's box by the same box test, and that it does if it
//! meets a triangle in it. Every box above that is then met too, so that no step on the way rejects
//! it: the first active ray is at or before this one, and the intervals reject only what every ray
//! misses. Packets visit more boxes than a ray would, which cannot change an answer, since whether
//! a triangle is hit does not depend on where it is found.

mod interval;
mod lanes;

use super::Counter;
use super::single::{FarFirst, FirstChild, Fixed, NearFirst};
use crate::geometry::Aabb;
use crate::intersect::{PreparedRay, Stage, TriangleTest};
use crate::ray::{Ray, VisitCounts};
use crate::tree::{Bvh2, ChildRef, MAX_DEPTH, Plan};
use interval::Interval;
use lanes::{LANES, Lanes};

/// Most rays in a packet: as many as bits in a word of answers.
pub const PACKET_SIZE: usize = 64;

/// What a packet tells of its visits. Masks have a bit for each ray.
///
/// A packet that enters a node pays for all rays that are active there: that have not hit anything
/// yet, from the first active one on, whether they meet the node or not. Triangle tests are counted
/// for the rays that are tested: those that meet the leaf's box.
pub trait PacketCounter {
    /// An inner node or leaf was entered with these rays active.
    fn node(&mut self, active: u128);
    /// These rays were tested against a triangle.
    fn triangle(&mut self, tested: u128);
    /// The test of this ray was settled by this arithmetic.
    fn settled(&mut self, ray: usize, by: Stage);
}

impl PacketCounter for super::NoCount {
    #[inline(always)]
    fn node(&mut self, _active: u128) {}
    #[inline(always)]
    fn triangle(&mut self, _tested: u128) {}
    #[inline(always)]
    fn settled(&mut self, _ray: usize, _by: Stage) {}
}

/// One element for each ray.
impl PacketCounter for &mut [VisitCounts] {
    fn node(&mut self, active: u128) {
        bits(active).for_each(|ray| self[ray].nodes += 1);
    }
    fn triangle(&mut self, tested: u128) {
        bits(tested).for_each(|ray| self[ray].triangles += 1);
    }
    fn settled(&mut self, ray: usize, by: Stage) {
        Counter::settled(&mut self[ray], by);
    }
}

/// For each of up to [`PACKET_SIZE`] rays, whether anything is in its way, from the lowest bit on.
///
/// # Panics
/// If there are more rays.
pub fn any_hit<T: TriangleTest, C: PacketCounter>(
    tree: &Bvh2,
    plan: &Plan,
    test: T,
    rays: &[Ray],
    counter: C,
) -> u64 {
    match plan {
        Plan::Fixed(bits) => any_hit_by(tree, &Fixed(bits), test, rays, counter),
        Plan::Near => any_hit_by(tree, &NearFirst, test, rays, counter),
        Plan::Far => any_hit_by(tree, &FarFirst, test, rays, counter),
    }
}

/// The indices of set bits.
fn bits(mut mask: u128) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then_some(mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}

/// The bits from `first` on, which is less than 64.
fn from(first: u32) -> u64 {
    u64::MAX << first
}

/// The second child of an inner node, to be visited later.
#[derive(Clone, Copy)]
struct Pending {
    node: u32,
    side: u32,
    first: u32,
}

fn any_hit_by<F: FirstChild, T: TriangleTest, C: PacketCounter>(
    tree: &Bvh2,
    order: &F,
    test: T,
    rays: &[Ray],
    mut counter: C,
) -> u64 {
    let Some(root) = tree.root else { return 0 };
    let packet = Packet::new(tree, test, rays);
    let mut active = packet.valid;
    let Some(mut first) = packet.first_to_meet(&tree.bounds, active) else { return 0 };
    let (mut current, mut bounds) = (root, &tree.bounds);
    let mut stack = [Pending { node: 0, side: 0, first: 0 }; MAX_DEPTH];
    let mut pending = 0;
    loop {
        let here = active & from(first);
        counter.node(here.into());
        if current.is_leaf() {
            active &= !packet.leaf_hits(tree, current, bounds, here, &mut counter);
        } else {
            let index = current.node_index();
            let node = &tree.nodes[index];
            let met = node.bounds.each_ref().map(|b| packet.first_to_meet(b, here));
            let side = match met {
                [Some(a), Some(b)] => {
                    // The ray that is the first active one in both decides; if the first one enters
                    // one child only, that is where it goes.
                    let second_first = if a == b || !F::BY_RAY {
                        let ray = packet.ray(a);
                        let entry = node.bounds.each_ref().map(|b| ray.enter(b));
                        order.is_second(index, entry.map(|e| e.unwrap_or(f32::INFINITY)))
                    } else {
                        b < a
                    };
                    let side = usize::from(second_first);
                    let other = 1 - side;
                    stack[pending] = Pending {
                        node: index as u32,
                        side: other as u32,
                        first: if other == 0 { a } else { b },
                    };
                    pending += 1;
                    Some((side, if side == 0 { a } else { b }))
                }
                [Some(a), None] => Some((0, a)),
                [None, Some(b)] => Some((1, b)),
                [None, None] => None,
            };
            if let Some((side, ray)) = side {
                (current, bounds, first) = (node.children[side], &node.bounds[side], ray);
                continue;
            }
        }
        loop {
            if pending == 0 {
                return packet.valid & !active;
            }
            pending -= 1;
            let next = stack[pending];
            let here = active & from(next.first);
            if here == 0 {
                continue;
            }
            let (node, side) = (&tree.nodes[next.node as usize], next.side as usize);
            // The ray that met the box may have hit something since.
            let still_first = here.trailing_zeros() == next.first;
            let met = if still_first {
                Some(next.first)
            } else {
                packet.first_to_meet(&node.bounds[side], here)
            };
            if let Some(ray) = met {
                (current, bounds, first) = (node.children[side], &node.bounds[side], ray);
                break;
            }
        }
    }
}

struct Packet<T> {
    test: T,
    rays: [Option<PreparedRay>; PACKET_SIZE],
    /// The rays that can hit anything, one bit each.
    valid: u64,
    lanes: Lanes,
    interval: Interval,
}

impl<T: TriangleTest> Packet<T> {
    #[inline]
    fn new(tree: &Bvh2, test: T, rays: &[Ray]) -> Self {
        assert!(rays.len() <= PACKET_SIZE, "{} rays in a packet", rays.len());
        let mut prepared = [None; PACKET_SIZE];
        let mut valid = 0;
        for (index, (ray, prepared)) in rays.iter().zip(&mut prepared).enumerate() {
            *prepared = PreparedRay::new(ray, &tree.bounds);
            valid |= u64::from(prepared.is_some()) << index;
        }
        let lanes = Lanes::new(&prepared, T::MODE);
        let interval = Interval::around(prepared.iter().flatten());
        Self { test, rays: prepared, valid, lanes, interval }
    }

    #[inline(always)]
    fn ray(&self, index: u32) -> &PreparedRay {
        self.rays[index as usize].as_ref().expect("only valid rays are active")
    }

    /// The first of the `active` rays, of which there is one at least, that meets `bounds`.
    #[inline]
    fn first_to_meet(&self, bounds: &Aabb, active: u64) -> Option<u32> {
        if active == 0 {
            return None;
        }
        let first = active.trailing_zeros();
        if self.ray(first).enter(bounds).is_some() {
            return Some(first);
        }
        if self.interval.all_miss(bounds) {
            return None;
        }
        let others = active & (active - 1);
        (first as usize / LANES..PACKET_SIZE / LANES).find_map(|group| {
            let others = lanes::of_group(others, group);
            if others == 0 {
                return None;
            }
            let met = self.lanes.meet(group, bounds) & others;
            (met != 0).then(|| (group * LANES) as u32 + met.trailing_zeros())
        })
    }

    /// Those of the `active` rays that a triangle of `leaf`, with box `bounds`, stops.
    #[inline]
    fn leaf_hits<C: PacketCounter>(
        &self,
        tree: &Bvh2,
        leaf: ChildRef,
        bounds: &Aabb,
        active: u64,
        counter: &mut C,
    ) -> u64 {
        let mut tested = 0;
        for group in 0..PACKET_SIZE / LANES {
            if lanes::of_group(active, group) != 0 {
                tested |= self.lanes.meet(group, bounds) << (group * LANES);
            }
        }
        tested &= active;
        let mut hits = 0;
        for triangle in &tree.triangles[leaf.leaf_slots()] {
            if tested == 0 {
                break;
            }
            counter.triangle(tested.into());
            for group in 0..PACKET_SIZE / LANES {
                let of_group = lanes::of_group(tested, group);
                if of_group == 0 {
                    continue;
                }
                let candidates = self.lanes.may_hit(T::MODE, group, triangle) & of_group;
                for lane in bits(candidates.into()) {
                    let index = group * LANES + lane;
                    let (hit, by) = self.test.hits(self.ray(index as u32), triangle);
                    counter.settled(index, by);
                    hits |= u64::from(hit) << index;
                }
            }
            tested &= !hits;
        }
        hits
    }
}

#[cfg(test)]
mod tests;

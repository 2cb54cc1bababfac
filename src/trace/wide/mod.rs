//! Kernels for eight-wide trees.
//!
//! Answers are those of brute force, ray for ray: the tests here only turn away what the scalar
//! tests of [`PreparedRay`](crate::intersect::PreparedRay) turn away too, and what is left is given
//! to these. So neither width nor instruction set nor order shows in an answer.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod closest;
mod group;
mod leaf;
mod occluders;
mod one_ray;
mod rays;
mod simd;
mod stream;

use super::NoCount;
use super::packet::PacketCounter;
use crate::geometry::Vec3;
use crate::ray::{Hit, Ray, VisitCounts};
use crate::tree::Bvh8;
use occluders::Occluders;
use rays::{NOBODY, Rays, STREAM};
use simd::{Portable, Simd, Wide};
use stream::Stack;

/// The instructions that kernels run on: asked for once, not for each ray.
#[derive(Clone, Copy, Debug)]
pub struct Instructions(Set);

#[derive(Clone, Copy, Debug)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(avx2::Avx2, avx512::Avx512),
}

impl Instructions {
    /// Those that every processor has.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// The best that this processor has, unless the environment says `SATO_PORTABLE=1`.
    pub fn detect() -> Self {
        if std::env::var_os("SATO_PORTABLE").is_some_and(|value| value == "1") {
            return Self::PORTABLE;
        }
        Self::all().pop().unwrap_or(Self::PORTABLE)
    }

    /// All that this processor has, the best last.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::PORTABLE];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(avx2::Avx2::detect().map(|avx2| Self(Set::Avx2(avx2))));
            let avx512 = avx512::Avx512::detect();
            all.extend(avx512.map(|(avx2, avx512)| Self(Set::Avx512(avx2, avx512))));
        }
        if std::env::var_os("SATO_AVX2").is_some() {
            all.truncate(2);
        }
        all
    }

    /// As printed beside timings.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable kernels",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(_) => "AVX2 kernels",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(..) => "AVX-512 kernels",
        }
    }
}

/// Memory of a kernel at work, for any number of batches.
pub struct Scratch {
    rays: Rays,
    stack: Stack,
    /// Places of rays in the batch, in the order in which streams take them.
    places: Vec<u16>,
    keys: Vec<u8>,
    occluders: Occluders,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            rays: Rays::EMPTY,
            stack: Stack::EMPTY,
            places: Vec::new(),
            keys: Vec::new(),
            occluders: Occluders::EMPTY,
        }
    }
}

/// How rays are taken through the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// One after the other.
    Single,
    /// 64 together.
    Stream,
}

/// For each of `rays` whether anything is in its way. `occluded` holds zeroed words.
pub fn any_hit(
    instructions: Instructions,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
) {
    dispatch(instructions, way, tree, rays, occluded, scratch, &mut NoCount);
}

/// As [`any_hit`], and adds what each ray visits to its element of `counts`.
pub fn any_hit_counted(
    instructions: Instructions,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    counts: &mut [VisitCounts],
) {
    let mut tally = Counts { of_all: counts, of_stream: [VisitCounts::default(); STREAM] };
    dispatch(instructions, way, tree, rays, occluded, scratch, &mut tally);
}

/// A counter of one stream after the other.
trait Tally: PacketCounter {
    /// The stream is done, whose rays have these places in the batch.
    fn next_stream(&mut self, places: &[u16]);
}

impl Tally for NoCount {
    #[inline(always)]
    fn next_stream(&mut self, _: &[u16]) {}
}

struct Counts<'a> {
    of_all: &'a mut [VisitCounts],
    of_stream: [VisitCounts; STREAM],
}

impl PacketCounter for Counts<'_> {
    fn node(&mut self, active: u64) {
        PacketCounter::node(&mut self.of_stream.as_mut_slice(), active);
    }
    fn triangle(&mut self, tested: u64) {
        PacketCounter::triangle(&mut self.of_stream.as_mut_slice(), tested);
    }
}

impl Tally for Counts<'_> {
    fn next_stream(&mut self, places: &[u16]) {
        for (place, counts) in places.iter().zip(&mut self.of_stream) {
            if *place != NOBODY {
                self.of_all[usize::from(*place)] += *counts;
            }
            *counts = VisitCounts::default();
        }
    }
}

fn dispatch<T: Tally>(
    instructions: Instructions,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    tally: &mut T,
) {
    // Places are 16-bit numbers.
    const MOST: usize = 1 << 14;
    if rays.len() > MOST {
        todo!();
    }
    match instructions.0 {
        Set::Portable => batch(Portable, Portable, way, tree, rays, occluded, scratch, tally),
        #[cfg(target_arch = "x86_64")]
        Set::Avx2(avx2) => avx2.run(
            #[inline(always)]
            || batch(avx2, avx2, way, tree, rays, occluded, scratch, tally),
        ),
        #[cfg(target_arch = "x86_64")]
        Set::Avx512(avx2, avx512) => avx512.run(
            #[inline(always)]
            || batch(avx2, avx512, way, tree, rays, occluded, scratch, tally),
        ),
    }
}

#[inline(always)]
fn batch<S: Simd, W: Wide, T: Tally>(
    s: S,
    w: W,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    tally: &mut T,
) {
    let Scratch { rays: prepared, stack, places, keys, occluders } = scratch;
    let occluders = occluders.of_tree(tree.id);
    places_by_octant::<W>(rays, places, keys);
    for places in places.chunks(STREAM) {
        prepared.fill(s, w, &tree.bounds, rays, places);
        let mut hits = match way {
            Way::Single => stream::any_hit_one_by_one(s, w, tree, prepared, stack, tally),
            Way::Stream => stream::any_hit(s, w, tree, prepared, stack, occluders, tally),
        };
        tally.next_stream(places);
        while hits != 0 {
            let place = usize::from(places[hits.trailing_zeros() as usize]);
            occluded[place / 64] |= 1 << (place % 64);
            hits &= hits - 1;
        }
    }
}

/// Lists the places of rays octant by octant, each from the start of a group on.
#[inline(always)]
fn places_by_octant<W: Wide>(rays: &[Ray], places: &mut Vec<u16>, keys: &mut Vec<u8>) {
    let Some(first) = rays.first() else { return places.clear() };
    let first = rays::octant(first);
    let alike = rays.iter().fold(0, |all, ray| all | rays::octant(ray) ^ first) == 0;
    places.clear();
    if alike {
        places.extend(0..rays.len() as u16);
        return;
    }
    keys.resize(rays.len(), 0);
    let mut next = [0u16; 64];
    for (key, ray) in keys.iter_mut().zip(rays) {
        let Vec3 { x, y, z } = ray.direction.abs();
        let order = u8::from(x < y) | u8::from(y < z) << 1 | u8::from(z < x) << 2;
        *key = rays::octant(ray) << 3 | order;
        next[usize::from(*key)] += 1;
    }
    let mut end = 0;
    for octant in next.as_chunks_mut::<8>().0 {
        for first in octant {
            let count = std::mem::replace(first, end);
            end += count;
        }
        end = end.next_multiple_of(W::GROUP as u16);
    }
    places.resize(end as usize, NOBODY);
    for (place, key) in keys.iter().enumerate() {
        let slot = &mut next[usize::from(*key)];
        places[usize::from(*slot)] = place as u16;
        *slot += 1;
    }
}

/// The closest hit of `ray`; ties go to the lower triangle index.
pub fn closest_hit(instructions: Instructions, tree: &Bvh8, ray: &Ray) -> Option<Hit> {
    match instructions.0 {
        Set::Portable => closest::closest_hit(Portable, tree, ray),
        #[cfg(target_arch = "x86_64")]
        Set::Avx2(avx2) => avx2.run(
            #[inline(always)]
            || closest::closest_hit(avx2, tree, ray),
        ),
        #[cfg(target_arch = "x86_64")]
        Set::Avx512(avx2, _) => avx2.run(
            #[inline(always)]
            || closest::closest_hit(avx2, tree, ray),
        ),
    }
}

#[cfg(test)]
mod tests;

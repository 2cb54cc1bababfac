//! Kernels for eight-wide trees.
//!
//! Answers are those of brute force, ray for ray: the tests here only turn away what the scalar
//! tests of [`PreparedRay`](crate::intersect::PreparedRay) turn away too, and what is left is given
//! to these. So neither width nor instruction set nor order shows in an answer.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod closest;
mod leaf;
mod one_ray;
mod rays;
mod simd;
mod stream;

use super::packet::PacketCounter;
use crate::ray::{Hit, Ray};
use crate::tree::Bvh8;
use rays::{Rays, STREAM};
use simd::{Portable, Simd};
use stream::Stack;

/// The instructions that kernels run on: asked for once, not for each ray.
#[derive(Clone, Copy, Debug)]
pub struct Instructions(Set);

#[derive(Clone, Copy, Debug)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
}

impl Instructions {
    /// Those that every processor has.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// The best that this processor has, unless the environment says `SATO_PORTABLE=1`.
    pub fn detect() -> Self {
        if std::env::var_os("SATO_PORTABLE").is_some_and(|value| value == "1") {
            return Self::PORTABLE;
        }
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = avx2::Avx2::detect() {
            return Self(Set::Avx2(avx2));
        }
        Self::PORTABLE
    }

    /// As printed beside timings.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable kernels",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(_) => "AVX2 kernels",
        }
    }
}

/// Memory of a kernel at work, for any number of batches.
pub struct Scratch {
    rays: Rays,
    stack: Stack,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { rays: Rays::EMPTY, stack: Stack::EMPTY }
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

/// For each of `rays` whether anything is in its way. `occluded` and what `counter` makes for each
/// word belong to 64 rays each.
pub fn any_hit<C: PacketCounter>(
    instructions: Instructions,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    counter: &mut impl FnMut(usize) -> C,
) {
    match instructions.0 {
        Set::Portable => any_hit_by(Portable, way, tree, rays, occluded, scratch, counter),
        #[cfg(target_arch = "x86_64")]
        Set::Avx2(avx2) => avx2.run(
            #[inline(always)]
            || any_hit_by(avx2, way, tree, rays, occluded, scratch, counter),
        ),
    }
}

#[inline(always)]
fn any_hit_by<S: Simd, C: PacketCounter>(
    s: S,
    way: Way,
    tree: &Bvh8,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    counter: &mut impl FnMut(usize) -> C,
) {
    let Scratch { rays: prepared, stack } = scratch;
    for (stream, (rays, word)) in rays.chunks(STREAM).zip(occluded).enumerate() {
        prepared.fill(s, &tree.bounds, rays);
        let counter = &mut counter(stream);
        *word = match way {
            Way::Single => stream::any_hit_one_by_one(s, tree, prepared, stack, counter),
            Way::Stream => stream::any_hit(s, tree, prepared, stack, counter),
        };
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
    }
}

#[cfg(test)]
mod tests;

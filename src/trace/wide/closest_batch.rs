//! Closest hits, of one ray or of a batch, on the instructions at hand.

use super::numbers::Target;
use super::octants::EntryPoint;
use super::rays::Rays;
use super::simd::{Portable, Simd, Wide};
use super::{Instructions, MOST_SORTED, Scratch, Set, Structure, closest, closest_stream};
use crate::geometry::TriangleMesh;
use crate::intersect::Mode;
use crate::ray::{Hit, Ray};

/// The closest hit of `ray`; ties go to the lower triangle index.
pub fn closest_hit(
    instructions: Instructions,
    structure: Structure<'_>,
    mesh: &TriangleMesh,
    ray: &Ray,
) -> Option<Hit> {
    match instructions.0 {
        Set::Portable => closest::closest_hit(Portable, structure, mesh, ray),
        #[cfg(target_arch = "x86_64")]
        Set::Avx2(avx2) | Set::Avx512(avx2, _) => avx2.run(
            #[inline(always)]
            || closest::closest_hit(avx2, structure, mesh, ray),
        ),
    }
}

/// For each of `rays` its [`closest_hit`], into the element of `hits` in its place.
pub fn closest_hits(
    instructions: Instructions,
    structure: Structure<'_>,
    mesh: &TriangleMesh,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
    scratch: &mut Scratch,
) {
    hits.fill(None);
    for (rays, hits) in rays.chunks(MOST_SORTED).zip(hits.chunks_mut(MOST_SORTED)) {
        let batch = ClosestBatch { structure, mesh, rays, hits };
        match instructions.0 {
            Set::Portable => batch.trace(Portable, Portable, scratch),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(avx2) => avx2.run(
                #[inline(always)]
                || batch.trace(avx2, avx2, scratch),
            ),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(avx2, avx512) => avx512.run(
                #[inline(always)]
                || batch.trace(avx2, avx512, scratch),
            ),
        }
    }
}

/// Rays to find the closest hits of.
struct ClosestBatch<'a> {
    structure: Structure<'a>,
    mesh: &'a TriangleMesh,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl ClosestBatch<'_> {
    #[inline(always)]
    fn trace<S: Simd, W: Wide>(self, s: S, w: W, scratch: &mut Scratch) {
        let Self { structure, mesh, rays, hits } = self;
        let Scratch { numbers, places, closest, .. } = scratch;
        // Distances are those of the plain test.
        let target = Target { bounds: &structure.top().bounds, mesh, mode: Mode::Fast };
        places.list(s, w, rays, MOST_SORTED, |_| EntryPoint::Whole);
        for picked in places.streams(rays) {
            let mut prepared = Rays::new(s, w, numbers, target, picked);
            closest_stream::closest_hits(s, w, structure, &mut prepared, closest, |index, hit| {
                hits[usize::from(picked.places[index])] = Some(hit);
            });
        }
    }
}

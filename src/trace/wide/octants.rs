//! Rays by octant: groups hold rays of one, which enter boxes by the same planes.

use super::rays::{NOBODY, STREAM};
use super::simd::{Simd, Wide};
use crate::ray::Ray;

/// Places of rays, by octant.
#[derive(Default)]
pub(super) struct Places {
    /// For 64 rays at a time those of each octant, one bit each.
    words: Vec<[u64; 8]>,
    places: Vec<u16>,
}

impl Places {
    /// Lists the places of rays octant by octant, each from the start of a group on: what is left of a
    /// group names its last ray again, as [`NOBODY`].
    #[inline(always)]
    pub(super) fn by_octant<S: Simd, W: Wide>(&mut self, s: S, w: W, rays: &[Ray]) -> &[u16] {
        let Self { words, places } = self;
        words.clear();
        let mut counts = [0; 8];
        let mut signs = [0; STREAM];
        for rays in rays.chunks(STREAM) {
            for (signs, ray) in signs.iter_mut().zip(rays) {
                // In the highest bits, which are transposed first.
                *signs = s.octant(ray) << 5;
            }
            let there = u64::MAX >> (STREAM - rays.len());
            let [.., x, y, z] = s.transpose(&signs);
            let of_octants: [u64; 8] = std::array::from_fn(|octant| {
                let picked =
                    |word: u64, axis: usize| if octant >> axis & 1 == 1 { word } else { !word };
                picked(x, 0) & picked(y, 1) & picked(z, 2) & there
            });
            for (count, word) in counts.iter_mut().zip(of_octants) {
                *count += word.count_ones() as usize;
            }
            words.push(of_octants);
        }
        let len = counts.iter().map(|count| count.next_multiple_of(W::GROUP)).sum();
        // Whatever is written after an octant's places ends here.
        places.resize(len + STREAM, 0);
        let mut next = 0;
        for (octant, count) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            for (chunk, of_octants) in words.iter().enumerate() {
                let to = &mut places[next..next + STREAM];
                let to = to.try_into().expect("as many places as asked for");
                next += w.numbers_of_bits(of_octants[octant], (chunk * STREAM) as u16, to);
            }
            let nobody = places[next - 1] | NOBODY;
            let end = next + count.next_multiple_of(W::GROUP) - count;
            places[next..end].fill(nobody);
            next = end;
        }
        &places[..len]
    }
}

//! Rays by octant: groups hold rays of one, which enter boxes by the same planes.

use super::rays::STREAM;
use super::simd::{Simd, Wide};
use crate::ray::Ray;

/// Rays of a batch that go through a tree together.
#[derive(Clone, Copy)]
pub(super) struct Picked<'a> {
    pub(super) batch: &'a [Ray],
    /// Their places in the batch.
    pub(super) places: &'a [u16],
    /// One bit for each place that has a ray of its own: others repeat one.
    pub(super) there: u64,
    /// What follows the batch, as far on as these rays are in it.
    pub(super) ahead: *const Ray,
}

/// Places of a batch's rays, by octant.
#[derive(Default)]
pub(super) struct Places {
    /// For 64 rays at a time those of each octant, one bit each.
    words: Vec<[u64; 8]>,
    /// Octant by octant, each from the start of a group on.
    places: Vec<u16>,
    /// For 64 places at a time those that do not repeat another one.
    there: Vec<u64>,
}

impl Places {
    /// The rays of a batch, 64 places at a time.
    #[inline(always)]
    pub(super) fn by_octant<'a, S: Simd, W: Wide>(
        &'a mut self,
        s: S,
        w: W,
        batch: &'a [Ray],
    ) -> impl Iterator<Item = Picked<'a>> {
        self.list(s, w, batch);
        let streams = self.places.chunks(STREAM).zip(&self.there).enumerate();
        streams.map(
            #[inline(always)]
            |(stream, (places, there))| {
                let ahead = batch.as_ptr_range().end.wrapping_add(stream * STREAM);
                Picked { batch, places, there: *there, ahead }
            },
        )
    }

    #[inline(always)]
    fn list<S: Simd, W: Wide>(&mut self, s: S, w: W, rays: &[Ray]) {
        let Self { words, places, there } = self;
        words.clear();
        let mut counts = [0; 8];
        let mut signs = [0; STREAM];
        for rays in rays.chunks(STREAM) {
            for (signs, ray) in signs.iter_mut().zip(rays) {
                // In the highest bits, which are transposed first.
                *signs = s.octant(ray) << 5;
            }
            let all = u64::MAX >> (STREAM - rays.len());
            let [.., x, y, z] = s.transpose(&signs);
            let of_octants: [u64; 8] = std::array::from_fn(|octant| {
                let picked =
                    |word: u64, axis: usize| if octant >> axis & 1 == 1 { word } else { !word };
                picked(x, 0) & picked(y, 1) & picked(z, 2) & all
            });
            for (count, word) in counts.iter_mut().zip(of_octants) {
                *count += word.count_ones() as usize;
            }
            words.push(of_octants);
        }
        let len: usize = counts.iter().map(|count| count.next_multiple_of(W::GROUP)).sum();
        there.clear();
        there.resize(len / STREAM, u64::MAX);
        there.extend((!len.is_multiple_of(STREAM)).then(|| u64::MAX >> (STREAM - len % STREAM)));
        // Whatever is written after an octant's places ends here.
        places.resize(len + STREAM, 0);
        let mut next = 0;
        for octant in (0..8).filter(|&octant| counts[octant] > 0) {
            for (chunk, of_octants) in words.iter().enumerate() {
                let to = &mut places[next..next + STREAM];
                let to = to.try_into().expect("as many places as asked for");
                next += w.numbers_of_bits(of_octants[octant], (chunk * STREAM) as u16, to);
            }
            let of_last_group = (next - 1) % W::GROUP + 1;
            let left_over = W::GROUP - of_last_group;
            let last = places[next - 1];
            places[next..next + left_over].fill(last);
            // What is left over of a group ends with it.
            let repeated = ((1 << left_over) - 1) << (next % STREAM);
            there[(next - 1) / STREAM] &= !repeated;
            next += left_over;
        }
        places.truncate(len);
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "x86_64")]
    use super::super::avx2::Avx2;
    #[cfg(target_arch = "x86_64")]
    use super::super::avx512::Avx512;
    use super::super::simd::Portable;
    use super::super::{Instructions, MOST_SORTED, Set};
    use super::*;
    use crate::geometry::Vec3;
    use crate::test_random::Random;

    /// Streams' places, and which of them are there.
    fn streams<S: Simd, W: Wide>(s: S, w: W, batch: &[Ray]) -> Vec<(Vec<u16>, u64)> {
        let mut places = Places::default();
        w.run(|| {
            places
                .by_octant(s, w, batch)
                .map(|picked| (picked.places.to_vec(), picked.there))
                .collect()
        })
    }

    #[test]
    fn every_ray_is_listed_once_and_groups_are_of_one_octant() {
        let mut random = Random::new(0x0c7a);
        let sizes = (0..40).map(|_| 1 + random.bits() as usize % 400).collect::<Vec<_>>();
        for size in sizes.into_iter().chain([1, 15, 16, 63, 64, 65, MOST_SORTED]) {
            let one_way = random.bits().is_multiple_of(4);
            let batch: Vec<Ray> = (0..size)
                .map(|_| random.ray())
                .map(|ray| if one_way { Ray { direction: Vec3::ONE, ..ray } } else { ray })
                .collect();
            for set in Instructions::all() {
                let (group, streams) = match set.0 {
                    Set::Portable => (Portable::GROUP, streams(Portable, Portable, &batch)),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx2(avx2) => (Avx2::GROUP, streams(avx2, avx2, &batch)),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx512(avx2, avx512) => (Avx512::GROUP, streams(avx2, avx512, &batch)),
                };
                let mut listed = Vec::new();
                for (places, there) in &streams {
                    assert_eq!(places.len() % group, 0);
                    assert!(there.count_ones() as usize <= places.len());
                    for (first, places) in places.chunks(group).enumerate() {
                        let octant = |place: &u16| Portable.octant(&batch[usize::from(*place)]);
                        assert!(places.iter().all(|place| octant(place) == octant(&places[0])));
                        let there = there >> (first * group);
                        assert_ne!(there & 1, 0, "a group of nobody");
                        let own = |index: &usize| there >> index & 1 != 0;
                        listed.extend((0..group).filter(own).map(|index| places[index]));
                    }
                }
                // In the order of the batch, octant by octant.
                let mut wanted: Vec<u16> = (0..size as u16).collect();
                wanted.sort_by_key(|place| Portable.octant(&batch[usize::from(*place)]));
                assert_eq!(listed, wanted, "{} of {size} rays", set.name());
            }
        }
    }
}

//! Rays by octant: groups hold rays of one, which enter boxes by the same planes.

use super::rays::{Bits, STREAM};
use super::simd::{Simd, Wide};
use crate::ray::Ray;

/// So many rays of an octant go through a tree together even where they fill no stream.
const LEAST_OF_OWN: usize = STREAM / 2;

/// Bits of a word.
pub(super) const WORD: usize = 64;

/// Rays of a batch that go through a tree together.
#[derive(Clone, Copy)]
pub(super) struct Picked<'a> {
    pub(super) batch: &'a [Ray],
    /// Their places in the batch.
    pub(super) places: &'a [u16],
    /// One bit for each place that has a ray of its own: others repeat one.
    pub(super) there: Bits,
    /// Where they start, if they all do: what was said of them when they were listed.
    pub(super) entry: Option<usize>,
    /// What follows the batch, as far on as these rays are in it.
    pub(super) ahead: *const Ray,
}

impl<'a> Picked<'a> {
    /// One ray, whose place comes first.
    #[inline(always)]
    pub(super) fn one(batch: &'a [Ray], places: &'a [u16]) -> Self {
        Self { batch, places, there: 1, entry: None, ahead: std::ptr::null() }
    }
}

/// Places of a batch's rays, by octant: first streams of one octant, then what is left over.
#[derive(Default)]
pub(super) struct Places {
    /// For 64 rays at a time those of each octant, one bit each.
    words: Vec<[u64; 8]>,
    places: Vec<u16>,
    left_over: LeftOver,
    streams: Vec<Listed>,
}

/// The places of a stream, which of them do not repeat another one, and where all of them start.
#[derive(Clone, Copy)]
struct Listed {
    first: usize,
    len: usize,
    there: Bits,
    entry: Option<usize>,
}

/// Where rays of an octant start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EntryPoint {
    /// Where all of the batch do: at the root, or where they were told to.
    Whole,
    /// At the node of this number.
    From(usize),
    /// There is nothing that they could meet.
    Nowhere,
}

impl Places {
    /// Lists the rays of a batch. Asks `entry_point` where rays of one octant start, as many as `run` at a
    /// time, a multiple of [`STREAM`].
    #[inline(always)]
    pub(super) fn list<S: Simd, W: Wide>(
        &mut self,
        s: S,
        w: W,
        rays: &[Ray],
        run: usize,
        mut entry_point: impl FnMut(&[u16]) -> EntryPoint,
    ) {
        let counts = self.sort(s, rays);
        let Self { words, places, left_over, streams } = self;
        streams.clear();
        left_over.clear();
        // Whatever is written after an octant's places ends here.
        let room = rays.len() + MOST_LEFT_OVER + STREAM;
        places.resize(room.max(places.len()), 0);
        let mut next = 0;
        for octant in (0..8).filter(|&octant| counts[octant] > 0) {
            let mut end = next;
            for (chunk, of_octants) in words.iter().enumerate() {
                let to = &mut places[end..end + WORD];
                let to = to.try_into().expect("as many places as asked for");
                end += w.numbers_of_bits(of_octants[octant], (chunk * WORD) as u16, to);
            }
            // What streams take moves up to those before; only an octant's last one repeats a place.
            let mut begin = next;
            while begin < end {
                let of_run = begin..end.min(begin + run);
                begin = of_run.end;
                let entry = match entry_point(&places[of_run.clone()]) {
                    EntryPoint::Whole => None,
                    EntryPoint::From(entry) => Some(entry),
                    EntryPoint::Nowhere => continue,
                };
                let mut own = of_run.clone();
                if own.len() % STREAM < LEAST_OF_OWN {
                    own.end -= own.len() % STREAM;
                    left_over.add::<W>(&places[own.end..of_run.end], entry);
                }
                let mut left = own.len();
                places.copy_within(own, next);
                while left > 0 {
                    let here = left.min(STREAM);
                    let len = here.next_multiple_of(W::GROUP);
                    let last = places[next + here - 1];
                    places[next + here..next + len].fill(last);
                    let there = Bits::MAX >> (STREAM - here);
                    streams.push(Listed { first: next, len, there, entry });
                    (next, left) = (next + len, left - here);
                }
            }
        }
        let rest = &left_over.places[..left_over.len];
        places[next..next + rest.len()].copy_from_slice(rest);
        for (stream, (there, entry)) in left_over.streams().enumerate() {
            let first = next + stream * STREAM;
            let len = STREAM.min(next + rest.len() - first);
            streams.push(Listed { first, len, there, entry });
        }
    }

    /// The rays listed, of that batch, a stream at a time.
    #[inline(always)]
    pub(super) fn streams<'a>(&'a self, batch: &'a [Ray]) -> impl Iterator<Item = Picked<'a>> {
        self.streams.iter().map(
            #[inline(always)]
            |&Listed { first, len, there, entry }| {
                let ahead = batch.as_ptr_range().end.wrapping_add(first);
                Picked { batch, places: &self.places[first..first + len], there, entry, ahead }
            },
        )
    }

    /// Sets the words, and returns how many rays there are of each octant.
    #[inline(always)]
    fn sort<S: Simd>(&mut self, s: S, rays: &[Ray]) -> [usize; 8] {
        self.words.clear();
        let mut counts = [0; 8];
        let mut signs = [0; WORD];
        for rays in rays.chunks(WORD) {
            for (signs, ray) in signs.iter_mut().zip(rays) {
                // In the highest bits, which are transposed first.
                *signs = s.octant(ray) << 5;
            }
            let all = u64::MAX >> (WORD - rays.len());
            let [.., x, y, z] = s.transpose(&signs);
            let of_octants: [u64; 8] = std::array::from_fn(|octant| {
                let picked =
                    |word: u64, axis: usize| if octant >> axis & 1 == 1 { word } else { !word };
                picked(x, 0) & picked(y, 1) & picked(z, 2) & all
            });
            for (count, word) in counts.iter_mut().zip(of_octants) {
                *count += word.count_ones() as usize;
            }
            self.words.push(of_octants);
        }
        counts
    }
}

/// Of each octant less than half a stream, and each fills its last group.
const MOST_LEFT_OVER: usize = 8 * LEAST_OF_OWN;

/// Places that fill no stream of their octant, from the start of a group on each.
struct LeftOver {
    places: [u16; MOST_LEFT_OVER],
    len: usize,
    /// For each stream's places those that do not repeat another one, and where all of them start.
    streams: [(Bits, Option<usize>); MOST_LEFT_OVER / STREAM],
}

impl Default for LeftOver {
    fn default() -> Self {
        Self { places: [0; MOST_LEFT_OVER], len: 0, streams: [(0, None); MOST_LEFT_OVER / STREAM] }
    }
}

impl LeftOver {
    fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds fewer than half a stream.
    #[inline(always)]
    fn add<W: Wide>(&mut self, places: &[u16], entry: Option<usize>) {
        for places in places.chunks(W::GROUP) {
            let group = &mut self.places[self.len..][..W::GROUP];
            group[..places.len()].copy_from_slice(places);
            group[places.len()..].fill(places[places.len() - 1]);
            let (stream, first) = (&mut self.streams[self.len / STREAM], self.len % STREAM);
            let there = Bits::MAX >> (STREAM - places.len()) << first;
            *stream = match *stream {
                _ if first == 0 => (there, entry),
                (others, of_others) => (others | there, entry.filter(|_| of_others == entry)),
            };
            self.len += W::GROUP;
        }
    }

    fn streams(&self) -> impl Iterator<Item = (Bits, Option<usize>)> {
        self.streams.into_iter().take(self.len.div_ceil(STREAM))
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

    /// Streams' places, which of them are there, and where they start.
    type Streams = Vec<(Vec<u16>, Bits, Option<usize>)>;

    const RUN: usize = 2 * STREAM;

    /// Where rays of an octant start.
    fn entry_point_of(octant: u8) -> EntryPoint {
        match octant % 3 {
            0 => EntryPoint::Whole,
            1 => EntryPoint::From(usize::from(octant)),
            _ => EntryPoint::Nowhere,
        }
    }

    fn streams<S: Simd, W: Wide>(s: S, w: W, batch: &[Ray]) -> Streams {
        let mut places = Places::default();
        w.run(|| {
            places.list(s, w, batch, RUN, |run| {
                assert!((1..=RUN).contains(&run.len()));
                entry_point_of(Portable.octant(&batch[usize::from(run[0])]))
            });
            let streams = places.streams(batch);
            streams.map(|picked| (picked.places.to_vec(), picked.there, picked.entry)).collect()
        })
    }

    #[test]
    fn every_ray_is_listed_once_and_groups_are_of_one_octant() {
        let mut random = Random::new(0x0c7a);
        let sizes = (0..40).map(|_| 1 + random.bits() as usize % 400).collect::<Vec<_>>();
        for size in sizes.into_iter().chain([1, 15, 16, 63, 64, 65, 127, 128, 129, MOST_SORTED]) {
            let one_way = random.bits().is_multiple_of(4);
            let batch: Vec<Ray> = (0..size)
                .map(|_| random.ray())
                .map(|ray| if one_way { Ray { direction: Vec3::ONE, ..ray } } else { ray })
                .collect();
            let octant = |place: &u16| Portable.octant(&batch[usize::from(*place)]);
            for set in Instructions::all() {
                let (group, streams) = match set.0 {
                    Set::Portable => (Portable::GROUP, streams(Portable, Portable, &batch)),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx2(avx2) => (Avx2::GROUP, streams(avx2, avx2, &batch)),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx512(avx2, avx512) => (Avx512::GROUP, streams(avx2, avx512, &batch)),
                };
                let mut listed = Vec::new();
                for (places, there, entry) in &streams {
                    assert!(places.len() % group == 0 && places.len() <= STREAM);
                    assert!(there.count_ones() as usize <= places.len());
                    for (first, places) in places.chunks(group).enumerate() {
                        assert!(places.iter().all(|place| octant(place) == octant(&places[0])));
                        let there = there >> (first * group);
                        assert_ne!(there & 1, 0, "a group of nobody");
                        let own = |index: &usize| there >> index & 1 != 0;
                        listed.extend((0..group).filter(own).map(|index| places[index]));
                    }
                    let point = entry_point_of(octant(&places[0]));
                    let alike = places.iter().all(|place| entry_point_of(octant(place)) == point);
                    let wanted = match point {
                        EntryPoint::From(entry) if alike => Some(entry),
                        _ => None,
                    };
                    assert_eq!(*entry, wanted, "{} of {size} rays", set.name());
                }
                let is_wanted = |place: &u16| entry_point_of(octant(place)) != EntryPoint::Nowhere;
                let wanted: Vec<u16> = (0..size as u16).filter(is_wanted).collect();
                listed.sort_unstable();
                assert_eq!(listed, wanted, "{} of {size} rays", set.name());
            }
        }
    }
}

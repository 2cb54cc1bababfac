//! Kernels for eight-wide trees.
//!
//! Answers are those of brute force, ray for ray: the tests here settle only what rounding cannot
//! change, in either [`Mode`], and what is left is given to the scalar tests. So neither width nor
//! instruction set nor order shows in an answer.

mod alone;
mod around;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod closest;
mod closest_batch;
mod closest_stream;
mod entry;
mod group;
mod hull;
mod leaf;
mod numbers;
mod occluders;
mod octants;
mod one_ray;
mod quads;
mod rays;
mod recent;
mod simd;
mod single;
mod stack;
mod stream;
mod two_level;

use super::NoCount;
use super::packet::PacketCounter;
use crate::geometry::TriangleMesh;
use crate::intersect::{Mode, Stage};
use crate::processor;
use crate::ray::{Ray, VisitCounts};
use crate::trace::shaft::{Entry, Gate};
use crate::tree::{Bvh8, Node8};
use alone::Habit;
use numbers::Target;
use occluders::Occluders;
use octants::{Picked, Places, WORD};
use rays::{Bits, Numbers, Rays, STREAM};
use simd::{Portable, Simd, Wide};
use single::End;
use stack::Stack;
use stream::{Start, Trees, Triangles};
use two_level::Levels;

pub use closest_batch::{closest_hit, closest_hits};
pub use two_level::TwoLevel;

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
        if processor::is_portable_wanted() {
            return Self::PORTABLE;
        }
        Self::all().pop().unwrap_or(Self::PORTABLE)
    }

    /// All that this processor has, the best last.
    pub fn all() -> Vec<Self> {
        let all = [Self::PORTABLE].into_iter();
        #[cfg(target_arch = "x86_64")]
        let all = all
            .chain(avx2::Avx2::detect().map(|avx2| Self(Set::Avx2(avx2))))
            .chain(avx512::Avx512::detect().map(|(avx2, avx512)| Self(Set::Avx512(avx2, avx512))));
        all.collect()
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
    numbers: Numbers,
    stack: Stack,
    /// Of rays in the batch, in the order in which streams take them.
    places: Places,
    /// One for each ray of the batch.
    answers: Vec<u8>,
    /// Those of each stratum, and of rays for which none are tried.
    occluders: [Occluders; STRATA + 1],
    /// Likewise, how much rays are alone.
    habits: [Habit; STRATA + 1],
    /// Likewise, whether looking for where to start tells anything.
    gates: [Gate; STRATA + 1],
    /// Where rays start, in place of the root.
    entries: Vec<Node8>,
    /// Rays of the last call that an occluder stopped first.
    stopped_early: u64,
    closest: closest_stream::Memory,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            numbers: Numbers::ZERO,
            stack: Stack::EMPTY,
            places: Places::default(),
            answers: Vec::new(),
            occluders: std::array::from_fn(|stratum| Occluders::new(stratum < STRATA)),
            habits: Default::default(),
            gates: Default::default(),
            entries: Vec::new(),
            stopped_early: 0,
            closest: closest_stream::Memory::EMPTY,
        }
    }
}

/// Strata whose occluders are told apart: others share them.
const STRATA: usize = 16;

/// How rays are taken through the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Together where there are enough of them.
    Automatic,
    /// One after the other.
    Single,
    /// 128 together.
    Stream,
}

/// What rays go through.
#[derive(Clone, Copy)]
pub enum Structure<'a> {
    /// One tree.
    Tree(&'a Bvh8),
    /// Trees in the leaves of a tree.
    TwoLevel(&'a dyn TwoLevel),
}

impl<'a> Structure<'a> {
    /// The tree in which rays start.
    fn top(self) -> &'a Bvh8 {
        match self {
            Self::Tree(tree) => tree,
            Self::TwoLevel(levels) => levels.top(),
        }
    }
}

/// What rays are asked of.
#[derive(Clone, Copy)]
pub struct Query<'a> {
    /// The tree or trees.
    pub structure: Structure<'a>,
    /// The mesh that it was built from.
    pub mesh: &'a TriangleMesh,
    /// How to go through it.
    pub way: Way,
    /// How to test triangles.
    pub mode: Mode,
    /// Where to start.
    pub entry: &'a Entry,
    /// What stopped rays of this stratum is tried first; `None` tries and remembers nothing.
    pub stratum: Option<usize>,
}

/// Fewer rays have little in common, and most groups would be near empty.
const LEAST_TOGETHER: usize = 8;

/// For each of `rays` whether anything is in its way. `occluded` holds zeroed words. Returns how many of
/// them were stopped by what had stopped others.
pub fn any_hit(
    instructions: Instructions,
    query: &Query<'_>,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
) -> u64 {
    dispatch(instructions, query, rays, occluded, scratch, &mut NoCount)
}

/// As [`any_hit`], and adds what each ray visits to its element of `counts`.
pub fn any_hit_counted(
    instructions: Instructions,
    query: &Query<'_>,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    counts: &mut [VisitCounts],
) {
    let mut tally =
        Counts { of_all: counts, first: 0, of_stream: [VisitCounts::default(); STREAM] };
    dispatch(instructions, query, rays, occluded, scratch, &mut tally);
}

/// A counter of one stream after the other.
trait Tally: PacketCounter {
    /// Places of rays count from this one on.
    fn begin(&mut self, first: usize);
    /// The stream of these rays is done.
    fn next_stream(&mut self, picked: Picked<'_>);
}

impl Tally for NoCount {
    #[inline(always)]
    fn begin(&mut self, _: usize) {}
    #[inline(always)]
    fn next_stream(&mut self, _: Picked<'_>) {}
}

struct Counts<'a> {
    of_all: &'a mut [VisitCounts],
    first: usize,
    of_stream: [VisitCounts; STREAM],
}

impl PacketCounter for Counts<'_> {
    fn node(&mut self, active: Bits) {
        PacketCounter::node(&mut self.of_stream.as_mut_slice(), active);
    }
    fn triangle(&mut self, tested: Bits) {
        PacketCounter::triangle(&mut self.of_stream.as_mut_slice(), tested);
    }
    fn settled(&mut self, ray: usize, by: Stage) {
        PacketCounter::settled(&mut self.of_stream.as_mut_slice(), ray, by);
    }
}

impl Tally for Counts<'_> {
    fn begin(&mut self, first: usize) {
        self.first = first;
    }
    fn next_stream(&mut self, picked: Picked<'_>) {
        for (index, place) in picked.places.iter().enumerate() {
            let counts = std::mem::take(&mut self.of_stream[index]);
            if picked.there >> index & 1 != 0 {
                self.of_all[self.first + usize::from(*place)] += counts;
            }
        }
    }
}

/// Rays of a batch that are sorted together: their places are 16-bit numbers.
const MOST_SORTED: usize = 1 << 12;

fn dispatch<T: Tally>(
    instructions: Instructions,
    query: &Query<'_>,
    rays: &[Ray],
    occluded: &mut [u64],
    scratch: &mut Scratch,
    tally: &mut T,
) -> u64 {
    scratch.stopped_early = 0;
    let words = occluded.chunks_mut(MOST_SORTED / WORD);
    for (part, (rays, occluded)) in rays.chunks(MOST_SORTED).zip(words).enumerate() {
        tally.begin(part * MOST_SORTED);
        Batch { query, rays, occluded }.trace_on(instructions, scratch, tally);
    }
    scratch.stopped_early
}

/// Rays to take through a tree.
struct Batch<'a> {
    query: &'a Query<'a>,
    rays: &'a [Ray],
    occluded: &'a mut [u64],
}

impl Batch<'_> {
    fn trace_on<T: Tally>(self, instructions: Instructions, scratch: &mut Scratch, tally: &mut T) {
        match instructions.0 {
            Set::Portable => self.trace(Portable, Portable, scratch, tally),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(avx2) => avx2.run(
                #[inline(always)]
                || self.trace(avx2, avx2, scratch, tally),
            ),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(avx2, avx512) => avx512.run(
                #[inline(always)]
                || self.trace(avx2, avx512, scratch, tally),
            ),
        }
    }

    #[inline(always)]
    fn trace<S: Simd, W: Wide, T: Tally>(self, s: S, w: W, scratch: &mut Scratch, tally: &mut T) {
        match self.query.structure {
            Structure::Tree(tree) => {
                self.trace_through(s, w, Triangles { tree, number: 0 }, scratch, tally);
            }
            Structure::TwoLevel(levels) => {
                self.trace_through(s, w, Levels(levels), scratch, tally);
            }
        }
    }

    #[inline(always)]
    fn trace_through<S: Simd, W: Wide, T: Tally>(
        self,
        s: S,
        w: W,
        trees: impl Trees,
        scratch: &mut Scratch,
        tally: &mut T,
    ) {
        let Self { query, rays, occluded } = self;
        let Query { mesh, way, mode, entry, stratum, .. } = *query;
        let tree = trees.tree();
        let entry = entry.parts().map(|parts| Node8 {
            planes: parts.planes,
            children: parts.children,
            len: parts.len as u32,
        });
        let Scratch {
            numbers,
            stack,
            places,
            answers,
            occluders,
            habits,
            gates,
            entries,
            stopped_early,
            ..
        } = scratch;
        let kind = stratum.map_or(STRATA, |s| s % STRATA);
        let (occluders, habit) = (occluders[kind].of_tree(tree.id), &mut habits[kind]);
        let target = Target { bounds: &tree.bounds, mesh, mode };
        let given = entry.as_ref();
        let one_by_one = match way {
            Way::Automatic => rays.len() < LEAST_TOGETHER,
            Way::Single => true,
            Way::Stream => false,
        };
        if one_by_one {
            let start = Start { trees, entry: given };
            for (place, ray) in rays.iter().enumerate() {
                let recent = occluders.recent(s.octant(ray));
                let end = single::any_hit(s, w, start, ray, target, numbers, stack, recent, tally);
                occluded[place / WORD] |= u64::from(end.is_occluded()) << (place % WORD);
                *stopped_early += u64::from(end == End::StoppedEarly);
                tally.next_stream(Picked::one(rays, &[place as u16]));
            }
            return;
        }
        // Bytes, as bits of one word would wait for each other.
        answers.clear();
        answers.resize(rays.len().next_multiple_of(WORD), 0);
        entries.clear();
        places.list(
            s,
            w,
            rays,
            entry::RUN,
            #[inline(always)]
            |run| entry::look(s, trees, given, rays, run, target, &mut gates[kind], entries),
        );
        for picked in places.streams(rays) {
            let of_run = picked.entry.map(|index| &entries[index]);
            let start = Start { trees, entry: of_run.or(given) };
            let prepared = Rays::new(s, w, numbers, target, picked);
            stack.alone.expect(*habit);
            let mut hits = stream::any_hit(s, w, start, &prepared, stack, occluders, tally);
            stack.alone.learn(habit, picked.there.count_ones());
            tally.next_stream(picked);
            while hits != 0 {
                answers[usize::from(picked.places[hits.trailing_zeros() as usize])] = 1;
                hits &= hits - 1;
            }
        }
        for (word, answers) in occluded.iter_mut().zip(answers.as_chunks().0) {
            let [bits, ..] = s.transpose(answers);
            *word |= bits;
        }
        *stopped_early += occluders.stopped_since();
    }
}

#[cfg(test)]
mod box_tests;
#[cfg(test)]
mod tests;

//! Splitting a set of references between them, by binned surface-area heuristic (Wald, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing,
//! 2007); the few references of a small set in every possible way.
//!
//! Boxes are vectors of eight lanes, bins of all axes are filled in one pass, and what the planes cost
//! is found for the three axes at once, in lanes.

mod bins;
mod lanes;
mod references;
mod sides;
#[cfg(test)]
mod tests;

pub(super) use references::{Extent, Reference, references_to};

use super::top_down::TRAVERSAL_COST;
use crate::geometry::Aabb;
#[cfg(target_arch = "x86_64")]
use crate::processor;
use bins::{Binning, best_plane, best_plane_on_all_threads};
use lanes::Portable;
use references::VectorBox;

/// Sets up to this size are split in the best of all possible ways.
const EXHAUSTIVE: usize = 4;

/// Sets that several threads should bin.
pub(super) const PARALLEL_BINNING: usize = 1 << 16;

/// The instructions that sets are split with: asked for once, not for each set. They do not show in what
/// comes of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instructions(Kind);

#[derive(Clone, Copy, Debug)]
enum Kind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(lanes::Avx2),
}

impl Instructions {
    /// Those that every processor has.
    const PORTABLE: Self = Self(Kind::Portable);

    /// The best that this processor has, unless the environment wants portable ones.
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if !processor::is_portable_wanted() {
            return lanes::Avx2::detect().map_or(Self::PORTABLE, |avx2| Self(Kind::Avx2(avx2)));
        }
        Self::PORTABLE
    }
}

/// References that become a subtree.
pub(super) struct Set<'a> {
    instructions: Instructions,
    pub(super) references: &'a mut [Reference],
    pub(super) extent: Extent,
}

impl<'a> Set<'a> {
    pub(super) fn new(references: &'a mut [Reference], extent: Extent) -> Self {
        Self { instructions: Instructions::detect(), references, extent }
    }

    /// The box around all.
    #[inline(always)]
    pub(super) fn bounds(&self) -> Aabb {
        self.extent.bounds()
    }

    /// As [`best_split`].
    pub(super) fn best_split(&self) -> Option<Split> {
        best_split(self.instructions, self.references, &self.extent)
    }

    /// The two sides of `split`.
    pub(super) fn divide(self, split: &Split) -> [Self; 2] {
        let (middle, extents) = split.divide(self.instructions, self.references);
        self.cut(middle, extents)
    }

    /// Two sides of equal numbers, in the middle of the longest axis: for what the heuristic cannot
    /// tell apart.
    pub(super) fn halve(self) -> [Self; 2] {
        let middle = halve(self.references, &self.bounds());
        let extents = [&self.references[..middle], &self.references[middle..]].map(Extent::of);
        self.cut(middle, extents)
    }

    fn cut(self, middle: usize, [lower_extent, upper_extent]: [Extent; 2]) -> [Self; 2] {
        let (lower, upper) = self.references.split_at_mut(middle);
        [
            Self { references: lower, extent: lower_extent, ..self },
            Self { references: upper, extent: upper_extent, ..self },
        ]
    }
}

/// How to split a set in two.
pub(super) struct Split {
    way: Way,
    boxes: [VectorBox; 2],
    /// In triangle tests, times half the area of the parent.
    pub(super) cost: f32,
}

#[derive(Clone, Copy)]
enum Way {
    /// By a plane between two bins of centres: the axis, the first bin of the upper side.
    Plane { axis: usize, bin: f32, binning: Binning },
    /// A bit for each reference of the lower side.
    Set(u32),
}

/// The cheapest split between two bins, or of all for few references; `None` where there is none, or
/// areas overflow. There are two references at least.
pub(super) fn best_split(
    instructions: Instructions,
    references: &[Reference],
    extent: &Extent,
) -> Option<Split> {
    // Smaller sets have fewer bins, as emptying and sweeping them is what takes long.
    let mut split = match references.len() {
        ..=EXHAUSTIVE => best_set(references),
        5..16 => best_plane::<4>(instructions, references, extent),
        16..64 => best_plane::<8>(instructions, references, extent),
        64..512 => best_plane::<16>(instructions, references, extent),
        512..PARALLEL_BINNING => best_plane::<32>(instructions, references, extent),
        _ => best_plane_on_all_threads::<32>(instructions, references, extent),
    }?;
    split.cost += TRAVERSAL_COST * extent.boxes.half_area();
    split.cost.is_finite().then_some(split)
}

/// The best way to split up to four references, the last of them on the upper side.
fn best_set(references: &[Reference]) -> Option<Split> {
    let all = (1usize << references.len()) - 1;
    let mut boxes = [VectorBox::EMPTY; 1 << EXHAUSTIVE];
    let mut costs = [0.0; 1 << EXHAUSTIVE];
    for set in 1..=all {
        let first = references[set.trailing_zeros() as usize].vectors;
        boxes[set] = boxes[set & (set - 1)].union(first);
        costs[set] = boxes[set].half_area() * set.count_ones() as f32;
    }
    let mut best = (f32::INFINITY, 0);
    for set in 1..=all / 2 {
        let cost = costs[set] + costs[all - set];
        best = if cost < best.0 { (cost, set) } else { best };
    }
    let (cost, set) = best;
    (set > 0).then(|| Split {
        way: Way::Set(set as u32),
        boxes: [boxes[set], boxes[all - set]],
        cost,
    })
}

impl Split {
    /// The boxes around the two sides.
    pub(super) fn bounds(&self) -> [Aabb; 2] {
        self.boxes.each_ref().map(VectorBox::aabb)
    }

    /// Moves the lower side to the front of `references`; returns its length and the extents of both
    /// sides.
    pub(super) fn divide(
        &self,
        instructions: Instructions,
        references: &mut [Reference],
    ) -> (usize, [Extent; 2]) {
        let (lower, centers) = self.move_apart(instructions, references);
        let extent = |side: usize| Extent { boxes: self.boxes[side], twice_centers: centers[side] };
        (lower, [extent(0), extent(1)])
    }

    /// The same, with boxes around both sides' centres; large sets on all threads.
    fn move_apart(
        &self,
        instructions: Instructions,
        references: &mut [Reference],
    ) -> (usize, [VectorBox; 2]) {
        let count = references.len();
        if count < PARALLEL_BINNING {
            return match instructions.0 {
                Kind::Portable => sides::move_apart(Portable, self.way, references),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2(avx2) => avx2.run(
                    #[inline(always)]
                    || sides::move_apart(avx2, self.way, references),
                ),
            };
        }
        let (first, second) = references.split_at_mut(count / 2);
        let ((first_lower, first_centers), (second_lower, second_centers)) = rayon::join(
            || self.move_apart(instructions, first),
            || self.move_apart(instructions, second),
        );
        // The upper side of the first half changes places with the lower one of the second.
        let (upper, lower) = (&mut first[first_lower..], &mut second[..second_lower]);
        let moved = upper.len().min(lower.len());
        let rest = lower.len() - moved;
        upper[..moved].swap_with_slice(&mut lower[rest..]);
        let centers = [0, 1].map(|side: usize| first_centers[side].union(second_centers[side]));
        (first_lower + second_lower, centers)
    }
}

/// Splits in the middle of the longest axis, by number: for what the heuristic cannot tell apart.
pub(super) fn halve(references: &mut [Reference], bounds: &Aabb) -> usize {
    let axis = bounds.size().max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let centers = (a.bounds().center()[axis], b.bounds().center()[axis]);
        centers.0.total_cmp(&centers.1).then(a.id().cmp(&b.id()))
    });
    middle
}

//! Bins of references on all axes, and the cheapest plane between them.

use super::lanes::{Lanes, Portable};
use super::references::{Extent, Reference, VectorBox};
use super::{Instructions, Kind, PARALLEL_BINNING, Split, Way};
use glam::Vec4;
use rayon::prelude::*;

/// Twice the centre of a box in the lower lanes, and its negative in the upper ones: what is a box around
/// it. Where it overflows there is one bin.
#[inline(always)]
pub(super) fn twice_center<L: Lanes>(lanes: L, around: L::Eight) -> L::Eight {
    lanes.sub(around, lanes.swap_halves(around))
}

/// Maps twice the centres to places, whose integers are bins; the same for binning and dividing.
#[derive(Clone, Copy)]
pub(super) struct Binning {
    pub(super) origin: Vec4,
    pub(super) scale: Vec4,
    last: Vec4,
}

impl Binning {
    #[inline(always)]
    fn new(centers: &VectorBox, bins: usize) -> Self {
        let bins = Vec4::splat(bins as f32);
        let scale = bins / centers.size();
        // An axis on which nothing differs, or too little to divide by, has one bin.
        let is_usable = scale.cmplt(Vec4::INFINITY);
        let scale = Vec4::select(is_usable, scale, Vec4::ZERO);
        Self { origin: centers.lower(), scale, last: bins - 1.0 }
    }
}

/// Boxes of references by bin and axis, each with the number of references in its last lane.
#[derive(Clone, Copy)]
struct Bins<const N: usize> {
    boxes: [[VectorBox; N]; 3],
}

impl<const N: usize> Bins<N> {
    #[inline(always)]
    fn empty() -> Self {
        let mut none = VectorBox::EMPTY;
        none.0[7] = 0.0;
        Self { boxes: [[none; N]; 3] }
    }

    /// Those in a bin of each axis; the fourth number means nothing.
    #[inline(always)]
    fn counts(&self, bin: usize) -> Vec4 {
        let [x, y, z] = self.boxes.each_ref().map(|own| own[bin].0[7]);
        Vec4::new(x, y, z, z)
    }

    #[inline(always)]
    fn fill<L: Lanes>(&mut self, lanes: L, references: &[Reference], binning: &Binning) {
        let row = |numbers: Vec4| lanes.load(&VectorBox::new(numbers, numbers).0);
        let [origin, scale, last] = [binning.origin, binning.scale, binning.last].map(row);
        let numbers = [origin, scale, last];
        // Neighbours fall into the same bins and would wait for each other: so one of each quarter at a
        // time, unless there are few. Bins do not depend on the order.
        let in_quarters = if N > 4 { references.len() / 4 * 4 } else { 0 };
        let (quarters, rest) = references.split_at(in_quarters);
        let (lower, upper) = quarters.split_at(quarters.len() / 2);
        let ((a, b), (c, d)) = (lower.split_at(lower.len() / 2), upper.split_at(upper.len() / 2));
        for (((a, b), c), d) in a.iter().zip(b).zip(c).zip(d) {
            self.add(lanes, a, numbers);
            self.add(lanes, b, numbers);
            self.add(lanes, c, numbers);
            self.add(lanes, d, numbers);
        }
        for reference in rest {
            self.add(lanes, reference, numbers);
        }
    }

    #[inline(always)]
    fn add<L: Lanes>(
        &mut self,
        lanes: L,
        reference: &Reference,
        [origin, scale, last]: [L::Eight; 3],
    ) {
        let around = lanes.load(&reference.vectors.0);
        let place = lanes.mul(lanes.sub(twice_center(lanes, around), origin), scale);
        let bins = lanes.integers(lanes.min(place, last));
        for (boxes, bin) in self.boxes.iter_mut().zip(bins) {
            let own = &mut boxes[bin as usize % N].0;
            lanes.store(own, lanes.add_to_box(lanes.load(own), around));
        }
    }

    fn merged(mut self, other: Self) -> Self {
        let all = self.boxes.as_flattened_mut().iter_mut().zip(other.boxes.as_flattened());
        for (own, other) in all {
            let count = own.0[7] + other.0[7];
            *own = own.union(*other);
            own.0[7] = count;
        }
        self
    }

    /// The cheapest plane, without the cost of entering the node.
    #[inline(always)]
    fn split(&self, binning: Binning) -> Option<Split> {
        // Of bins i and up.
        let mut upper_costs = [Vec4::ZERO; N];
        let mut boxes = [VectorBox::EMPTY; 3];
        let mut count = Vec4::ZERO;
        for bin in (1..N).rev() {
            for (around, own) in boxes.iter_mut().zip(&self.boxes) {
                *around = around.union(own[bin]);
            }
            count += self.counts(bin);
            upper_costs[bin] = half_areas(&boxes) * count;
        }
        let mut boxes = [VectorBox::EMPTY; 3];
        let mut count = Vec4::ZERO;
        let (mut least, mut at) = (Vec4::INFINITY, Vec4::ZERO);
        for bin in 1..N {
            for (around, own) in boxes.iter_mut().zip(&self.boxes) {
                *around = around.union(own[bin - 1]);
            }
            count += self.counts(bin - 1);
            // An empty side costs infinity times 0, which is less than nothing.
            let cost = half_areas(&boxes) * count + upper_costs[bin];
            let is_less = cost.cmplt(least);
            least = Vec4::select(is_less, cost, least);
            at = Vec4::select(is_less, Vec4::splat(bin as f32), at);
        }
        let (least, at) = (least.to_array(), at.to_array());
        let axis = (1..3).fold(0, |best, axis| if least[axis] < least[best] { axis } else { best });
        let (cost, bin) = (least[axis], at[axis]);
        if cost == f32::INFINITY {
            return None;
        }
        let (lower, upper) = self.boxes[axis].split_at(bin as usize % N);
        let boxes = [lower, upper]
            .map(|own| own.iter().fold(VectorBox::EMPTY, |around, own| around.union(*own)));
        Some(Split { way: Way::Plane { axis, bin, binning }, boxes, cost })
    }
}

/// Half the areas of three boxes; infinite for empty ones.
#[inline(always)]
fn half_areas(boxes: &[VectorBox; 3]) -> Vec4 {
    let [a, b, c] = boxes.each_ref().map(VectorBox::size);
    let x = Vec4::new(a.x, b.x, c.x, c.x);
    let y = Vec4::new(a.y, b.y, c.y, c.y);
    let z = Vec4::new(a.z, b.z, c.z, c.z);
    x * y + y * z + z * x
}

pub(super) fn best_plane<const N: usize>(
    instructions: Instructions,
    references: &[Reference],
    extent: &Extent,
) -> Option<Split> {
    let binning = Binning::new(&extent.twice_centers, N);
    match instructions.0 {
        Kind::Portable => best_of_bins::<N, _>(Portable, references, binning),
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2(avx2) => avx2.run(
            #[inline(always)]
            || best_of_bins::<N, _>(avx2, references, binning),
        ),
    }
}

#[inline(always)]
fn best_of_bins<const N: usize, L: Lanes>(
    lanes: L,
    references: &[Reference],
    binning: Binning,
) -> Option<Split> {
    let mut bins = Bins::<N>::empty();
    bins.fill(lanes, references, &binning);
    bins.split(binning)
}

pub(super) fn best_plane_on_all_threads<const N: usize>(
    instructions: Instructions,
    references: &[Reference],
    extent: &Extent,
) -> Option<Split> {
    let binning = Binning::new(&extent.twice_centers, N);
    let fill = |chunk: &[Reference]| {
        let mut bins = Bins::<N>::empty();
        match instructions.0 {
            Kind::Portable => bins.fill(Portable, chunk, &binning),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(avx2) => avx2.run(
                #[inline(always)]
                || bins.fill(avx2, chunk, &binning),
            ),
        }
        bins
    };
    // Merging boxes and counts gives the same result in any order.
    let chunks = references.par_chunks(PARALLEL_BINNING / 4);
    chunks.map(fill).reduce(Bins::empty, Bins::merged).split(binning)
}

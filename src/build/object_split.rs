//! Splitting a set of references between them, by binned surface-area heuristic (Wald, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing,
//! 2007).

use super::top_down::{TRAVERSAL_COST, half_area};
use crate::geometry::{Aabb, TriangleMesh};
use glam::Vec3;
use rayon::prelude::*;

/// Bins on each axis; half of them for small ranges, where emptying bins is what costs.
const BINS: usize = 32;
const SMALL_RANGE: usize = 64;

/// Ranges that several threads should bin.
pub(super) const PARALLEL_BINNING: usize = 1 << 16;

/// The box of a triangle, or of a part of it, with its index in the mesh.
#[derive(Clone, Copy)]
pub(super) struct Reference {
    pub(super) bounds: Aabb,
    pub(super) id: u32,
}

/// One for each triangle.
pub(super) fn references_to(mesh: &TriangleMesh) -> Vec<Reference> {
    (0..mesh.len())
        .into_par_iter()
        .map(|i| Reference { bounds: mesh.triangle(i).bounds(), id: i as u32 })
        .collect()
}

/// Splits in the middle of the longest axis, by number: for what the heuristic cannot tell apart.
pub(super) fn halve(references: &mut [Reference], bounds: &Aabb) -> (usize, [Aabb; 2]) {
    let axis = bounds.size().max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let centers = (a.bounds.center()[axis], b.bounds.center()[axis]);
        centers.0.total_cmp(&centers.1).then(a.id.cmp(&b.id))
    });
    let (left, right) = references.split_at(middle);
    (middle, [bounds_of(left), bounds_of(right)])
}

pub(super) fn bounds_of(references: &[Reference]) -> Aabb {
    references.iter().fold(Aabb::EMPTY, |b, r| b.union(r.bounds))
}

/// Maps centres to bins; the same for binning and partition.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3,
    scale: Vec3,
    bins: usize,
}

impl Binning {
    /// `None` where all centres are one.
    fn new(centers: &Aabb, count: usize) -> Option<Self> {
        let bins = if count < SMALL_RANGE { BINS / 2 } else { BINS };
        let size = centers.size();
        let scale = Vec3::from_array(size.to_array().map(|s| {
            // An axis on which nothing differs, or too little to divide by, has one bin.
            let scale = bins as f32 / s;
            if scale.is_finite() { scale } else { 0.0 }
        }));
        (scale != Vec3::ZERO).then_some(Self { origin: centers.min, scale, bins })
    }

    #[inline(always)]
    fn bin(&self, reference: &Reference, axis: usize) -> usize {
        let place = (reference.bounds.center()[axis] - self.origin[axis]) * self.scale[axis];
        (place as usize).min(self.bins - 1)
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, count: 0 };

    fn merged(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }
}

type Bins = [[Bin; BINS]; 3];

fn fill_bins(references: &[Reference], binning: &Binning) -> Bins {
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for reference in references {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[binning.bin(reference, axis)];
            bin.bounds = bin.bounds.union(reference.bounds);
            bin.count += 1;
        }
    }
    bins
}

fn center_bounds(references: &[Reference]) -> Aabb {
    Aabb::of_points(references.iter().map(|r| r.bounds.center()))
}

/// A plane between two bins of centres.
pub(super) struct Split {
    axis: usize,
    /// The first bin of the right side.
    bin: usize,
    binning: Binning,
    pub(super) bounds: [Aabb; 2],
    /// In triangle tests, times half the area of the parent.
    pub(super) cost: f32,
}

/// The cheapest split between two bins; `None` where there is none, or areas overflow.
pub(super) fn best_split(references: &[Reference], bounds: &Aabb) -> Option<Split> {
    let parallel = references.len() >= PARALLEL_BINNING;
    let chunks = || references.par_chunks(PARALLEL_BINNING / 4);
    let centers = if parallel {
        chunks().map(center_bounds).reduce(|| Aabb::EMPTY, Aabb::union)
    } else {
        center_bounds(references)
    };
    let binning = Binning::new(&centers, references.len())?;
    let bins = if parallel {
        // Merging boxes and counts gives the same result in any order.
        chunks().map(|chunk| fill_bins(chunk, &binning)).reduce(
            || [[Bin::EMPTY; BINS]; 3],
            |a, b| std::array::from_fn(|k| std::array::from_fn(|i| a[k][i].merged(b[k][i]))),
        )
    } else {
        fill_bins(references, &binning)
    };
    let mut best: Option<Split> = None;
    for (axis, bins) in bins.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        let bins = &bins[..binning.bins];
        // right[i] holds bins i and up.
        let mut right = [Bin::EMPTY; BINS + 1];
        for i in (1..bins.len()).rev() {
            right[i] = right[i + 1].merged(bins[i]);
        }
        let mut left = Bin::EMPTY;
        for i in 1..bins.len() {
            left = left.merged(bins[i - 1]);
            let right = &right[i];
            if left.count == 0 || right.count == 0 {
                continue;
            }
            let weighted = |b: &Bin| half_area(&b.bounds) * b.count as f32;
            let cost = weighted(&left) + weighted(right) + TRAVERSAL_COST * half_area(bounds);
            if cost.is_finite() && best.as_ref().is_none_or(|b| cost < b.cost) {
                let bounds = [left.bounds, right.bounds];
                best = Some(Split { axis, bin: i, binning, bounds, cost });
            }
        }
    }
    best
}

impl Split {
    /// Moves the left side to the front and returns its length.
    pub(super) fn partition(&self, references: &mut [Reference]) -> usize {
        let is_left = |r: &Reference| self.binning.bin(r, self.axis) < self.bin;
        let (mut left, mut right) = (0, references.len());
        loop {
            while left < right && is_left(&references[left]) {
                left += 1;
            }
            while left < right && !is_left(&references[right - 1]) {
                right -= 1;
            }
            if left >= right {
                return left;
            }
            references.swap(left, right - 1);
        }
    }
}

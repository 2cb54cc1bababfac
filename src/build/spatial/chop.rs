//! The search for the cheapest plane: references chopped into bins of equal width (Popov, Georgiev,
//! Dimov and Slusallek, "Object Partitioning Considered Harmful: Space Subdivision for BVHs", High
//! Performance Graphics, 2009; Stich, Friedrich and Dietrich, 2009).
//!
//! Here boxes of parts only serve to compare costs, so that plain `f32` will do; references are cut
//! by `build::clip`.

use super::super::object_split::{PARALLEL_BINNING, Reference};
use super::super::top_down::{TRAVERSAL_COST, half_area};
use crate::geometry::{Aabb, Triangle};
use glam::Vec3;
use rayon::prelude::*;

/// Bins on each axis; half of them for small parts.
const BINS: usize = 32;
const SMALL_PART: usize = 64;

/// A plane that may cut references.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) axis: usize,
    pub(super) position: f32,
    /// References on each side; those that it cuts count on both.
    pub(super) counts: [usize; 2],
    /// Around what lies on each side.
    pub(super) bounds: [Aabb; 2],
    /// In triangle tests, times half the area of the part.
    pub(super) cost: f32,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    /// References whose first and whose last bin this is.
    entries: u32,
    exits: u32,
}

const EMPTY_BIN: Bin = Bin { bounds: Aabb::EMPTY, entries: 0, exits: 0 };

type Bins = [[Bin; BINS]; 3];

fn merged(mut a: Bins, b: Bins) -> Bins {
    for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
        a.bounds = a.bounds.union(b.bounds);
        a.entries += b.entries;
        a.exits += b.exits;
    }
    a
}

/// Bins of equal width across a part's box.
struct Grid {
    origin: Vec3,
    width: Vec3,
    scale: Vec3,
    bins: usize,
}

impl Grid {
    fn new(bounds: &Aabb, count: usize) -> Self {
        let bins = if count < SMALL_PART { BINS / 2 } else { BINS };
        let width = bounds.size() / bins as f32;
        // An axis on which it is flat, or too thin to divide by, has one bin.
        let scale = Vec3::from_array(width.to_array().map(|w| {
            let scale = 1.0 / w;
            if scale.is_finite() { scale } else { 0.0 }
        }));
        Self { origin: bounds.min, width, scale, bins }
    }

    #[inline(always)]
    fn bin(&self, position: f32, axis: usize) -> usize {
        (((position - self.origin[axis]) * self.scale[axis]) as usize).min(self.bins - 1)
    }

    /// The plane below a bin.
    #[inline(always)]
    fn plane(&self, bin: usize, axis: usize) -> f32 {
        self.origin[axis] + self.width[axis] * bin as f32
    }
}

/// The box around the points in which the triangle's edges meet a plane.
#[inline(always)]
fn cross_section(triangle: &Triangle, axis: usize, position: f32) -> Aabb {
    let mut section = Aabb::EMPTY;
    let [a, b, c] = triangle.0;
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let (above_p, above_q) = (p[axis] - position, q[axis] - position);
        if (above_p <= 0.0) != (above_q <= 0.0) {
            let mut crossing = p + (q - p) * (above_p / (above_p - above_q));
            crossing[axis] = position;
            section = section.with_point(crossing);
        }
    }
    section
}

/// Adds the parts of a reference to the bins that it reaches into.
fn chop(reference: &Reference, triangle: &Triangle, grid: &Grid, axis: usize, bins: &mut [Bin]) {
    let own = reference.bounds();
    let (first, last) = (grid.bin(own.min[axis], axis), grid.bin(own.max[axis], axis));
    bins[first].entries += 1;
    bins[last].exits += 1;
    if first == last {
        bins[first].bounds = bins[first].bounds.union(reference.bounds());
        return;
    }
    let mut lower = own.min[axis];
    let mut lower_section = cross_section(triangle, axis, lower);
    for (index, bin) in bins.iter_mut().enumerate().take(last + 1).skip(first) {
        let upper = if index == last { own.max[axis] } else { grid.plane(index + 1, axis) };
        let upper_section = cross_section(triangle, axis, upper);
        let mut part = lower_section.union(upper_section);
        for corner in triangle.0 {
            if lower <= corner[axis] && corner[axis] <= upper {
                part = part.with_point(corner);
            }
        }
        let part = part.overlap(own);
        if !part.is_empty() {
            bin.bounds = bin.bounds.union(part);
        }
        (lower, lower_section) = (upper, upper_section);
    }
}

/// The cheapest plane that has references on both sides and adds no more than `budget` of them.
pub(super) fn best_plane(
    references: &[Reference],
    triangles: &[Triangle],
    bounds: &Aabb,
    budget: usize,
) -> Option<Plane> {
    let grid = Grid::new(bounds, references.len());
    let fill = |references: &[Reference]| {
        let mut bins = [[EMPTY_BIN; BINS]; 3];
        for reference in references {
            let triangle = &triangles[reference.id() as usize];
            for (axis, bins) in bins.iter_mut().enumerate() {
                chop(reference, triangle, &grid, axis, bins);
            }
        }
        bins
    };
    let bins = if references.len() >= PARALLEL_BINNING {
        // Merging gives the same result in any order.
        let chunks = references.par_chunks(PARALLEL_BINNING / 4).map(fill);
        chunks.reduce(|| [[EMPTY_BIN; BINS]; 3], merged)
    } else {
        fill(references)
    };
    let mut best: Option<Plane> = None;
    for (axis, bins) in bins.iter().enumerate() {
        if grid.scale[axis] == 0.0 {
            continue;
        }
        let bins = &bins[..grid.bins];
        // upper[i] holds bins i and up.
        let mut upper = [(Aabb::EMPTY, 0usize); BINS + 1];
        for i in (1..bins.len()).rev() {
            let (bounds, count) = upper[i + 1];
            upper[i] = (bounds.union(bins[i].bounds), count + bins[i].exits as usize);
        }
        let mut lower = (Aabb::EMPTY, 0usize);
        for i in 1..bins.len() {
            let bin = &bins[i - 1];
            lower = (lower.0.union(bin.bounds), lower.1 + bin.entries as usize);
            let (bounds, counts) = ([lower.0, upper[i].0], [lower.1, upper[i].1]);
            let added = counts[0] + counts[1] - references.len();
            if counts.contains(&0) || bounds.iter().any(Aabb::is_empty) || added > budget {
                continue;
            }
            let cost =
                half_area(&bounds[0]) * counts[0] as f32 + half_area(&bounds[1]) * counts[1] as f32;
            if cost.is_finite() && best.is_none_or(|b| cost < b.cost) {
                let position = grid.plane(i, axis);
                best = Some(Plane { axis, position, counts, bounds, cost });
            }
        }
    }
    best.map(|plane| Plane { cost: plane.cost + TRAVERSAL_COST * half_area(bounds), ..plane })
        .filter(|plane| plane.cost.is_finite())
}

//! Cuts a mesh into regions of neighbouring triangles, in a few passes over it: along the Morton
//! curve (Lauterbach et al., "Fast BVH Construction on GPUs", Computer Graphics Forum 28(2), 2009),
//! with triangles of very different size apart, so that no small one shares a region with a wall.

use crate::geometry::{Aabb, TriangleMesh, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Triangles by region.
#[derive(Debug, Default)]
pub(super) struct Regions {
    /// Indices of the triangles, region by region.
    pub(super) triangle_ids: Vec<u32>,
    /// Where each region's begin and end: in order, none empty.
    pub(super) ranges: Vec<Range<usize>>,
    /// The box around each region's triangles.
    pub(super) bounds: Vec<Aabb>,
}

/// Bits of a cell's number along the curve.
const MOST_BITS: u32 = 15;

/// Sizes that are told apart, each `2^SIZE_STEP` times the next.
const SIZES: usize = 4;
const SIZE_STEP: usize = 3;

/// Triangles that one thread counts at once.
const CHUNK: usize = 1 << 14;

/// Regions, or cells to be divided, that one thread takes at once.
const PIECES: usize = 1 << 9;

/// Regions of at most `most` of the triangles `ids`. On the current rayon pool; the same for any number
/// of threads.
pub(super) fn regions(mesh: &TriangleMesh, ids: Vec<u32>, most: usize) -> Regions {
    let boxes: Vec<Aabb> =
        ids.par_iter().with_min_len(CHUNK).map(|&id| mesh.triangle(id as usize).bounds()).collect();
    let numbers = (0..ids.len() as u32).collect();
    let mut regions = Regions::default();
    Division { ids: &ids, boxes: &boxes, most }.divide(numbers, true, &mut regions);
    regions
}

/// Where a triangle is, and how large.
#[derive(Clone, Copy)]
struct Place {
    /// The centre of its box.
    center: Vec3,
    /// Half the longest side of that.
    size: f32,
}

impl Place {
    fn of(bounds: &Aabb) -> Self {
        // Halved first, so that nothing overflows.
        let (min, max) = (bounds.min * 0.5, bounds.max * 0.5);
        Self { center: min + max, size: (max - min).max_element() }
    }
}

/// What is divided: triangles are numbered as they are given.
struct Division<'a> {
    ids: &'a [u32],
    boxes: &'a [Aabb],
    most: usize,
}

impl Division<'_> {
    /// Adds regions of some of the triangles.
    fn divide(&self, numbers: Vec<u32>, by_size: bool, regions: &mut Regions) {
        let most = self.most;
        if numbers.len() <= most {
            return self.add(&numbers, regions);
        }
        let place = |number: &u32| Place::of(&self.boxes[*number as usize]);
        let bounds = numbers
            .par_chunks(CHUNK)
            .map(|numbers| Aabb::of_points(numbers.iter().map(|number| place(number).center)))
            .reduce(|| Aabb::EMPTY, Aabb::union);
        let extent = bounds.size().max_element();
        // Some cells for each region to be, so that regions end near where they should.
        let bits = (numbers.len() / most).ilog2() + 4;
        let grid = Grid::new(&bounds, bits.min(MOST_BITS));
        if grid.bits == 0 {
            // All in one place: by number.
            numbers.chunks(most).for_each(|numbers| self.add(numbers, regions));
            return;
        }
        let sizes = if by_size { SIZES } else { 1 };
        let cell_of: Vec<u32> = numbers
            .par_iter()
            .with_min_len(CHUNK)
            .map(|number| {
                let place = place(number);
                // 0 for the largest.
                let exponent =
                    |number: f32| (number.max(f32::MIN_POSITIVE).to_bits() >> 23) as usize;
                let steps = exponent(extent).saturating_sub(exponent(place.size)) / SIZE_STEP;
                let class = steps.min(sizes - 1);
                ((class as u32) << grid.bits) | grid.cell(place.center)
            })
            .collect();
        let cells = sizes << grid.bits;
        let mut starts = vec![0; cells + 1];
        cell_of.iter().for_each(|&cell| starts[cell as usize + 1] += 1);
        (0..cells).for_each(|cell| starts[cell + 1] += starts[cell]);
        let sorted = sort(&numbers, &cell_of, &starts);
        drop((numbers, cell_of));
        let mut pieces = Vec::new();
        for size in 0..sizes {
            cut(&starts, size << grid.bits..(size + 1) << grid.bits, most, &mut pieces);
        }
        let found = pieces.par_chunks(PIECES).map(|pieces| {
            let mut regions = Regions::default();
            for piece in pieces {
                let numbers = &sorted[piece.clone()];
                if numbers.len() <= most {
                    self.add(numbers, &mut regions);
                } else {
                    self.divide(numbers.to_vec(), false, &mut regions);
                }
            }
            regions
        });
        found.collect::<Vec<_>>().iter().for_each(|found| regions.append(found));
    }

    /// Adds one region.
    fn add(&self, numbers: &[u32], regions: &mut Regions) {
        if numbers.is_empty() {
            return;
        }
        let Regions { triangle_ids, ranges, bounds } = regions;
        let first = triangle_ids.len();
        triangle_ids.extend(numbers.iter().map(|&number| self.ids[number as usize]));
        ranges.push(first..triangle_ids.len());
        let boxes = numbers.iter().map(|&number| self.boxes[number as usize]);
        bounds.push(boxes.fold(Aabb::EMPTY, Aabb::union));
    }
}

/// Adds the ranges of the triangles of `cells`, of which `starts` says where each one's begin: some
/// cells with at most so many together, or one with more.
fn cut(starts: &[usize], cells: Range<usize>, most: usize, pieces: &mut Vec<Range<usize>>) {
    let piece = starts[cells.start]..starts[cells.end];
    if piece.is_empty() {
    } else if piece.len() <= most || cells.len() == 1 {
        pieces.push(piece);
    } else {
        let middle = cells.start + cells.len() / 2;
        cut(starts, cells.start..middle, most, pieces);
        cut(starts, middle..cells.end, most, pieces);
    }
}

/// `ids` by cell, each cell's in the order in which they were; `starts` says where each begins.
fn sort(ids: &[u32], cell_of: &[u32], starts: &[usize]) -> Vec<u32> {
    let mut sorted = vec![0; ids.len()];
    let threads = rayon::current_num_threads().clamp(1, 16);
    // Each thread goes through all for the cells that are its own.
    let mut rest = sorted.as_mut_slice();
    let mut tasks = Vec::new();
    let mut first = 0;
    for thread in 0..threads {
        let goal = ids.len() * (thread + 1) / threads;
        let end = starts.partition_point(|start| *start < goal).min(starts.len() - 1);
        let (own, others) = std::mem::take(&mut rest).split_at_mut(starts[end] - starts[first]);
        rest = others;
        tasks.push((first..end, own));
        first = end;
    }
    tasks.into_par_iter().for_each(|(cells, own)| {
        let base = starts[cells.start];
        let mut next: Vec<usize> = starts[cells.clone()].iter().map(|start| start - base).collect();
        for (&id, &cell) in ids.iter().zip(cell_of) {
            let cell = cell as usize;
            if cells.contains(&cell) {
                let place = &mut next[cell - cells.start];
                own[*place] = id;
                *place += 1;
            }
        }
    });
    sorted
}

impl Regions {
    /// Adds others behind these.
    fn append(&mut self, others: &Self) {
        let first = self.triangle_ids.len();
        self.triangle_ids.extend_from_slice(&others.triangle_ids);
        let moved = |range: &Range<usize>| first + range.start..first + range.end;
        self.ranges.extend(others.ranges.iter().map(moved));
        self.bounds.extend_from_slice(&others.bounds);
    }
}

/// Numbers cells of a box by halving the longest side of what is left, so that cells are near cubes.
struct Grid {
    bits: u32,
    min: Vec3,
    /// Cells along each axis over its length.
    per_length: Vec3,
    /// For each axis the bits of a cell's number by its coordinate.
    bits_of: [Vec<u32>; 3],
}

impl Grid {
    /// Of at most `2^bits` cells; none where the box has no length that can be divided.
    fn new(bounds: &Aabb, bits: u32) -> Self {
        let size = bounds.size();
        let mut left = size;
        // The axis of each bit, from the highest on.
        let mut axes = Vec::new();
        while axes.len() < bits as usize {
            let axis = left.max_position();
            left[axis] *= 0.5;
            if !(left[axis] > 0.0 && bounds.min[axis] + left[axis] > bounds.min[axis]) {
                break;
            }
            axes.push(axis);
        }
        let bits_of = std::array::from_fn(|axis| {
            let of_axis = || (0..axes.len()).rev().filter(|&place| axes[place] == axis);
            let number = |coordinate: u32| {
                // The lowest bit of the coordinate is the last that was given to the axis.
                let bits = of_axis()
                    .enumerate()
                    .map(|(bit, place)| (coordinate >> bit & 1) << (axes.len() - 1 - place));
                bits.sum()
            };
            (0..1 << of_axis().count()).map(number).collect::<Vec<u32>>()
        });
        let mut per_length = Vec3::ZERO;
        for axis in (0..3).filter(|&axis| bits_of[axis].len() > 1) {
            per_length[axis] = bits_of[axis].len() as f32 / size[axis];
        }
        Self { bits: axes.len() as u32, min: bounds.min, per_length, bits_of }
    }

    fn cell(&self, center: Vec3) -> u32 {
        let offset = (center - self.min) * self.per_length;
        let bits = |axis: usize| {
            let numbers = &self.bits_of[axis];
            numbers[(offset[axis] as usize).min(numbers.len() - 1)]
        };
        bits(0) | bits(1) | bits(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    fn check(mesh: &TriangleMesh, most: usize) -> Regions {
        let regions = regions(mesh, (0..mesh.len() as u32).collect(), most);
        let mut next = 0;
        for range in &regions.ranges {
            assert_eq!(range.start, next);
            assert!((1..=most).contains(&range.len()), "{range:?}");
            next = range.end;
        }
        assert_eq!(regions.bounds.len(), regions.ranges.len());
        for (range, bounds) in regions.ranges.iter().zip(&regions.bounds) {
            let ids = &regions.triangle_ids[range.clone()];
            let boxes = ids.iter().map(|&id| mesh.triangle(id as usize).bounds());
            assert_eq!(*bounds, boxes.fold(Aabb::EMPTY, Aabb::union), "{range:?}");
        }
        let mut ids = regions.triangle_ids.clone();
        ids.sort_unstable();
        assert!(next == mesh.len() && ids.into_iter().eq(0..mesh.len() as u32));
        regions
    }

    #[test]
    fn every_triangle_is_in_one_region() {
        let mut random = Random::new(71);
        for count in [0, 1, 100, 101, 5000, 70_000] {
            check(&random.mesh(count), 100);
        }
        // All in one place, on a line, and where halves of numbers are lost.
        let flat = |scale: Vec3| {
            let corner = |i: usize| scale * Vec3::new((i % 89) as f32, (i % 97) as f32, i as f32);
            let vertices: Vec<_> = (0..3000).map(corner).collect();
            TriangleMesh::new(vertices, (0..2998).map(|i| [i, i + 1, i + 2]).collect())
        };
        for scale in [Vec3::ZERO, Vec3::X, Vec3::splat(1e15), Vec3::splat(1e-43), Vec3::ONE] {
            check(&flat(scale), 64);
        }
    }

    #[test]
    fn regions_do_not_depend_on_threads_and_are_compact() {
        let mesh = Random::new(72).mesh(50_000);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| regions(&mesh, (0..50_000).collect(), 200))
        };
        let (one, three) = (on(1), on(3));
        assert_eq!((&one.triangle_ids, &one.ranges), (&three.triangle_ids, &three.ranges));
        assert!(one.ranges.len() < 4 * 50_000 / 200, "{} regions", one.ranges.len());
        let area_of = |ids: &[u32]| {
            let boxes = ids.iter().map(|&id| mesh.triangle(id as usize).bounds());
            boxes.fold(Aabb::EMPTY, Aabb::union).half_area()
        };
        let by_place: f64 = one.ranges.iter().map(|r| area_of(&one.triangle_ids[r.clone()])).sum();
        let all: Vec<u32> = (0..50_000).collect();
        let by_number: f64 = all.chunks(200).map(area_of).sum();
        assert!(by_place * 3.0 < by_number, "{by_place} {by_number}");
    }
}

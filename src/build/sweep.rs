//! Top-down building by full sweeps: every place between two centres, on each axis, is a candidate
//! (Wald, Boulos and Shirley, "Ray Tracing Deformable Scenes Using Dynamic Bounding Volume
//! Hierarchies", TOG 26(1), 2007, after MacDonald and Booth, 1990). The triangles are sorted once on
//! each axis; splits keep the lists sorted, so all of it takes O(N log N).

use super::top_down::{TRAVERSAL_COST, half_area};
use super::{BuilderEntry, Leaves, in_parts, ordered, top_down};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::Bvh2;
use rayon::prelude::*;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "sweep",
    about: "top-down by surface-area heuristic at every centre, without bins",
    build,
    in_parts: Some(|mesh, order| with_root(mesh, |root| in_parts::build(mesh, root, order, None))),
};

/// Parts whose axes are worth a thread each.
const PARALLEL_AXES: usize = 1 << 14;

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    with_root(mesh, |root| top_down::build(mesh, root, leaves, None))
}

/// Gives `build` the set of all triangles; `None` of an empty mesh.
fn with_root<R>(mesh: &TriangleMesh, build: impl FnOnce(Option<Part<'_>>) -> R) -> R {
    let boxes: Vec<Aabb> =
        (0..mesh.len()).into_par_iter().map(|i| mesh.triangle(i).bounds()).collect();
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
    let mut lists = [0, 1, 2].map(|axis| sorted(&boxes, axis));
    let mut scratch = [(); 3].map(|()| vec![0; boxes.len()]);
    let [x, y, z] = &mut lists;
    let [scratch_x, scratch_y, scratch_z] = &mut scratch;
    let axes = [(x, scratch_x), (y, scratch_y), (z, scratch_z)];
    let axes = axes.map(|(ids, scratch)| List { ids, scratch });
    build((!mesh.is_empty()).then_some(Part { boxes: &boxes, axes, bounds }))
}

/// Sorts triangles along an axis by their centres, then by index.
#[inline(always)]
fn key(boxes: &[Aabb], axis: usize, id: u32) -> u64 {
    u64::from(ordered(boxes[id as usize].center()[axis])) << 32 | u64::from(id)
}

fn sorted(boxes: &[Aabb], axis: usize) -> Vec<u32> {
    let mut keys: Vec<u64> =
        (0..boxes.len() as u32).into_par_iter().map(|id| key(boxes, axis, id)).collect();
    keys.par_sort_unstable();
    keys.into_par_iter().map(|key| key as u32).collect()
}

/// A part's triangles, sorted along an axis.
struct List<'a> {
    ids: &'a mut [u32],
    /// As long: areas, as bits, while splits are sought, then triangles on their way.
    scratch: &'a mut [u32],
}

/// A set of triangles.
struct Part<'a> {
    boxes: &'a [Aabb],
    axes: [List<'a>; 3],
    bounds: Aabb,
}

/// The first so many along an axis go to the lower side.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    lower: usize,
}

fn bounds_of(boxes: &[Aabb], ids: &[u32]) -> Aabb {
    ids.iter().fold(Aabb::EMPTY, |all, &id| all.union(boxes[id as usize]))
}

/// The best split of a sorted list, and its cost without that of entering the node.
fn best_on_axis(boxes: &[Aabb], axis: usize, list: &mut List<'_>) -> Option<(Split, f32)> {
    let count = list.ids.len();
    let mut upper = Aabb::EMPTY;
    for (&id, area) in list.ids.iter().zip(&mut *list.scratch).rev() {
        upper = upper.union(boxes[id as usize]);
        *area = half_area(&upper).to_bits();
    }
    let center = |id: u32| boxes[id as usize].center()[axis];
    let mut best: Option<(Split, f32)> = None;
    let mut lower = Aabb::EMPTY;
    for i in 1..count {
        let last = list.ids[i - 1];
        lower = lower.union(boxes[last as usize]);
        let upper_area = f32::from_bits(list.scratch[i]);
        let cost = half_area(&lower) * i as f32 + upper_area * (count - i) as f32;
        let is_better = cost.is_finite() && best.is_none_or(|(_, least)| cost < least);
        // What the heuristic cannot tell apart is not split one by one.
        if is_better && center(last) != center(list.ids[i]) {
            best = Some((Split { axis, lower: i }, cost));
        }
    }
    best
}

impl<'a> List<'a> {
    /// Moves the triangles that are `lower` to the front, of which there are `middle`; both sides
    /// stay sorted.
    fn divide(self, middle: usize, is_lower: impl Fn(u32) -> bool) -> [Self; 2] {
        let (mut lower, mut upper) = (0, 0);
        for i in 0..self.ids.len() {
            let id = self.ids[i];
            if is_lower(id) {
                self.ids[lower] = id;
                lower += 1;
            } else {
                self.scratch[upper] = id;
                upper += 1;
            }
        }
        self.ids[lower..].copy_from_slice(&self.scratch[..upper]);
        let (lower_ids, upper_ids) = self.ids.split_at_mut(middle);
        let (lower_scratch, upper_scratch) = self.scratch.split_at_mut(middle);
        [
            Self { ids: lower_ids, scratch: lower_scratch },
            Self { ids: upper_ids, scratch: upper_scratch },
        ]
    }
}

/// Applies `f` to each axis, on several threads if it is worth that.
fn on_axes<T: Send, R: Send>(
    parallel: bool,
    [x, y, z]: [T; 3],
    f: impl Fn(usize, T) -> R + Sync,
) -> [R; 3] {
    if parallel {
        let (x, (y, z)) = rayon::join(|| f(0, x), || rayon::join(|| f(1, y), || f(2, z)));
        [x, y, z]
    } else {
        [f(0, x), f(1, y), f(2, z)]
    }
}

impl top_down::Part for Part<'_> {
    type Split = Split;

    fn count(&self) -> usize {
        self.axes[0].ids.len()
    }

    fn capacity(&self) -> usize {
        self.count()
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn triangle_ids(&self) -> impl Iterator<Item = u32> {
        self.axes[0].ids.iter().copied()
    }

    fn best_split(&mut self) -> Option<(Split, f32)> {
        let (parallel, boxes) = (self.count() >= PARALLEL_AXES, self.boxes);
        let found =
            on_axes(parallel, self.axes.each_mut(), |axis, list| best_on_axis(boxes, axis, list));
        // The first of equals.
        let best = found.into_iter().flatten().reduce(|a, b| if b.1 < a.1 { b } else { a });
        let entering = TRAVERSAL_COST * half_area(&self.bounds);
        best.map(|(split, cost)| (split, cost + entering)).filter(|(_, cost)| cost.is_finite())
    }

    fn divide(self, split: Split) -> [Self; 2] {
        let (parallel, boxes) = (self.count() >= PARALLEL_AXES, self.boxes);
        let first_upper = key(boxes, split.axis, self.axes[split.axis].ids[split.lower]);
        let sides = on_axes(parallel, self.axes, |axis, list: List<'_>| {
            if axis == split.axis {
                let (ids, upper_ids) = list.ids.split_at_mut(split.lower);
                let (scratch, upper_scratch) = list.scratch.split_at_mut(split.lower);
                return [List { ids, scratch }, List { ids: upper_ids, scratch: upper_scratch }];
            }
            list.divide(split.lower, |id| key(boxes, split.axis, id) < first_upper)
        });
        let [[lower_x, upper_x], [lower_y, upper_y], [lower_z, upper_z]] = sides;
        [[lower_x, lower_y, lower_z], [upper_x, upper_y, upper_z]].map(|axes| {
            let bounds = bounds_of(boxes, axes[0].ids);
            Self { boxes, axes, bounds }
        })
    }

    fn halve(self) -> [Self; 2] {
        let axis = self.bounds.size().max_position();
        let lower = self.count() / 2;
        self.divide(Split { axis, lower })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use crate::tree::MAX_LEAF_TRIANGLES;

    /// Every plane between two centres, counted one by one.
    fn by_counting(boxes: &[Aabb], axis: usize) -> f32 {
        let around = |boxes: Vec<&Aabb>| {
            let count = boxes.len() as f32;
            let bounds = boxes.into_iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
            if count == 0.0 { f32::INFINITY } else { half_area(&bounds) * count }
        };
        let costs = boxes.iter().map(|b| b.center()[axis]).map(|at| {
            let (lower, upper) = boxes.iter().partition(|b| b.center()[axis] < at);
            around(lower) + around(upper)
        });
        costs.fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn the_sweep_finds_what_counting_finds() {
        let mut random = Random::new(81);
        for count in 2..60 {
            let mesh = random.mesh(count);
            let boxes: Vec<Aabb> = (0..count).map(|i| mesh.triangle(i).bounds()).collect();
            for axis in 0..3 {
                let (mut ids, mut scratch) = (sorted(&boxes, axis), vec![0; count]);
                let mut list = List { ids: &mut ids, scratch: &mut scratch };
                let found = best_on_axis(&boxes, axis, &mut list);
                let cost = found.map_or(f32::INFINITY, |(_, cost)| cost);
                assert_eq!(cost, by_counting(&boxes, axis), "{count} triangles, axis {axis}");
            }
        }
    }

    #[test]
    fn it_costs_no_more_than_bins() {
        for (seed, count) in [(82, 300), (83, 3000), (84, 20_000)] {
            let mesh = Random::new(seed).mesh(count);
            let binned =
                (super::super::find("binned").unwrap().build)(&mesh, Leaves::Fit).sah_cost();
            let tree = build(&mesh, Leaves::Fit);
            assert!(tree.sah_cost() <= binned, "{count}: {} {binned}", tree.sah_cost());
            assert!(tree.leaf_count() > count / MAX_LEAF_TRIANGLES);
        }
    }
}

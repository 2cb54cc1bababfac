//! Top-down building by what a shadow ray is expected to cost, which ends at the first triangle that it
//! meets: triangles that stop many rays are kept whole and high.
//!
//! The surface-area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies",
//! IEEE Symposium on Interactive Ray Tracing, 2007) takes rays for lines that are never stopped. Here,
//! as in Ize and Hansen, "RTSAH Traversal Order for Occlusion Rays", CGF 30(2), 2011, they may be. A
//! uniformly distributed line that enters a convex box of half area `H` meets triangles of area `A` in it
//! `k = A / H` times in the mean (Cauchy), and none of them with a probability of about `e^-k`. So a
//! search of `n` triangles one after the other ends after `n (1 - e^-k) / k` of them, and of two children
//! the second is needed by those rays alone that the first one lets pass; the better order counts.
//!
//! Besides planes across each axis, a split between larger triangles and smaller ones is considered: a
//! few walls beside all that is in the room, which no plane tells apart from them.

use super::object_split::{Extent, Reference, halve, references_to};
use super::top_down::{TRAVERSAL_COST, half_area};
use super::{BuilderEntry, Leaves, in_parts, top_down};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::Bvh2;
use rayon::prelude::*;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "any-hit",
    about: "top-down by the expected cost of rays that any hit ends: large occluders whole and high",
    build,
    in_parts: Some(|mesh, order| with_root(mesh, |root| in_parts::build(mesh, root, order, None))),
};

/// Shadow rays are segments, which meet less than lines do: how much less depends on the rays, which the
/// builder does not know.
const SHARE_OF_LINES: f32 = 0.1;

/// The two sides of a split by size lie in the same place, and planes must tell the triangles of each apart
/// all over again: so it has to be better than a plane by this factor.
const SIZE_MARGIN: f32 = 1.5;

/// Smaller sets are not split by size.
const LEAST_BY_SIZE: usize = 64;

/// Sets are put in so many bins at most, on each axis and by size.
const MOST_BINS: usize = 32;

/// That of triangles' sizes.
const BY_SIZE: usize = 3;

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    with_root(mesh, |root| top_down::build(mesh, root, leaves, None))
}

/// Gives `build` the set of all triangles; `None` of an empty mesh.
fn with_root<R>(mesh: &TriangleMesh, build: impl FnOnce(Option<Part<'_>>) -> R) -> R {
    let (mut references, _) = references_to(mesh);
    let areas: Vec<f32> =
        (0..mesh.len()).into_par_iter().map(|i| mesh.triangle(i).area() as f32).collect();
    build((!mesh.is_empty()).then(|| Part::new(&mut references, &areas)))
}

/// A set of triangles.
struct Part<'a> {
    references: &'a mut [Reference],
    /// Of all triangles of the mesh.
    areas: &'a [f32],
    bounds: Aabb,
}

/// Those in lower bins are the lower side.
#[derive(Clone, Copy)]
struct Split {
    scale: Scale,
    bin: usize,
}

/// Maps triangles to bins.
#[derive(Clone, Copy)]
struct Scale {
    axis: usize,
    origin: f32,
    factor: f32,
    bins: usize,
}

impl Scale {
    /// `None` where all fall into one bin.
    fn new(part: &Part<'_>, axis: usize, bins: usize) -> Option<Self> {
        let all = part.references.iter().map(|reference| position(reference, axis));
        let (least, most) = all.fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), at| {
            (least.min(at), most.max(at))
        });
        let factor = bins as f32 / (most - least);
        factor.is_finite().then_some(Self { axis, origin: least, factor, bins })
    }

    fn bin(&self, reference: &Reference) -> usize {
        let place = (position(reference, self.axis) - self.origin) * self.factor;
        (place as usize).min(self.bins - 1)
    }
}

/// Where a triangle's box is on an axis, or its size: an integer that grows about as the logarithm does, as
/// sizes differ by orders of magnitude.
fn position(reference: &Reference, axis: usize) -> f32 {
    if axis == BY_SIZE {
        (half_area(&reference.bounds()).to_bits() >> 12) as f32
    } else {
        reference.bounds().center()[axis]
    }
}

/// What is known of some triangles.
#[derive(Clone, Copy)]
struct Several {
    count: usize,
    area: f32,
    bounds: Aabb,
}

impl Several {
    const NONE: Self = Self { count: 0, area: 0.0, bounds: Aabb::EMPTY };

    fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            area: self.area + other.area,
            bounds: self.bounds.union(other.bounds),
        }
    }

    fn weigh(&self) -> Weight {
        let half_area = half_area(&self.bounds);
        let hits = SHARE_OF_LINES * self.area / half_area;
        // A flat box of no area: no line enters it.
        let hits = if hits.is_finite() { hits } else { 0.0 };
        let stopped = -(-hits).exp_m1();
        let tested = if hits > 1e-4 { stopped / hits } else { 1.0 };
        Weight { half_area, stopped, cost: half_area * tested * self.count as f32 }
    }
}

/// What a side costs.
#[derive(Clone, Copy)]
struct Weight {
    half_area: f32,
    /// Share of the lines that enter its box that it stops.
    stopped: f32,
    /// In triangle tests, times `half_area`.
    cost: f32,
}

/// What both cost below a node, likewise.
fn cost_of_both(a: Weight, b: Weight, half_area_of_node: f32) -> f32 {
    let passed = |side: Weight| 1.0 - side.stopped * (side.half_area / half_area_of_node).min(1.0);
    (a.cost + passed(a) * b.cost).min(b.cost + passed(b) * a.cost)
}

/// The best split of one axis or by size, and its cost without that of entering the node.
fn best_on_axis(part: &Part<'_>, axis: usize, bins: usize) -> Option<(Split, f32)> {
    let scale = Scale::new(part, axis, bins)?;
    let mut filled = [Several::NONE; MOST_BINS];
    for reference in part.references.iter() {
        let own = &mut filled[scale.bin(reference)];
        let area = part.areas[reference.id() as usize];
        *own = own.and(Several { count: 1, area, bounds: reference.bounds() });
    }
    let mut uppers = [Several::NONE; MOST_BINS];
    let mut upper = Several::NONE;
    for bin in (1..bins).rev() {
        upper = upper.and(filled[bin]);
        uppers[bin] = upper;
    }
    let whole = half_area(&part.bounds);
    let mut best: Option<(Split, f32)> = None;
    let mut lower = Several::NONE;
    for bin in 1..bins {
        lower = lower.and(filled[bin - 1]);
        if filled[bin - 1].count == 0 || uppers[bin].count == 0 {
            continue;
        }
        let cost = cost_of_both(lower.weigh(), uppers[bin].weigh(), whole);
        if cost.is_finite() && best.is_none_or(|(_, least)| cost < least) {
            best = Some((Split { scale, bin }, cost));
        }
    }
    best
}

impl<'a> Part<'a> {
    fn new(references: &'a mut [Reference], areas: &'a [f32]) -> Self {
        let bounds = Extent::of(references).bounds();
        Self { references, areas, bounds }
    }

    fn cut(self, middle: usize) -> [Self; 2] {
        let (lower, upper) = self.references.split_at_mut(middle);
        [lower, upper].map(|references| Self::new(references, self.areas))
    }
}

impl top_down::Part for Part<'_> {
    type Split = Split;

    fn count(&self) -> usize {
        self.references.len()
    }

    fn capacity(&self) -> usize {
        self.references.len()
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn triangle_ids(&self) -> impl Iterator<Item = u32> {
        self.references.iter().map(Reference::id)
    }

    fn best_split(&mut self) -> Option<(Split, f32)> {
        let count = self.references.len();
        let bins = count.next_power_of_two().clamp(4, MOST_BINS);
        let planes = (0..BY_SIZE).filter_map(|axis| best_on_axis(self, axis, bins));
        // The first of equals.
        let mut best = planes.reduce(|a, b| if b.1 < a.1 { b } else { a });
        if count >= LEAST_BY_SIZE
            && let Some((split, cost)) = best_on_axis(self, BY_SIZE, bins)
            && best.is_none_or(|(_, least)| cost * SIZE_MARGIN < least)
        {
            best = Some((split, cost));
        }
        let entering = TRAVERSAL_COST * half_area(&self.bounds);
        best.map(|(split, cost)| (split, cost + entering)).filter(|(_, cost)| cost.is_finite())
    }

    fn divide(self, Split { scale, bin }: Split) -> [Self; 2] {
        let mut middle = 0;
        for index in 0..self.references.len() {
            if scale.bin(&self.references[index]) < bin {
                self.references.swap(middle, index);
                middle += 1;
            }
        }
        self.cut(middle)
    }

    fn halve(self) -> [Self; 2] {
        let middle = halve(self.references, &self.bounds);
        self.cut(middle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use glam::{Vec3, Vec3Swizzles};

    /// Triangles far smaller than three walls that they are around: all boxes' centres are close together.
    fn room(random: &mut Random, count: usize) -> TriangleMesh {
        let wall = |turn: fn(Vec3) -> Vec3| {
            [Vec3::new(-20.0, -20.0, 0.0), Vec3::new(20.0, -20.0, 0.0), Vec3::new(0.0, 20.0, 0.0)]
                .map(turn)
        };
        let mut vertices = [wall(|v| v), wall(|v| v.yzx()), wall(|v| v.zxy())].concat();
        let mut triangles = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        for _ in 0..count {
            let at = random.point();
            let first = vertices.len() as u32;
            vertices.extend([at, at + Vec3::X * 0.02, at + Vec3::new(0.0, 0.02, 0.01)]);
            triangles.push([first, first + 1, first + 2]);
        }
        TriangleMesh::new(vertices, triangles)
    }

    #[test]
    fn walls_are_told_apart_from_what_is_between_them() {
        let mesh = room(&mut Random::new(0xa1), 2000);
        let tree = build(&mesh, Leaves::Fit);
        let root = &tree.nodes[tree.root.expect("a tree").node_index()];
        assert_eq!(root.counts.into_iter().min(), Some(3), "{:?}", root.counts);
        let binned = (super::super::find("binned").expect("a builder").build)(&mesh, Leaves::Fit);
        let root = &binned.nodes[binned.root.expect("a tree").node_index()];
        assert_ne!(root.counts.into_iter().min(), Some(3), "{:?}", root.counts);
    }

    /// Lines through a box, chosen uniformly: from one point of a sphere to another one.
    #[test]
    fn lines_are_stopped_as_often_as_it_says() {
        let mut random = Random::new(0xa2);
        let mut on_sphere = || loop {
            let v = Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                return v.normalize() * 8.0;
            }
        };
        let mesh = Random::new(0xa3).mesh(60);
        let bounds = mesh.bounds();
        let area: f64 = (0..mesh.len()).map(|i| mesh.triangle(i).area()).sum();
        let several = Several { count: mesh.len(), area: area as f32 * 0.02, bounds };
        // As if triangles were that much smaller, so that lines that meet two of them are rare.
        let said = several.weigh().stopped / SHARE_OF_LINES;
        let (mut entered, mut hits) = (0, 0);
        for _ in 0..40_000 {
            let (a, b) = (on_sphere(), on_sphere());
            let ray = crate::ray::Ray::new(a, b - a, 1.0);
            let Some(prepared) = crate::intersect::PreparedRay::new(&ray, &bounds) else {
                continue;
            };
            if prepared.enter(&bounds).is_none() {
                continue;
            }
            entered += 1;
            hits +=
                (0..mesh.len()).filter(|&i| prepared.triangle(&mesh.triangle(i)).is_some()).count();
        }
        let met = hits as f32 * 0.02 / entered as f32;
        assert!((said / met - 1.0).abs() < 0.1, "{said} said, {met} met");
    }
}

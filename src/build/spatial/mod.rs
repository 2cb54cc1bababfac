//! Trees with spatial splits (Stich, Friedrich and Dietrich, "Spatial Splits in Bounding Volume
//! Hierarchies", High Performance Graphics, 2009).
//!
//! Where the sides of the best object split overlap, a plane is tried instead that cuts references
//! in two, so that large triangles do not blow up boxes. A triangle then lies in several leaves. How
//! many references that may add is bounded for the whole tree, and what is left of it after a split
//! is shared out to the sides by their numbers: it does not depend on what threads do.
//!
//! Rays find in these trees what they find in others: parts of references come from `build::clip`,
//! object splits and unsplit references keep boxes as they are, and boxes further up hold those
//! below. [`intersect`](crate::intersect) has the argument.

mod chop;

use super::clip::clipped_bounds;
use super::object_split::{self, Extent, Instructions, Reference, references_to};
use super::top_down::half_area;
use super::{BuilderEntry, Leaves, top_down};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::tree::{Bvh2, ChildRef};
use chop::Plane;
use rayon::prelude::*;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "spatial",
    about: "as binned, but planes may cut triangles: better trees of large ones, more memory",
    build,
    in_parts: None,
};

/// Planes are tried where the sides of the object split share more than this part of the root's
/// surface: the paper's value.
const LEAST_OVERLAP: f32 = 1e-5;

/// Most references that splitting may add, in percent of the triangles.
const BUDGET_PERCENT: usize = 50;

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    let triangles: Vec<Triangle> =
        (0..mesh.len()).into_par_iter().map(|i| mesh.triangle(i)).collect();
    let (references, extent) = references_to(mesh);
    let bounds = extent.bounds();
    let least_overlap = if bounds.is_empty() { 0.0 } else { LEAST_OVERLAP * half_area(&bounds) };
    let instructions = Instructions::detect();
    let shared = Shared { instructions, triangles: &triangles, least_overlap };
    let room = ChildRef::MAX_TRIANGLES.saturating_sub(mesh.len());
    let budget = (mesh.len() * BUDGET_PERCENT / 100).min(room);
    let part = Part { shared: &shared, references, extent, budget };
    let root = (!mesh.is_empty()).then_some(part);
    top_down::build(mesh, root, leaves, None)
}

struct Shared<'a> {
    instructions: Instructions,
    triangles: &'a [Triangle],
    least_overlap: f32,
}

struct Part<'a> {
    shared: &'a Shared<'a>,
    references: Vec<Reference>,
    extent: Extent,
    /// How many references its splits may add.
    budget: usize,
}

enum Split {
    Object(object_split::Split),
    Spatial(Plane),
}

impl<'a> Part<'a> {
    /// The sides of a split that leaves `budget`.
    fn sides(shared: &'a Shared<'a>, references: [Vec<Reference>; 2], budget: usize) -> [Self; 2] {
        let [lower, upper] = references.each_ref().map(|r| r.len() as u64);
        let lower_budget = (budget as u64 * lower / (lower + upper)) as usize;
        let [lower, upper] = references;
        [(lower, lower_budget), (upper, budget - lower_budget)].map(|(references, budget)| {
            let extent = Extent::of(&references);
            Self { shared, references, extent, budget }
        })
    }

    /// Cuts references in two, or, where that is cheaper, leaves them whole on one side.
    fn cut(self, plane: &Plane) -> [Self; 2] {
        let mut sides = plane.counts.map(Vec::with_capacity);
        let mut astride = Vec::new();
        for reference in self.references {
            let bounds = reference.bounds();
            if bounds.max[plane.axis] <= plane.position {
                sides[0].push(reference);
            } else if bounds.min[plane.axis] >= plane.position {
                sides[1].push(reference);
            } else {
                astride.push(reference);
            }
        }
        let mut estimate = Estimate {
            bounds: plane.bounds,
            counts: [0, 1].map(|side| sides[side].len() + astride.len()),
        };
        let mut budget = self.budget;
        for reference in astride {
            let whole_side = estimate.cheaper_whole(&reference.bounds(), budget == 0);
            if let Some(side) = whole_side {
                estimate.leave_whole(side, &reference.bounds());
                sides[side].push(reference);
                continue;
            }
            let mut halves = [reference.bounds(); 2];
            halves[0].max[plane.axis] = plane.position;
            halves[1].min[plane.axis] = plane.position;
            let triangle = &self.shared.triangles[reference.id() as usize];
            let mut parts = halves.map(|half| clipped_bounds(triangle, &half, &half));
            // Rounding alone could have it vanish from both; it must not.
            if parts == [None; 2] {
                parts = halves.map(Some);
            }
            budget -= usize::from(!parts.contains(&None));
            for (side, bounds) in parts.into_iter().enumerate() {
                estimate.counts[side] -= usize::from(bounds.is_none());
                sides[side].extend(bounds.map(|bounds| Reference::new(&bounds, reference.id())));
            }
        }
        match sides {
            // All that the plane cut turned out to lie on one side of it.
            [all, none] | [none, all] if none.is_empty() => {
                let extent = Extent::of(&all);
                top_down::Part::halve(Self { references: all, extent, budget, ..self })
            }
            sides => Self::sides(self.shared, sides, budget),
        }
    }

    fn cut_at(mut self, middle: usize) -> [Self; 2] {
        let upper = self.references.split_off(middle);
        Self::sides(self.shared, [self.references, upper], self.budget)
    }
}

/// What the sides of a plane come to while references that it cuts are looked at one by one.
struct Estimate {
    bounds: [Aabb; 2],
    counts: [usize; 2],
}

impl Estimate {
    /// The side on which a reference costs less, left whole, than cut in two ("reference
    /// unsplitting" in the paper); one of them in any case if it `must` stay whole.
    fn cheaper_whole(&self, reference: &Aabb, must: bool) -> Option<usize> {
        let [lower, upper] = self.counts.map(|count| count as f32);
        let [lower_area, upper_area] = self.bounds.each_ref().map(half_area);
        let grown = |side: usize| half_area(&self.bounds[side].union(*reference));
        let cut = lower_area * lower + upper_area * upper;
        let costs = [
            (grown(0) * lower + upper_area * (upper - 1.0), 0, self.counts[1]),
            (lower_area * (lower - 1.0) + grown(1) * upper, 1, self.counts[0]),
        ];
        // Neither side may lose its last one. As there are two references at least, one can.
        let allowed =
            costs.into_iter().filter(|(cost, _, other)| *other > 1 && (must || *cost < cut));
        allowed.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, side, _)| side)
    }

    fn leave_whole(&mut self, side: usize, reference: &Aabb) {
        self.bounds[side] = self.bounds[side].union(*reference);
        self.counts[1 - side] -= 1;
    }
}

impl top_down::Part for Part<'_> {
    type Split = Split;

    fn count(&self) -> usize {
        self.references.len()
    }

    fn capacity(&self) -> usize {
        self.references.len() + self.budget
    }

    fn bounds(&self) -> Aabb {
        self.extent.bounds()
    }

    fn triangle_ids(&self) -> impl Iterator<Item = u32> {
        self.references.iter().map(Reference::id)
    }

    fn best_split(&mut self) -> Option<(Split, f32)> {
        let instructions = self.shared.instructions;
        let object = object_split::best_split(instructions, &self.references, &self.extent);
        let overlap = object.as_ref().map_or(f32::INFINITY, |split| {
            let [lower, upper] = split.bounds();
            let shared = lower.overlap(upper);
            if shared.is_empty() { 0.0 } else { half_area(&shared) }
        });
        let bounds = self.bounds();
        // What costs no less than a leaf is not worth another reference.
        let least = self.references.len() as f32 * half_area(&bounds);
        let least = object.as_ref().map_or(least, |split| split.cost.min(least));
        let plane = (self.budget > 0 && overlap > self.shared.least_overlap)
            .then(|| {
                let triangles = self.shared.triangles;
                chop::best_plane(&self.references, triangles, &bounds, self.budget)
            })
            .flatten()
            .filter(|plane| plane.cost < least);
        match (plane, object) {
            (Some(plane), _) => Some((Split::Spatial(plane), plane.cost)),
            (None, object) => object.map(|split| {
                let cost = split.cost;
                (Split::Object(split), cost)
            }),
        }
    }

    fn divide(mut self, split: Split) -> [Self; 2] {
        match split {
            Split::Object(split) => {
                let (middle, _) = split.divide(self.shared.instructions, &mut self.references);
                self.cut_at(middle)
            }
            Split::Spatial(plane) => self.cut(&plane),
        }
    }

    fn halve(mut self) -> [Self; 2] {
        let bounds = self.bounds();
        let middle = object_split::halve(&mut self.references, &bounds);
        self.cut_at(middle)
    }
}

#[cfg(test)]
mod tests;

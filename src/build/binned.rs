//! Top-down building by binned surface-area heuristic: fast, and the trees are good.

use super::object_split::{Reference, Split, best_split, bounds_of, halve, references_to};
use super::{BuilderEntry, top_down};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::Bvh2;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "binned",
    about: "top-down by binned surface-area heuristic, 32 bins on each axis",
    build,
};

fn build(mesh: &TriangleMesh) -> Bvh2 {
    let mut references = references_to(mesh);
    let bounds = bounds_of(&references);
    let root = (!mesh.is_empty()).then_some(Part { references: &mut references, bounds });
    top_down::build(mesh, root)
}

/// A range of the references, in the order of the splits above it.
struct Part<'a> {
    references: &'a mut [Reference],
    bounds: Aabb,
}

impl Part<'_> {
    fn cut(self, middle: usize, bounds: [Aabb; 2]) -> [Self; 2] {
        let (lower, upper) = self.references.split_at_mut(middle);
        [
            Self { references: lower, bounds: bounds[0] },
            Self { references: upper, bounds: bounds[1] },
        ]
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
        self.references.iter().map(|r| r.id)
    }

    fn best_split(&mut self) -> Option<(Split, f32)> {
        let split = best_split(self.references, &self.bounds)?;
        let cost = split.cost;
        Some((split, cost))
    }

    fn divide(self, split: Split) -> [Self; 2] {
        let middle = split.partition(self.references);
        self.cut(middle, split.bounds)
    }

    fn halve(self) -> [Self; 2] {
        let (middle, bounds) = halve(self.references, &self.bounds);
        self.cut(middle, bounds)
    }
}

//! Top-down building by binned surface-area heuristic: fast, and the trees are good.

use super::object_split::{Extent, Reference, Split, best_split, halve, references_to};
use super::{BuilderEntry, Leaves, top_down};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::Bvh2;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "binned",
    about: "top-down by binned surface-area heuristic, up to 32 bins on each axis",
    build,
};

pub(super) fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    let (mut references, extent) = references_to(mesh);
    let mut room = bytemuck::zeroed_vec(references.len());
    let root =
        (!mesh.is_empty()).then_some(Part { references: &mut references, room: &mut room, extent });
    top_down::build(mesh, root, leaves)
}

/// A range of the references, in the order of the splits above it.
struct Part<'a> {
    references: &'a mut [Reference],
    /// As long: where they go when they are divided, by turns.
    room: &'a mut [Reference],
    extent: Extent,
}

impl<'a> Part<'a> {
    fn cut(
        references: &'a mut [Reference],
        room: &'a mut [Reference],
        middle: usize,
        extents: [Extent; 2],
    ) -> [Self; 2] {
        let (lower, upper) = references.split_at_mut(middle);
        let (lower_room, upper_room) = room.split_at_mut(middle);
        [
            Self { references: lower, room: lower_room, extent: extents[0] },
            Self { references: upper, room: upper_room, extent: extents[1] },
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
        self.extent.bounds()
    }

    fn triangle_ids(&self) -> impl Iterator<Item = u32> {
        self.references.iter().map(Reference::id)
    }

    fn best_split(&mut self) -> Option<(Split, f32)> {
        let split = best_split(self.references, &self.extent)?;
        let cost = split.cost;
        Some((split, cost))
    }

    fn divide(self, split: Split) -> [Self; 2] {
        let (middle, extents) = split.divide(self.references, self.room);
        Self::cut(self.room, self.references, middle, extents)
    }

    fn halve(self) -> [Self; 2] {
        let middle = halve(self.references, &self.bounds());
        let extents = [&self.references[..middle], &self.references[middle..]].map(Extent::of);
        Self::cut(self.references, self.room, middle, extents)
    }
}

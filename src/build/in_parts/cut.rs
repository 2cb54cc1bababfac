//! Triangles that are divided into sets, and sets that go where they cost least.

use super::{Grown, parent};
use crate::build::Leaves;
use crate::build::subtrees::Subtrees;
use crate::build::top_down::{Fate, Part, fate};
use crate::build::top_reinsertion::improved;
use crate::geometry::Aabb;
use crate::tree::{ChildRef, Node2};
use bytemuck::Zeroable;

/// Triangles that are divided so far.
pub(super) enum Cut<P> {
    /// With `depth` nodes of the binary tree above them.
    Set {
        set: P,
        depth: usize,
    },
    Sides {
        count: usize,
        bounds: Aabb,
        sides: Box<[Cut<P>; 2]>,
    },
}

impl<P: Part> Cut<P> {
    /// Divides a set into ones of at most `most`, on all threads; `counts_as` gives the depth as which theirs
    /// counts from there on.
    pub(super) fn new(set: P, depth: usize, most: usize, counts_as: fn(usize) -> usize) -> Self {
        if set.count() <= most {
            return Self::Set { set, depth: counts_as(depth) };
        }
        match fate(set, depth, Leaves::Wide) {
            Fate::Leaf(set) => Self::Set { set, depth: counts_as(depth) },
            Fate::Sides([lower, upper]) | Fate::LeafOf([lower, upper]) => {
                let (lower, upper) = rayon::join(
                    || Self::new(lower, depth + 1, most, counts_as),
                    || Self::new(upper, depth + 1, most, counts_as),
                );
                Self::of_sides([lower, upper])
            }
        }
    }

    /// The same sets where they cost least.
    pub(super) fn moved(self, bounds: &Aabb) -> Self {
        let (mut nodes, mut sets) = (Vec::new(), 0);
        let root = self.add_nodes(&mut nodes, &mut sets).child;
        let Some(better) = improved(&nodes, root, bounds) else { return self };
        let mut sets = Vec::with_capacity(sets);
        self.take_apart(&mut sets);
        put_together(&better, better.root(), &mut sets)
    }

    /// Adds the nodes above sets in depth-first order, and counts these.
    fn add_nodes(&self, nodes: &mut Vec<Node2>, sets: &mut usize) -> Grown {
        match self {
            Self::Set { .. } => {
                *sets += 1;
                let child = ChildRef::leaf(*sets - 1, 1);
                Grown { child, bounds: self.bounds(), count: self.count() }
            }
            Self::Sides { sides, .. } => {
                let index = nodes.len();
                nodes.push(Node2::zeroed());
                let [lower, upper] = &**sides;
                let sides = [lower.add_nodes(nodes, sets), upper.add_nodes(nodes, sets)];
                parent(nodes, index, sides)
            }
        }
    }

    /// Adds the sets, in the same order.
    fn take_apart(self, sets: &mut Vec<Option<Self>>) {
        match self {
            Self::Set { .. } => sets.push(Some(self)),
            Self::Sides { sides, .. } => sides.into_iter().for_each(|side| side.take_apart(sets)),
        }
    }

    fn of_sides(sides: [Self; 2]) -> Self {
        let [(lower, lower_bounds), (upper, upper_bounds)] =
            sides.each_ref().map(|side| (side.count(), side.bounds()));
        let (count, bounds) = (lower + upper, lower_bounds.union(upper_bounds));
        Self::Sides { count, bounds, sides: Box::new(sides) }
    }

    pub(super) fn count(&self) -> usize {
        match self {
            Self::Set { set, .. } => set.count(),
            Self::Sides { count, .. } => *count,
        }
    }

    pub(super) fn bounds(&self) -> Aabb {
        match self {
            Self::Set { set, .. } => set.bounds(),
            Self::Sides { bounds, .. } => *bounds,
        }
    }
}

/// The sets below a subtree.
fn put_together<P: Part>(better: &Subtrees, subtree: u32, sets: &mut [Option<Cut<P>>]) -> Cut<P> {
    match better.below(subtree) {
        Ok(sides) => Cut::of_sides(sides.map(|side| put_together(better, side, sets))),
        Err(set) => sets[set.leaf_slots().start].take().expect("each has one place"),
    }
}

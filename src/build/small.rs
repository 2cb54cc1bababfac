//! A wide tree over a few triangles, on one thread and without a binary one: a node's slots are filled by
//! splitting the child with the largest surface (Dammertz, Hanika and Keller, "Shallow Bounding Volume
//! Hierarchies for Fast SIMD Ray Tracing of Incoherent Rays", Computer Graphics Forum 27(4), 2008),
//! and the order of children is set while both sides of a split are at hand (Nah and Manocha, "SATO:
//! Surface-Area Traversal Order for Shadow Ray Tracing", Computer Graphics Forum 33(6), 2014).

use super::WideCosts;
use super::object_split::{Extent, Reference, Set, Split};
use super::top_down::{TRAVERSAL_COST, half_area};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::tree::{
    Bvh8, ChildRef, LEAF_ROWS, MAX_WIDE_LEAF, Node8, ScoreAtSplit, WIDTH, write_leaf_in_lanes,
};
use crate::vectorized::vectorized;
use std::cell::RefCell;

/// From here on sets are halved, so that depth stays in bounds.
const DEEPEST_BY_COST: usize = 16;

/// Sets so small are leaves: looking for a split costs more than it brings.
const ALWAYS_LEAF: usize = 3;

/// Most triangles of a tree.
pub const MOST_SMALL: usize = 4096;

/// The tree over the triangles `ids` of a mesh, at most [`MOST_SMALL`], which its slots name. Children
/// with larger scores come first.
pub fn small_tree(mesh: &TriangleMesh, ids: &[u32], score: ScoreAtSplit) -> Bvh8 {
    debug_assert!(ids.len() <= MOST_SMALL);
    SCRATCH.with_borrow_mut(|scratch| {
        let Scratch { references, output } = scratch;
        references.clear();
        references
            .extend(ids.iter().map(|&id| Reference::new(&mesh.triangle(id as usize).bounds(), id)));
        output.nodes.clear();
        output.triangle_ids.clear();
        output.leaves.resize(output.leaves.len().max(ids.len() * LEAF_ROWS), 0.0);
        let extent = Extent::of(references);
        let bounds = if ids.is_empty() { Aabb::EMPTY } else { extent.bounds() };
        let root = (!ids.is_empty())
            .then(|| Builder { mesh, score, output }.grow(Set::new(references, extent), 0));
        let Output { nodes, leaves, triangle_ids } = output;
        let mut own_leaves = Vec::with_capacity(ids.len() * LEAF_ROWS + WIDTH);
        own_leaves.extend_from_slice(&leaves[..ids.len() * LEAF_ROWS]);
        own_leaves.extend([0.0; WIDTH]);
        Bvh8 {
            nodes: nodes.clone(),
            root,
            bounds,
            leaves: own_leaves,
            triangle_ids: triangle_ids.clone(),
            id: Bvh8::new_id(),
        }
    })
}

/// What a thread uses again for all its trees, so that each takes no more memory than it keeps.
#[derive(Default)]
struct Scratch {
    references: Vec<Reference>,
    output: Output,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// A tree under way.
#[derive(Default)]
struct Output {
    nodes: Vec<Node8>,
    /// Room for the leaves of all triangles.
    leaves: Vec<f32>,
    triangle_ids: Vec<u32>,
}

struct Builder<'a> {
    mesh: &'a TriangleMesh,
    score: ScoreAtSplit,
    output: &'a mut Output,
}

/// What becomes of a set.
enum Fate {
    Leaf,
    /// Two sets, by the heuristic.
    Split(Split),
    /// Two sets of equal numbers.
    Halves,
}

/// What is best for a set, where two sets in its place cost `more` besides.
fn fate(set: &Set<'_>, depth: usize, more: f32) -> Fate {
    let count = set.references.len();
    if count <= ALWAYS_LEAF {
        return Fate::Leaf;
    }
    let split = (depth < DEEPEST_BY_COST).then(|| set.best_split()).flatten();
    if count > MAX_WIDE_LEAF {
        return split.map_or(Fate::Halves, Fate::Split);
    }
    let Some(split) = split else { return Fate::Leaf };
    let WideCosts { leaf, triangle } = WideCosts::default();
    let area = area(set);
    let as_leaf = WideCosts::default().leaf(count) * area;
    // The split's own cost is the area of each side times its triangles, and that of the whole.
    let areas: f32 = split.bounds().iter().map(half_area).sum();
    let as_two = leaf * areas + triangle * (split.cost - TRAVERSAL_COST * area);
    if as_leaf <= as_two + more { Fate::Leaf } else { Fate::Split(split) }
}

fn area(set: &Set<'_>) -> f32 {
    half_area(&set.bounds())
}

impl Builder<'_> {
    /// Adds what a set becomes.
    fn grow(&mut self, set: Set<'_>, depth: usize) -> ChildRef {
        // A node of its own for so few seldom pays, and it takes a look for a split to know.
        if set.references.len() <= MAX_WIDE_LEAF {
            return self.leaf(&set);
        }
        let sides = match fate(&set, depth, area(&set)) {
            Fate::Leaf => return self.leaf(&set),
            Fate::Split(split) => set.divide(&split),
            Fate::Halves => set.halve(),
        };
        let mut children: [Option<Set<'_>>; WIDTH] = [const { None }; WIDTH];
        let mut areas = [0.0; WIDTH];
        let mut len = 0;
        for side in sides {
            areas[len] = area(&side);
            children[len] = Some(side);
            len += 1;
        }
        while len < WIDTH {
            // Those that stay as they are have no area here.
            let largest = (0..len).fold(0, |best, i| if areas[i] > areas[best] { i } else { best });
            let Some(set) = children[largest].take_if(|_| areas[largest] > 0.0) else { break };
            let sides = match fate(&set, depth, 0.0) {
                Fate::Leaf => {
                    areas[largest] = 0.0;
                    children[largest] = Some(set);
                    continue;
                }
                Fate::Split(split) => set.divide(&split),
                Fate::Halves => set.halve(),
            };
            for (slot, side) in [largest, len].into_iter().zip(sides) {
                areas[slot] = area(&side);
                children[slot] = Some(side);
            }
            len += 1;
        }
        self.node(children, depth)
    }

    /// Adds a node of these children, and what they become.
    fn node(&mut self, mut children: [Option<Set<'_>>; WIDTH], depth: usize) -> ChildRef {
        let mut scored = [(0.0, 0); WIDTH];
        let mut len = 0;
        for set in children.iter().flatten() {
            let mut ids = set.references.iter().map(Reference::id);
            scored[len] = ((self.score)(self.mesh, &set.extent.bounds(), &mut ids), len);
            len += 1;
        }
        let order = &mut scored[..len];
        // Stable, so that ties stay as they are.
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let index = self.output.nodes.len();
        let mut placed = [(ChildRef::UNUSED, Aabb::EMPTY); WIDTH];
        for (place, (_, child)) in placed.iter_mut().zip(&*order) {
            place.1 = children[*child].as_ref().map_or(Aabb::EMPTY, |set| set.extent.bounds());
        }
        self.output.nodes.push(Node8::new(&placed[..len]));
        for (slot, (_, child)) in order.iter().enumerate() {
            if let Some(set) = children[*child].take() {
                let child = self.grow(set, depth + 1);
                self.output.nodes[index].children[slot] = child;
            }
        }
        ChildRef::inner(index)
    }

    fn leaf(&mut self, set: &Set<'_>) -> ChildRef {
        let mut triangles = [Triangle::default(); MAX_WIDE_LEAF];
        let Output { leaves, triangle_ids, .. } = &mut *self.output;
        let first = triangle_ids.len();
        for reference in &*set.references {
            let id = reference.id();
            triangles[triangle_ids.len() - first] = self.mesh.triangle(id as usize);
            triangle_ids.push(id);
        }
        let end = triangle_ids.len();
        let block = &mut leaves[first * LEAF_ROWS..end * LEAF_ROWS];
        vectorized(
            #[inline(always)]
            || write_leaf_in_lanes(block, &triangles[..end - first]),
        );
        ChildRef::leaf(first, end - first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{self, Leaves, collapse};
    use crate::geometry::Vec3;
    use crate::test_random::Random;

    const BY_AREA: ScoreAtSplit = |_, bounds, _| bounds.half_area();

    #[test]
    fn trees_are_valid_sorted_and_nearly_as_good_as_the_best() {
        let mut random = Random::new(81);
        let mut ratios = Vec::new();
        for count in (0..40).chain([100, 1000, MOST_SMALL]) {
            let mesh = random.mesh(count);
            let ids: Vec<u32> = (0..count as u32).rev().collect();
            let tree = small_tree(&mesh, &ids, BY_AREA);
            tree.validate(&mesh).unwrap_or_else(|fault| panic!("{count} triangles: {fault}"));
            for node in &tree.nodes {
                let areas = (0..node.len as usize).map(|slot| node.bounds(slot).half_area());
                assert!(areas.is_sorted_by(|a, b| a >= b));
            }
            if count >= 100 {
                let binary = (build::find("binned").unwrap().build)(&mesh, Leaves::Wide);
                let best = collapse(&binary, WideCosts::default(), |_, _| 0.0);
                let cost = |tree| WideCosts::default().sah_cost(tree);
                ratios.push(cost(&tree) / cost(&best));
            }
        }
        assert!(ratios.iter().all(|ratio| *ratio < 1.2), "{ratios:?}");
    }

    #[test]
    fn sets_that_cannot_be_told_apart_stay_within_the_depth() {
        // All alike, and ever smaller towards a corner.
        for step in [0.0, 0.9f32] {
            let corner = |i: usize| Vec3::splat(step.powi((i / 3) as i32)) + Vec3::AXES[i % 3];
            let vertices: Vec<_> = (0..3 * 3000).map(corner).collect();
            let triangles = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mesh = TriangleMesh::new(vertices, triangles);
            let ids: Vec<u32> = (0..3000).collect();
            small_tree(&mesh, &ids, BY_AREA).validate(&mesh).unwrap();
        }
    }
}

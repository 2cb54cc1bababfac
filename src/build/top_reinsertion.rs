//! Much of the gain of [`reinsertion`](super::reinsertion) in little more time than [`binned`] takes: the
//! largest subtrees are the ones that matter, and they are few. So only what is above about two thousand
//! sets of triangles is taken apart, and sets are moved whole.

use super::subtrees::Subtrees;
use super::{BuilderEntry, Leaves, binned, in_parts};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::{Bvh2, ChildRef, Node2};
use bytemuck::Zeroable;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "top-reinsertion",
    about: "as binned, then the largest subtrees go where they cost least: better trees, little slower",
    build,
    in_parts: Some(|mesh, order| {
        binned::with_root(mesh, |root| {
            in_parts::build(mesh, root, order, Some(Sets::of(mesh.len())))
        })
    }),
};

/// What is moved whole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sets {
    /// Most triangles of a set, more than a leaf may have.
    pub(super) most: usize,
}

/// A set is this part of all triangles at most, or has so many.
const ONE_IN: usize = 1000;
const FEWEST: usize = 64;

/// No set ends up deeper than this.
const DEPTH: usize = 32;

/// Subtrees that a pass takes out, for each that there are; what later passes and smaller subtrees bring
/// is not worth their time.
const SHARE: f64 = 0.25;
const PASSES: usize = 2;

impl Sets {
    /// Those of a mesh of so many triangles.
    pub(super) fn of(triangles: usize) -> Self {
        Self { most: (triangles / ONE_IN).max(FEWEST) }
    }

    /// As how deep a set counts while it is built, since it may go there.
    pub(super) fn depth(depth: usize) -> usize {
        depth.max(DEPTH)
    }
}

/// The tree above sets with its subtrees in better places; `None` if there are none, or some set would be
/// too deep. Each set is a leaf.
pub(super) fn improved(nodes: &[Node2], root: ChildRef, bounds: &Aabb) -> Option<Subtrees> {
    if nodes.len() < 3 {
        return None;
    }
    let before = Subtrees::of(nodes, root, bounds);
    let mut after = before.clone();
    for _ in 0..PASSES {
        after.move_largest((after.len() as f64 * SHARE) as usize);
    }
    let is_better = after.inner_areas() < before.inner_areas();
    (is_better && after.depth() <= DEPTH).then_some(after)
}

fn build(mesh: &TriangleMesh, leaves: Leaves) -> Bvh2 {
    let sets = Sets::of(mesh.len());
    let mut tree = binned::build_in_sets(mesh, leaves, Some(sets));
    let Some(root) = tree.root else { return tree };
    let mut top = Top::default();
    let root = top.add(&tree, root, sets);
    let Some(better) = improved(&top.nodes, root, &tree.bounds) else { return tree };
    let (root, _) = top.put(&better, better.root(), &mut tree);
    tree.root = Some(root);
    tree.in_depth_first_order().0
}

/// What is above the sets of a tree.
#[derive(Default)]
struct Top {
    nodes: Vec<Node2>,
    /// Of each node in the tree.
    places: Vec<usize>,
    /// The sets' roots, one for each leaf.
    sets: Vec<ChildRef>,
}

impl Top {
    /// Adds what is above the sets below `child`, nodes in depth-first order.
    fn add(&mut self, tree: &Bvh2, child: ChildRef, sets: Sets) -> ChildRef {
        let node = (!child.is_leaf()).then(|| &tree.nodes[child.node_index()]);
        let Some(node) = node.filter(|_| count(tree, child) as usize > sets.most) else {
            self.sets.push(child);
            return ChildRef::leaf(self.sets.len() - 1, 1);
        };
        let own = self.nodes.len();
        self.nodes.push(Node2::zeroed());
        self.places.push(child.node_index());
        let children = node.children.map(|child| self.add(tree, child, sets));
        self.nodes[own] = Node2 { children, ..*node };
        ChildRef::inner(own)
    }

    /// Puts what is above sets where it is better, and returns what is now at the root of `subtree` and how
    /// many triangles are below. There are as many nodes as before, which take the places of those.
    fn put(&self, better: &Subtrees, subtree: u32, tree: &mut Bvh2) -> (ChildRef, u32) {
        match better.below(subtree) {
            Err(set) => {
                let set = self.sets[set.leaf_slots().start];
                (set, count(tree, set))
            }
            Ok(below) => {
                let [(lower, lower_count), (upper, upper_count)] =
                    below.map(|below| self.put(better, below, tree));
                let place = self.places[subtree as usize];
                tree.nodes[place] = Node2 {
                    bounds: below.map(|below| better.bounds(below)),
                    children: [lower, upper],
                    counts: [lower_count, upper_count],
                };
                (ChildRef::inner(place), lower_count + upper_count)
            }
        }
    }
}

/// Triangles below a child.
fn count(tree: &Bvh2, child: ChildRef) -> u32 {
    if child.is_leaf() {
        child.leaf_slots().len() as u32
    } else {
        tree.nodes[child.node_index()].counts.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn it_costs_less_than_before_and_no_set_is_taken_apart() {
        for (seed, triangles) in [(0x2f1, 500), (0x2f2, 20_000), (0x2f3, 80_000)] {
            let mesh = Random::new(seed).mesh(triangles);
            let (before, after) =
                (binned::build(&mesh, Leaves::Single), build(&mesh, Leaves::Single));
            after.validate(&mesh).unwrap();
            let costs = [&before, &after].map(Bvh2::sah_cost);
            // A few sets have no better places.
            let most = if triangles > 1000 { 0.999 } else { 1.0 };
            assert!(costs[1] <= most * costs[0], "{seed:#x}: {costs:?}");
            let sets = |tree: &Bvh2| {
                let mut top = Top::default();
                top.add(tree, tree.root.unwrap(), Sets::of(triangles));
                let mut ids: Vec<Vec<u32>> = top.sets.iter().map(|set| ids(tree, *set)).collect();
                ids.sort_unstable();
                ids
            };
            assert_eq!(sets(&before), sets(&after), "{seed:#x}");
        }
    }

    fn ids(tree: &Bvh2, child: ChildRef) -> Vec<u32> {
        let mut all = Vec::new();
        let mut pending = vec![child];
        while let Some(child) = pending.pop() {
            if child.is_leaf() {
                all.extend(&tree.triangle_ids[child.leaf_slots()]);
            } else {
                pending.extend(tree.nodes[child.node_index()].children);
            }
        }
        all.sort_unstable();
        all
    }
}

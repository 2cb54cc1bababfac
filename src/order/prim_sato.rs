//! PrimSATO (Nah and Manocha, "SATO: Surface-Area Traversal Order for Shadow Ray Tracing", Computer
//! Graphics Forum 33(6), 2014): the child whose triangles are larger first, by their mean area or
//! by the largest one. Areas are those of whole triangles.

use super::bottom_up::{BottomUp, bottom_up, score_part, scores};
use super::upkeep::keep;
use super::{DependsOn, OrderEntry, Scores, kd};
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2, PartSummary, Plan};

pub(super) static MEAN: OrderEntry = OrderEntry {
    name: "prim-sato-avg",
    about: "surface-area traversal order: the child with the larger mean triangle first",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, Areas::mean),
    depends_on: DependsOn::AllBelow(|| keep(ByTriangleArea { key: Areas::mean })),
    box_score: None,
    plan_kd: Some(kd::prim_sato_average),
    scores: Some(|tree, _| score(tree, Areas::mean)),
    score_part: Some(|tree, below, scores| part(tree, below, scores, Areas::mean)),
    at_split: Some(|mesh, _, triangles| {
        let count = triangles.len() as f64;
        triangles.map(|id| mesh.triangle(id as usize).area()).sum::<f64>() / count
    }),
};

pub(super) static LARGEST: OrderEntry = OrderEntry {
    name: "prim-sato-max",
    about: "surface-area traversal order: the child with the largest triangle first",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, Areas::largest),
    depends_on: DependsOn::AllBelow(|| keep(ByTriangleArea { key: Areas::largest })),
    box_score: None,
    plan_kd: Some(kd::prim_sato_max),
    scores: Some(|tree, _| score(tree, Areas::largest)),
    score_part: Some(|tree, below, scores| part(tree, below, scores, Areas::largest)),
    at_split: Some(|mesh, _, triangles| {
        triangles.map(|id| mesh.triangle(id as usize).area()).fold(0.0, f64::max)
    }),
};

fn plan<F: Fn(&Areas, u32) -> f64 + Sync>(tree: &Bvh2, key: F) -> Plan {
    Plan::Fixed(bottom_up(tree, &ByTriangleArea { key }).0)
}

fn score<F: Fn(&Areas, u32) -> f64 + Sync + Copy>(tree: &Bvh2, key: F) -> Scores {
    let of_child = |node: &Node2, side: usize, areas: &Areas| key(areas, node.counts[side]);
    scores(tree, &ByTriangleArea { key }, of_child)
}

fn part<F: Fn(&Areas, u32) -> f64 + Sync + Copy>(
    tree: &Bvh2,
    below: Option<&[PartSummary]>,
    scores: &mut Vec<[f64; 2]>,
    key: F,
) -> PartSummary {
    let of_child = |node: &Node2, side: usize, areas: &Areas| key(areas, node.counts[side]);
    score_part(tree, below, &ByTriangleArea { key }, of_child, scores)
}

/// Areas of the triangles of a subtree.
#[derive(Clone, Copy, Default)]
struct Areas {
    sum: f64,
    largest: f64,
}

impl From<PartSummary> for Areas {
    fn from([sum, largest]: PartSummary) -> Self {
        Self { sum, largest }
    }
}

impl From<Areas> for PartSummary {
    fn from(areas: Areas) -> Self {
        [areas.sum, areas.largest]
    }
}

impl Areas {
    fn mean(&self, count: u32) -> f64 {
        self.sum / f64::from(count)
    }

    fn largest(&self, _: u32) -> f64 {
        self.largest
    }
}

/// Larger keys first; a key is computed from the areas and the number of triangles.
struct ByTriangleArea<F> {
    key: F,
}

impl<F: Fn(&Areas, u32) -> f64 + Sync> BottomUp for ByTriangleArea<F> {
    type Summary = Areas;
    type Own = ();

    fn leaf(&self, triangles: &[Triangle], _: &Aabb) -> Areas {
        let mut all = Areas::default();
        for area in triangles.iter().map(Triangle::area) {
            all.sum += area;
            all.largest = all.largest.max(area);
        }
        all
    }

    fn own(&self, _: &Node2) {}

    fn node(&self, node: &Node2, (): &(), below: &[Areas; 2]) -> (Areas, bool) {
        let key = |side: usize| (self.key)(&below[side], node.counts[side]);
        let all = Areas {
            sum: below[0].sum + below[1].sum,
            largest: below[0].largest.max(below[1].largest),
        };
        (all, key(1) > key(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::order::OrderContext;
    use crate::test_random::Random;
    use crate::tree::ChildRef;

    fn areas(tree: &Bvh2, child: ChildRef) -> Vec<f64> {
        if child.is_leaf() {
            return tree.triangles[child.leaf_slots()].iter().map(Triangle::area).collect();
        }
        let node = &tree.nodes[child.node_index()];
        node.children.iter().flat_map(|c| areas(tree, *c)).collect()
    }

    fn mean(areas: &[f64]) -> f64 {
        areas.iter().sum::<f64>() / areas.len() as f64
    }

    fn largest(areas: &[f64]) -> f64 {
        areas.iter().copied().fold(0.0, f64::max)
    }

    #[test]
    fn the_first_child_has_the_larger_triangles() {
        let mesh = Random::new(31).mesh(5000);
        for (entry, key) in [(&MEAN, mean as fn(&[f64]) -> f64), (&LARGEST, largest)] {
            let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
            let Plan::Fixed(bits) = (entry.plan_bvh2)(&tree, &OrderContext::new(&mesh)) else {
                panic!("a fixed order");
            };
            for (index, node) in tree.nodes.iter().enumerate() {
                let mut keys = node.children.map(|c| key(&areas(&tree, c)));
                if bits.get(index) {
                    keys.swap(0, 1);
                }
                let [first, second] = keys;
                assert!(first >= second * (1.0 - 1e-12), "{}: {first} {second}", entry.name);
            }
        }
    }
}

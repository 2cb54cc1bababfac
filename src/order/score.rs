//! Orders as scores, for trees with more than two children: among siblings the child with the
//! largest score comes first. Each is the key by which the order of the same name compares the two
//! children of a binary node.

use super::OrderContext;
use super::rtsah::{Shares, between};
use crate::geometry::Triangle;
use crate::tree::{Bvh2, ChildRef, Node2};

/// For each inner node the scores of its two children.
pub type Scores = Vec<[f64; 2]>;

/// An order that can be told as a score.
#[derive(Debug)]
pub struct ScoredOrder {
    /// The name of the order in the catalogue.
    pub name: &'static str,
    /// Scores the children of all nodes. Same result for any number of threads.
    pub score: fn(&Bvh2, &OrderContext<'_>) -> Scores,
}

/// All of them.
pub static SCORED: &[ScoredOrder] = &[
    ScoredOrder { name: "random", score: random },
    ScoredOrder { name: "node-sato", score: node_sato },
    ScoredOrder { name: "prim-sato-avg", score: |tree, _| prim_sato(tree, |a, n| a.sum / n) },
    ScoredOrder { name: "prim-sato-max", score: |tree, _| prim_sato(tree, |a, _| a.largest) },
    ScoredOrder {
        name: "prim-num",
        score: |tree, _| each_child(tree, |n, s| -f64::from(n.counts[s])),
    },
    ScoredOrder {
        name: "prim-num-most",
        score: |tree, _| each_child(tree, |n, s| n.counts[s].into()),
    },
    ScoredOrder { name: "p-over-c", score: p_over_c },
];

/// The scored order called `name`.
pub fn find_scored(name: &str) -> Option<&'static ScoredOrder> {
    SCORED.iter().find(|o| o.name == name)
}

fn each_child(tree: &Bvh2, score: impl Fn(&Node2, usize) -> f64) -> Scores {
    tree.nodes.iter().map(|node| [score(node, 0), score(node, 1)]).collect()
}

fn node_sato(tree: &Bvh2, _: &OrderContext<'_>) -> Scores {
    each_child(tree, |node, side| node.bounds[side].half_area())
}

fn random(tree: &Bvh2, context: &OrderContext<'_>) -> Scores {
    let toss = |index: usize| super::random::hash(context.seed, index as u64) as f64;
    (0..tree.nodes.len()).map(|index| [toss(2 * index), toss(2 * index + 1)]).collect()
}

/// Areas of the triangles of a subtree.
#[derive(Clone, Copy, Default)]
struct Areas {
    sum: f64,
    largest: f64,
}

fn prim_sato(tree: &Bvh2, key: impl Fn(&Areas, f64) -> f64) -> Scores {
    let mut scores = vec![[0.0; 2]; tree.nodes.len()];
    let mut areas = vec![Areas::default(); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let below = node.children.map(|child| areas_below(tree, child, &areas));
        areas[index] = Areas {
            sum: below[0].sum + below[1].sum,
            largest: below[0].largest.max(below[1].largest),
        };
        scores[index] = [0, 1].map(|side| key(&below[side], node.counts[side].into()));
    }
    scores
}

fn areas_below(tree: &Bvh2, child: ChildRef, inner: &[Areas]) -> Areas {
    if !child.is_leaf() {
        return inner[child.node_index()];
    }
    let areas = tree.triangles[child.leaf_slots()].iter().map(Triangle::area);
    areas.fold(Areas::default(), |all, area| Areas {
        sum: all.sum + area,
        largest: all.largest.max(area),
    })
}

/// What a random line that hits a subtree's box can expect.
#[derive(Clone, Copy, Default)]
struct Chances {
    stop: f64,
    cost: f64,
}

/// As `p_over_c` has it for two children.
fn p_over_c(tree: &Bvh2, _: &OrderContext<'_>) -> Scores {
    let mut scores = vec![[0.0; 2]; tree.nodes.len()];
    let mut chances = vec![Chances::default(); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let hits = Shares::of(node).each;
        let below: [Chances; 2] = std::array::from_fn(|side| {
            let child = node.children[side];
            if child.is_leaf() {
                let triangles = &tree.triangles[child.leaf_slots()];
                Chances { stop: 1.0 - between(triangles, &node.bounds[side]), cost: 1.0 }
            } else {
                chances[child.node_index()]
            }
        });
        scores[index] = below.map(|b| b.stop / b.cost);
        let (first, second) = if scores[index][1] > scores[index][0] { (1, 0) } else { (0, 1) };
        let passed_first = 1.0 - hits[first] * below[first].stop;
        chances[index] = Chances {
            stop: 1.0 - passed_first * (1.0 - hits[second] * below[second].stop),
            cost: 1.0
                + hits[first] * below[first].cost
                + passed_first * hits[second] * below[second].cost,
        };
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::order::{ORDERS, OrderContext, find};
    use crate::test_random::Random;

    /// Sorting by scores leaves a tree alone that the order of the same name has sorted.
    #[test]
    fn scores_say_what_the_orders_do() {
        let mesh = Random::new(61).mesh(4000);
        for scored in SCORED.iter().filter(|s| s.name != "random") {
            let mut tree = (build::find("binned").unwrap().build)(&mesh);
            let context = OrderContext::new(&mesh);
            (find(scored.name).unwrap().plan_bvh2)(&mut tree, &context);
            let scores = (scored.score)(&tree, &context);
            for [first, second] in scores {
                let slack = 1e-12 * second.abs();
                assert!(first >= second - slack, "{}: {first} {second}", scored.name);
            }
        }
        assert!(SCORED.iter().all(|s| ORDERS.iter().any(|o| o.name == s.name)));
    }
}

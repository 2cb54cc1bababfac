//! Children by descending probability of stopping a line over cost of finding out. Under
//! independence that is optimal (Ogaki and Derouet-Jourdan, "An N-ary BVH Child Node Sorting
//! Technique for Occlusion Tests", Journal of Computer Graphics Techniques 5(2), 2016); here the
//! figures come from areas, not from recorded rays. Both children's boxes are tested at once, so
//! testing them costs nothing extra.

use super::bottom_up::{BottomUp, bottom_up, score_part, scores};
use super::rtsah::{Shares, between};
use super::upkeep::keep;
use super::{DependsOn, OrderEntry, Scores};
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2, NodeBits, PartSummary, Plan};

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "p-over-c",
    about: "the child with the most chance of stopping a line for its cost first, by areas",
    needs_training: false,
    plan_bvh2: |tree, _| Plan::Fixed(second_first(tree)),
    depends_on: DependsOn::AllBelow(|| keep(StopOverCost)),
    box_score: None,
    plan_kd: None,
    scores: Some(|tree, _| scores_of(tree)),
    score_part: Some(|tree, below, scores| score_part(tree, below, &StopOverCost, score, scores)),
    at_split: None,
};

pub(super) fn scores_of(tree: &Bvh2) -> Scores {
    scores(tree, &StopOverCost, score)
}

fn score(_: &Node2, _: usize, below: &Summary) -> f64 {
    below.stop / below.cost
}

pub(super) fn second_first(tree: &Bvh2) -> NodeBits {
    bottom_up(tree, &StopOverCost).0
}

/// What a random line that hits a subtree's box can expect.
#[derive(Clone, Copy, Debug, Default)]
struct Summary {
    /// Probability of being stopped.
    stop: f64,
    /// Nodes visited.
    cost: f64,
}

impl From<PartSummary> for Summary {
    fn from([stop, cost]: PartSummary) -> Self {
        Self { stop, cost }
    }
}

impl From<Summary> for PartSummary {
    fn from(summary: Summary) -> Self {
        [summary.stop, summary.cost]
    }
}

struct StopOverCost;

impl BottomUp for StopOverCost {
    type Summary = Summary;
    type Own = [f64; 2];

    fn leaf(&self, triangles: &[Triangle], bounds: &Aabb) -> Summary {
        Summary { stop: 1.0 - between(triangles, bounds), cost: 1.0 }
    }

    fn own(&self, node: &Node2) -> [f64; 2] {
        Shares::of(node).each
    }

    fn node(&self, _: &Node2, hits: &[f64; 2], below: &[Summary; 2]) -> (Summary, bool) {
        let second_first = below[1].stop * below[0].cost > below[0].stop * below[1].cost;
        let (first, second) = if second_first { (1, 0) } else { (0, 1) };
        let passed_first = 1.0 - hits[first] * below[first].stop;
        let summary = Summary {
            stop: 1.0 - passed_first * (1.0 - hits[second] * below[second].stop),
            cost: 1.0
                + hits[first] * below[first].cost
                + passed_first * hits[second] * below[second].cost,
        };
        (summary, second_first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::test_random::Random;

    #[test]
    fn probabilities_and_costs_are_possible() {
        let mesh = Random::new(51).mesh(3000);
        let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
        let (bits, root) = bottom_up(&tree, &StopOverCost);
        let root = root.unwrap();
        assert!((0.0..=1.0).contains(&root.stop) && root.cost > 1.0, "{root:?}");
        assert!(bits.count_ones() > 0 && bits.count_ones() < tree.nodes.len());
    }
}

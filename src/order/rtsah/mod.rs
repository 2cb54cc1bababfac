//! RTSAH (Ize and Hansen, "RTSAH Traversal Order for Occlusion Rays", Computer Graphics Forum 30(2),
//! 2011): from the leaves up, the expected cost of a random line under either order of the
//! children, and the probability that nothing stops it. The cheaper order is kept.

mod lanes;
pub(super) mod line_probability;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

use super::bottom_up::{BottomUp, bottom_up};
use super::upkeep::keep;
use super::{DependsOn, OrderEntry, kd};
use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Node2, Plan};
use line_probability::lines_through_both;

/// Costs of a box test and of a triangle test, as in Manta, where RTSAH and SATO were measured.
const STEP: f64 = 1.0;
const TRIANGLE: f64 = 3.0;

pub(super) static EXACT: OrderEntry = OrderEntry {
    name: "rtsah",
    about: "ray termination surface-area heuristic: the cheaper order for random lines",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, &exact_model()),
    depends_on: DependsOn::AllBelow(|| keep(exact_model())),
    box_score: None,
    plan_kd: Some(kd::rtsah),
    scores: None,
    score_part: None,
    at_split: None,
};

pub(super) static PAPER: OrderEntry = OrderEntry {
    name: "rtsah-paper",
    about: "rtsah as published: without the second box test of a line that survives one child",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, &paper_model()),
    depends_on: DependsOn::AllBelow(|| keep(paper_model())),
    box_score: None,
    plan_kd: None,
    scores: None,
    score_part: None,
    at_split: None,
};

pub(super) static LEAF: OrderEntry = OrderEntry {
    name: "rtsah-leaf",
    about: "rtsah with leaves that stop a line as likely as their triangles' areas say",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, &leaf_model()),
    depends_on: DependsOn::AllBelow(|| keep(leaf_model())),
    box_score: None,
    plan_kd: None,
    scores: None,
    score_part: None,
    at_split: None,
};

pub(super) static APPROXIMATE: OrderEntry = OrderEntry {
    name: "rtsah-approx",
    about: "rtsah as if the children's boxes filled their parent's",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, &approximate_model()),
    depends_on: DependsOn::AllBelow(|| keep(approximate_model())),
    box_score: None,
    plan_kd: None,
    scores: None,
    score_part: None,
    at_split: None,
};

pub(super) static CLAMPED: OrderEntry = OrderEntry {
    name: "rtsah-approx-clamped",
    about: "rtsah-approx with probabilities kept from falling below 0",
    needs_training: false,
    plan_bvh2: |tree, _| plan(tree, &clamped_model()),
    depends_on: DependsOn::AllBelow(|| keep(clamped_model())),
    box_score: None,
    plan_kd: None,
    scores: None,
    score_part: None,
    at_split: None,
};

fn plan(tree: &Bvh2, model: &impl BottomUp) -> Plan {
    Plan::Fixed(bottom_up(tree, model).0)
}

/// RTSAH with its choices. Type parameters, so that each combination is compiled as one.
struct Rtsah<B, C, P> {
    /// Probability that a line which hits a node hits both children.
    both: B,
    /// Expected cost of a node if the first of the given children comes first.
    cost: C,
    /// Probability that a line which hits a leaf's box passes.
    pass: P,
}

fn exact_model() -> impl BottomUp {
    Rtsah { both: exact, cost: corrected, pass: opaque }
}

fn paper_model() -> impl BottomUp {
    Rtsah { both: exact, cost: published, pass: opaque }
}

fn leaf_model() -> impl BottomUp {
    Rtsah { both: exact, cost: corrected, pass: between }
}

fn approximate_model() -> impl BottomUp {
    Rtsah { both: filled, cost: corrected, pass: opaque }
}

fn clamped_model() -> impl BottomUp {
    Rtsah { both: filled_or_0, cost: corrected, pass: opaque }
}

/// What a random line that hits a subtree's box can expect.
#[derive(Clone, Copy, Debug, Default)]
struct Summary {
    cost: f64,
    /// Probability of passing through unoccluded.
    pass: f64,
}

/// One child as its parent sees it: probability of being hit, and its summary.
#[derive(Clone, Copy)]
struct Branch {
    hit: f64,
    below: Summary,
}

/// Probabilities that a line which hits a node hits child 0, child 1, both.
#[derive(Clone, Copy, Debug, Default)]
struct Hits {
    each: [f64; 2],
    both: f64,
}

impl Hits {
    /// Just this child.
    fn just(&self, side: usize) -> f64 {
        self.each[side] - self.both
    }

    /// Neither child.
    fn neither(&self) -> f64 {
        1.0 - self.just(0) - self.just(1) - self.both
    }
}

/// Costs with child 0 first and with child 1 first.
#[inline]
fn costs(cost: impl Fn(Branch, Branch, f64) -> f64, hits: &Hits, below: &[Summary; 2]) -> [f64; 2] {
    let branch = |side: usize| Branch { hit: hits.each[side], below: below[side] };
    let (left, right) = (branch(0), branch(1));
    [cost(left, right, hits.both), cost(right, left, hits.both)]
}

impl<B, C, P> BottomUp for Rtsah<B, C, P>
where
    B: Fn(&Node2, &Shares) -> f64 + Sync,
    C: Fn(Branch, Branch, f64) -> f64 + Sync,
    P: Fn(&[Triangle], &Aabb) -> f64 + Sync,
{
    type Summary = Summary;
    type Own = Hits;

    fn leaf(&self, triangles: &[Triangle], bounds: &Aabb) -> Summary {
        Summary {
            cost: TRIANGLE * triangles.len() as f64 + STEP,
            pass: (self.pass)(triangles, bounds),
        }
    }

    fn own(&self, node: &Node2) -> Hits {
        let shares = Shares::of(node);
        Hits { each: shares.each, both: (self.both)(node, &shares) }
    }

    fn node(&self, _: &Node2, hits: &Hits, below: &[Summary; 2]) -> (Summary, bool) {
        let costs = costs(&self.cost, hits, below);
        let pass = hits.just(0) * below[0].pass
            + hits.just(1) * below[1].pass
            + hits.both * below[0].pass * below[1].pass
            + hits.neither();
        let summary = Summary { cost: costs[0].min(costs[1]), pass: pass.clamp(0.0, 1.0) };
        (summary, costs[1] < costs[0])
    }
}

/// Surface areas of children over that of their parent: the probabilities that a random line which
/// hits the parent hits them.
pub(super) struct Shares {
    pub(super) each: [f64; 2],
    /// Half the parent's area.
    half_area: f64,
}

impl Shares {
    #[inline]
    pub(super) fn of(node: &Node2) -> Self {
        let half_area = node.bounds[0].union(node.bounds[1]).half_area();
        // Of a segment or a point: then all boxes are alike.
        let share = |b: &Aabb| if half_area > 0.0 { b.half_area() / half_area } else { 1.0 };
        Self { each: [share(&node.bounds[0]), share(&node.bounds[1])], half_area }
    }
}

/// Probability that a random line which hits a leaf's box passes between its triangles, as if they
/// were independent: a triangle stops a line through a box around it with twice its area over the
/// box's surface area (Cauchy's theorem on mean projections).
pub(super) fn between(triangles: &[Triangle], bounds: &Aabb) -> f64 {
    let half_area = bounds.half_area();
    // A box without area holds degenerate triangles, which stop nothing.
    let stop = |t: &Triangle| if half_area > 0.0 { t.area() / half_area } else { 0.0 };
    triangles.iter().map(|t| (1.0 - stop(t)).clamp(0.0, 1.0)).product()
}

/// As published: whatever enters a leaf is stopped there.
fn opaque(_: &[Triangle], _: &Aabb) -> f64 {
    0.0
}

/// From the measure of lines through both boxes.
fn exact(node: &Node2, shares: &Shares) -> f64 {
    let [left, right] = shares.each;
    let (least, most) = ((left + right - 1.0).max(0.0), left.min(right));
    if least >= most {
        return most;
    }
    let lines = lines_through_both(&node.bounds[0], &node.bounds[1]);
    (lines / shares.half_area).clamp(least, most)
}

/// As for the cells of a kd-tree, which leave no line out; negative where boxes leave much space.
/// The choice of Manta for animations.
fn filled(_: &Node2, shares: &Shares) -> f64 {
    shares.each[0] + shares.each[1] - 1.0
}

fn filled_or_0(node: &Node2, shares: &Shares) -> f64 {
    filled(node, shares).max(0.0)
}

/// The paper's cost, its equations 3 and 4.
fn published(first: Branch, second: Branch, both: f64) -> f64 {
    let just_second = second.hit - both;
    let neither = 1.0 - (first.hit - both) - just_second - both;
    let to_second = just_second + both * first.below.pass;
    STEP + first.hit * first.below.cost + to_second * (STEP + second.below.cost) + neither * STEP
}

/// The cost of what traversal does: the second box is tested whenever the first child has not
/// stopped the line, whether or not it will be hit. So the authors' renderer, Manta, has it.
fn corrected(first: Branch, second: Branch, both: f64) -> f64 {
    let to_second = second.hit - both + both * first.below.pass;
    let tests = 1.0 + (1.0 - first.hit) + first.hit * first.below.pass;
    first.hit * first.below.cost + to_second * second.below.cost + STEP * tests
}

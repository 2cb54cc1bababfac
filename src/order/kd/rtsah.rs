//! RTSAH (Ize and Hansen, "RTSAH Traversal Order for Occlusion Rays", Computer Graphics Forum
//! 30(2), 2011) for kd-trees, as in the Manta ray tracer.
//!
//! Of lines through a cell, a share `p_lower` passes through the lower side and `p_upper` through
//! the upper one. The two fill the cell, so `p_both = p_lower + p_upper - 1` pass through both, and
//! only these ask which comes first. With `cost` and `open`, the expected cost of a subtree and the
//! share of lines that it lets through:
//! ```text
//! cost = T + p_only_lower cost_l + p_only_upper cost_u
//!          + p_both min(cost_l + open_l cost_u, cost_u + open_u cost_l)
//! open = p_only_lower open_l + p_only_upper open_u + p_both open_l open_u
//! ```

use crate::geometry::Aabb;
use crate::order::OrderContext;
use crate::tree::{KD_INTERSECTION_COST, KD_TRAVERSAL_COST, KdNode, KdTree, NodeBits, Plan};

/// Subtrees of more nodes are worth another thread.
const PARALLEL_NODES: usize = 1 << 15;

/// The side first that makes a random line's expected cost the lower one.
pub fn rtsah(tree: &KdTree, _: &OrderContext<'_>) -> Plan {
    let mut upper_first = NodeBits::none(tree.nodes.len());
    if !tree.nodes.is_empty() {
        let cell = Cell::new(&tree.bounds);
        let half_area = tree.bounds.half_area();
        Pass { nodes: &tree.nodes, base: 0, upper_first: &mut upper_first, cell }
            .visit(0, half_area);
    }
    Plan::Fixed(upper_first)
}

/// What random lines through a node's cell meet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Expectation {
    cost: f64,
    /// Share of lines that get through. Leaves stop all, unless they are empty.
    open: f64,
}

/// A box whose axes are found by index without a branch: no processor foresees which one a node
/// splits. A fourth one spares the check of a node's two bits.
#[derive(Clone, Copy)]
struct Cell {
    min: [f64; 4],
    max: [f64; 4],
}

impl Cell {
    fn new(bounds: &Aabb) -> Self {
        let [min, max] = [bounds.min, bounds.max].map(|v| v.as_dvec3().extend(0.0).to_array());
        Self { min, max }
    }

    /// Half the surface areas of both sides of a plane.
    #[inline(always)]
    fn half_areas(&self, axis: usize, split: f64) -> [f64; 2] {
        const OTHERS: [[usize; 2]; 4] = [[1, 2], [2, 0], [0, 1], [3, 3]];
        let [u, v] = OTHERS[axis].map(|other| self.max[other] - self.min[other]);
        let half_area = |length: f64| u * v + (u + v) * length;
        [half_area(split - self.min[axis]), half_area(self.max[axis] - split)]
    }
}

/// The shares of lines through a cell that pass through its sides.
#[inline(always)]
fn shares(half_area: f64, sides: [f64; 2]) -> [f64; 2] {
    // Lines that meet a cell without a surface meet all of it.
    let scale = if half_area > 0.0 { 1.0 / half_area } else { f64::INFINITY };
    sides.map(|side| if half_area > 0.0 { (side * scale).min(1.0) } else { 1.0 })
}

/// A walk over some of the nodes, which has bits of its own for them, the first for node `base`.
struct Pass<'a> {
    nodes: &'a [KdNode],
    base: usize,
    upper_first: &'a mut NodeBits,
    /// That of the node to be visited.
    cell: Cell,
}

impl Pass<'_> {
    /// Sets the bits of the subtree of the node at `index`.
    fn visit(&mut self, index: usize, half_area: f64) -> Expectation {
        let node = self.nodes[index];
        if node.is_leaf() {
            let cost = node.leaf_range().len() as f64 * KD_INTERSECTION_COST + KD_TRAVERSAL_COST;
            return Expectation { cost, open: 0.0 };
        }
        let (axis, split) = (node.axis(), f64::from(node.split()));
        let half_areas = self.cell.half_areas(axis, split);
        let shares = shares(half_area, half_areas);
        if node.is_single() {
            // As `combined` has it, with nothing on the other side.
            let side = usize::from(node.only_upper());
            let below = self.visit_side(index + 1, side, (axis, split), half_areas[side]);
            return Expectation {
                cost: KD_TRAVERSAL_COST + shares[side] * below.cost,
                open: 1.0 - shares[side] * (1.0 - below.open),
            };
        }
        let upper = node.upper_child();
        let plane = (axis, split);
        let sides = if upper - index > PARALLEL_NODES {
            self.visit_both([index + 1, upper], plane, half_areas)
        } else {
            let lower = self.visit_side(index + 1, 0, plane, half_areas[0]);
            [lower, self.visit_side(upper, 1, plane, half_areas[1])]
        };
        let (expectation, upper_first) = combined(shares, sides);
        self.upper_first.set(index - self.base, upper_first);
        expectation
    }

    /// The child at `index` on one side of its parent's plane.
    #[inline(always)]
    fn visit_side(
        &mut self,
        index: usize,
        side: usize,
        (axis, split): (usize, f64),
        half_area: f64,
    ) -> Expectation {
        let end = if side == 0 { &mut self.cell.max } else { &mut self.cell.min };
        let before = std::mem::replace(&mut end[axis], split);
        let expectation = self.visit(index, half_area);
        let end = if side == 0 { &mut self.cell.max } else { &mut self.cell.min };
        end[axis] = before;
        expectation
    }

    /// Both children of a node, on two threads. The lower one's nodes end where the upper one's
    /// begin; where those end is not known here, so that their bits are the rest of this pass's.
    fn visit_both(
        &mut self,
        [lower, upper]: [usize; 2],
        plane: (usize, f64),
        half_areas: [f64; 2],
    ) -> [Expectation; 2] {
        let end = self.base + self.upper_first.len();
        let mut beside = NodeBits::none(end - upper);
        let mut other =
            Pass { nodes: self.nodes, base: upper, upper_first: &mut beside, cell: self.cell };
        let sides = rayon::join(
            || self.visit_side(lower, 0, plane, half_areas[0]),
            || other.visit_side(upper, 1, plane, half_areas[1]),
        );
        self.upper_first.include(upper - self.base, &beside);
        [sides.0, sides.1]
    }
}

/// The expectation of a node, and whether its upper side comes first; ties keep the lower one.
#[inline]
fn combined([p_lower, p_upper]: [f64; 2], [lower, upper]: [Expectation; 2]) -> (Expectation, bool) {
    let (only_lower, only_upper, both) = (1.0 - p_upper, 1.0 - p_lower, p_lower + p_upper - 1.0);
    let lower_first = lower.cost + lower.open * upper.cost;
    let upper_first = upper.cost + upper.open * lower.cost;
    let expectation = Expectation {
        cost: KD_TRAVERSAL_COST
            + only_lower * lower.cost
            + only_upper * upper.cost
            + both * lower_first.min(upper_first),
        open: only_lower * lower.open + only_upper * upper.open + both * lower.open * upper.open,
    };
    (expectation, upper_first < lower_first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::test_random::Random;
    use glam::Vec3;

    /// Two unit cubes side by side: the shares are those of the reference table's adjacent boxes.
    #[test]
    fn shares_of_adjacent_boxes() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::new(3.0, 1.0, 1.0) };
        let half_areas = Cell::new(&bounds).half_areas(0, 1.0);
        assert_eq!(half_areas, [3.0, 5.0]);
        let [p_lower, p_upper] = shares(bounds.half_area(), half_areas);
        assert_eq!(shares(0.0, [0.0, 0.0]), [1.0, 1.0]);
        assert!((p_lower - 0.428571).abs() < 1e-6 && (p_upper - 0.714286).abs() < 1e-6);
        assert!((p_lower + p_upper - 1.0 - 0.142857).abs() < 1e-6);
    }

    /// Lines are drawn one by one, and the cheaper order is found by walking.
    #[test]
    fn the_cost_is_that_of_simulated_lines() {
        let sides = [Expectation { cost: 5.0, open: 0.75 }, Expectation { cost: 3.0, open: 0.25 }];
        let (p_lower, p_upper) = (0.6, 0.7);
        let (expected, upper_first) = combined([p_lower, p_upper], sides);
        assert!(upper_first);
        let mut random = Random::new(46);
        let lines = 400_000;
        let (mut cost, mut open) = (0.0, 0.0);
        for _ in 0..lines {
            let place = f64::from(random.unit());
            // Only lower, both, only upper.
            let meets = [place < p_lower, place >= 1.0 - p_upper];
            cost += KD_TRAVERSAL_COST;
            let mut gone_through = true;
            for side in [1, 0] {
                if meets[side] && gone_through {
                    cost += sides[side].cost;
                    gone_through = f64::from(random.unit()) < sides[side].open;
                }
            }
            open += f64::from(u8::from(gone_through));
        }
        let n = f64::from(lines);
        assert!((cost / n - expected.cost).abs() < 0.02, "{} {expected:?}", cost / n);
        assert!((open / n - expected.open).abs() < 0.005, "{} {expected:?}", open / n);
    }

    #[test]
    fn mirrored_sides_flip_the_bit_and_ties_keep_the_lower() {
        let mut random = Random::new(47);
        for _ in 0..1000 {
            let mut side = || Expectation {
                cost: f64::from(random.unit()) * 10.0,
                open: f64::from(random.unit()),
            };
            let [a, b] = [side(), side()];
            assert_ne!(combined([0.7, 0.6], [a, b]).1, combined([0.6, 0.7], [b, a]).1);
            assert!(!combined([0.7, 0.6], [a, a]).1);
            let open = combined([0.7, 0.6], [a, b]).0.open;
            assert!((0.0..=1.0).contains(&open));
            // An empty leaf is not visited, so it costs nothing; it never comes first.
            let empty = Expectation { cost: 0.0, open: 1.0 };
            let (with_empty, empty_first) = combined([0.7, 0.6], [a, empty]);
            assert!(!empty_first || a.open == 1.0);
            let (cost, open) = (KD_TRAVERSAL_COST + 0.7 * a.cost, 1.0 - 0.7 * (1.0 - a.open));
            assert!((with_empty.cost - cost).abs() < 1e-12);
            assert!((with_empty.open - open).abs() < 1e-12);
        }
    }

    #[test]
    fn any_number_of_threads_sets_the_same_bits() {
        let mesh = Random::new(48).mesh(30_000);
        let tree = build(&mesh, Splits::Perfect).unwrap();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rtsah(&tree, &OrderContext::new(&mesh)))
        };
        let (one, three) = (on(1), on(3));
        assert!(tree.nodes.len() > 2 * PARALLEL_NODES && one == three);
        let Plan::Fixed(bits) = one else { panic!("a fixed order") };
        assert!(bits.count_ones() > 1000, "{}", bits.count_ones());
    }
}

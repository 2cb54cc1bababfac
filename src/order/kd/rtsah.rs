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
        let mut pass = Pass { nodes: &tree.nodes, base: 0, upper_first: &mut upper_first };
        pass.visit(0, Cell { bounds: tree.bounds, half_area: tree.bounds.half_area() });
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

/// An empty leaf is not visited, so it costs nothing.
const EMPTY: Expectation = Expectation { cost: 0.0, open: 1.0 };

/// A cell, with what its children's shares are of.
#[derive(Clone, Copy)]
struct Cell {
    bounds: Aabb,
    half_area: f64,
}

/// A walk over some of the nodes, which has bits of its own for them, the first for node `base`.
struct Pass<'a> {
    nodes: &'a [KdNode],
    base: usize,
    upper_first: &'a mut NodeBits,
}

impl Pass<'_> {
    /// Sets the bits of the subtree of the node at `index`.
    fn visit(&mut self, index: usize, cell: Cell) -> Expectation {
        let node = self.nodes[index];
        if node.is_leaf() {
            let cost = node.leaf_range().len() as f64 * KD_INTERSECTION_COST + KD_TRAVERSAL_COST;
            return Expectation { cost, open: 0.0 };
        }
        let (cells, shares) = divided(&cell, node);
        if node.is_single() {
            let upper = usize::from(node.only_upper());
            let mut sides = [EMPTY; 2];
            sides[upper] = self.visit(index + 1, cells[upper]);
            return combined(shares, sides).0;
        }
        let upper = node.upper_child();
        let sides = if upper - index > PARALLEL_NODES {
            self.visit_both(index + 1, upper, cells)
        } else {
            [self.visit(index + 1, cells[0]), self.visit(upper, cells[1])]
        };
        let (expectation, upper_first) = combined(shares, sides);
        self.upper_first.set(index - self.base, upper_first);
        expectation
    }

    /// Both children of a node, on two threads. The lower one's nodes end where the upper one's
    /// begin; where those end is not known here, so that their bits are the rest of this pass's.
    fn visit_both(&mut self, lower: usize, upper: usize, cells: [Cell; 2]) -> [Expectation; 2] {
        let end = self.base + self.upper_first.len();
        let mut beside = NodeBits::none(end - upper);
        let mut other = Pass { nodes: self.nodes, base: upper, upper_first: &mut beside };
        let sides = rayon::join(|| self.visit(lower, cells[0]), || other.visit(upper, cells[1]));
        self.upper_first.include(upper - self.base, &beside);
        [sides.0, sides.1]
    }
}

/// The cells of both sides, and the shares of lines through `cell` that pass through them.
#[inline]
fn divided(cell: &Cell, node: KdNode) -> ([Cell; 2], [f64; 2]) {
    let axis = node.axis();
    let size = cell.bounds.max.as_dvec3() - cell.bounds.min.as_dvec3();
    let (u, v) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
    let (across, around) = (u * v, u + v);
    let split = f64::from(node.split());
    let lengths =
        [split - f64::from(cell.bounds.min[axis]), f64::from(cell.bounds.max[axis]) - split];
    let half_areas = lengths.map(|length| across + around * length);
    // Lines that meet a cell without a surface meet all of it.
    let shares = if cell.half_area > 0.0 {
        let scale = 1.0 / cell.half_area;
        half_areas.map(|area| (area * scale).min(1.0))
    } else {
        [1.0; 2]
    };
    let [lower, upper] = KdTree::split_cell(&cell.bounds, node);
    let cells = [
        Cell { bounds: lower, half_area: half_areas[0] },
        Cell { bounds: upper, half_area: half_areas[1] },
    ];
    (cells, shares)
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
        let cell = Cell { bounds, half_area: bounds.half_area() };
        let (cells, [p_lower, p_upper]) = divided(&cell, KdNode::inner(0, 1.0));
        for cell in cells {
            assert!((cell.half_area - cell.bounds.half_area()).abs() < 1e-12);
        }
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
            // An empty side never comes first.
            assert!(!combined([0.7, 0.6], [Expectation { open: 0.0, ..a }, EMPTY]).1);
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

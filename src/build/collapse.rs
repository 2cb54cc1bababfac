//! Collapses a binary tree into an eight-wide one, by dynamic programming over the surface-area
//! heuristic (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", High Performance Graphics, 2017): for each subtree and each number of
//! slots, the cheapest way to fill them with leaves and nodes.

use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, Bvh8, ChildRef, LEAF_ROWS, MAX_WIDE_LEAF, Node8, WIDTH, write_leaf};

/// Expected costs of visits, in visits of a node.
#[derive(Clone, Copy, Debug)]
pub struct WideCosts {
    /// Of a leaf, however few triangles it holds: they are tested at once.
    pub leaf: f32,
    /// More for each of its triangles.
    pub triangle: f32,
}

impl Default for WideCosts {
    fn default() -> Self {
        Self { leaf: 1.2, triangle: 0.03 }
    }
}

/// The eight-wide tree over the leaves of `tree`, or over several merged into one. `priority` gives
/// the score of a child of a binary node, by the node's index and the child's side: among the
/// children of a wide node those with larger scores come first.
///
/// # Panics
/// If a leaf holds more triangles than a wide one may: see [`split_leaves`](super::split_leaves).
pub fn collapse(tree: &Bvh2, costs: WideCosts, priority: &dyn Fn(usize, usize) -> f64) -> Bvh8 {
    let mut wide = Bvh8 {
        nodes: Vec::with_capacity(tree.nodes.len() / 4),
        root: None,
        id: Bvh8::new_id(),
        bounds: tree.bounds,
        leaves: Vec::with_capacity(tree.triangles.len() * LEAF_ROWS + WIDTH),
        triangle_ids: Vec::with_capacity(tree.triangles.len()),
    };
    if let Some(root) = tree.root {
        let plans = plans(tree, costs);
        let mut collapse = Collapse { tree, plans, priority, wide };
        let root = collapse.emit(root);
        wide = collapse.wide;
        wide.root = Some(root);
    }
    wide.leaves.resize(tree.triangles.len() * LEAF_ROWS + WIDTH, 0.0);
    wide
}

/// How a subtree fills slots at the least cost.
#[derive(Clone, Copy)]
struct Plan {
    /// `cost[i - 1]`: with `i` slots at most.
    cost: [f32; WIDTH],
    /// `to_first[i - 1]`: of `i` slots, those that the first child gets; 0 if fewer slots do.
    to_first: [u8; WIDTH],
    /// Slots of the subtree's own node for the first child, if it becomes a node; 0 for a leaf.
    node_to_first: u8,
    triangles: u32,
}

/// Plans of all inner nodes.
fn plans(tree: &Bvh2, costs: WideCosts) -> Vec<Plan> {
    let empty = Plan { cost: [0.0; WIDTH], to_first: [0; WIDTH], node_to_first: 0, triangles: 0 };
    let mut plans = vec![empty; tree.nodes.len()];
    // Areas relative to the root's, as those of large scenes overflow.
    let unit = tree.bounds.half_area().max(f64::MIN_POSITIVE);
    let area = |bounds: &Aabb| (bounds.half_area() / unit) as f32;
    let leaf_cost = |triangles: u32| costs.leaf + costs.triangle * triangles as f32;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let below: [[f32; WIDTH]; 2] = std::array::from_fn(|side| {
            let child = node.children[side];
            if child.is_leaf() {
                let cost = area(&node.bounds[side]) * leaf_cost(child.leaf_slots().len() as u32);
                [cost; WIDTH]
            } else {
                plans[child.node_index()].cost
            }
        });
        let shared = |slots: usize| {
            let ways =
                (1..slots).map(|first| (below[0][first - 1] + below[1][slots - first - 1], first));
            ways.fold((f32::INFINITY, 1), |best, way| if way.0 < best.0 { way } else { best })
        };
        let triangles = node.counts[0] + node.counts[1];
        let own_area = area(&node.bounds[0].union(node.bounds[1]));
        let (below_node, node_to_first) = shared(WIDTH);
        let as_node = own_area + below_node;
        let as_leaf = if triangles as usize <= MAX_WIDE_LEAF {
            own_area * leaf_cost(triangles)
        } else {
            f32::INFINITY
        };
        let plan = &mut plans[index];
        plan.triangles = triangles;
        // Costs that overflowed are not less than each other: a node is always possible.
        plan.node_to_first =
            if as_leaf <= as_node && as_leaf.is_finite() { 0 } else { node_to_first as u8 };
        plan.cost[0] = as_leaf.min(as_node);
        for slots in 2..=WIDTH {
            let (cost, first) =
                if slots == WIDTH { (below_node, node_to_first) } else { shared(slots) };
            let fewer = plan.cost[slots - 2];
            (plan.cost[slots - 1], plan.to_first[slots - 1]) =
                if cost < fewer { (cost, first as u8) } else { (fewer, 0) };
        }
    }
    plans
}

/// A child of a wide node to be.
#[derive(Clone, Copy)]
struct Child {
    binary: ChildRef,
    bounds: Aabb,
    score: f64,
}

struct Collapse<'a> {
    tree: &'a Bvh2,
    plans: Vec<Plan>,
    priority: &'a dyn Fn(usize, usize) -> f64,
    wide: Bvh8,
}

impl Collapse<'_> {
    /// Adds what `binary` becomes, a node with all below it or a leaf.
    fn emit(&mut self, binary: ChildRef) -> ChildRef {
        if binary.is_leaf() || self.plans[binary.node_index()].node_to_first == 0 {
            return self.emit_leaf(binary);
        }
        let mut children = Vec::with_capacity(WIDTH);
        let first = self.plans[binary.node_index()].node_to_first;
        self.share(binary.node_index(), first.into(), WIDTH, &mut children);
        // A stable sort: ties stay as the binary tree has them.
        children.sort_by(|a, b| b.score.total_cmp(&a.score));
        let index = self.wide.nodes.len();
        let placed: Vec<_> = children.iter().map(|c| (ChildRef::UNUSED, c.bounds)).collect();
        self.wide.nodes.push(Node8::new(&placed));
        for (slot, child) in children.iter().enumerate() {
            self.wide.nodes[index].children[slot] = self.emit(child.binary);
        }
        ChildRef::inner(index)
    }

    /// Fills slots with the two children of a binary node, `first` of them with the first one.
    fn share(&self, node: usize, first: usize, slots: usize, children: &mut Vec<Child>) {
        let binary = &self.tree.nodes[node];
        for (side, slots) in [first, slots - first].into_iter().enumerate() {
            let child = binary.children[side];
            match self.slots_to_share(child, slots) {
                Some((first, slots)) => self.share(child.node_index(), first, slots, children),
                None => children.push(Child {
                    binary: child,
                    bounds: binary.bounds[side],
                    score: (self.priority)(node, side),
                }),
            }
        }
    }

    /// How a child that has `slots` shares them among its own children; `None` if it takes one.
    fn slots_to_share(&self, child: ChildRef, slots: usize) -> Option<(usize, usize)> {
        if child.is_leaf() {
            return None;
        }
        let plan = &self.plans[child.node_index()];
        (2..=slots).rev().find_map(|slots| {
            let first = usize::from(plan.to_first[slots - 1]);
            (first > 0).then_some((first, slots))
        })
    }

    fn emit_leaf(&mut self, binary: ChildRef) -> ChildRef {
        let first = self.wide.triangle_ids.len();
        let mut slots = Vec::with_capacity(MAX_WIDE_LEAF);
        self.slots_below(binary, &mut slots);
        assert!(slots.len() <= MAX_WIDE_LEAF, "{} triangles in a leaf", slots.len());
        self.wide.triangle_ids.extend(slots.iter().map(|&slot| self.tree.triangle_ids[slot]));
        let mut triangles = [Triangle::default(); MAX_WIDE_LEAF];
        for (triangle, &slot) in triangles.iter_mut().zip(&slots) {
            *triangle = self.tree.triangles[slot];
        }
        self.wide.leaves.resize((first + slots.len()) * LEAF_ROWS, 0.0);
        let block = &mut self.wide.leaves[first * LEAF_ROWS..];
        write_leaf(block, &triangles[..slots.len()]);
        ChildRef::leaf(first, slots.len())
    }

    fn slots_below(&self, binary: ChildRef, slots: &mut Vec<usize>) {
        if binary.is_leaf() {
            slots.extend(binary.leaf_slots());
        } else {
            let children = self.tree.nodes[binary.node_index()].children;
            children.into_iter().for_each(|child| self.slots_below(child, slots));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{find, split_leaves};
    use crate::test_random::Random;

    #[test]
    fn trees_of_every_small_size_are_valid() {
        for count in 0..70 {
            let mesh = Random::new(count as u64).mesh(count);
            let binary = split_leaves(&(find("binned").unwrap().build)(&mesh));
            binary.validate(&mesh).unwrap();
            assert!(binary.triangles.is_empty() || binary.leaf_count() == count);
            for triangle in [0.0, 0.1, 10.0] {
                let costs = WideCosts { triangle, ..WideCosts::default() };
                collapse(&binary, costs, &|_, _| 0.0).validate(&mesh).unwrap();
            }
        }
    }

    #[test]
    fn costs_decide_on_leaves_and_scores_on_the_order() {
        let mesh = Random::new(9).mesh(5000);
        let binary = split_leaves(&(find("binned").unwrap().build)(&mesh));
        let area = |node: usize, side: usize| binary.nodes[node].bounds[side].half_area();
        let of = |triangle| collapse(&binary, WideCosts { leaf: 1.0, triangle }, &area);
        let (cheap, dear) = (of(0.0), of(1e3));
        assert!(cheap.leaf_count() < 2000, "{} leaves", cheap.leaf_count());
        // All but those without area, which cost nothing.
        assert!(dear.leaf_count() > 4800, "{} leaves", dear.leaf_count());
        for node in &cheap.nodes {
            let areas: Vec<_> =
                (0..node.len as usize).map(|s| node.bounds(s).half_area()).collect();
            assert!(areas.is_sorted_by(|a, b| a >= b), "{areas:?}");
        }
        let children: u32 = dear.nodes.iter().map(|node| node.len).sum();
        let filled = f64::from(children) / (8.0 * dear.nodes.len() as f64);
        assert!(filled > 0.5, "{filled} of the slots are filled");
    }

    #[test]
    fn the_validator_sees_what_is_wrong() {
        let mesh = Random::new(10).mesh(300);
        let binary = split_leaves(&(find("binned").unwrap().build)(&mesh));
        let good = collapse(&binary, WideCosts::default(), &|_, _| 0.0);
        let broken = |change: fn(&mut Bvh8)| {
            let mut tree = good.clone();
            change(&mut tree);
            tree.validate(&mesh).unwrap_err()
        };
        assert!(broken(|t| t.nodes[0].planes[1][0][0] -= 1.0).contains("box"));
        assert!(broken(|t| t.nodes[0].children.swap(0, 1)).contains("box"));
        assert!(broken(|t| t.triangle_ids.swap(0, 299)).contains("corners"));
        assert!(broken(|t| t.nodes[0].len -= 1).contains("children"));
        assert!(broken(|t| t.leaves.truncate(100)).contains("numbers"));
    }
}

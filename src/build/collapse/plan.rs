//! The dynamic program: how each subtree of a binary tree fills slots of a wide node at the least
//! cost.

use super::WideCosts;
use crate::geometry::Aabb;
use crate::tree::{Bvh2, ChildRef, MAX_WIDE_LEAF, Node2, Pieces, WIDTH};
use rayon::prelude::*;
use std::collections::HashMap;

/// How a subtree fills slots at the least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::build) struct Plan {
    /// Of `i` slots, two at least, `to_first[i - 1]` are those that the first child gets; 0 if fewer
    /// slots do. `to_first[0]`: of the slots of the subtree's own node, those for the first child, if
    /// it becomes a node in its one slot; 0 for a leaf.
    to_first: [u8; WIDTH],
}

impl Plan {
    /// Slots of the subtree's own node for the first child; `None` if it becomes a leaf.
    pub(in crate::build) fn as_node(&self) -> Option<usize> {
        (self.to_first[0] > 0).then_some(self.to_first[0].into())
    }

    /// How the subtree shares `slots` of its parent's among its children, the first one's and all
    /// that it uses; `None` if it takes one.
    pub(in crate::build) fn shared(&self, slots: usize) -> Option<(usize, usize)> {
        (2..=slots).rev().find_map(|slots| {
            let first = usize::from(self.to_first[slots - 1]);
            (first > 0).then_some((first, slots))
        })
    }
}

/// `cost[i - 1]`: with `i` slots at most, relative to the area of the root's box.
pub(in crate::build) type Cost = [f32; WIDTH];

/// What a child of a binary node costs by its number of slots, and the most that it can use.
#[derive(Clone, Copy)]
pub(in crate::build) struct Slots {
    costs: Cost,
    most: usize,
}

/// Plans of all inner nodes.
pub(super) fn plans(tree: &Bvh2, costs: WideCosts) -> Vec<Plan> {
    let mut plans = vec![Plan::default(); tree.nodes.len()];
    let program = Program::new(costs, &tree.bounds);
    let leaf = |leaf: ChildRef, bounds: &Aabb| program.leaf(leaf, bounds);
    let pieces = Pieces::of(tree);
    let parts = pieces.split(&mut plans).into_par_iter().zip(&pieces.subtrees);
    let of_root = |(plans, nodes): (&mut [Plan], &std::ops::Range<usize>)| {
        let first = nodes.start;
        let mut below = vec![Cost::default(); nodes.len()];
        for index in nodes.clone().rev() {
            let cost = |child: usize| below[child - first];
            (plans[index - first], below[index - first]) =
                program.plan(&tree.nodes[index], leaf, cost);
        }
        (first, below[0])
    };
    let mut of_roots: HashMap<usize, Cost> = parts.map(of_root).collect();
    for &index in pieces.top.iter().rev() {
        let (plan, cost) = program.plan(&tree.nodes[index], leaf, |child| of_roots[&child]);
        plans[index] = plan;
        of_roots.insert(index, cost);
    }
    plans
}

/// Of a subtree over so many triangles, in the node above it, which has another child.
#[inline(always)]
fn most_slots(counts: &[u32]) -> usize {
    (counts.iter().sum::<u32>() as usize).min(WIDTH - 1)
}

/// What lengths are multiplied by: areas of large scenes overflow, and those of small ones vanish.
fn unit(bounds: &Aabb) -> f32 {
    let size = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    (1.0 / size.max_element().max(f64::MIN_POSITIVE)).min(f64::from(f32::MAX)) as f32
}

/// The dynamic program of trees within some bounds.
pub(in crate::build) struct Program {
    costs: WideCosts,
    unit: f32,
}

impl Program {
    pub(in crate::build) fn new(costs: WideCosts, bounds: &Aabb) -> Self {
        Self { costs, unit: unit(bounds) }
    }

    #[inline(always)]
    fn area(&self, bounds: &Aabb) -> f32 {
        let d = bounds.max * self.unit - bounds.min * self.unit;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// A leaf, in its one slot.
    #[inline(always)]
    pub(in crate::build) fn leaf(&self, leaf: ChildRef, bounds: &Aabb) -> Slots {
        let cost = self.area(bounds) * self.costs.leaf(leaf.leaf_slots().len());
        Slots { costs: [cost; WIDTH], most: 1 }
    }

    /// The plans of the nodes of a tree, and its root as a child of another, on one thread. `leaf` has
    /// its leaves, and `below` is memory to use.
    pub(in crate::build) fn plan_all(
        &self,
        tree: &Bvh2,
        leaf: impl Fn(ChildRef, &Aabb) -> Slots,
        below: &mut Vec<Cost>,
    ) -> (Vec<Plan>, Slots) {
        let nodes = &tree.nodes;
        let mut plans = vec![Plan::default(); nodes.len()];
        below.resize(nodes.len(), Cost::default());
        for (index, node) in nodes.iter().enumerate().rev() {
            (plans[index], below[index]) = self.plan(node, &leaf, |child| below[child]);
        }
        let root = tree.root.expect("there are triangles");
        let root = if root.is_leaf() {
            leaf(root, &tree.bounds)
        } else {
            Slots { costs: below[0], most: most_slots(&nodes[0].counts) }
        };
        (plans, root)
    }

    /// The plan of a node, and its cost, from its children's.
    #[inline(always)]
    fn plan(
        &self,
        node: &Node2,
        leaf: impl Fn(ChildRef, &Aabb) -> Slots,
        cost: impl Fn(usize) -> Cost,
    ) -> (Plan, Cost) {
        // Each child, and the most slots that it can use.
        let child = |side: usize| {
            let child = node.children[side];
            if child.is_leaf() {
                leaf(child, &node.bounds[side])
            } else {
                Slots {
                    costs: cost(child.node_index()),
                    most: most_slots(&node.counts[side..=side]),
                }
            }
        };
        let Slots { costs: lower, most: lower_most } = child(0);
        let Slots { costs: upper, most: upper_most } = child(1);
        let most = (lower_most + upper_most).min(WIDTH);
        let mut plan = Plan::default();
        let mut costs = [0.0; WIDTH];
        let mut shared = (f32::INFINITY, 1);
        for slots in 2..=most {
            shared = (f32::INFINITY, 1);
            for first in slots.saturating_sub(upper_most).max(1)..=lower_most.min(slots - 1) {
                let cost = lower[first - 1] + upper[slots - first - 1];
                shared = if cost < shared.0 { (cost, first) } else { shared };
            }
            costs[slots - 1] = shared.0;
            plan.to_first[slots - 1] = shared.1 as u8;
        }
        // With all slots that it can use.
        let (below_node, node_to_first) = shared;
        let own_area = self.area(&node.bounds[0].union(node.bounds[1]));
        let as_node = own_area + below_node;
        let triangles = (node.counts[0] + node.counts[1]) as usize;
        let as_leaf = own_area * self.costs.leaf(triangles);
        // Costs that overflowed are not less than each other: a node is always possible.
        let is_leaf = triangles <= MAX_WIDE_LEAF && as_leaf <= as_node && as_leaf.is_finite();
        plan.to_first[0] = if is_leaf { 0 } else { node_to_first as u8 };
        costs[0] = if is_leaf { as_leaf } else { as_node };
        for slots in 2..=WIDTH {
            let fewer = costs[slots - 2];
            if slots > most || costs[slots - 1] >= fewer {
                costs[slots - 1] = fewer;
                plan.to_first[slots - 1] = 0;
            }
        }
        (plan, costs)
    }
}

//! The dynamic program: how each subtree of a binary tree fills slots of a wide node at the least
//! cost.

use super::WideCosts;
use crate::geometry::Aabb;
use crate::tree::{Bvh2, MAX_WIDE_LEAF, Node2, Pieces, WIDTH};
use rayon::prelude::*;
use std::collections::HashMap;

/// How a subtree fills slots at the least cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plan {
    /// Of `i` slots, two at least, `to_first[i - 1]` are those that the first child gets; 0 if fewer
    /// slots do. `to_first[0]`: of the slots of the subtree's own node, those for the first child, if
    /// it becomes a node in its one slot; 0 for a leaf.
    to_first: [u8; WIDTH],
}

impl Plan {
    /// Slots of the subtree's own node for the first child; `None` if it becomes a leaf.
    pub(super) fn as_node(&self) -> Option<usize> {
        (self.to_first[0] > 0).then_some(self.to_first[0].into())
    }

    /// How the subtree shares `slots` of its parent's among its children, the first one's and all
    /// that it uses; `None` if it takes one.
    pub(super) fn shared(&self, slots: usize) -> Option<(usize, usize)> {
        (2..=slots).rev().find_map(|slots| {
            let first = usize::from(self.to_first[slots - 1]);
            (first > 0).then_some((first, slots))
        })
    }
}

/// `cost[i - 1]`: with `i` slots at most, relative to the area of the root's box.
type Cost = [f32; WIDTH];

/// Plans of all inner nodes.
pub(super) fn plans(tree: &Bvh2, costs: WideCosts) -> Vec<Plan> {
    let mut plans = vec![Plan::default(); tree.nodes.len()];
    let program = Program { costs, unit: unit(&tree.bounds) };
    let pieces = Pieces::of(tree);
    let parts = pieces.split(&mut plans).into_par_iter().zip(&pieces.subtrees);
    let of_root = |(plans, nodes): (&mut [Plan], &std::ops::Range<usize>)| {
        let first = nodes.start;
        let mut below = vec![Cost::default(); nodes.len()];
        for index in nodes.clone().rev() {
            let cost = |child: usize| below[child - first];
            (plans[index - first], below[index - first]) = program.plan(&tree.nodes[index], cost);
        }
        (first, below[0])
    };
    let mut of_roots: HashMap<usize, Cost> = parts.map(of_root).collect();
    for &index in pieces.top.iter().rev() {
        let (plan, cost) = program.plan(&tree.nodes[index], |child| of_roots[&child]);
        plans[index] = plan;
        of_roots.insert(index, cost);
    }
    plans
}

/// What lengths are multiplied by: areas of large scenes overflow, and those of small ones vanish.
fn unit(bounds: &Aabb) -> f32 {
    let size = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    (1.0 / size.max_element().max(f64::MIN_POSITIVE)).min(f64::from(f32::MAX)) as f32
}

struct Program {
    costs: WideCosts,
    unit: f32,
}

impl Program {
    #[inline(always)]
    fn area(&self, bounds: &Aabb) -> f32 {
        let d = bounds.max * self.unit - bounds.min * self.unit;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The plan of a node, and its cost, from its children's.
    #[inline(always)]
    fn plan(&self, node: &Node2, cost: impl Fn(usize) -> Cost) -> (Plan, Cost) {
        // Each child, and the most slots that it can use.
        let child = |side: usize| {
            let child = node.children[side];
            if child.is_leaf() {
                let area = self.area(&node.bounds[side]);
                ([area * self.costs.leaf(child.leaf_slots().len()); WIDTH], 1)
            } else {
                (cost(child.node_index()), (node.counts[side] as usize).min(WIDTH - 1))
            }
        };
        let ((lower, lower_most), (upper, upper_most)) = (child(0), child(1));
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

//! Keeping a plan right while its tree changes.
//!
//! A bit speaks of two children by their sides, so it is wrong as soon as others take their places,
//! and nothing in the tree says so: whoever exchanges children has to list the node. NodeSATO asks
//! no more than the nodes listed ("SATO: Surface-Area Traversal Order for Shadow Ray Tracing", Nah
//! and Manocha, Computer Graphics Forum 33(6), 2014); orders that sum up what lies below ask for all
//! nodes above them too.

use super::super::{SECOND, Upkeep};
use super::BinaryFollower;
use crate::order::{DependsOn, KeptOrder, OrderContext, OrderEntry};
use crate::tree::{Bvh2, Node2, NodeBits, Plan};

/// Keeps the plan of an order right.
#[derive(Debug)]
pub(crate) struct PlanUpkeep {
    order: &'static OrderEntry,
    upkeep: Upkeep,
    kept: Option<Box<dyn KeptOrder>>,
}

impl PlanUpkeep {
    /// Of an order.
    ///
    /// # Errors
    /// If the order cannot be kept up in that way.
    pub(crate) fn new(order: &'static OrderEntry, upkeep: Upkeep) -> Result<Self, String> {
        let kept = match order.depends_on {
            DependsOn::AllBelow(keep) if upkeep != Upkeep::None => Some(keep()),
            DependsOn::Everything if upkeep == Upkeep::Selective => {
                return Err(format!(
                    "order={} cannot be kept up in parts of a moving tree: it learns from recorded \
                     rays; give it upkeep=full or upkeep=none",
                    order.name
                ));
            }
            _ => None,
        };
        Ok(Self { order, upkeep, kept })
    }

    /// Whether the nodes above those touched are needed.
    pub(crate) fn needs_ancestors(&self) -> bool {
        self.kept.is_some() && self.upkeep == Upkeep::Selective
    }

    /// What is asked of nodes as soon as their children were exchanged.
    pub(crate) fn asks_of_exchanged(&self) -> Option<fn(&Node2) -> bool> {
        match (self.order.depends_on, self.upkeep) {
            (DependsOn::Children(second), Upkeep::Selective) => Some(second),
            _ => None,
        }
    }

    /// The plan of a tree that has just been built.
    pub(crate) fn plan(
        &mut self,
        tree: &Bvh2,
        follower: &BinaryFollower,
        context: &OrderContext<'_>,
    ) -> Plan {
        match &mut self.kept {
            Some(kept) => Plan::Fixed(kept.find_all(tree, &follower.pieces)),
            None => (self.order.plan_bvh2)(tree, context),
        }
    }

    /// Brings the plan up to date after an update, and returns the number of nodes looked at. A tree
    /// may be laid out anew for orders that need it.
    pub(crate) fn update(
        &mut self,
        tree: &mut Bvh2,
        follower: &mut BinaryFollower,
        plan: &mut Plan,
        context: &OrderContext<'_>,
    ) -> u64 {
        let all = tree.nodes.len() as u64;
        match (self.order.depends_on, self.upkeep) {
            (DependsOn::Nothing, _) | (_, Upkeep::None) => return 0,
            (DependsOn::Children(_), Upkeep::Selective) => {
                let Plan::Fixed(bits) = plan else { return 0 };
                return set_some(follower, bits);
            }
            (DependsOn::Children(second), Upkeep::Full) => {
                let nodes = &tree.nodes;
                *plan = Plan::Fixed(NodeBits::from_fn(nodes.len(), |index| second(&nodes[index])));
            }
            (DependsOn::AllBelow(_), upkeep) => {
                let (Some(kept), Plan::Fixed(bits)) = (&mut self.kept, &mut *plan) else {
                    return 0;
                };
                if upkeep == Upkeep::Full {
                    *bits = kept.find_all(tree, &follower.pieces);
                    return all;
                }
                let lists: Vec<&[u32]> =
                    follower.touched.iter().map(|touched| touched.disturbed.as_slice()).collect();
                let (top, subtrees) = lists.split_last().expect("one for the top");
                kept.find_some(tree, &follower.pieces, subtrees, top, bits);
                return lists.iter().map(|list| list.len() as u64).sum();
            }
            (DependsOn::Everything, _) => {
                *tree = tree.in_depth_first_order().0;
                *follower = BinaryFollower::of(tree, false);
                *plan = (self.order.plan_bvh2)(tree, context);
            }
        }
        all
    }

    /// Share of the nodes of which a plan says something else than one made from scratch would.
    pub(crate) fn stale_share(&self, tree: &Bvh2, plan: &Plan, context: &OrderContext<'_>) -> f64 {
        if matches!(self.order.depends_on, DependsOn::Nothing) || tree.nodes.is_empty() {
            return 0.0;
        }
        let (laid_out, places) = tree.in_depth_first_order();
        let scratch = (self.order.plan_bvh2)(&laid_out, context);
        let (Plan::Fixed(bits), Plan::Fixed(scratch)) = (plan, &scratch) else { return 0.0 };
        let differs = |(new, old): (usize, &u32)| bits.get(*old as usize) != scratch.get(new);
        let stale = places.iter().enumerate().filter(|&entry| differs(entry)).count();
        stale as f64 / places.len() as f64
    }

    /// Bytes of what is kept.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.kept.as_ref().map_or(0, |kept| kept.memory_bytes())
    }
}

/// Sets the bits of the nodes touched to what was found when they were, and returns their number.
fn set_some(follower: &BinaryFollower, bits: &mut NodeBits) -> u64 {
    let mut count = 0;
    for entry in follower.touched.iter().flat_map(|touched| &touched.exchanged) {
        bits.set((entry & !SECOND) as usize, entry & SECOND != 0);
        count += 1;
    }
    count
}

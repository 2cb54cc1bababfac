//! The order of children of eight-wide nodes, kept right while their tree changes.
//!
//! It is where the children are, so those that take each other's places take each other's turns until
//! they are sorted again. Where boxes give the scores, these are those of the boxes now. Other scores
//! are those that subtrees were built with: each takes its own along, and those whose insides were
//! exchanged keep theirs, so sorting again everywhere finds no more than sorting where children were
//! exchanged does.

use super::super::Upkeep;
use super::{Touched, WideFollower, slots_in, split_if_any};
use crate::build::WideScores;
use crate::geometry::Aabb;
use crate::tree::{Bvh8, Node8, WIDTH};
use rayon::prelude::*;

/// Nodes that are worth another thread.
const PARALLEL_NODES: u64 = 2048;

/// What children are sorted by, and when.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranking {
    /// The score of a box; `None` where scores are kept.
    pub(crate) box_score: Option<fn(&Aabb) -> f64>,
    pub(crate) upkeep: Upkeep,
}

impl Ranking {
    /// Sorts children after an update, and returns the number of nodes looked at.
    pub(crate) fn update(&self, tree: &mut Bvh8, follower: &mut WideFollower) -> u64 {
        let exchanged = |touched: &Touched| touched.exchanged.len() as u64;
        let count = match self.upkeep {
            Upkeep::None => return 0,
            Upkeep::Selective => follower.touched.iter().map(exchanged).sum(),
            Upkeep::Full => tree.nodes.len() as u64,
        };
        let WideFollower { pieces, scores, touched, .. } = follower;
        let (of_top, of_subtrees) = touched.split_last().expect("one for the top");
        let is_full = self.upkeep == Upkeep::Full;
        if is_full || count >= PARALLEL_NODES {
            let parts = pieces.split(&mut tree.nodes).into_par_iter();
            let parts = parts.zip(split_if_any(pieces, scores)).zip(of_subtrees);
            parts.zip(&pieces.subtrees).for_each(|(((nodes, scores), touched), subtree)| {
                if is_full {
                    (0..nodes.len()).for_each(|place| self.sort_at(nodes, scores, place));
                } else {
                    let first = subtree.start;
                    let places = touched.exchanged.iter().map(|&index| index as usize - first);
                    places.for_each(|place| self.sort_at(nodes, scores, place));
                }
            });
        } else {
            let all = of_subtrees.iter().flat_map(|touched| &touched.exchanged);
            all.for_each(|&index| self.sort_at(&mut tree.nodes, scores, index as usize));
        }
        if is_full {
            pieces.top.iter().for_each(|&index| self.sort_at(&mut tree.nodes, scores, index));
        } else {
            let top = of_top.exchanged.iter();
            top.for_each(|&index| self.sort_at(&mut tree.nodes, scores, index as usize));
        }
        count
    }

    /// Share of the nodes whose children would be in another order if they were sorted anew; `None`
    /// where scores are kept, as there is no way to find them again.
    pub(crate) fn stale_share(&self, tree: &Bvh8) -> Option<f64> {
        let score = self.box_score?;
        let is_stale = |node: &&Node8| {
            let scores = slots_in(node).map(|slot| score(&node.bounds(slot)));
            !scores.is_sorted_by(|a, b| a >= b)
        };
        let stale = tree.nodes.iter().filter(is_stale).count();
        Some(stale as f64 / tree.nodes.len().max(1) as f64)
    }

    fn sort_at(&self, nodes: &mut [Node8], scores: &mut [WideScores], place: usize) {
        let node = &mut nodes[place];
        let mut keys = [f64::NEG_INFINITY; WIDTH];
        for (slot, key) in keys.iter_mut().enumerate().take(node.len as usize) {
            *key = match self.box_score {
                Some(score) => score(&node.bounds(slot)),
                None => f64::from(scores[place][slot]),
            };
        }
        let mut order: [usize; WIDTH] = std::array::from_fn(|slot| slot);
        // Stable, and empty slots stay last.
        let len = node.len as usize;
        order[..len].sort_by(|&a, &b| keys[b].total_cmp(&keys[a]));
        if order.is_sorted() {
            return;
        }
        let from = *node;
        node.children = order.map(|slot| from.children[slot]);
        for (to, from) in node.planes.iter_mut().zip(&from.planes) {
            *to = from.map(|planes| order.map(|slot| planes[slot]));
        }
        if let Some(scores) = scores.get_mut(place) {
            *scores = order.map(|slot| scores[slot]);
        }
    }
}

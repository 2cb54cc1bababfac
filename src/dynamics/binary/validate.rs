//! What a follower relies on, checked.

use super::{BinaryFollower, Updated};
use crate::geometry::TriangleMesh;
use crate::tree::{Bvh2, downwards};

impl BinaryFollower {
    /// Checks a tree after an update: the tree itself; that subtrees hold their own nodes and slots
    /// only; heights; the cost.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub(crate) fn validate(
        &self,
        tree: &Bvh2,
        mesh: &TriangleMesh,
        updated: &Updated,
    ) -> Result<(), String> {
        tree.validate_moved(mesh)?;
        let mut steps = Vec::new();
        let mut seen = self.pieces.downwards(&tree.nodes).0.len();
        for (nodes, slots) in self.pieces.subtrees.iter().zip(&self.slots) {
            for index in nodes.clone() {
                for child in tree.nodes[index].children {
                    let is_own = if child.is_leaf() {
                        let leaf = child.leaf_slots();
                        slots.start <= leaf.start && leaf.end <= slots.end
                    } else {
                        nodes.contains(&child.node_index())
                    };
                    if !is_own {
                        return Err(format!("node {index}: a child of another subtree"));
                    }
                }
            }
            downwards(&tree.nodes[nodes.clone()], nodes.start, 0, &mut steps);
            seen += steps.len();
        }
        if seen != tree.nodes.len() {
            return Err(format!("{seen} of {} nodes are in pieces", tree.nodes.len()));
        }
        let (laid_out, places) = tree.in_depth_first_order();
        for (height, &index) in crate::tree::heights_of(&laid_out.nodes).iter().zip(&places) {
            if self.heights[index as usize] != *height {
                return Err(format!("node {index}: height {height} is kept otherwise"));
            }
        }
        let cost = tree.sah_cost();
        let is_equal = (cost - updated.sah_cost).abs() <= 1e-9 * cost;
        if is_equal { Ok(()) } else { Err(format!("cost {cost}, not {}", updated.sah_cost)) }
    }
}

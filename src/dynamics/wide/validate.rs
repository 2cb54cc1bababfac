//! What a follower relies on, checked.

use super::super::Updated;
use super::{WideFollower, slots_in};
use crate::geometry::TriangleMesh;
use crate::tree::{Bvh8, ChildRef};

impl WideFollower {
    /// Checks a tree after an update: the tree itself; that subtrees hold their own nodes and slots
    /// only; heights; the cost.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub(super) fn validate(
        &self,
        tree: &Bvh8,
        mesh: &TriangleMesh,
        updated: &Updated,
    ) -> Result<(), String> {
        tree.validate_moved(mesh)?;
        for (nodes, slots) in self.pieces.subtrees.iter().zip(&self.slots) {
            for index in nodes.clone() {
                let node = &tree.nodes[index];
                for child in &node.children[slots_in(node)] {
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
        }
        if let Some(root) = tree.root {
            self.validate_height(tree, root)?;
        }
        let cost = self.costs.sah_cost(tree);
        let is_equal = (cost - updated.sah_cost).abs() <= 1e-9 * cost;
        if is_equal { Ok(()) } else { Err(format!("cost {cost}, not {}", updated.sah_cost)) }
    }

    fn validate_height(&self, tree: &Bvh8, child: ChildRef) -> Result<u8, String> {
        if child.is_leaf() {
            return Ok(0);
        }
        let (index, mut height) = (child.node_index(), 0);
        let node = &tree.nodes[index];
        for child in &node.children[slots_in(node)] {
            height = height.max(self.validate_height(tree, *child)?);
        }
        if self.heights[index] == height + 1 {
            Ok(height + 1)
        } else {
            Err(format!("node {index}: height {} is kept otherwise", height + 1))
        }
    }
}

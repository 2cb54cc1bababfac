//! What the kernels rely on, checked.

use super::{Bvh8, LEAF_ROWS, MAX_WIDE_DEPTH, MAX_WIDE_LEAF, WIDTH, write_leaf};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::ChildRef;

struct State {
    /// For each node whether it was reached.
    reached: Vec<bool>,
    /// For each slot whether it is in a leaf.
    seen: Vec<bool>,
    /// For each triangle likewise.
    held: Vec<bool>,
    has_moved: bool,
}

impl Bvh8 {
    /// Checks everything that traversal relies on: every triangle of `mesh` in one leaf, with its
    /// corners; boxes that are exactly those of what lies below; depth; node order; padding.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub fn validate(&self, mesh: &TriangleMesh) -> Result<(), String> {
        self.validate_as(mesh, false)
    }

    /// As [`validate`](Self::validate), of a tree whose triangles have moved since it was built: nodes
    /// may lie in any order, and triangles that the builder had cut in several leaves.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub fn validate_moved(&self, mesh: &TriangleMesh) -> Result<(), String> {
        self.validate_as(mesh, true)
    }

    fn validate_as(&self, mesh: &TriangleMesh, has_moved: bool) -> Result<(), String> {
        if !has_moved && self.triangle_ids.len() != mesh.len() {
            return Err(format!("{} of {} triangles", self.triangle_ids.len(), mesh.len()));
        }
        if self.leaves.len() != self.triangle_ids.len() * LEAF_ROWS + WIDTH {
            return Err(format!("{} numbers in leaves", self.leaves.len()));
        }
        let (seen, held) = (vec![false; self.triangle_ids.len()], vec![false; mesh.len()]);
        let Some(root) = self.root else {
            return if mesh.is_empty() { Ok(()) } else { Err("no root".into()) };
        };
        let reached = vec![false; self.nodes.len()];
        let mut state = State { reached, seen, held, has_moved };
        let bounds = self.validate_child(root, 0, mesh, &mut state)?;
        if bounds != self.bounds {
            return Err("the root's box is another".into());
        }
        if let Some(index) = state.reached.iter().position(|reached| !reached) {
            return Err(format!("node {index} is not reached"));
        }
        if let Some(slot) = state.seen.iter().position(|seen| !seen) {
            return Err(format!("slot {slot} is in no leaf"));
        }
        match state.held.iter().position(|held| !held) {
            Some(id) => Err(format!("triangle {id} is in no leaf")),
            None => Ok(()),
        }
    }

    fn validate_child(
        &self,
        child: ChildRef,
        depth: usize,
        mesh: &TriangleMesh,
        state: &mut State,
    ) -> Result<Aabb, String> {
        if child.is_leaf() {
            let slots = child.leaf_slots();
            if slots.len() > MAX_WIDE_LEAF {
                return Err(format!("leaf {slots:?} is too large"));
            }
            let mut bounds = Aabb::EMPTY;
            let mut triangles = Vec::with_capacity(slots.len());
            for slot in slots.clone() {
                if state.seen.get(slot).is_none_or(|&seen| seen) {
                    return Err(format!("leaf {slots:?}: slot {slot} is out of range or shared"));
                }
                state.seen[slot] = true;
                let id = self.triangle_ids[slot] as usize;
                if state.held.get(id).is_none_or(|&held| held && !state.has_moved) {
                    return Err(format!("leaf {slots:?}: triangle {id} is none or shared"));
                }
                state.held[id] = true;
                triangles.push(mesh.triangle(id));
                bounds = bounds.union(mesh.triangle(id).bounds());
            }
            let mut expected = vec![0.0; slots.len() * LEAF_ROWS];
            write_leaf(&mut expected, &triangles);
            let block = self.leaves.get(slots.start * LEAF_ROWS..slots.end * LEAF_ROWS);
            if block.is_none_or(|block| *block != *expected) {
                return Err(format!("leaf {slots:?} has other corners than its triangles"));
            }
            return Ok(bounds);
        }
        let index = child.node_index();
        if depth >= MAX_WIDE_DEPTH {
            return Err(format!("node {index} is too deep"));
        }
        let node = self.nodes.get(index).ok_or_else(|| format!("no node {index}"))?;
        if std::mem::replace(&mut state.reached[index], true) {
            return Err(format!("node {index} is reached twice"));
        }
        let len = node.len as usize;
        if !(2..=WIDTH).contains(&len) {
            return Err(format!("node {index} has {len} children"));
        }
        let mut all = Aabb::EMPTY;
        for slot in 0..len {
            let child = node.children[slot];
            if !state.has_moved && !child.is_leaf() && child.node_index() <= index {
                return Err(format!("node {index}: a child before its parent"));
            }
            let bounds = self.validate_child(child, depth + 1, mesh, state)?;
            if bounds != node.bounds(slot) {
                return Err(format!("node {index}: child {slot} has another box"));
            }
            all = all.union(bounds);
        }
        if node.children[len..].iter().any(|child| *child != ChildRef::UNUSED) {
            return Err(format!("node {index}: children beyond the last"));
        }
        Ok(all)
    }
}

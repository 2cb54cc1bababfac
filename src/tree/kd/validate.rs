//! What the kernels rely on, checked.

use super::{KD_MAX_DEPTH, KdTree};
use crate::geometry::{Aabb, TriangleMesh};

impl KdTree {
    /// Checks everything that traversal relies on: every triangle of `mesh` once, with its corners;
    /// nodes in depth-first order, each reached once; planes within their cells; lists without
    /// repeats, of triangles whose boxes meet the leaf's cell; every triangle in some leaf, and
    /// with boxes alone on both sides of every plane that goes through it; counts; depth.
    ///
    /// # Errors
    /// What is wrong, naming the node.
    pub fn validate(&self, mesh: &TriangleMesh) -> Result<(), String> {
        self.validate_triangles(mesh)?;
        let mut state = State { next: 0, listed: vec![usize::MAX; mesh.len()], lists: Vec::new() };
        if mesh.is_empty() != self.nodes.is_empty()
            || self.counts.len() != self.nodes.len()
            || self.notes.len() != self.nodes.len()
        {
            return Err(format!("{} nodes, {} counts", self.nodes.len(), self.counts.len()));
        }
        if !mesh.is_empty() {
            let list = self.validate_node(0, &self.bounds, 0, &mut state)?;
            if list.len() != mesh.len() {
                return Err(format!("{} of {} triangles are listed", list.len(), mesh.len()));
            }
        }
        if state.next != self.nodes.len() {
            return Err(format!("{} of {} nodes are reached", state.next, self.nodes.len()));
        }
        if self.references.len() != state.lists.iter().sum::<usize>() {
            return Err(format!("{} references, but not all in leaves", self.references.len()));
        }
        Ok(())
    }

    fn validate_triangles(&self, mesh: &TriangleMesh) -> Result<(), String> {
        if self.triangles.len() != mesh.len() || self.triangle_ids.len() != mesh.len() {
            return Err(format!("{} of {} triangles", self.triangles.len(), mesh.len()));
        }
        let mut seen = vec![false; mesh.len()];
        for (slot, &id) in self.triangle_ids.iter().enumerate() {
            let first_time = seen.get_mut(id as usize).is_some_and(|s| !std::mem::replace(s, true));
            if !first_time || mesh.triangle(id as usize) != self.triangles[slot] {
                return Err(format!("slot {slot} holds triangle {id} wrongly or twice"));
            }
        }
        if self.bounds != mesh.bounds() {
            return Err(format!("bounds are {:?}", self.bounds));
        }
        Ok(())
    }

    /// The sorted list of the triangles below a node.
    fn validate_node(
        &self,
        index: usize,
        cell: &Aabb,
        depth: usize,
        state: &mut State,
    ) -> Result<Vec<u32>, String> {
        if index != state.next {
            return Err(format!("node {index} is not in depth-first order"));
        }
        state.next += 1;
        let node = self.nodes.get(index).ok_or_else(|| format!("no node {index}"))?;
        let list = if node.is_leaf() {
            self.validate_leaf(index, cell, state)?
        } else {
            let (axis, split) = (node.axis(), node.split());
            if depth >= KD_MAX_DEPTH {
                return Err(format!("node {index} is too deep"));
            }
            let size = cell.max[axis].max(split) - cell.min[axis].min(split);
            if !(cell.min[axis] <= split && split <= cell.max[axis] && size > 0.0) {
                return Err(format!("node {index} splits {cell:?} at {split} on axis {axis}"));
            }
            let length = |lo: f32, hi: f32| f64::from(hi) - f64::from(lo);
            let larger = length(split, cell.max[axis]) > length(cell.min[axis], split);
            let [lower, upper] = self.children(index).map(|c| c.map(|c| self.counts.get(c)));
            let expected = [larger && node.has_two(), node.has_two() && upper < lower];
            let notes = [&self.notes.second_larger, &self.notes.second_fewer];
            if notes.map(|note| note.get(index)) != expected {
                return Err(format!("node {index}: wrong notes of its sides"));
            }
            let cells = Self::split_cell(cell, *node);
            let mut list = Vec::new();
            for (child, cell) in self.children(index).into_iter().zip(&cells) {
                if let Some(child) = child {
                    list.extend(self.validate_node(child, cell, depth + 1, state)?);
                }
            }
            list.sort_unstable();
            list.dedup();
            list
        };
        if list.len() != self.counts[index] as usize {
            let count = self.counts[index];
            return Err(format!("node {index} counts {count} of {} triangles", list.len()));
        }
        Ok(list)
    }

    fn validate_leaf(
        &self,
        index: usize,
        cell: &Aabb,
        state: &mut State,
    ) -> Result<Vec<u32>, String> {
        let range = self.nodes[index].leaf_range();
        let slots = self.references.get(range.clone());
        let slots = slots.ok_or_else(|| format!("leaf {index}: no references {range:?}"))?;
        if slots.is_empty() {
            return Err(format!("leaf {index} is empty and stored"));
        }
        state.lists.push(slots.len());
        for &slot in slots {
            let triangle = self.triangles.get(slot as usize);
            let bounds = triangle.ok_or_else(|| format!("leaf {index}: no slot {slot}"))?.bounds();
            if std::mem::replace(&mut state.listed[slot as usize], index) == index {
                return Err(format!("leaf {index} lists slot {slot} twice"));
            }
            if !(bounds.min.cmple(cell.max).all() && cell.min.cmple(bounds.max).all()) {
                return Err(format!("leaf {index}: slot {slot} is elsewhere"));
            }
        }
        let mut list = slots.to_vec();
        list.sort_unstable();
        Ok(list)
    }
}

/// What the walk has seen.
struct State {
    /// The node that comes next in depth-first order.
    next: usize,
    /// For each slot, the last leaf that listed it.
    listed: Vec<usize>,
    /// The leaves' list lengths.
    lists: Vec<usize>,
}

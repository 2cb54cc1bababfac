//! What the kernels rely on, checked.

use super::{Bvh2, ChildRef, MAX_DEPTH};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use glam::{DVec3, Vec3};

/// A subtree, as found.
struct Found {
    /// The union of the boxes of its leaves.
    bounds: Aabb,
    count: usize,
}

struct State {
    /// Inner nodes reached.
    reached: usize,
    /// For each slot, the box of its leaf.
    leaf_of: Vec<Option<Aabb>>,
    /// For each node whether it was reached.
    seen: Vec<bool>,
    has_moved: bool,
}

impl Bvh2 {
    /// Checks everything that traversal relies on: every slot in one leaf, every triangle of `mesh`
    /// in some slot, with its corners, and not twice in a leaf; inner boxes that are exactly those
    /// of what lies below; counts; depth; node order. Of leaves, where no triangle is in several,
    /// that their boxes are exactly those of their triangles. Else: that they are no larger, that
    /// they hold all of triangles that are in no other, and that the boxes around points of the
    /// others, tried in several places, are covered by their leaves.
    ///
    /// # Errors
    /// What is wrong, naming the node, slot or triangle.
    pub fn validate(&self, mesh: &TriangleMesh) -> Result<(), String> {
        self.validate_as(mesh, false)?;
        self.validate_notes()
    }

    /// As [`validate`](Self::validate) of a tree whose triangles have moved since it was built: in
    /// any order of nodes, without notes, and with boxes that are exactly those of the whole triangles
    /// below.
    ///
    /// # Errors
    /// What is wrong, naming the node, slot or triangle.
    pub fn validate_moved(&self, mesh: &TriangleMesh) -> Result<(), String> {
        if !self.notes.is_empty() {
            return Err("notes of a tree that has moved".into());
        }
        self.validate_as(mesh, true)
    }

    fn validate_as(&self, mesh: &TriangleMesh, has_moved: bool) -> Result<(), String> {
        let slots = self.slots_by_triangle(mesh)?;
        let leaf_of = vec![None; self.triangles.len()];
        let mut state =
            State { reached: 0, leaf_of, seen: vec![false; self.nodes.len()], has_moved };
        match self.root {
            None if mesh.is_empty() => {}
            None => return Err("no root".into()),
            Some(root) => {
                let all = self.validate_child(root, &self.bounds, 0, &mut state)?;
                if all.bounds != self.bounds || self.bounds != mesh.bounds() {
                    return Err(format!("root: {:?} is {:?}", self.bounds, all.bounds));
                }
            }
        }
        if state.reached != self.nodes.len() {
            return Err(format!("{} of {} nodes are reached", state.reached, self.nodes.len()));
        }
        for slots in &slots {
            self.validate_cover(slots, &state.leaf_of)?;
        }
        Ok(())
    }

    /// Checks what the builder noted of each split, in `f64`.
    fn validate_notes(&self) -> Result<(), String> {
        if self.notes.len() != self.nodes.len() {
            return Err(format!("notes of {} of {} nodes", self.notes.len(), self.nodes.len()));
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let larger = node.bounds[1].half_area() > node.bounds[0].half_area();
            let fewer = node.counts[1] < node.counts[0];
            let notes = [&self.notes.second_larger, &self.notes.second_fewer];
            if notes.map(|note| note.get(index)) != [larger, fewer] {
                return Err(format!("node {index}: wrong notes of its children"));
            }
        }
        Ok(())
    }

    /// The slots of each triangle.
    fn slots_by_triangle(&self, mesh: &TriangleMesh) -> Result<Vec<Vec<usize>>, String> {
        if self.triangles.len() != self.triangle_ids.len() {
            let ids = self.triangle_ids.len();
            return Err(format!("{} triangles, {ids} indices", self.triangles.len()));
        }
        let mut slots = vec![Vec::new(); mesh.len()];
        for (slot, &id) in self.triangle_ids.iter().enumerate() {
            match slots.get_mut(id as usize) {
                Some(slots) if mesh.triangle(id as usize) == self.triangles[slot] => {
                    slots.push(slot);
                }
                _ => return Err(format!("slot {slot} holds triangle {id} wrongly")),
            }
        }
        match slots.iter().position(Vec::is_empty) {
            Some(id) => Err(format!("triangle {id} is nowhere")),
            None => Ok(slots),
        }
    }

    /// Checks the subtree whose parent says that its box is `bounds`.
    fn validate_child(
        &self,
        child: ChildRef,
        bounds: &Aabb,
        depth: usize,
        state: &mut State,
    ) -> Result<Found, String> {
        if child.is_leaf() {
            return self.validate_leaf(child, bounds, state);
        }
        let index = child.node_index();
        if depth >= MAX_DEPTH {
            return Err(format!("node {index} is too deep"));
        }
        state.reached += 1;
        let node = self.nodes.get(index).ok_or_else(|| format!("no node {index}"))?;
        if std::mem::replace(&mut state.seen[index], true) {
            return Err(format!("node {index} is reached twice"));
        }
        let mut all = Found { bounds: Aabb::EMPTY, count: 0 };
        for side in 0..2 {
            let child = node.children[side];
            if !state.has_moved && !child.is_leaf() && child.node_index() <= index {
                return Err(format!("node {index}: a child before its parent"));
            }
            let found = self.validate_child(child, &node.bounds[side], depth + 1, state)?;
            if found.bounds != node.bounds[side] || found.count != node.counts[side] as usize {
                return Err(format!("node {index}: child {side} has other bounds or count"));
            }
            all.bounds = all.bounds.union(found.bounds);
            all.count += found.count;
        }
        Ok(all)
    }

    fn validate_leaf(
        &self,
        leaf: ChildRef,
        bounds: &Aabb,
        state: &mut State,
    ) -> Result<Found, String> {
        let range = leaf.leaf_slots();
        let mut around = Aabb::EMPTY;
        for slot in range.clone() {
            if state.leaf_of.get(slot).is_none_or(Option::is_some) {
                return Err(format!("leaf {range:?}: slot {slot} is out of range or shared"));
            }
            let id = self.triangle_ids[slot];
            if self.triangle_ids[range.start..slot].contains(&id) {
                return Err(format!("leaf {range:?} holds triangle {id} twice"));
            }
            state.leaf_of[slot] = Some(*bounds);
            around = around.union(self.triangles[slot].bounds());
        }
        if state.has_moved && *bounds != around {
            return Err(format!("leaf {range:?}: {bounds:?} is not {around:?}"));
        }
        if bounds.is_empty() || !around.contains(bounds) {
            return Err(format!("leaf {range:?}: {bounds:?} is more than {around:?}"));
        }
        Ok(Found { bounds: *bounds, count: range.len() })
    }

    /// Checks that the leaves with a triangle cover it.
    fn validate_cover(&self, slots: &[usize], leaf_of: &[Option<Aabb>]) -> Result<(), String> {
        let (triangle, id) = (&self.triangles[slots[0]], self.triangle_ids[slots[0]]);
        let mut leaves = Vec::new();
        for &slot in slots {
            leaves.push(leaf_of[slot].ok_or_else(|| format!("slot {slot} is in no leaf"))?);
        }
        let is_covered = |part: &Aabb| leaves.iter().any(|leaf| leaf.contains(part));
        if let [leaf] = &leaves[..] {
            return if leaf.contains(&triangle.bounds()) {
                Ok(())
            } else {
                Err(format!("triangle {id} is cut off by its only leaf"))
            };
        }
        for around in boxes_around_points(triangle) {
            // A plane may go through the box.
            let corners = (0..8).map(|bits| {
                let pick = |axis: usize| [around.min, around.max][bits >> axis & 1][axis];
                let corner = Vec3::new(pick(0), pick(1), pick(2));
                Aabb { min: corner, max: corner }
            });
            if let Some(lost) = corners.into_iter().find(|corner| !is_covered(corner)) {
                return Err(format!("{} of triangle {id} is in none of its leaves", lost.min));
            }
        }
        Ok(())
    }
}

/// Boxes around points of a triangle, as a hit asks for (see [`intersect`](crate::intersect)).
fn boxes_around_points(triangle: &Triangle) -> impl Iterator<Item = Aabb> + '_ {
    const STEPS: u32 = 8;
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let all = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j)));
    all.map(move |(i, j)| {
        let [u, v, w] = [STEPS - i - j, i, j].map(|n| f64::from(n) / f64::from(STEPS));
        let point: DVec3 = a * u + b * v + c * w;
        triangle.box_around(point)
    })
}

//! The trees that can be looked through.

use super::look::{Hierarchy, Part, Parts};
use crate::geometry::{Triangle, TriangleMesh};
use crate::tree::{Bvh2, Bvh8, ChildRef, KdTree};

impl Hierarchy for Bvh2 {
    fn root(&self) -> Option<Part> {
        self.root.map(|child| Part { child, bounds: self.bounds })
    }

    fn is_leaf(&self, child: ChildRef) -> bool {
        child.is_leaf()
    }

    fn children(&self, of: &Part, into: &mut Parts) {
        let node = &self.nodes[of.child.node_index()];
        for (child, bounds) in node.children.iter().zip(&node.bounds) {
            into.push(&Part { child: *child, bounds: *bounds });
        }
    }

    fn triangles(&self, leaf: ChildRef, wants_more: &mut dyn FnMut(&Triangle) -> bool) {
        self.triangles[leaf.leaf_slots()].iter().all(wants_more);
    }
}

/// An eight-wide tree with the mesh that it was built from.
#[derive(Clone, Copy, Debug)]
pub struct WithMesh<'a> {
    /// The tree.
    pub tree: &'a Bvh8,
    /// The mesh.
    pub mesh: &'a TriangleMesh,
}

impl Hierarchy for WithMesh<'_> {
    fn root(&self) -> Option<Part> {
        self.tree.root.map(|child| Part { child, bounds: self.tree.bounds })
    }

    fn is_leaf(&self, child: ChildRef) -> bool {
        child.is_leaf()
    }

    fn children(&self, of: &Part, into: &mut Parts) {
        let node = &self.tree.nodes[of.child.node_index()];
        into.planes = node.planes;
        into.children = node.children;
        into.len = node.len as usize;
    }

    fn triangles(&self, leaf: ChildRef, wants_more: &mut dyn FnMut(&Triangle) -> bool) {
        let ids = &self.tree.triangle_ids[leaf.leaf_slots()];
        ids.iter().map(|&id| self.mesh.triangle(id as usize)).all(|triangle| wants_more(&triangle));
    }
}

/// The cells of a kd-tree. All nodes are referred to as inner ones, leaves too: cells have no other
/// names, so they are no places for rays to start.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a>(pub &'a KdTree);

impl Hierarchy for Cells<'_> {
    fn root(&self) -> Option<Part> {
        let root = Part { child: ChildRef::inner(0), bounds: self.0.bounds };
        (!self.0.nodes.is_empty()).then_some(root)
    }

    fn is_leaf(&self, child: ChildRef) -> bool {
        self.0.nodes[child.node_index()].is_leaf()
    }

    fn children(&self, of: &Part, into: &mut Parts) {
        let index = of.child.node_index();
        let cells = KdTree::split_cell(&of.bounds, self.0.nodes[index]);
        for (child, bounds) in self.0.children(index).into_iter().zip(cells) {
            if let Some(child) = child {
                into.push(&Part { child: ChildRef::inner(child), bounds });
            }
        }
    }

    fn triangles(&self, leaf: ChildRef, wants_more: &mut dyn FnMut(&Triangle) -> bool) {
        let range = self.0.nodes[leaf.node_index()].leaf_range();
        let slots = self.0.references[range].iter();
        slots.map(|&slot| &self.0.triangles[slot as usize]).all(wants_more);
    }
}

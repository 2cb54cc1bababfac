//! Parts whose triangles move.

use super::{Made, Part, Parts, Tally};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::scene::Motion;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, ScoreAtSplit, WIDTH, write_leaf};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, PoisonError};

/// A part's tree is built anew where rays would pay so many times as much for it as when it was built.
/// Building costs some ten times as much as bringing up to date, and most parts are visited by few
/// rays in a frame.
const MOST_GROWTH: f64 = 1.5;

/// The mesh is cut up anew where the boxes of parts have grown so much in area, over all: triangles
/// that were neighbours no longer are.
const MOST_SPREAD: f64 = 3.0;

/// What is known of how parts move.
pub(super) struct Movement {
    /// Parts before this one hold what stands still.
    first_moving: usize,
    /// Triangles before this place in `triangle_ids` stand still.
    first_triangle: usize,
    /// The vertices of each moving part, one after the other, each once.
    vertex_ids: Vec<u32>,
    /// Those of the parts from the first moving one on.
    vertices: Vec<Range<usize>>,
    /// Areas of the boxes of moving parts when the mesh was cut up.
    area: f64,
}

impl Parts {
    /// Cuts up a mesh that moves. `still` becomes the tree of all triangles that stand still, in one
    /// part; without it they are parts as the others are.
    pub fn moving(
        mesh: Arc<TriangleMesh>,
        motion: Option<&Motion>,
        still: impl FnOnce(&TriangleMesh, &[u32]) -> Option<Bvh8>,
        score: ScoreAtSplit,
    ) -> Self {
        let mut moves = vec![motion.is_none(); mesh.len()];
        let objects = motion.iter().flat_map(|motion| &motion.objects);
        for object in objects.filter(|object| object.moves) {
            moves[object.triangles.clone()].fill(true);
        }
        let ids_that = |moving: bool| {
            let ids = 0..mesh.len() as u32;
            ids.filter(|&id| moves[id as usize] == moving).collect::<Vec<u32>>()
        };
        let (still_ids, moving_ids) = (ids_that(false), ids_that(true));
        let mut parts = Self::uncut(Arc::clone(&mesh), score);
        match (!still_ids.is_empty()).then(|| still(&mesh, &still_ids)).flatten() {
            Some(tree) => {
                let part = Part::new(0..still_ids.len());
                let _ = part.tree.set(Box::new(Made::new(tree)));
                parts.triangle_ids.extend(still_ids);
                parts.parts.push(part);
            }
            None => parts.cut(still_ids),
        }
        let (first_moving, first_triangle) = (parts.parts.len(), parts.triangle_ids.len());
        parts.cut(moving_ids);
        parts.place();
        parts.movement = Some(Movement {
            first_moving,
            first_triangle,
            vertex_ids: Vec::new(),
            vertices: Vec::new(),
            area: 0.0,
        });
        parts.note_vertices();
        parts
    }

    /// Finds the vertices of the parts, which have their boxes.
    fn note_vertices(&mut self) {
        let Self { mesh, triangle_ids, parts, movement, .. } = self;
        let Some(movement) = movement else { return };
        let moving = &parts[movement.first_moving..];
        let of_part = |part: &Part| {
            let triangles = &triangle_ids[part.triangles.clone()];
            let corners = triangles.iter().flat_map(|&id| mesh.triangles()[id as usize]);
            let mut ids: Vec<u32> = corners.collect();
            ids.sort_unstable();
            ids.dedup();
            ids
        };
        let lists: Vec<Vec<u32>> = moving.par_iter().with_min_len(8).map(of_part).collect();
        movement.vertices.clear();
        let mut first = 0;
        for list in &lists {
            movement.vertices.push(first..first + list.len());
            first += list.len();
        }
        movement.vertex_ids = lists.concat();
        movement.area = area(moving);
    }

    /// Follows the vertices to where they are in `mesh`, whose triangles are the same. Returns whether
    /// it was cut up anew. On the current rayon pool.
    pub fn follow(&mut self, mesh: Arc<TriangleMesh>) -> bool {
        self.mesh = mesh;
        self.tally = Tally::default();
        let Self { mesh, parts, movement, .. } = self;
        let Some(Movement { first_moving, vertex_ids, vertices, area: cut_area, .. }) = movement
        else {
            return false;
        };
        let moving = &mut parts[*first_moving..];
        moving.par_iter_mut().zip(vertices).with_min_len(8).for_each(|(part, range)| {
            let places = vertex_ids[range.clone()].iter().map(|&id| mesh.vertices()[id as usize]);
            part.bounds = Aabb::of_points(places);
            if let Some(made) = part.tree.take() {
                *part.earlier.get_mut().unwrap_or_else(PoisonError::into_inner) = Some(made);
            }
        });
        let is_spread = area(moving) > MOST_SPREAD * *cut_area;
        if is_spread {
            self.cut_anew();
        }
        self.make_top();
        is_spread
    }

    fn cut_anew(&mut self) {
        let Some(movement) = &self.movement else { return };
        let moving_ids = self.triangle_ids.split_off(movement.first_triangle);
        self.parts.truncate(movement.first_moving);
        self.cut(moving_ids);
        self.place();
        self.note_vertices();
    }
}

/// Of the boxes of all parts, one after the other.
fn area(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.bounds.half_area()).sum()
}

impl Made {
    pub(super) fn new(tree: Bvh8) -> Self {
        let built_cost = relative_cost(&tree);
        Self { tree, built_cost }
    }

    /// The same tree for other places of the vertices; `None` where a new one is better.
    pub(super) fn brought_up_to_date(
        mut self: Box<Self>,
        mesh: &TriangleMesh,
    ) -> Option<Box<Self>> {
        refit(&mut self.tree, mesh);
        (relative_cost(&self.tree) <= MOST_GROWTH * self.built_cost).then_some(self)
    }
}

/// Visits of nodes and leaves that a random line through the tree's box can expect.
pub(super) fn relative_cost(tree: &Bvh8) -> f64 {
    let children =
        tree.nodes.iter().flat_map(|node| (0..node.len as usize).map(|i| node.bounds(i)));
    let areas: f64 = children.map(|bounds| bounds.half_area()).sum();
    let own = tree.bounds.half_area();
    if own > 0.0 { 1.0 + areas / own } else { 1.0 }
}

/// Brings boxes and leaves up to date (Wald, Boulos and Shirley, "Ray Tracing Deformable Scenes Using
/// Dynamic Bounding Volume Hierarchies", ACM Transactions on Graphics 26(1), 2007), on this thread.
fn refit(tree: &mut Bvh8, mesh: &TriangleMesh) {
    let Some(root) = tree.root else { return };
    let mut leaf = |child: ChildRef| {
        let slots = child.leaf_slots();
        let mut triangles = [Triangle::default(); WIDTH];
        let triangles = &mut triangles[..slots.len()];
        let mut bounds = Aabb::EMPTY;
        for (triangle, &id) in triangles.iter_mut().zip(&tree.triangle_ids[slots.clone()]) {
            *triangle = mesh.triangle(id as usize);
            bounds = bounds.union(triangle.bounds());
        }
        let block = slots.start * LEAF_ROWS..slots.end * LEAF_ROWS;
        write_leaf(&mut tree.leaves[block], triangles);
        bounds
    };
    if root.is_leaf() {
        tree.bounds = leaf(root);
        return;
    }
    let mut of_nodes = vec![Aabb::EMPTY; tree.nodes.len()];
    // Children come after their parents.
    for (index, node) in tree.nodes.iter_mut().enumerate().rev() {
        let mut all = Aabb::EMPTY;
        for slot in 0..node.len as usize {
            let child = node.children[slot];
            let bounds = if child.is_leaf() { leaf(child) } else { of_nodes[child.node_index()] };
            node.set_bounds(slot, &bounds);
            all = all.union(bounds);
        }
        of_nodes[index] = all;
    }
    tree.bounds = of_nodes[0];
}

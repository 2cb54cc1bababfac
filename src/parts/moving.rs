//! Parts whose triangles move.

use super::{Made, Part, Parts, Tally, most_in_part};
use crate::build::WideCosts;
use crate::geometry::{Aabb, TriangleMesh};
use crate::scene::Motion;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, ScoreAtSplit, refit_leaf};
use crate::vectorized::vectorized;
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

/// Objects with fewer triangles share parts: theirs would be small, and the tree over all parts large.
const LEAST_ALONE: usize = 256;

/// What is known of how parts move.
pub(super) struct Movement {
    /// Parts before this one hold what stands still.
    first_moving: usize,
    /// Most triangles of a moving part.
    most: usize,
    /// Where the triangles that are cut up together are in `triangle_ids`: no part has triangles of
    /// two of these.
    groups: Vec<Range<usize>>,
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
        let still_ids: Vec<u32> =
            (0..mesh.len() as u32).filter(|&id| !moves[id as usize]).collect();
        let moving_ids = groups_of(&moves, motion);
        let mut parts = Self::uncut(Arc::clone(&mesh), score);
        match (!still_ids.is_empty()).then(|| still(&mesh, &still_ids)).flatten() {
            Some(tree) => {
                let part = Part::new(0..still_ids.len(), tree.bounds);
                let _ = part.tree.set(Box::new(Made::new(tree)));
                parts.triangle_ids.extend(still_ids);
                parts.parts.push(part);
            }
            None => {
                let most = most_in_part(still_ids.len());
                parts.cut(vec![still_ids], most);
            }
        }
        let first_moving = parts.parts.len();
        let most = most_in_part(moving_ids.iter().map(Vec::len).sum());
        let groups = parts.cut(moving_ids, most);
        parts.make_top();
        parts.movement = Some(Movement {
            first_moving,
            most,
            groups,
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

    /// Cuts up again what moves; the tree over the parts is left as it was.
    fn cut_anew(&mut self) {
        let Some(Movement { first_moving, most, groups, .. }) = &self.movement else { return };
        let most = *most;
        let moving_ids =
            groups.iter().map(|range| self.triangle_ids[range.clone()].to_vec()).collect();
        self.parts.truncate(*first_moving);
        self.triangle_ids.truncate(groups.first().map_or(usize::MAX, |range| range.start));
        let groups = self.cut(moving_ids, most);
        self.movement.as_mut().expect("moves").groups = groups;
        self.note_vertices();
    }
}

/// The triangles that move, those of each larger object on their own: objects that are neighbours now
/// may part.
fn groups_of(moves: &[bool], motion: Option<&Motion>) -> Vec<Vec<u32>> {
    let objects = motion.iter().flat_map(|motion| &motion.objects);
    let is_large = |range: &Range<usize>| range.len() >= LEAST_ALONE;
    let alone: Vec<Range<usize>> = objects
        .filter(|o| o.moves && is_large(&o.triangles))
        .map(|o| o.triangles.clone())
        .collect();
    let mut is_left = moves.to_vec();
    alone.iter().for_each(|range| is_left[range.clone()].fill(false));
    let left = (0..moves.len() as u32).filter(|&id| is_left[id as usize]).collect::<Vec<u32>>();
    let mut groups: Vec<Vec<u32>> =
        alone.into_iter().map(|range| (range.start as u32..range.end as u32).collect()).collect();
    if !left.is_empty() {
        groups.push(left);
    }
    groups
}

/// Of the boxes of all parts, one after the other.
fn area(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.bounds.half_area()).sum()
}

impl Made {
    pub(super) fn new(tree: Bvh8) -> Self {
        let built_cost = WideCosts::default().sah_cost(&tree);
        Self { tree, built_cost }
    }

    /// The same tree for other places of the vertices; `None` where a new one is better.
    pub(super) fn brought_up_to_date(
        mut self: Box<Self>,
        mesh: &TriangleMesh,
    ) -> Option<Box<Self>> {
        vectorized(
            #[inline(always)]
            || refit(&mut self.tree, mesh),
        );
        let cost = WideCosts::default().sah_cost(&self.tree);
        (cost <= MOST_GROWTH * self.built_cost).then_some(self)
    }
}

/// Brings boxes and leaves up to date (Wald, Boulos and Shirley, "Ray Tracing Deformable Scenes Using
/// Dynamic Bounding Volume Hierarchies", ACM Transactions on Graphics 26(1), 2007), on this thread.
#[inline(always)]
fn refit(tree: &mut Bvh8, mesh: &TriangleMesh) {
    tree.id = Bvh8::new_id();
    let Some(root) = tree.root else { return };
    let mut leaf = |child: ChildRef| {
        let slots = child.leaf_slots();
        let block = slots.start * LEAF_ROWS..slots.end * LEAF_ROWS;
        refit_leaf(mesh, &tree.triangle_ids[slots], &mut tree.leaves[block])
    };
    if root.is_leaf() {
        tree.bounds = leaf(root);
        return;
    }
    // Children come after their parents.
    for index in (0..tree.nodes.len()).rev() {
        for slot in 0..tree.nodes[index].len as usize {
            let child = tree.nodes[index].children[slot];
            let bounds = if child.is_leaf() {
                leaf(child)
            } else {
                tree.nodes[child.node_index()].all_bounds()
            };
            tree.nodes[index].set_bounds(slot, &bounds);
        }
    }
    tree.bounds = tree.nodes[0].all_bounds();
}

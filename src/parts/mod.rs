//! Trees that are built where rays come by (Djeu et al., "Razor: An Architecture for Dynamic
//! Multiresolution Ray Tracing", ACM Transactions on Graphics 30(5), 2011): a mesh is cut into parts,
//! a small tree is built over their boxes, and a part gets its own tree when a ray first asks for it.
//!
//! Where triangles move, boxes and the tree over them are made anew for each frame, and a part's tree
//! is brought up to date when a ray first asks for it in that frame.

mod moving;
mod regions;

use crate::build::{Leaves, MOST_SMALL, WideCosts, collapse, find, small_tree};
use crate::geometry::{Aabb, TriangleMesh};
use crate::trace::wide::TwoLevel;
use crate::tree::{Bvh8, ScoreAtSplit};
use moving::Movement;
use rayon::prelude::*;
use regions::regions;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

/// Most triangles of a part, for meshes of so many: small parts are built for few rays in vain, but the
/// tree over them is built before any ray comes.
///
/// Whoever waits for a part's tree must not be given other work meanwhile, as that might need the same
/// tree: [`small_tree`] works on one thread.
fn most_in_part(triangles: usize) -> usize {
    const LEAST: usize = 64;
    const PARTS: usize = 1 << 15;
    (triangles / PARTS).next_power_of_two().clamp(LEAST, MOST_SMALL)
}

/// A mesh in parts.
pub struct Parts {
    mesh: Arc<TriangleMesh>,
    score: ScoreAtSplit,
    /// Of each part, one after the other.
    triangle_ids: Vec<u32>,
    parts: Vec<Part>,
    top: Bvh8,
    tally: Tally,
    /// If it moves.
    movement: Option<Movement>,
}

/// Some triangles, and their tree.
struct Part {
    /// Where they are in `triangle_ids`.
    triangles: Range<usize>,
    bounds: Aabb,
    tree: OnceLock<Box<Made>>,
    /// That of an earlier frame.
    earlier: Mutex<Option<Box<Made>>>,
}

/// The tree of a part.
struct Made {
    tree: Bvh8,
    /// What it cost to go through when it was built: see [`WideCosts::sah_cost`].
    built_cost: f64,
}

/// What was done so far.
#[derive(Debug, Default)]
struct Tally {
    built: AtomicU64,
    refitted: AtomicU64,
    nanoseconds: AtomicU64,
}

/// How much of a mesh in parts rays have come by.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Visited {
    /// Parts in all.
    pub parts: u64,
    /// Those with a tree.
    pub parts_ready: u64,
    /// Triangles in all.
    pub triangles: u64,
    /// Those in the trees that are there.
    pub triangles_ready: u64,
    /// Inner nodes of all trees that are there, with the one over the parts.
    pub nodes: u64,
    /// Trees of parts that were built since the last frame began.
    pub built: u64,
    /// Those brought up to date instead.
    pub refitted: u64,
    /// Time that it took, summed over threads, in milliseconds.
    pub build_ms: f64,
    /// Bytes of all trees that are there.
    pub memory_bytes: u64,
}

impl Parts {
    /// Cuts up a mesh; no part is built yet. Of the children of a node, those with larger scores come
    /// first. On the current rayon pool; the same for any number of threads.
    pub fn new(mesh: Arc<TriangleMesh>, score: ScoreAtSplit) -> Self {
        let all: Vec<u32> = (0..mesh.len() as u32).collect();
        let most = most_in_part(all.len());
        let mut parts = Self::uncut(mesh, score);
        parts.cut(vec![all], most);
        parts.make_top();
        parts
    }

    fn uncut(mesh: Arc<TriangleMesh>, score: ScoreAtSplit) -> Self {
        let (triangle_ids, parts, movement) = (Vec::new(), Vec::new(), None);
        let (top, tally) = (top_over(&[]), Tally::default());
        Self { mesh, score, triangle_ids, parts, top, tally, movement }
    }

    /// Adds parts of at most so many of these triangles, each of those of one group. Returns where the
    /// groups are in `triangle_ids`.
    fn cut(&mut self, groups: Vec<Vec<u32>>, most: usize) -> Vec<Range<usize>> {
        let mesh = &self.mesh;
        let cut: Vec<_> = groups.into_par_iter().map(|ids| regions(mesh, ids, most)).collect();
        let add = |regions: regions::Regions| {
            let first = self.triangle_ids.len();
            self.triangle_ids.extend(regions.triangle_ids);
            let shifted = |range: Range<usize>| first + range.start..first + range.end;
            let ranges = regions.ranges.into_iter().map(shifted);
            self.parts.extend(ranges.zip(regions.bounds).map(|(range, b)| Part::new(range, b)));
            first..self.triangle_ids.len()
        };
        cut.into_iter().map(add).collect()
    }

    /// Builds the tree over all parts.
    fn make_top(&mut self) {
        let boxes: Vec<Aabb> = self.parts.iter().map(|part| part.bounds).collect();
        self.top = top_over(&boxes);
    }

    /// The mesh, as it is in the frame.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.mesh
    }

    /// How much of it is there.
    pub fn visited(&self) -> Visited {
        let ready = self.parts.iter().filter_map(|part| Some((part, part.tree.get()?)));
        let mut visited = Visited {
            parts: self.parts.len() as u64,
            triangles: self.mesh.len() as u64,
            nodes: self.top.nodes.len() as u64,
            built: self.tally.built.load(Ordering::Relaxed),
            refitted: self.tally.refitted.load(Ordering::Relaxed),
            build_ms: self.tally.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-6,
            memory_bytes: self.own_bytes(),
            ..Visited::default()
        };
        for (part, made) in ready {
            visited.parts_ready += 1;
            visited.triangles_ready += part.triangles.len() as u64;
            visited.nodes += made.tree.nodes.len() as u64;
            visited.memory_bytes += made.tree.memory_bytes();
        }
        visited
    }

    /// Bytes of what is there before any ray comes.
    fn own_bytes(&self) -> u64 {
        let ids = size_of_val(self.triangle_ids.as_slice()) as u64;
        let parts = size_of_val(self.parts.as_slice()) as u64;
        ids + parts + self.top.memory_bytes()
    }

    /// Builds the tree of a part, on this thread alone.
    fn build(&self, part: &Part) -> Bvh8 {
        small_tree(&self.mesh, &self.triangle_ids[part.triangles.clone()], self.score)
    }

    /// The tree of a part for this frame.
    fn make(&self, part: &Part) -> Box<Made> {
        let start = Instant::now();
        let earlier = part.earlier.lock().unwrap_or_else(PoisonError::into_inner).take();
        let kept = earlier.and_then(|earlier| earlier.brought_up_to_date(&self.mesh));
        let counter = if kept.is_some() { &self.tally.refitted } else { &self.tally.built };
        counter.fetch_add(1, Ordering::Relaxed);
        let made = kept.unwrap_or_else(|| Box::new(Made::new(self.build(part))));
        let nanoseconds = start.elapsed().as_nanos() as u64;
        self.tally.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        made
    }
}

impl Part {
    fn new(triangles: Range<usize>, bounds: Aabb) -> Self {
        let (tree, earlier) = (OnceLock::new(), Mutex::new(None));
        Self { triangles, bounds, tree, earlier }
    }
}

impl TwoLevel for Parts {
    fn top(&self) -> &Bvh8 {
        &self.top
    }

    fn part(&self, part: usize) -> &Bvh8 {
        let part = &self.parts[part];
        &part.tree.get_or_init(|| self.make(part)).tree
    }

    fn ready(&self, part: usize) -> Option<&Bvh8> {
        self.parts[part].tree.get().map(|made| &made.tree)
    }
}

/// A tree over boxes, which slots name by their indices: the larger one of siblings comes first.
fn top_over(boxes: &[Aabb]) -> Bvh8 {
    // Builders build over triangles: here are some that fill these boxes.
    let corners = boxes.iter().flat_map(|bounds| [bounds.min, bounds.max]).collect();
    let triangles = (0..boxes.len() as u32).map(|i| [2 * i, 2 * i + 1, 2 * i + 1]).collect();
    let proxies = TriangleMesh::new(corners, triangles);
    let binned = find("binned").expect("is in the catalogue");
    let binary = (binned.build)(&proxies, Leaves::Single);
    // A leaf is another tree, so that it costs more than any number of nodes saved.
    let costs = WideCosts { leaf: 0.0, triangle: 100.0 };
    collapse(&binary, costs, |node, side| binary.nodes[node].bounds[side].half_area())
}

#[cfg(test)]
mod tests;

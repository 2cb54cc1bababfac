//! An eight-wide tree part by part: binary trees are built over as many triangles as fit a core's cache,
//! each scored and planned before the next. Then what lies above them is planned, which gives each part
//! its slots, and parts are laid out. The tree is that which [`collapse`](super::collapse()) makes of
//! the binary tree of all triangles, but that tree is never put together.

mod cut;
mod top;

use super::collapse::{
    Child, Cost, Layout, Output, Part as Laid, Plan, Program, Slots, WideScores, join,
};
use super::top_down::{Fate, Part, fate};
use super::top_reinsertion::Sets;
use super::{Leaves, WideCosts};
use crate::geometry::{Aabb, TriangleMesh};
use crate::huge_pages;
use crate::tree::{
    Bvh2, Bvh8, ChildRef, LEAF_ROWS, Node2, Node8, PartSummary, ScorePart, SplitNotes, WIDTH,
};
use bytemuck::Zeroable;
use cut::Cut;
use rayon::prelude::*;
use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Most triangles of a part, and of one of few triangles, which are to keep all threads busy: the tree
/// does not depend on it.
const MOST: usize = 4096;
const MOST_OF_FEW: usize = 256;

/// A tree, and what is known of how it was built.
#[derive(Debug)]
pub struct BuiltInParts {
    /// The tree.
    pub tree: Bvh8,
    /// Its nodes' scores, if they were to be kept.
    pub(crate) scores: Vec<WideScores>,
    /// What finding scores took, in milliseconds: the sum of all threads over their number.
    pub order_ms: f64,
}

/// How children are sorted.
#[derive(Clone, Copy, Debug)]
pub struct PartOrder {
    /// Among the children of a node those with larger scores come first.
    pub score: ScorePart,
    /// Whether the scores are kept.
    pub keeps_scores: bool,
}

/// Builds the tree of all of `mesh` from its root, `None` for an empty mesh. On the current rayon pool;
/// the same for any number of threads. Where there are `sets`, these go where they cost least.
pub(super) fn build<P: Part>(
    mesh: &TriangleMesh,
    root: Option<P>,
    order: PartOrder,
    sets: Option<Sets>,
) -> BuiltInParts {
    of_size(mesh, root, order, sets, (mesh.len() / 16).clamp(MOST_OF_FEW, MOST))
}

/// The same in parts of at most `most` triangles, more than a leaf may have, and a set.
fn of_size<P: Part>(
    mesh: &TriangleMesh,
    root: Option<P>,
    order: PartOrder,
    sets: Option<Sets>,
    most: usize,
) -> BuiltInParts {
    let count = mesh.len();
    let bounds = root.as_ref().map_or(Aabb::EMPTY, P::bounds);
    // Not touched before each thread fills its part.
    let mut leaves = vec![0.0; count * LEAF_ROWS + WIDTH];
    let mut triangle_ids = vec![0; count];
    huge_pages::ask_for(&mut leaves);
    huge_pages::ask_for(&mut triangle_ids);
    let program = Program::new(WideCosts::default(), &bounds);
    let builder = Builder { mesh, order, program, score_ns: AtomicU64::new(0) };
    let (mut nodes, mut scores) = (Vec::new(), Vec::new());
    let root = root.map(|root| {
        let room = Room { leaves: &mut leaves, triangle_ids: &mut triangle_ids, first_slot: 0 };
        let cut = match sets {
            None => Cut::new(root, 0, most, |depth| depth),
            Some(sets) => Cut::new(root, 0, sets.most, Sets::depth).moved(&bounds),
        };
        let (mut top, mut parts) = (Vec::new(), Vec::new());
        let root = add(cut, most, &mut Some(room), &mut top, &mut parts).child;
        let parts: Vec<_> = parts.into_par_iter().map(|set| builder.plan(set)).collect();
        let top = builder.plan_top(top, root, bounds, &parts);
        let parts = parts.into_par_iter().zip(&top.slots);
        let parts = parts.map(|(part, &slots)| builder.lay_out(part, slots)).collect();
        let pieces = builder.lay_out_top(&top, parts);
        let root;
        (nodes, scores, root) = join(&pieces, order.keeps_scores);
        root
    });
    let id = Bvh8::new_id();
    let threads = rayon::current_num_threads() as f64;
    let order_ms = builder.score_ns.into_inner() as f64 * 1e-6 / threads;
    BuiltInParts { tree: Bvh8 { nodes, root, bounds, leaves, triangle_ids, id }, scores, order_ms }
}

struct Builder<'a> {
    mesh: &'a TriangleMesh,
    order: PartOrder,
    program: Program,
    score_ns: AtomicU64,
}

/// What a set of triangles owns of the tree to be.
struct Room<'a> {
    leaves: &'a mut [f32],
    triangle_ids: &'a mut [u32],
    first_slot: usize,
}

impl<'a> Room<'a> {
    /// For the first `count` triangles, and for the others.
    fn split(self, count: usize) -> [Self; 2] {
        let (lower_leaves, leaves) = self.leaves.split_at_mut(count * LEAF_ROWS);
        let (lower_ids, triangle_ids) = self.triangle_ids.split_at_mut(count);
        let (first_slot, upper_slot) = (self.first_slot, self.first_slot + count);
        [
            Self { leaves: lower_leaves, triangle_ids: lower_ids, first_slot },
            Self { leaves, triangle_ids, first_slot: upper_slot },
        ]
    }
}

/// Triangles that become a part.
struct Unfinished<'a, P> {
    cut: Cut<P>,
    room: Room<'a>,
}

/// A part with its place in the tree to be.
struct Planned<'a> {
    tree: Bvh2,
    scores: Vec<[f64; 2]>,
    plans: Vec<Plan>,
    in_slots: Slots,
    summary: PartSummary,
    room: Room<'a>,
}

/// A part that is laid out.
struct LaidOut {
    /// What is in its slots, with scores unless it is the whole part.
    slots: Vec<(Laid, Aabb, f64)>,
    summary: PartSummary,
}

/// A subtree of a binary one.
struct Grown {
    child: ChildRef,
    bounds: Aabb,
    count: usize,
}

impl Builder<'_> {
    /// Builds the binary tree of a part and plans it, on one thread.
    fn plan<'a, P: Part>(&self, part: Unfinished<'a, P>) -> Planned<'a> {
        let Unfinished { cut, room } = part;
        SCRATCH.with_borrow_mut(|scratch| {
            let Scratch { nodes, below, .. } = scratch;
            let mut tree = Bvh2 {
                nodes: std::mem::take(nodes),
                root: None,
                bounds: Aabb::EMPTY,
                triangles: Vec::new(),
                triangle_ids: Vec::with_capacity(cut.count()),
                notes: SplitNotes::default(),
            };
            let root = grow_cut(cut, &mut tree);
            (tree.root, tree.bounds) = (Some(root.child), root.bounds);
            let of_mesh = tree.triangle_ids.iter().map(|&id| self.mesh.triangle(id as usize));
            tree.triangles = of_mesh.collect();
            let mut scores = Vec::new();
            let summary = self.score(&tree, None, &mut scores);
            let leaf = |leaf: ChildRef, bounds: &Aabb| self.program.leaf(leaf, bounds);
            let (plans, in_slots) = self.program.plan_all(&tree, leaf, below);
            // What is kept takes no more room than it needs.
            let own_nodes = tree.nodes.clone();
            *nodes = std::mem::replace(&mut tree.nodes, own_nodes);
            nodes.clear();
            Planned { tree, scores, plans, in_slots, summary, room }
        })
    }

    /// Lays out a part in so many slots, on one thread.
    fn lay_out(&self, part: Planned<'_>, slots: usize) -> LaidOut {
        let Planned { tree, scores, plans, summary, room, .. } = part;
        let Room { leaves, triangle_ids, first_slot } = room;
        SCRATCH.with_borrow_mut(|scratch| {
            let Scratch { wide_nodes, wide_scores, .. } = scratch;
            let layout = Layout {
                tree: &tree,
                plans: &plans,
                priority: |node: usize, side: usize| scores[node][side],
                keeps_scores: self.order.keeps_scores,
            };
            let mut used = 0;
            let mut lay_out = |child: &Child| {
                wide_nodes.clear();
                wide_scores.clear();
                let (nodes, scores) = (&mut *wide_nodes, &mut *wide_scores);
                let (leaves, triangle_ids) = (&mut *leaves, &mut *triangle_ids);
                let mut output = Output { nodes, scores, leaves, triangle_ids, first_slot, used };
                let root = layout.emit(child.binary, &mut output);
                used = output.used;
                let laid = Laid { nodes: wide_nodes.clone(), scores: wide_scores.clone(), root };
                (laid, child.bounds, child.score)
            };
            let root = tree.root.expect("a part has triangles");
            let children = layout.in_slots(root, slots, 0.0);
            LaidOut { slots: children.iter().map(&mut lay_out).collect(), summary }
        })
    }

    fn score(
        &self,
        tree: &Bvh2,
        below: Option<&[PartSummary]>,
        scores: &mut Vec<[f64; 2]>,
    ) -> PartSummary {
        let start = Instant::now();
        let summary = (self.order.score)(tree, below, scores);
        self.score_ns.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        summary
    }
}

/// Adds nodes in depth-first order and a leaf for each part of at most `most` triangles.
fn add<'a, P: Part>(
    cut: Cut<P>,
    most: usize,
    room: &mut Option<Room<'a>>,
    nodes: &mut Vec<Node2>,
    parts: &mut Vec<Unfinished<'a, P>>,
) -> Grown {
    let (bounds, count) = (cut.bounds(), cut.count());
    match cut {
        Cut::Sides { sides, .. } if count > most => {
            let index = nodes.len();
            nodes.push(Node2::zeroed());
            let sides = sides.map(|side| add(side, most, room, nodes, parts));
            parent(nodes, index, sides)
        }
        _ => {
            let [own, others] = room.take().expect("it is put back").split(count);
            *room = Some(others);
            parts.push(Unfinished { cut, room: own });
            Grown { child: ChildRef::leaf(parts.len() - 1, 1), bounds, count }
        }
    }
}

/// Sets the node at `index` to the one above two subtrees.
fn parent(nodes: &mut [Node2], index: usize, [lower, upper]: [Grown; 2]) -> Grown {
    nodes[index] = Node2 {
        bounds: [lower.bounds, upper.bounds],
        children: [lower.child, upper.child],
        counts: [lower.count as u32, upper.count as u32],
    };
    let (bounds, count) = (lower.bounds.union(upper.bounds), lower.count + upper.count);
    Grown { child: ChildRef::inner(index), bounds, count }
}

/// Adds the binary tree of triangles that are divided so far, likewise.
fn grow_cut<P: Part>(cut: Cut<P>, tree: &mut Bvh2) -> Grown {
    match cut {
        Cut::Set { set, depth } => grow(set, depth, tree),
        Cut::Sides { sides, .. } => {
            let index = tree.nodes.len();
            tree.nodes.push(Node2::zeroed());
            let sides = sides.map(|side| grow_cut(side, tree));
            parent(&mut tree.nodes, index, sides)
        }
    }
}

/// Adds the binary tree of a set with `depth` nodes above it, its nodes and leaves in depth-first
/// order.
fn grow<P: Part>(set: P, depth: usize, tree: &mut Bvh2) -> Grown {
    let (count, bounds) = (set.count(), set.bounds());
    let first = tree.triangle_ids.len();
    match fate(set, depth, Leaves::Wide) {
        Fate::Leaf(set) => tree.triangle_ids.extend(set.triangle_ids()),
        Fate::LeafOf(sides) => {
            tree.triangle_ids.extend(sides.iter().flat_map(P::triangle_ids));
        }
        Fate::Sides([lower, upper]) => {
            let index = tree.nodes.len();
            tree.nodes.push(Node2::zeroed());
            let sides = [grow(lower, depth + 1, tree), grow(upper, depth + 1, tree)];
            return parent(&mut tree.nodes, index, sides);
        }
    }
    Grown { child: ChildRef::leaf(first, count), bounds, count }
}

/// What a thread uses again for all its parts.
#[derive(Default)]
struct Scratch {
    nodes: Vec<Node2>,
    below: Vec<Cost>,
    wide_nodes: Vec<Node8>,
    wide_scores: Vec<WideScores>,
}

thread_local! {
    // Nobody works on a part while another is under way on the same thread: that waits for nobody.
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

#[cfg(test)]
mod tests;

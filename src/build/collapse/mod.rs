//! Collapses a binary tree into an eight-wide one, by dynamic programming over the surface-area
//! heuristic (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", High Performance Graphics, 2017): for each subtree and each number of
//! slots, the cheapest way to fill them with leaves and nodes.

mod join;
mod layout;
mod plan;

pub(super) use join::{Part, Piece, join};
pub(super) use layout::{Child, Children, Layout, Output};
pub(super) use plan::{Cost, Plan, Program, Slots};

use crate::tree::{Bvh2, Bvh8, ChildRef, LEAF_ROWS, Node8, WIDTH};
use plan::plans;
use rayon::prelude::*;

/// Most triangles of a subtree that one thread lays out.
const SUBTREE_TRIANGLES: usize = 8192;

/// Expected costs of visits, in visits of a node.
#[derive(Clone, Copy, Debug)]
pub struct WideCosts {
    /// Of a leaf, however few triangles it holds: they are tested at once.
    pub leaf: f32,
    /// More for each of its triangles.
    pub triangle: f32,
}

impl WideCosts {
    /// Expected cost of a random line through the root's box, in visits of a node: as
    /// [`Bvh2::sah_cost`], of a tree whose leaves are tested at once.
    pub fn sah_cost(&self, tree: &Bvh8) -> f64 {
        let Some(root) = tree.root else { return 0.0 };
        let visit = |child: ChildRef| {
            if child.is_leaf() { f64::from(self.leaf(child.leaf_slots().len())) } else { 1.0 }
        };
        let of_node = |node: &Node8| {
            let slots = 0..node.len as usize;
            slots
                .map(|slot| visit(node.children[slot]) * node.bounds(slot).half_area())
                .sum::<f64>()
        };
        let below: f64 = tree.nodes.iter().map(of_node).sum();
        let area = tree.bounds.half_area();
        visit(root) + if area > 0.0 { below / area } else { 0.0 }
    }

    /// Of a leaf of so many triangles.
    #[inline(always)]
    pub fn leaf(&self, triangles: usize) -> f32 {
        self.leaf + self.triangle * triangles as f32
    }
}

impl Default for WideCosts {
    fn default() -> Self {
        Self { leaf: 1.2, triangle: 0.03 }
    }
}

/// The eight-wide tree over the leaves of `tree`, or over several merged into one. `priority` gives
/// the score of a child of a binary node, by the node's index and the child's side: among the
/// children of a wide node those with larger scores come first. On the current rayon pool; the same
/// for any number of threads.
///
/// # Panics
/// If a leaf holds more triangles than a wide one may: see [`Leaves::Wide`](super::Leaves).
pub fn collapse(
    tree: &Bvh2,
    costs: WideCosts,
    priority: impl Fn(usize, usize) -> f64 + Sync,
) -> Bvh8 {
    collapse_and_keep(tree, costs, priority, false).0
}

/// The scores of a wide node's children, slot by slot; least possible for empty slots.
pub(crate) type WideScores = [f32; WIDTH];

/// As [`collapse`], and each node's scores if they are to be kept.
pub(crate) fn collapse_and_keep(
    tree: &Bvh2,
    costs: WideCosts,
    priority: impl Fn(usize, usize) -> f64 + Sync,
    keeps_scores: bool,
) -> (Bvh8, Vec<WideScores>) {
    let count = tree.triangles.len();
    // Not touched before each thread fills its part.
    let mut leaves = vec![0.0; count * LEAF_ROWS + WIDTH];
    let mut triangle_ids = vec![0; count];
    let (mut nodes, mut scores) = (Vec::new(), Vec::new());
    let root = tree.root.map(|root| {
        let plans = plans(tree, costs);
        let layout = Layout { tree, plans: &plans, priority, keeps_scores };
        let mut pieces = Vec::new();
        let mut parts = Vec::new();
        cut_up(&layout, root, &mut pieces, &mut parts);
        fill(&layout, &mut pieces, parts, &mut leaves, &mut triangle_ids);
        let root;
        (nodes, scores, root) = join(&pieces, keeps_scores);
        root
    });
    let (id, bounds) = (Bvh8::new_id(), tree.bounds);
    (Bvh8 { nodes, root, id, bounds, leaves, triangle_ids }, scores)
}

/// Adds the pieces of what `binary` becomes, those of subtrees without nodes yet: `parts` has their
/// roots.
fn cut_up<P: Fn(usize, usize) -> f64>(
    layout: &Layout<'_, P>,
    binary: ChildRef,
    pieces: &mut Vec<Piece>,
    parts: &mut Vec<ChildRef>,
) {
    let is_large = layout.triangles(binary) > SUBTREE_TRIANGLES;
    let Some(children) = is_large.then(|| layout.children(binary)).flatten() else {
        let root = ChildRef::UNUSED;
        pieces.push(Piece::Part(Part { nodes: Vec::new(), scores: Vec::new(), root }));
        parts.push(binary);
        return;
    };
    let own = pieces.len();
    let mut node = children.node();
    pieces.push(Piece::Node(Box::new(node), children.scores()));
    for (child, reference) in children.iter().zip(&mut node.children) {
        *reference = ChildRef::inner(pieces.len());
        cut_up(layout, child.binary, pieces, parts);
    }
    pieces[own] = Piece::Node(Box::new(node), children.scores());
}

/// Lays out all subtrees.
fn fill<P: Fn(usize, usize) -> f64 + Sync>(
    layout: &Layout<'_, P>,
    pieces: &mut [Piece],
    parts: Vec<ChildRef>,
    mut leaves: &mut [f32],
    mut triangle_ids: &mut [u32],
) {
    let mut tasks = Vec::with_capacity(parts.len());
    let mut first_slot = 0;
    let to_fill = pieces.iter_mut().filter_map(|piece| match piece {
        Piece::Node(..) => None,
        Piece::Part(part) => Some(part),
    });
    for (part, binary) in to_fill.zip(parts) {
        let triangles = layout.triangles(binary);
        let (own_leaves, own_ids);
        (own_leaves, leaves) = std::mem::take(&mut leaves).split_at_mut(triangles * LEAF_ROWS);
        (own_ids, triangle_ids) = std::mem::take(&mut triangle_ids).split_at_mut(triangles);
        tasks.push((part, binary, own_leaves, own_ids, first_slot));
        first_slot += triangles;
    }
    tasks.into_par_iter().for_each(|(part, binary, leaves, triangle_ids, first_slot)| {
        let Part { nodes, scores, root } = part;
        let mut output = Output { nodes, scores, leaves, triangle_ids, first_slot, used: 0 };
        *root = layout.emit(binary, &mut output);
    });
}

#[cfg(test)]
mod tests;

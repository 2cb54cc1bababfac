//! Collapses a binary tree into an eight-wide one, by dynamic programming over the surface-area
//! heuristic (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", High Performance Graphics, 2017): for each subtree and each number of
//! slots, the cheapest way to fill them with leaves and nodes.

mod plan;

use crate::geometry::{Aabb, Triangle};
use crate::tree::{
    Bvh2, Bvh8, ChildRef, LEAF_ROWS, MAX_WIDE_LEAF, Node8, WIDTH, write_leaf_in_lanes,
};
use crate::vectorized::vectorized;
use plan::{Plan, plans};
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
    let mut nodes = Vec::new();
    let mut scores = Vec::new();
    let root = tree.root.map(|root| {
        let plans = plans(tree, costs);
        let collapse = Collapse { tree, plans, priority, keeps_scores };
        let mut pieces = Vec::new();
        collapse.cut_up(root, &mut 0, &mut pieces);
        let places = collapse.fill(&mut pieces, &mut leaves, &mut triangle_ids);
        if keeps_scores {
            scores.extend(pieces.iter().flat_map(|piece| match piece {
                Piece::Node(_, scores) => std::slice::from_ref(scores),
                Piece::Subtree(subtree) => subtree.scores.as_slice(),
            }));
        }
        join(&pieces, &places, &mut nodes)
    });
    let (id, bounds) = (Bvh8::new_id(), tree.bounds);
    (Bvh8 { nodes, root, id, bounds, leaves, triangle_ids }, scores)
}

/// A child of a wide node to be.
#[derive(Clone, Copy)]
struct Child {
    binary: ChildRef,
    bounds: Aabb,
    score: f64,
}

/// A part of the wide tree, in depth-first order.
enum Piece {
    /// A node above the subtrees, its children given by the pieces with which they begin.
    Node(Box<Node8>, WideScores),
    /// What becomes of a subtree of the binary tree.
    Subtree(Subtree),
}

struct Subtree {
    binary: ChildRef,
    triangles: usize,
    /// The first of its triangles' slots.
    first_slot: usize,
    /// Its nodes, none yet or with their children counted from the first of them.
    nodes: Vec<Node8>,
    /// Of its nodes, if they are kept.
    scores: Vec<WideScores>,
    root: ChildRef,
}

/// What one thread fills.
struct Output<'a> {
    nodes: &'a mut Vec<Node8>,
    scores: &'a mut Vec<WideScores>,
    leaves: &'a mut [f32],
    triangle_ids: &'a mut [u32],
    first_slot: usize,
    /// Of the slots from the first one on.
    used: usize,
}

struct Collapse<'a, P> {
    tree: &'a Bvh2,
    plans: Vec<Plan>,
    priority: P,
    keeps_scores: bool,
}

impl<P: Fn(usize, usize) -> f64 + Sync> Collapse<'_, P> {
    /// Adds the pieces of what `binary` becomes, its triangles from `slot` on, and moves that on.
    fn cut_up(&self, binary: ChildRef, slot: &mut usize, pieces: &mut Vec<Piece>) {
        let triangles = self.triangles(binary);
        let children = if triangles > SUBTREE_TRIANGLES { self.children(binary) } else { None };
        let Some(children) = children else {
            pieces.push(Piece::Subtree(Subtree {
                binary,
                triangles,
                first_slot: *slot,
                nodes: Vec::new(),
                scores: Vec::new(),
                root: ChildRef::UNUSED,
            }));
            *slot += triangles;
            return;
        };
        let own = pieces.len();
        let mut node = children.node();
        pieces.push(Piece::Node(Box::new(node), children.scores()));
        for (child, reference) in children.iter().zip(&mut node.children) {
            *reference = ChildRef::inner(pieces.len());
            self.cut_up(child.binary, slot, pieces);
        }
        pieces[own] = Piece::Node(Box::new(node), children.scores());
    }

    /// Lays out all subtrees, and returns for each piece the index of its first node.
    fn fill(
        &self,
        pieces: &mut [Piece],
        mut leaves: &mut [f32],
        mut triangle_ids: &mut [u32],
    ) -> Vec<usize> {
        let mut tasks = Vec::new();
        for piece in pieces.iter_mut() {
            let Piece::Subtree(subtree) = piece else { continue };
            let own_leaves;
            let own_ids;
            (own_leaves, leaves) =
                std::mem::take(&mut leaves).split_at_mut(subtree.triangles * LEAF_ROWS);
            (own_ids, triangle_ids) =
                std::mem::take(&mut triangle_ids).split_at_mut(subtree.triangles);
            tasks.push((subtree, own_leaves, own_ids));
        }
        tasks.into_par_iter().for_each(|(subtree, leaves, triangle_ids)| {
            let first_slot = subtree.first_slot;
            let Subtree { nodes, scores, .. } = subtree;
            let mut output = Output { nodes, scores, leaves, triangle_ids, first_slot, used: 0 };
            subtree.root = self.emit(subtree.binary, &mut output);
        });
        let mut next = 0;
        let mut place = |piece: &Piece| {
            let place = next;
            next += match piece {
                Piece::Node(..) => 1,
                Piece::Subtree(subtree) => subtree.nodes.len(),
            };
            place
        };
        pieces.iter().map(&mut place).collect()
    }

    /// Adds what `binary` becomes, a node with all below it or a leaf.
    fn emit(&self, binary: ChildRef, output: &mut Output<'_>) -> ChildRef {
        let Some(children) = self.children(binary) else { return self.emit_leaf(binary, output) };
        let index = output.nodes.len();
        output.nodes.push(children.node());
        if self.keeps_scores {
            output.scores.push(children.scores());
        }
        for (slot, child) in children.iter().enumerate() {
            output.nodes[index].children[slot] = self.emit(child.binary, output);
        }
        ChildRef::inner(index)
    }

    fn emit_leaf(&self, binary: ChildRef, output: &mut Output<'_>) -> ChildRef {
        let mut slots = [0; MAX_WIDE_LEAF];
        let count = self.slots_below(binary, &mut slots, 0);
        let mut triangles = [Triangle::default(); MAX_WIDE_LEAF];
        let first = output.used;
        output.used += count;
        let ids = &mut output.triangle_ids[first..output.used];
        for ((triangle, id), &slot) in triangles.iter_mut().zip(ids).zip(&slots) {
            (*triangle, *id) = (self.tree.triangles[slot], self.tree.triangle_ids[slot]);
        }
        let block = &mut output.leaves[first * LEAF_ROWS..output.used * LEAF_ROWS];
        vectorized(
            #[inline(always)]
            || write_leaf_in_lanes(block, &triangles[..count]),
        );
        ChildRef::leaf(output.first_slot + first, count)
    }

    /// Adds the slots of the triangles below to the first `count`, and returns how many there are.
    fn slots_below(
        &self,
        binary: ChildRef,
        slots: &mut [usize; MAX_WIDE_LEAF],
        count: usize,
    ) -> usize {
        if binary.is_leaf() {
            let own = binary.leaf_slots();
            let end = count + own.len();
            assert!(end <= MAX_WIDE_LEAF, "{end} triangles in a leaf");
            slots[count..end].iter_mut().zip(own).for_each(|(slot, own)| *slot = own);
            return end;
        }
        let children = self.tree.nodes[binary.node_index()].children;
        children.into_iter().fold(count, |count, child| self.slots_below(child, slots, count))
    }

    fn triangles(&self, binary: ChildRef) -> usize {
        if binary.is_leaf() {
            return binary.leaf_slots().len();
        }
        let [lower, upper] = self.tree.nodes[binary.node_index()].counts;
        (lower + upper) as usize
    }

    /// The children in their order, if it becomes a node; `None` for a leaf.
    fn children(&self, binary: ChildRef) -> Option<Children> {
        if binary.is_leaf() {
            return None;
        }
        let first = self.plans[binary.node_index()].as_node()?;
        let mut children = Children::default();
        self.share(binary.node_index(), first, WIDTH, &mut children);
        Some(children)
    }

    /// Fills slots with the two children of a binary node, `first` of them with the first one.
    fn share(&self, node: usize, first: usize, slots: usize, children: &mut Children) {
        let binary = &self.tree.nodes[node];
        for (side, slots) in [first, slots - first].into_iter().enumerate() {
            let child = binary.children[side];
            let shared =
                if child.is_leaf() { None } else { self.plans[child.node_index()].shared(slots) };
            match shared {
                Some((first, slots)) => self.share(child.node_index(), first, slots, children),
                None => children.insert(Child {
                    binary: child,
                    bounds: binary.bounds[side],
                    score: (self.priority)(node, side),
                }),
            }
        }
    }
}

/// The children of a wide node to be, those with larger scores first; ties stay as they came.
#[derive(Clone, Copy)]
struct Children {
    all: [Child; WIDTH],
    len: usize,
}

impl Default for Children {
    fn default() -> Self {
        let none = Child { binary: ChildRef::UNUSED, bounds: Aabb::EMPTY, score: 0.0 };
        Self { all: [none; WIDTH], len: 0 }
    }
}

impl Children {
    fn insert(&mut self, child: Child) {
        let mut slot = self.len;
        while slot > 0 && self.all[slot - 1].score.total_cmp(&child.score).is_lt() {
            self.all[slot] = self.all[slot - 1];
            slot -= 1;
        }
        self.all[slot] = child;
        self.len += 1;
    }

    fn iter(&self) -> std::slice::Iter<'_, Child> {
        self.all[..self.len].iter()
    }

    fn scores(&self) -> WideScores {
        let mut scores = [f32::NEG_INFINITY; WIDTH];
        let all = scores.iter_mut().zip(self.iter());
        all.for_each(|(score, child)| *score = child.score as f32);
        scores
    }

    /// The node, without references to its children.
    fn node(&self) -> Node8 {
        let placed = self.all.map(|child| (ChildRef::UNUSED, child.bounds));
        Node8::new(&placed[..self.len])
    }
}

/// Puts the nodes of all pieces together, each from its place on, and returns the root.
fn join(pieces: &[Piece], places: &[usize], nodes: &mut Vec<Node8>) -> ChildRef {
    let moved = |child: ChildRef, by: usize| {
        if child.is_leaf() { child } else { ChildRef::inner(child.node_index() + by) }
    };
    let begins = |piece: usize| match &pieces[piece] {
        Piece::Node(..) => ChildRef::inner(places[piece]),
        Piece::Subtree(subtree) => moved(subtree.root, places[piece]),
    };
    let count = pieces.last().zip(places.last()).map_or(0, |(piece, place)| match piece {
        Piece::Node(..) => place + 1,
        Piece::Subtree(subtree) => place + subtree.nodes.len(),
    });
    nodes.reserve_exact(count);
    for (piece, &place) in pieces.iter().zip(places) {
        match piece {
            Piece::Node(node, _) => {
                let mut node = **node;
                let count = node.len as usize;
                node.children[..count].iter_mut().for_each(|c| *c = begins(c.node_index()));
                nodes.push(node);
            }
            Piece::Subtree(subtree) => nodes.extend(subtree.nodes.iter().map(|node| {
                let mut node = *node;
                let count = node.len as usize;
                node.children[..count].iter_mut().for_each(|c| *c = moved(*c, place));
                node
            })),
        }
    }
    begins(0)
}

#[cfg(test)]
mod tests;

//! What lies above the parts.

use super::{Builder, LaidOut, Planned};
use crate::build::collapse::{Child, Children, Part as Laid, Piece, Plan};
use crate::geometry::Aabb;
use crate::tree::{Bvh2, ChildRef, Node2, PartSummary, WIDTH};

/// The binary tree above the parts.
pub(super) struct Top {
    /// A leaf for each part, which its slot names.
    tree: Bvh2,
    root: ChildRef,
    plans: Vec<Plan>,
    /// How many each part gets in the node above it.
    pub(super) slots: Vec<usize>,
}

impl Builder<'_> {
    /// Decides on the nodes above the parts.
    pub(super) fn plan_top(
        &self,
        nodes: Vec<Node2>,
        root: ChildRef,
        bounds: Aabb,
        parts: &[Planned<'_>],
    ) -> Top {
        let (notes, triangles, triangle_ids) = Default::default();
        let tree = Bvh2 { nodes, root: Some(root), bounds, triangles, triangle_ids, notes };
        let part = |part: ChildRef, _: &Aabb| parts[part.leaf_slots().start].in_slots;
        let (plans, _) = self.program.plan_all(&tree, part, &mut Vec::new());
        let mut top = Top { tree, root, plans, slots: vec![1; parts.len()] };
        top.give_slots(root, 1);
        top
    }

    /// The pieces of the wide tree: the nodes above the parts, and what is in the slots of these.
    pub(super) fn lay_out_top(&self, top: &Top, parts: Vec<LaidOut>) -> Vec<Piece> {
        let summaries: Vec<PartSummary> = parts.iter().map(|part| part.summary).collect();
        let mut scores = Vec::new();
        self.score(&top.tree, Some(&summaries), &mut scores);
        let mut laid = Laying { top, scores, parts, pieces: Vec::new() };
        if top.root.is_leaf() {
            let only = laid.parts.swap_remove(0).slots.swap_remove(0).0;
            return vec![Piece::Part(only)];
        }
        laid.add_node(top.root.node_index());
        laid.pieces
    }
}

impl Top {
    /// Gives the parts below `binary` their slots, which itself has so many of its parent's.
    fn give_slots(&mut self, binary: ChildRef, slots: usize) {
        if binary.is_leaf() {
            self.slots[binary.leaf_slots().start] = slots;
            return;
        }
        let node = binary.node_index();
        let (first, slots) = self.shares(node, slots);
        let [lower, upper] = self.tree.nodes[node].children;
        self.give_slots(lower, first);
        self.give_slots(upper, slots - first);
    }

    /// The slots that go to the first child of a node, and to both: of its parent's, or of its own.
    fn shares(&self, node: usize, slots: usize) -> (usize, usize) {
        let plan = &self.plans[node];
        let own = || (plan.as_node().expect("more triangles than a leaf holds"), WIDTH);
        plan.shared(slots).unwrap_or_else(own)
    }
}

/// The wide nodes above the parts, under way.
struct Laying<'a> {
    top: &'a Top,
    scores: Vec<[f64; 2]>,
    parts: Vec<LaidOut>,
    pieces: Vec<Piece>,
}

impl Laying<'_> {
    /// Adds the wide node that a binary one becomes, and all below.
    fn add_node(&mut self, node: usize) {
        let mut children = Children::default();
        let first = self.top.plans[node].as_node().expect("more triangles than a leaf holds");
        let mut laid = Vec::with_capacity(WIDTH);
        self.share(node, [first, WIDTH - first], &mut children, &mut laid);
        let own = self.pieces.len();
        let mut wide = children.node();
        self.pieces.push(Piece::Node(Box::new(wide), children.scores()));
        for (child, reference) in children.iter().zip(&mut wide.children) {
            *reference = ChildRef::inner(self.pieces.len());
            if child.binary.is_leaf() {
                let part: Option<Laid> = laid[child.binary.leaf_slots().start].take();
                self.pieces.push(Piece::Part(part.expect("each has one place")));
            } else {
                self.add_node(child.binary.node_index());
            }
        }
        self.pieces[own] = Piece::Node(Box::new(wide), children.scores());
    }

    /// Adds what is in the slots of the two children of a node, parts by their place in `laid`.
    fn share(
        &mut self,
        node: usize,
        slots: [usize; 2],
        children: &mut Children,
        laid: &mut Vec<Option<Laid>>,
    ) {
        let binary = &self.top.tree.nodes[node];
        for (side, slots) in slots.into_iter().enumerate() {
            let (child, own_score) = (binary.children[side], self.scores[node][side]);
            if child.is_leaf() {
                let part = std::mem::take(&mut self.parts[child.leaf_slots().start].slots);
                let is_whole = part.len() == 1;
                for (part, bounds, score) in part {
                    let score = if is_whole { own_score } else { score };
                    children.insert(Child { binary: ChildRef::leaf(laid.len(), 1), bounds, score });
                    laid.push(Some(part));
                }
            } else if let Some((first, slots)) = self.top.plans[child.node_index()].shared(slots) {
                self.share(child.node_index(), [first, slots - first], children, laid);
            } else {
                let bounds = binary.bounds[side];
                children.insert(Child { binary: child, bounds, score: own_score });
            }
        }
    }
}

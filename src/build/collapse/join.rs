//! A wide tree from parts that were laid out on their own.

use super::WideScores;
use crate::filled;
use crate::tree::{ChildRef, Node8};

/// A part of a wide tree, in depth-first order.
pub(in crate::build) enum Piece {
    /// A node above the parts, its children given by the pieces with which they begin.
    Node(Box<Node8>, WideScores),
    /// All nodes below one that is above them.
    Part(Part),
}

/// Nodes, with their children counted from the first of them: none if the root is a leaf.
pub(in crate::build) struct Part {
    pub(in crate::build) nodes: Vec<Node8>,
    /// Of the nodes, if they are kept.
    pub(in crate::build) scores: Vec<WideScores>,
    pub(in crate::build) root: ChildRef,
}

impl Piece {
    fn len(&self) -> usize {
        match self {
            Self::Node(..) => 1,
            Self::Part(part) => part.nodes.len(),
        }
    }
}

/// The nodes of all pieces together, their scores if they are kept, and the root.
pub(in crate::build) fn join(
    pieces: &[Piece],
    keeps_scores: bool,
) -> (Vec<Node8>, Vec<WideScores>, ChildRef) {
    let mut count = 0;
    let places: Vec<usize> = pieces.iter().map(|piece| (count, count += piece.len()).0).collect();
    let moved = |child: ChildRef, by: usize| {
        if child.is_leaf() { child } else { ChildRef::inner(child.node_index() + by) }
    };
    let begins = |piece: usize| match &pieces[piece] {
        Piece::Node(..) => ChildRef::inner(places[piece]),
        Piece::Part(part) => moved(part.root, places[piece]),
    };
    let lengths: Vec<usize> = pieces.iter().map(Piece::len).collect();
    let (nodes, _) = filled::in_parts(&lengths, |piece, own| match &pieces[piece] {
        Piece::Node(node, _) => {
            own.push(**node);
            let children = own.filled()[0].children_mut();
            children.iter_mut().for_each(|child| *child = begins(child.node_index()));
        }
        Piece::Part(part) => {
            for node in &part.nodes {
                own.push(*node);
            }
            for node in own.filled() {
                let children = node.children_mut().iter_mut();
                children.for_each(|child| *child = moved(*child, places[piece]));
            }
        }
    });
    let mut scores = Vec::new();
    if keeps_scores {
        scores.extend(pieces.iter().flat_map(|piece| match piece {
            Piece::Node(_, scores) => std::slice::from_ref(scores),
            Piece::Part(part) => part.scores.as_slice(),
        }));
    }
    (nodes, scores, begins(0))
}

//! A wide tree from parts that were laid out on their own.

use super::WideScores;
use crate::huge_pages;
use crate::tree::{ChildRef, Node8};
use bytemuck::zeroed_vec;
use rayon::prelude::*;

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
    let mut nodes = zeroed_vec::<Node8>(count);
    huge_pages::ask_for(&mut nodes);
    let mut rest = nodes.as_mut_slice();
    let mut tasks = Vec::with_capacity(pieces.len());
    for (piece, &place) in pieces.iter().zip(&places) {
        let (own, others) = rest.split_at_mut(piece.len());
        rest = others;
        tasks.push((piece, place, own));
    }
    tasks.into_par_iter().for_each(|(piece, place, own)| match piece {
        Piece::Node(node, _) => {
            own[0] = **node;
            own[0].children_mut().iter_mut().for_each(|child| *child = begins(child.node_index()));
        }
        Piece::Part(part) => {
            own.copy_from_slice(&part.nodes);
            for node in own {
                node.children_mut().iter_mut().for_each(|child| *child = moved(*child, place));
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

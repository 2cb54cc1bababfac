//! What a builder knows of the two sides of each split, kept for the orders that ask no more.

use super::{Node2, NodeBits};

/// Comparisons of the two children of each node, ties not set. Orders by area or count are nothing
/// but these, as in "SATO: Surface-Area Traversal Order for Shadow Ray Tracing" (Nah and Manocha,
/// Computer Graphics Forum 33(6), 2014), where the builder compares while both sides are at hand.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SplitNotes {
    /// Whether child 1 has the larger surface.
    pub second_larger: NodeBits,
    /// Whether there are fewer triangles below child 1.
    pub second_fewer: NodeBits,
}

impl SplitNotes {
    /// In a builder's byte for a node: child 1 has the larger surface.
    pub(crate) const LARGER: u8 = 1;
    /// Likewise: there are fewer triangles below child 1.
    pub(crate) const FEWER: u8 = 2;

    /// From a builder's byte for each node.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Self {
        let noted = |note: u8| NodeBits::from_fn(bytes.len(), |i| bytes[i] & note != 0);
        Self { second_larger: noted(Self::LARGER), second_fewer: noted(Self::FEWER) }
    }

    /// Of the nodes of a finished binary tree.
    pub fn of(nodes: &[Node2]) -> Self {
        Self {
            second_larger: NodeBits::from_fn(nodes.len(), |i| nodes[i].second_is_larger()),
            second_fewer: NodeBits::from_fn(nodes.len(), |i| {
                nodes[i].counts[1] < nodes[i].counts[0]
            }),
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.second_larger.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.second_larger.is_empty()
    }

    /// Bytes of all bits.
    pub fn memory_bytes(&self) -> u64 {
        self.second_larger.memory_bytes() + self.second_fewer.memory_bytes()
    }
}

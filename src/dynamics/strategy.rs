//! Ways for a tree to follow its triangles, and for its order to follow the tree.

/// How a tree follows its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// A new tree for each frame.
    Rebuild,
    /// The same tree with new boxes.
    Refit,
    /// New boxes, and rotations.
    Rotate,
    /// As `Rotate`, and a new tree when [`SkiRental`](super::SkiRental) says so.
    Auto,
}

impl Strategy {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Rebuild, Self::Refit, Self::Rotate, Self::Auto];

    /// As typed after `update=`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rebuild => "rebuild",
            Self::Refit => "refit",
            Self::Rotate => "rotate",
            Self::Auto => "auto",
        }
    }

    /// What it is, in a line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Rebuild => "built anew for each frame",
            Self::Refit => "boxes brought up to date in a tree that stays as it was built",
            Self::Rotate => "refit, with subtrees put elsewhere where that makes the tree better",
            Self::Auto => "rotate, and built anew once slower tracing has cost as much as a build",
        }
    }
}

/// When the order of nodes is looked at again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Upkeep {
    /// Never: nodes keep the order that they were built with, whatever is below them now.
    None,
    /// Where children were exchanged, or what an order sums up below a node was.
    Selective,
    /// Everywhere.
    Full,
}

impl Upkeep {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Selective, Self::Full];

    /// As typed after `upkeep=`.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Selective => "selective",
            Self::Full => "full",
        }
    }

    /// What it is, in a line.
    pub fn about(self) -> &'static str {
        match self {
            Self::None => "never: each node keeps the order that it was built with",
            Self::Selective => {
                "where children were exchanged, and above where the order asks for it"
            }
            Self::Full => "at all nodes in each frame",
        }
    }
}

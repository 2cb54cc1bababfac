//! Builders of binary trees, and their catalogue. A builder knows nothing of traversal orders.

mod any_hit;
mod binned;
mod clip;
mod collapse;
mod in_parts;
pub mod kd_sah;
mod object_split;
mod reinsertion;
mod small;
mod spatial;
mod subtrees;
mod sweep;
mod top_down;
mod top_reinsertion;

pub use collapse::{WideCosts, collapse};
pub(crate) use collapse::{WideScores, collapse_and_keep};
pub use in_parts::{BuiltInParts, PartOrder};
pub use small::{MOST_SMALL, small_tree};

use crate::geometry::TriangleMesh;
use crate::tree::Bvh2;

/// One way to build a binary tree.
#[derive(Debug)]
pub struct BuilderEntry {
    /// As typed after `builder=`.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Builds on the current rayon pool. The tree is the same for any number of threads.
    pub build: fn(&TriangleMesh, Leaves) -> Bvh2,
    /// Builds an eight-wide tree without a binary one of all triangles, likewise; `None` where that has
    /// to be collapsed.
    pub in_parts: Option<fn(&TriangleMesh, PartOrder) -> BuiltInParts>,
}

/// Where a builder ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// At leaves of as many triangles as suit tests one by one.
    Fit,
    /// Where splitting further cannot pay by [`WideCosts`]: [`collapse`] puts leaves together.
    Wide,
    /// At single references, each whatever the heuristic says.
    Single,
}

/// All builders.
pub static BUILDERS: &[&BuilderEntry] = &[
    &binned::ENTRY,
    &top_reinsertion::ENTRY,
    &sweep::ENTRY,
    &spatial::ENTRY,
    &reinsertion::ENTRY,
    &any_hit::ENTRY,
];

/// The builder called `name`.
pub fn find(name: &str) -> Option<&'static BuilderEntry> {
    BUILDERS.iter().copied().find(|b| b.name == name)
}

/// An integer that sorts as the finite `position` does, with both zeros alike.
#[inline(always)]
fn ordered(position: f32) -> u32 {
    let bits = (position + 0.0).to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

#[cfg(test)]
mod tests;

//! Where in the tree rays of a batch start: rays that have enough in common start at the few subtrees that they
//! can meet, or nowhere.

use super::hull::Hull;
use super::numbers::Target;
use super::octants::EntryPoint;
use super::rays::STREAM;
use super::simd::Simd;
use super::stream::Trees;
use crate::geometry::TriangleMesh;
use crate::ray::Ray;
use crate::trace::shaft::Gate;
use crate::tree::{Bvh8, ChildRef, Node8, WIDTH};

/// Rays of an octant that are looked at together: more have less in common, and a look at fewer may cost more
/// than it saves, as it takes as long as 10 to 30 rays in the tree.
pub(super) const RUN: usize = 4 * STREAM;
const LEAST: usize = STREAM;

/// Nodes that are opened in a look.
const MOST_OPENED: usize = 12;

/// Subtrees under consideration: more than a node may have, as many of them may turn out empty.
const MOST_PARTS: usize = 16;

/// Where some rays of a batch start that go into one octant, and would start at a given node or the root. Adds
/// the node if it is another one.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the batch has at hand")]
pub(super) fn look<S: Simd, T: Trees>(
    s: S,
    trees: T,
    given: Option<&Node8>,
    batch: &[Ray],
    run: &[u16],
    target: Target<'_>,
    gate: &mut Gate,
    entries: &mut Vec<Node8>,
) -> EntryPoint {
    if run.len() < LEAST || !gate.is_open() {
        return EntryPoint::Whole;
    }
    // Other leaves hold no triangles.
    let mesh = (!T::PUTS_OFF).then_some(target.mesh);
    let found = match Hull::around(s, batch, run, target) {
        Some(hull) => entry(s, &hull, trees.tree(), given, mesh),
        None => None,
    };
    gate.note(found.is_some());
    match found {
        None => EntryPoint::Whole,
        Some(node) if node.len == 0 => EntryPoint::Nowhere,
        Some(node) => {
            entries.push(node);
            EntryPoint::From(entries.len() - 1)
        }
    }
}

/// What of a tree, or below a given node, the rays in a hull may meet: up to eight subtrees, in the order of
/// visits. `None` if that tells nothing.
#[inline(always)]
fn entry<S: Simd>(
    s: S,
    hull: &Hull,
    tree: &Bvh8,
    given: Option<&Node8>,
    mesh: Option<&TriangleMesh>,
) -> Option<Node8> {
    let root = match given {
        Some(node) => node,
        None => &tree.nodes[tree.root.filter(|root| !root.is_leaf())?.node_index()],
    };
    let (mut first, mut second) = (Parts::NONE, Parts::NONE);
    let (mut parts, mut next) = (&mut first, &mut second);
    parts.add(s, root, hull.meets(s, root));
    let mut entry = parts.node(s);
    let mut tells = entry.len < root.len;
    let mut budget = MOST_OPENED;
    while budget > 0 && parts.children[..parts.len].iter().any(|child| !child.is_leaf()) {
        next.len = 0;
        for part in 0..parts.len {
            let child = parts.children[part];
            if budget == 0 || child.is_leaf() {
                next.take(parts, part);
            } else {
                budget -= 1;
                let node = &tree.nodes[child.node_index()];
                next.add(s, node, hull.meets(s, node));
            }
            if next.len > MOST_PARTS {
                break;
            }
        }
        if next.len > MOST_PARTS {
            break;
        }
        std::mem::swap(&mut parts, &mut next);
        if parts.len <= WIDTH {
            entry = parts.node(s);
            tells = true;
        }
    }
    // Boxes have said what they can: now the triangles of what is left.
    if let Some(mesh) = mesh.filter(|_| tells) {
        let mut kept = 0;
        for slot in 0..entry.len as usize {
            let child = entry.children[slot];
            if !child.is_leaf() || hull.meets_leaf(s, tree, mesh, child) {
                for planes in entry.planes.as_flattened_mut() {
                    planes[kept] = planes[slot];
                }
                entry.children[kept] = child;
                kept += 1;
            }
        }
        entry.len = kept as u32;
    }
    tells.then_some(entry)
}

/// Subtrees with their boxes, in reverse order of visits.
struct Parts {
    planes: [[f32; Self::ROOM]; 6],
    children: [ChildRef; Self::ROOM],
    len: usize,
}

impl Parts {
    const ROOM: usize = MOST_PARTS + 1 + WIDTH;
    const NONE: Self =
        Self { planes: [[0.0; Self::ROOM]; 6], children: [ChildRef::UNUSED; Self::ROOM], len: 0 };

    /// Adds some children of a node, one bit each.
    #[inline(always)]
    fn add<S: Simd>(&mut self, s: S, node: &Node8, some: u32) {
        let there = self.len..self.len + WIDTH;
        for (to, planes) in self.planes.iter_mut().zip(node.planes.as_flattened()) {
            let to = &mut to[there.clone()];
            s.pick_numbers(planes, some, to.try_into().expect("eight places"));
        }
        let to = &mut self.children[there];
        s.pick(&node.children, some, to.try_into().expect("eight places"));
        self.len += some.count_ones() as usize;
    }

    /// Adds one of others.
    #[inline(always)]
    fn take(&mut self, others: &Self, part: usize) {
        for (to, planes) in self.planes.iter_mut().zip(&others.planes) {
            to[self.len] = planes[part];
        }
        self.children[self.len] = others.children[part];
        self.len += 1;
    }

    /// A node of these, which are no more than eight.
    #[inline(always)]
    fn node<S: Simd>(&self, s: S) -> Node8 {
        let mut node = Node8::new(&[]);
        let all = (1 << self.len) - 1;
        for (to, planes) in node.planes.as_flattened_mut().iter_mut().zip(&self.planes) {
            s.pick_numbers(planes[..WIDTH].try_into().expect("eight places"), all, to);
        }
        let children = self.children[..WIDTH].try_into().expect("eight places");
        s.pick(children, all, &mut node.children);
        node.len = self.len as u32;
        node
    }
}

#[cfg(test)]
mod tests;

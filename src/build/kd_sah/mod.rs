//! Kd-trees by the surface-area heuristic (Wald and Havran, "On building fast kd-Trees for Ray
//! Tracing, and on doing that in O(N log N)", IEEE Symposium on Interactive Ray Tracing, 2006).
//!
//! The ends of all boxes are sorted once. A node's cheapest plane is found in one sweep over each
//! axis; its sorted events are then dealt out to its sides, and only references that the plane cuts
//! get new ones. Subtrees of some size are built in parallel; the tree does not depend on the
//! number of threads.
//!
//! # Why every accepted hit is found
//!
//! The kernel cuts a ray's interval at each plane by the arithmetic of the box test, so a ray's
//! interval in a cell is that of the padded box test of the cell, and is empty only where that
//! fails (see [`trace::kd`](crate::trace::kd)). A hit means that the ray enters `Q`, a tiny box
//! around a point of the triangle, at some `t` that is not beyond the hit (see
//! [`intersect`](crate::intersect)). What remains to be shown is that the triangle is listed in a
//! leaf whose interval holds that `t`. The root's does. At a plane, if the triangle's box, cut to
//! the cell, lies on one side, then so do `Q` and `t` by monotony, and the triangle is listed there;
//! if not, it is listed on both sides, and `t` lies on one, as the two intervals overlap. With
//! [`Splits::Perfect`] the clipped boxes are smaller, but cover what is left of `Q` on their side
//! (see `build::clip`): where one does not reach into a cell, `Q` does not.

mod events;
mod split;

use super::clip::clipped_bounds;
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::tree::{KD_MAX_DEPTH, KD_MAX_NODES, KdNode, KdTree, SplitNotes};
use events::{EventList, MAX_REFERENCES, Target, distribute, push_events};
use rayon::prelude::*;
use split::{Side, Split, best_on_axis, leaf_cost};

/// What is listed in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Splits {
    /// Triangles that reach into it, each cut by a plane being clipped to the new cells.
    #[default]
    Perfect,
    /// Triangles whose boxes reach into it.
    Boxes,
}

/// Nodes whose sides are worth another thread.
const PARALLEL_NODE: usize = 8192;

/// Nodes whose axes are worth a thread each.
const PARALLEL_AXES: usize = 1 << 16;

/// Builds the tree on the current rayon pool.
///
/// # Errors
/// If the mesh or the tree is larger than the layout can hold.
pub fn build(mesh: &TriangleMesh, splits: Splits) -> Result<KdTree, String> {
    let triangles: Vec<Triangle> =
        (0..mesh.len()).into_par_iter().map(|i| mesh.triangle(i)).collect();
    if triangles.len() > MAX_REFERENCES {
        return Err(format!("more than {MAX_REFERENCES} triangles"));
    }
    let references: Vec<Reference> = triangles
        .par_iter()
        .zip(0..triangles.len() as u32)
        .map(|(triangle, id)| Reference { bounds: triangle.bounds(), id })
        .collect();
    let bounds = references.iter().fold(Aabb::EMPTY, |b, r| b.union(r.bounds));
    let mut subtree = Subtree::default();
    if !references.is_empty() {
        let root = Node { events: sorted_events(&references), references };
        // Wald and Havran cite Havran's thesis; the constants are those of Pharr and Humphreys,
        // "Physically Based Rendering", 2004.
        let depth = (8.0 + 1.3 * (triangles.len() as f64).log2()) as usize;
        let builder = Builder { triangles: &triangles, splits };
        builder.grow(root, &bounds, depth.min(KD_MAX_DEPTH), &mut subtree);
    }
    if subtree.nodes.len() > KD_MAX_NODES || u32::try_from(subtree.references.len()).is_err() {
        return Err(format!(
            "{} nodes and {} references are more than a tree can hold",
            subtree.nodes.len(),
            subtree.references.len()
        ));
    }
    Ok(laid_out(subtree, &triangles, bounds))
}

/// Moves the triangles into the order in which leaves refer to them.
fn laid_out(subtree: Subtree, triangles: &[Triangle], bounds: Aabb) -> KdTree {
    let Subtree { mut nodes, mut counts, mut references, notes } = subtree;
    nodes.shrink_to_fit();
    counts.shrink_to_fit();
    references.shrink_to_fit();
    let mut slots = vec![u32::MAX; triangles.len()];
    let mut triangle_ids = Vec::with_capacity(triangles.len());
    for reference in &mut references {
        let slot = &mut slots[*reference as usize];
        if *slot == u32::MAX {
            *slot = triangle_ids.len() as u32;
            triangle_ids.push(*reference);
        }
        *reference = *slot;
    }
    let triangles = triangle_ids.par_iter().map(|&id| triangles[id as usize]).collect();
    let notes = SplitNotes::from_bytes(&notes);
    KdTree { nodes, counts, references, triangles, triangle_ids, bounds, notes }
}

fn sorted_events(references: &[Reference]) -> [EventList; 3] {
    let sorted = |axis: usize| {
        let mut events = Vec::with_capacity(2 * references.len());
        for (index, reference) in references.iter().enumerate() {
            push_events(&mut events, &reference.bounds, axis, index);
        }
        events.par_sort_unstable();
        events
    };
    [sorted(0), sorted(1), sorted(2)]
}

/// The part of a triangle in a cell.
#[derive(Clone, Copy)]
struct Reference {
    bounds: Aabb,
    id: u32,
}

/// A node to be: its references, and their events on each axis.
struct Node {
    references: Vec<Reference>,
    events: [EventList; 3],
}

/// Nodes in depth-first order, the counts of each, the leaves' lists of mesh indices, and what is
/// noted of the nodes with two children.
#[derive(Default)]
struct Subtree {
    nodes: Vec<KdNode>,
    counts: Vec<u32>,
    references: Vec<u32>,
    notes: Vec<u8>,
}

impl Subtree {
    fn append(&mut self, mut other: Self) {
        let (nodes, references) = (self.nodes.len(), self.references.len());
        // Sizes that overflow the layout are refused at the end.
        if nodes + other.nodes.len() <= KD_MAX_NODES {
            other.nodes.iter_mut().for_each(|n| n.relocate(nodes, references));
        }
        self.nodes.append(&mut other.nodes);
        self.counts.append(&mut other.counts);
        self.references.append(&mut other.references);
        self.notes.append(&mut other.notes);
    }
}

struct Builder<'a> {
    triangles: &'a [Triangle],
    splits: Splits,
}

impl Builder<'_> {
    /// Appends the subtree of a node that holds something, at most `depth` inner nodes deep.
    fn grow(&self, node: Node, cell: &Aabb, depth: usize, subtree: &mut Subtree) {
        let count = node.references.len();
        let index = subtree.nodes.len();
        subtree.counts.push(count as u32);
        subtree.notes.push(0);
        let best = if depth == 0 { None } else { best_split(&node, cell) };
        let Some(split) = best.filter(|s| s.cost < leaf_cost(count, cell)) else {
            subtree.nodes.push(KdNode::leaf(subtree.references.len(), count));
            subtree.references.extend(node.references.iter().map(|r| r.id));
            return;
        };
        let (axis, at) = (split.axis, f64::from(split.position));
        let inner = KdNode::inner(axis, split.position);
        subtree.nodes.push(inner);
        let cells = KdTree::split_cell(cell, inner);
        let [lower, upper] = self.divided(node, &split, &cells);
        if lower.references.is_empty() || upper.references.is_empty() {
            let is_upper = lower.references.is_empty();
            subtree.nodes[index].set_single(is_upper);
            let (node, cell) = if is_upper { (upper, &cells[1]) } else { (lower, &cells[0]) };
            self.grow(node, cell, depth - 1, subtree);
            return;
        }
        // Both cells share the plane's cross-section: the longer one is the larger one.
        if f64::from(cell.max[axis]) - at > at - f64::from(cell.min[axis]) {
            subtree.notes[index] |= SplitNotes::LARGER;
        }
        if upper.references.len() < lower.references.len() {
            subtree.notes[index] |= SplitNotes::FEWER;
        }
        if count > PARALLEL_NODE {
            let ((), beside) = rayon::join(
                || self.grow(lower, &cells[0], depth - 1, subtree),
                || {
                    let mut beside = Subtree::default();
                    self.grow(upper, &cells[1], depth - 1, &mut beside);
                    beside
                },
            );
            Self::set_upper_child(subtree, index);
            subtree.append(beside);
        } else {
            self.grow(lower, &cells[0], depth - 1, subtree);
            Self::set_upper_child(subtree, index);
            self.grow(upper, &cells[1], depth - 1, subtree);
        }
    }

    /// The upper child comes next.
    fn set_upper_child(subtree: &mut Subtree, parent: usize) {
        let next = subtree.nodes.len();
        if next < KD_MAX_NODES {
            subtree.nodes[parent].set_upper_child(next);
        }
    }

    /// Deals out a node's references and events to the two sides of `split`.
    fn divided(&self, node: Node, split: &Split, cells: &[Aabb; 2]) -> [Node; 2] {
        let mut sides = split.counts.map(Vec::with_capacity);
        let mut renewed = [const { [const { Vec::new() }; 2] }; 3];
        let mut targets = Vec::with_capacity(node.references.len());
        for reference in &node.references {
            if let Some(side) = split.side(&reference.bounds) {
                targets.push(Target::new(side, sides[side as usize].len()));
                sides[side as usize].push(*reference);
                continue;
            }
            targets.push(Target::RENEWED);
            let parts = self.parts(reference, split, cells);
            for (side, bounds) in parts.into_iter().enumerate() {
                let Some(bounds) = bounds else { continue };
                for (axis, renewed) in renewed.iter_mut().enumerate() {
                    push_events(&mut renewed[side], &bounds, axis, sides[side].len());
                }
                sides[side].push(Reference { bounds, id: reference.id });
            }
        }
        let large = node.references.len() > PARALLEL_AXES;
        drop(node.references);
        let [lower, upper] = sides;
        let expected = [lower.len(), upper.len()];
        let on_axis = |(events, mut renewed): (EventList, [EventList; 2])| {
            renewed.iter_mut().for_each(|list| list.sort_unstable());
            distribute(events, &targets, renewed, expected)
        };
        let [x, y, z] = node.events;
        let [renewed_x, renewed_y, renewed_z] = renewed;
        let (x, y, z) = ((x, renewed_x), (y, renewed_y), (z, renewed_z));
        let ([x0, x1], ([y0, y1], [z0, z1])) = if large {
            rayon::join(|| on_axis(x), || rayon::join(|| on_axis(y), || on_axis(z)))
        } else {
            (on_axis(x), (on_axis(y), on_axis(z)))
        };
        [
            Node { references: lower, events: [x0, y0, z0] },
            Node { references: upper, events: [x1, y1, z1] },
        ]
    }

    /// The boxes around both parts of a reference that the plane cuts; at least one.
    fn parts(&self, reference: &Reference, split: &Split, cells: &[Aabb; 2]) -> [Option<Aabb>; 2] {
        let mut halves = [reference.bounds; 2];
        halves[Side::Lower as usize].max[split.axis] = split.position;
        halves[Side::Upper as usize].min[split.axis] = split.position;
        if self.splits == Splits::Perfect {
            let triangle = &self.triangles[reference.id as usize];
            let clipped: [_; 2] =
                std::array::from_fn(|i| clipped_bounds(triangle, &cells[i], &halves[i]));
            // Rounding alone could have it vanish from both; it must not.
            if clipped != [None; 2] {
                return clipped;
            }
        }
        halves.map(Some)
    }
}

/// The cheapest split on any axis; the first of equals.
fn best_split(node: &Node, cell: &Aabb) -> Option<Split> {
    let count = node.references.len();
    let on_axis = |axis: usize| best_on_axis(&node.events[axis], axis, count, cell);
    let (x, (y, z)) = if count > PARALLEL_AXES {
        rayon::join(|| on_axis(0), || rayon::join(|| on_axis(1), || on_axis(2)))
    } else {
        (on_axis(0), (on_axis(1), on_axis(2)))
    };
    [x, y, z].into_iter().flatten().reduce(|a, b| if b.cost < a.cost { b } else { a })
}

#[cfg(test)]
mod tests;

//! Splits the leaves of a binary tree down to single triangles, by the surface-area heuristic over
//! all splits of the sorted centres: what a wide tree puts together in its leaves depends on costs
//! that the binary tree's builder does not know.

use crate::geometry::{Aabb, Triangle};
use crate::tree::{Bvh2, ChildRef, Node2, SplitNotes};

/// The same tree with one triangle in each leaf.
pub fn split_leaves(tree: &Bvh2) -> Bvh2 {
    let count = tree.triangles.len();
    let mut split = Bvh2 {
        nodes: Vec::with_capacity(count.saturating_sub(1)),
        root: None,
        bounds: tree.bounds,
        triangles: tree.triangles.clone(),
        triangle_ids: tree.triangle_ids.clone(),
        notes: SplitNotes::default(),
    };
    split.root = tree.root.map(|root| copy(tree, root, &mut split));
    split.notes = SplitNotes::of(&split.nodes);
    split
}

fn copy(tree: &Bvh2, child: ChildRef, split: &mut Bvh2) -> ChildRef {
    if child.is_leaf() {
        let slots = child.leaf_slots();
        return split_range(slots.start, slots.end, split);
    }
    let index = split.nodes.len();
    split.nodes.push(tree.nodes[child.node_index()]);
    for side in 0..2 {
        let child = tree.nodes[child.node_index()].children[side];
        split.nodes[index].children[side] = copy(tree, child, split);
    }
    ChildRef::inner(index)
}

/// Splits the triangles in slots from `first` to before `end`, and sorts them.
fn split_range(first: usize, end: usize, split: &mut Bvh2) -> ChildRef {
    let count = end - first;
    if count == 1 {
        return ChildRef::leaf(first, 1);
    }
    let mut triangles: Vec<(Triangle, u32)> =
        (first..end).map(|slot| (split.triangles[slot], split.triangle_ids[slot])).collect();
    let mut best = (f64::INFINITY, 0, count / 2);
    for axis in 0..3 {
        sort_along(axis, &mut triangles);
        let mut right = vec![Aabb::EMPTY; count + 1];
        for i in (0..count).rev() {
            right[i] = right[i + 1].union(triangles[i].0.bounds());
        }
        let mut left = Aabb::EMPTY;
        for middle in 1..count {
            left = left.union(triangles[middle - 1].0.bounds());
            let cost = left.half_area() * middle as f64
                + right[middle].half_area() * (count - middle) as f64;
            if cost < best.0 {
                best = (cost, axis, middle);
            }
        }
    }
    let (_, axis, middle) = best;
    sort_along(axis, &mut triangles);
    for (slot, (triangle, id)) in triangles.iter().enumerate() {
        split.triangles[first + slot] = *triangle;
        split.triangle_ids[first + slot] = *id;
    }
    let bounds = |half: &[(Triangle, u32)]| {
        half.iter().fold(Aabb::EMPTY, |bounds, t| bounds.union(t.0.bounds()))
    };
    let index = split.nodes.len();
    split.nodes.push(Node2 {
        bounds: [bounds(&triangles[..middle]), bounds(&triangles[middle..])],
        children: [ChildRef::UNUSED; 2],
        counts: [middle as u32, (count - middle) as u32],
    });
    let left = split_range(first, first + middle, split);
    let right = split_range(first + middle, end, split);
    split.nodes[index].children = [left, right];
    ChildRef::inner(index)
}

fn sort_along(axis: usize, triangles: &mut [(Triangle, u32)]) {
    let center = |t: &(Triangle, u32)| t.0.bounds().center()[axis];
    triangles.sort_by(|a, b| center(a).total_cmp(&center(b)).then(a.1.cmp(&b.1)));
}

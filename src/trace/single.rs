//! One ray at a time through a binary tree.
//!
//! Both children's boxes are tested where their parent is visited, so the nodes that a ray visits
//! if nothing stops it are the same under every order.

use super::Counter;
use crate::intersect::{PreparedRay, TriangleTest};
use crate::ray::{Hit, Ray};
use crate::tree::{Bvh2, ChildRef, MAX_DEPTH, Node2, NodeBits, Plan};

/// Which of two children that the ray enters at the given distances comes first.
pub(super) trait FirstChild {
    /// Whether it depends on the ray.
    const BY_RAY: bool;
    /// Whether that is child 1 of the node at `index`.
    fn is_second(&self, index: usize, entry: [f32; 2]) -> bool;
}

/// As each node's bit says.
pub(super) struct Fixed<'a>(pub(super) &'a NodeBits);
impl FirstChild for Fixed<'_> {
    const BY_RAY: bool = false;
    #[inline(always)]
    fn is_second(&self, index: usize, _: [f32; 2]) -> bool {
        self.0.get(index)
    }
}

pub(super) struct NearFirst;
impl FirstChild for NearFirst {
    const BY_RAY: bool = true;
    #[inline(always)]
    fn is_second(&self, _: usize, entry: [f32; 2]) -> bool {
        entry[1] < entry[0]
    }
}

pub(super) struct FarFirst;
impl FirstChild for FarFirst {
    const BY_RAY: bool = true;
    #[inline(always)]
    fn is_second(&self, _: usize, entry: [f32; 2]) -> bool {
        entry[1] > entry[0]
    }
}

/// Whether anything below `from`, which for all of the tree is its root, is in the way of `ray`,
/// visiting children as `plan` says.
#[inline]
pub fn any_hit<T: TriangleTest, C: Counter>(
    tree: &Bvh2,
    from: Option<ChildRef>,
    plan: &Plan,
    test: T,
    ray: &Ray,
    counter: &mut C,
) -> bool {
    match plan {
        Plan::Fixed(bits) => any_hit_by(tree, from, &Fixed(bits), test, ray, counter),
        Plan::Near => any_hit_by(tree, from, &NearFirst, test, ray, counter),
        Plan::Far => any_hit_by(tree, from, &FarFirst, test, ray, counter),
    }
}

fn any_hit_by<F: FirstChild, T: TriangleTest, C: Counter>(
    tree: &Bvh2,
    from: Option<ChildRef>,
    order: &F,
    test: T,
    ray: &Ray,
    counter: &mut C,
) -> bool {
    let Some(root) = from else { return false };
    let Some(prepared) = PreparedRay::new(ray, &tree.bounds) else { return false };
    if prepared.enter(&tree.bounds).is_none() {
        return false;
    }
    let mut stack = [root; MAX_DEPTH];
    let mut pending = 0;
    let mut current = root;
    loop {
        counter.enter(current);
        if current.is_leaf() {
            for triangle in &tree.triangles[current.leaf_slots()] {
                counter.triangles(1);
                let (hit, by) = test.hits(&prepared, triangle);
                counter.settled(by);
                if hit {
                    return true;
                }
            }
        } else {
            let index = current.node_index();
            let node: &Node2 = &tree.nodes[index];
            let [a, b] = &node.bounds;
            let entry = [prepared.enter(a), prepared.enter(b)];
            match entry {
                [Some(first), Some(second)] => {
                    let swap = usize::from(order.is_second(index, [first, second]));
                    stack[pending] = node.children[1 - swap];
                    pending += 1;
                    current = node.children[swap];
                    continue;
                }
                [Some(_), None] => {
                    current = node.children[0];
                    continue;
                }
                [None, Some(_)] => {
                    current = node.children[1];
                    continue;
                }
                [None, None] => {}
            }
        }
        if pending == 0 {
            return false;
        }
        pending -= 1;
        current = stack[pending];
    }
}

/// The closest hit of `ray`, front to back; ties go to the lower triangle index.
pub fn closest_hit(tree: &Bvh2, ray: &Ray) -> Option<Hit> {
    let root = tree.root?;
    let prepared = PreparedRay::new(ray, &tree.bounds)?;
    let mut stack = [(root, 0.0f32); MAX_DEPTH];
    let mut pending = 0;
    let mut current = (root, prepared.enter(&tree.bounds)?);
    let mut best: Option<(f32, u32)> = None;
    let best_t = |best: &Option<(f32, u32)>| best.map_or(f32::INFINITY, |b| b.0);
    loop {
        let (child, entered) = current;
        // Not `>=`: a triangle at the same distance may have the lower index.
        if entered > best_t(&best) {
            // Entered before the best hit was known.
        } else if child.is_leaf() {
            for slot in child.leaf_slots() {
                if let Some(t) = prepared.triangle(&tree.triangles[slot]) {
                    let candidate = (t, tree.triangle_ids[slot]);
                    if best.is_none_or(|b| candidate < b) {
                        best = Some(candidate);
                    }
                }
            }
        } else {
            let node = &tree.nodes[child.node_index()];
            let limit = best_t(&best);
            let [a, b] = &node.bounds;
            let entry = [prepared.enter_before(a, limit), prepared.enter_before(b, limit)];
            match entry {
                [Some(first), Some(second)] => {
                    let swap = usize::from(second < first);
                    let entry = [first, second];
                    stack[pending] = (node.children[1 - swap], entry[1 - swap]);
                    pending += 1;
                    current = (node.children[swap], entry[swap]);
                    continue;
                }
                [Some(entry), None] => {
                    current = (node.children[0], entry);
                    continue;
                }
                [None, Some(entry)] => {
                    current = (node.children[1], entry);
                    continue;
                }
                [None, None] => {}
            }
        }
        if pending == 0 {
            return best.map(|(t, triangle)| prepared.hit(t, triangle));
        }
        pending -= 1;
        current = stack[pending];
    }
}

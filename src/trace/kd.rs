//! One ray at a time through a kd-tree.
//!
//! At a plane the ray's interval is cut to those of the two cells, by the box test's own arithmetic:
//! it leaves the first side at the padded exit and enters the second at the padded entry, which is
//! never later. So the interval in a cell is, bit for bit, that of the padded box test of the cell,
//! cells of rays in a plane or with a direction of zero need no special case, and no hit lies
//! between two cells. [`build::kd_sah`](crate::build::kd_sah) shows that every hit lies in one.
//!
//! A hit counts wherever it lies on the ray, not only within the cell that lists its triangle. Both
//! sides wait with their own intervals, so that the cells which a ray visits, if nothing stops it,
//! are the same under every order. Empty leaves are never visited.

use super::Counter;
use crate::geometry::Aabb;
use crate::intersect::{AxisRay, PreparedRay, TriangleTest};
use crate::ray::{Hit, Ray};
use crate::tree::{KD_MAX_DEPTH, KdNode, KdTree, NodeBits, Plan};

/// Which of two cells, whose near one the ray passes first, is visited first.
trait FirstCell {
    /// Whether that is the near one, given whether the upper one is near.
    fn is_near(&self, index: u32, upper_is_near: bool) -> bool;
}

/// As each node's bit says.
struct Fixed<'a>(&'a NodeBits);
impl FirstCell for Fixed<'_> {
    #[inline(always)]
    fn is_near(&self, index: u32, upper_is_near: bool) -> bool {
        self.0.get(index as usize) == upper_is_near
    }
}

struct NearFirst;
impl FirstCell for NearFirst {
    #[inline(always)]
    fn is_near(&self, _: u32, _: bool) -> bool {
        true
    }
}

struct FarFirst;
impl FirstCell for FarFirst {
    #[inline(always)]
    fn is_near(&self, _: u32, _: bool) -> bool {
        false
    }
}

/// A node, and where the ray is in its cell.
#[derive(Clone, Copy, Default)]
struct Visit {
    node: u32,
    entry: f32,
    exit: f32,
}

/// A prepared ray with its axes at hand; a fourth one spares the check of a node's two bits.
struct KdRay {
    prepared: PreparedRay,
    axes: [AxisRay; 4],
}

impl KdRay {
    /// The ray, and the root's visit; `None` if it misses the tree.
    #[inline(always)]
    fn new(tree: &KdTree, ray: &Ray) -> Option<(Self, Visit)> {
        // Padding has no meaning for the box around nothing.
        if tree.nodes.is_empty() {
            return None;
        }
        let bounds: &Aabb = &tree.bounds;
        let prepared = PreparedRay::new(ray, bounds)?;
        let [entry, exit] = prepared.interval(bounds)?;
        let axes = [prepared.axis(0), prepared.axis(1), prepared.axis(2), AxisRay::default()];
        Some((Self { prepared, axes }, Visit { node: 0, entry, exit }))
    }

    /// Goes on to the child of an inner node whose cell the ray meets. Where it meets both, the
    /// other one is given to `wait`. `false` if it meets none.
    #[inline(always)]
    fn descend<F: FirstCell>(
        &self,
        order: &F,
        node: KdNode,
        visit: &mut Visit,
        wait: impl FnOnce(Visit),
    ) -> bool {
        let axis = &self.axes[node.axis()];
        let (entry, exit) = (axis.entry(node.split()), axis.exit(node.split()));
        let upper_is_near = axis.descending;
        // The ray is in the near cell until `exit` and in the far one from `entry` on.
        let (in_near, in_far) = (visit.entry <= exit, entry <= visit.exit);
        let next = visit.node + 1;
        if node.is_single() {
            visit.node = next;
            return if node.only_upper() == upper_is_near {
                visit.exit = visit.exit.min(exit);
                in_near
            } else {
                visit.entry = visit.entry.max(entry);
                in_far
            };
        }
        let upper = node.upper_child() as u32;
        let (near, far) = if upper_is_near { (upper, next) } else { (next, upper) };
        if in_near && in_far {
            let near = Visit { node: near, exit: visit.exit.min(exit), ..*visit };
            let far = Visit { node: far, entry: visit.entry.max(entry), ..*visit };
            let (first, second) =
                if order.is_near(next - 1, upper_is_near) { (near, far) } else { (far, near) };
            *visit = first;
            wait(second);
        } else {
            // As `entry <= exit`, it meets one of them; the interval stays.
            visit.node = if in_near { near } else { far };
        }
        true
    }
}

/// Whether anything is in the way of `ray`, visiting children as `plan` says.
#[inline]
pub fn any_hit<T: TriangleTest, C: Counter>(
    tree: &KdTree,
    plan: &Plan,
    test: T,
    ray: &Ray,
    counter: &mut C,
) -> bool {
    match plan {
        Plan::Fixed(bits) => any_hit_by(tree, &Fixed(bits), test, ray, counter),
        Plan::Near => any_hit_by(tree, &NearFirst, test, ray, counter),
        Plan::Far => any_hit_by(tree, &FarFirst, test, ray, counter),
    }
}

fn any_hit_by<F: FirstCell, T: TriangleTest, C: Counter>(
    tree: &KdTree,
    order: &F,
    test: T,
    ray: &Ray,
    counter: &mut C,
) -> bool {
    let Some((ray, mut current)) = KdRay::new(tree, ray) else { return false };
    let mut stack = [Visit::default(); KD_MAX_DEPTH];
    let mut pending = 0;
    loop {
        let node = tree.nodes[current.node as usize];
        counter.node();
        if node.is_leaf() {
            for &slot in &tree.references[node.leaf_range()] {
                counter.triangles(1);
                let (hit, by) = test.hits(&ray.prepared, &tree.triangles[slot as usize]);
                counter.settled(by);
                if hit {
                    return true;
                }
            }
        } else {
            let wait = |visit| {
                stack[pending] = visit;
                pending += 1;
            };
            if ray.descend(order, node, &mut current, wait) {
                continue;
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
pub fn closest_hit(tree: &KdTree, ray: &Ray) -> Option<Hit> {
    let (ray, mut current) = KdRay::new(tree, ray)?;
    let mut stack = [Visit::default(); KD_MAX_DEPTH];
    let mut pending = 0;
    let mut best: Option<(f32, u32)> = None;
    loop {
        let node = tree.nodes[current.node as usize];
        // Not `>=`: a triangle at the same distance may have the lower index. No hit lies before
        // the entry of the cell through which it is found: `build::kd_sah` shows that too.
        if best.is_some_and(|(t, _)| current.entry > t) {
            // Beyond the best hit.
        } else if node.is_leaf() {
            for &slot in &tree.references[node.leaf_range()] {
                if let Some(t) = ray.prepared.triangle(&tree.triangles[slot as usize]) {
                    let candidate = (t, tree.triangle_ids[slot as usize]);
                    if best.is_none_or(|b| candidate < b) {
                        best = Some(candidate);
                    }
                }
            }
        } else {
            let wait = |visit| {
                stack[pending] = visit;
                pending += 1;
            };
            if ray.descend(&NearFirst, node, &mut current, wait) {
                continue;
            }
        }
        if pending == 0 {
            return best.map(|(t, triangle)| ray.prepared.hit(t, triangle));
        }
        pending -= 1;
        current = stack[pending];
    }
}

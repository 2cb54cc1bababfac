//! The closest hit of one ray, front to back.

use super::Structure;
use super::leaf::{
    ANY_HEIGHT_SLACK, EDGE_SLACK_FAST, END_SLACK, Lines, SLOPE_SLACK, UNDERFLOW, facets_of, test,
};
use super::numbers::{extent_from, is_plain};
use super::simd::{LANES, Simd};
use crate::geometry::{Aabb, TriangleMesh};
use crate::intersect::PreparedRay;
use crate::ray::{Hit, Ray};
use crate::tree::{Bvh8, ChildRef, MAX_WIDE_DEPTH, Node8, WIDTH};

/// A subtree, and where the ray enters its box.
type Entered = (ChildRef, f32);

/// As [`PreparedRay::enter_before`], for eight boxes: the same operations, the same bits.
struct Slabs<S: Simd> {
    near_origin: [S::Floats; 3],
    far_origin: [S::Floats; 3],
    reciprocal: [S::Floats; 3],
    entry_side: [usize; 3],
    t_min: S::Floats,
    t_max: S::Floats,
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(s: S, ray: &PreparedRay) -> Self {
        let slabs = ray.slabs();
        let mut all = Self {
            near_origin: [s.splat(0.0); 3],
            far_origin: [s.splat(0.0); 3],
            reciprocal: [s.splat(0.0); 3],
            entry_side: slabs.descending.map(usize::from),
            t_min: s.splat(slabs.t_min),
            t_max: s.splat(slabs.t_max),
        };
        for axis in 0..3 {
            all.near_origin[axis] = s.splat(slabs.near_origin[axis]);
            all.far_origin[axis] = s.splat(slabs.far_origin[axis]);
            all.reciprocal[axis] = s.splat(slabs.reciprocal[axis]);
        }
        all
    }

    /// The children that the ray meets before `limit`, one bit each, and where it enters them.
    #[inline(always)]
    fn meets(&self, s: S, node: &Node8, limit: f32) -> (u32, [f32; LANES]) {
        let (mut entry, mut exit) = (self.t_min, s.min(s.splat(limit), self.t_max));
        for axis in 0..3 {
            let side = self.entry_side[axis] & 1;
            let planes = &node.planes[axis];
            let near = s.sub(s.load(&planes[side]), self.near_origin[axis]);
            let far = s.sub(s.load(&planes[1 - side]), self.far_origin[axis]);
            entry = s.max(s.mul(near, self.reciprocal[axis]), entry);
            exit = s.min(s.mul(far, self.reciprocal[axis]), exit);
        }
        let mut entries = [0.0; LANES];
        s.store(&mut entries, entry);
        (s.bits(s.less_equal(entry, exit)) as u32 & node.occupied(), entries)
    }
}

/// What [`Rays`](super::rays::Rays) computes of a ray in the plain mode, but for the cut interval.
#[inline(always)]
fn line<S: Simd>(s: S, ray: &Ray, bounds: &Aabb) -> Lines<S> {
    let d = ray.direction.abs();
    let (length, extent) = (d.x + d.y + d.z, extent_from(ray, bounds));
    let usable = if is_plain(ray, extent) { 1.0 } else { f32::NAN };
    let end_slack = |t: f32| s.splat(t.abs() * length * END_SLACK + UNDERFLOW);
    Lines {
        origin: ray.origin.to_array().map(|o| s.splat(o)),
        direction: ray.direction.to_array().map(|d| s.splat(d * usable)),
        start: s.splat(ray.t_min),
        end: s.splat(ray.t_max),
        slope_slack: s.splat(length * SLOPE_SLACK),
        edge_slack: s.splat(extent * length * EDGE_SLACK_FAST + UNDERFLOW),
        start_slack: end_slack(ray.t_min),
        end_slack: end_slack(ray.t_max),
        height_slack: s.splat(extent * ANY_HEIGHT_SLACK),
    }
}

/// The closest hit; ties go to the lower triangle index.
#[inline(always)]
pub(super) fn closest_hit<S: Simd>(
    s: S,
    structure: Structure<'_>,
    mesh: &TriangleMesh,
    ray: &Ray,
) -> Option<Hit> {
    let top = structure.top();
    let prepared = PreparedRay::new(ray, &top.bounds)?;
    let entered = prepared.enter(&top.bounds)?;
    let slabs = Slabs::new(s, &prepared);
    let line = line(s, ray, &top.bounds);
    let mut best: Option<(f32, u32)> = None;
    let searched = Searched { mesh, prepared: &prepared, line: &line };
    match structure {
        Structure::Tree(tree) => descend(
            s,
            tree,
            &slabs,
            entered,
            &mut best,
            #[inline(always)]
            |leaf, _, best| searched.leaf(s, tree, leaf, best),
        ),
        Structure::TwoLevel(levels) => descend(
            s,
            top,
            &slabs,
            entered,
            &mut best,
            #[inline(always)]
            |leaf, entered, best| {
                for slot in leaf.leaf_slots() {
                    let part = levels.part(top.triangle_ids[slot] as usize);
                    descend(
                        s,
                        part,
                        &slabs,
                        entered,
                        best,
                        #[inline(always)]
                        |leaf, _, best| searched.leaf(s, part, leaf, best),
                    );
                }
            },
        ),
    }
    best.map(|(t, triangle)| prepared.hit(t, triangle))
}

/// What leaves are searched for.
struct Searched<'a, S: Simd> {
    mesh: &'a TriangleMesh,
    prepared: &'a PreparedRay,
    line: &'a Lines<S>,
}

impl<S: Simd> Searched<'_, S> {
    /// Brings the closest hit up to date.
    #[inline(always)]
    fn leaf(&self, s: S, tree: &Bvh8, leaf: ChildRef, best: &mut Option<(f32, u32)>) {
        let ids = &tree.triangle_ids[leaf.leaf_slots()];
        let certain = test(s, &facets_of(s, tree, leaf), self.line);
        let mut candidates = certain.not_misses & ((1 << ids.len()) - 1);
        while candidates != 0 {
            let id = ids[candidates.trailing_zeros() as usize];
            candidates &= candidates - 1;
            if let Some(t) = self.prepared.triangle(&self.mesh.triangle(id as usize)) {
                let candidate = (t, id);
                if best.is_none_or(|best| candidate < best) {
                    *best = Some(candidate);
                }
            }
        }
    }
}

/// Takes the ray through a tree whose box it enters at `entered`; `in_leaf` is given leaves, where
/// their boxes are entered, and the closest hit so far.
#[inline(always)]
fn descend<S: Simd>(
    s: S,
    tree: &Bvh8,
    slabs: &Slabs<S>,
    entered: f32,
    best: &mut Option<(f32, u32)>,
    mut in_leaf: impl FnMut(ChildRef, f32, &mut Option<(f32, u32)>),
) {
    let Some(root) = tree.root else { return };
    let mut stack = [(ChildRef::UNUSED, 0.0f32); MAX_WIDE_DEPTH * (WIDTH - 1) + 1];
    stack[0] = (root, entered);
    let mut pending = 1;
    while pending > 0 {
        pending -= 1;
        let (child, entered) = stack[pending];
        let limit = best.map_or(f32::INFINITY, |best| best.0);
        // Not `>=`: a triangle at the same distance may have the lower index.
        if entered > limit {
            continue;
        }
        if child.is_leaf() {
            in_leaf(child, entered, best);
            continue;
        }
        let node = &tree.nodes[child.node_index()];
        let (mut met, entries) = slabs.meets(s, node, limit);
        let above = pending;
        while met != 0 {
            let slot = met.trailing_zeros() as usize;
            met &= met - 1;
            insert(&mut stack, above, pending, (node.children[slot], entries[slot]));
            pending += 1;
        }
    }
}

/// Puts an element into `stack[from..to]`, which is sorted so that the nearest comes last.
#[inline(always)]
fn insert(stack: &mut [Entered], from: usize, to: usize, element: Entered) {
    let mut place = to;
    while place > from && stack[place - 1].1 < element.1 {
        stack[place] = stack[place - 1];
        place -= 1;
    }
    stack[place] = element;
}

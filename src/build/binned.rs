//! Top-down building by binned surface-area heuristic (Wald, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies", IEEE Symposium on Interactive Ray Tracing, 2007), on all threads.
//!
//! A range of `n` primitives owns `n - 1` node slots before it is split, its left part the first of
//! them: threads never wait for each other, and the tree does not depend on how many there are.
//! Slots that leaves of several triangles leave empty are closed up at the end.

use super::BuilderEntry;
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::{Bvh2, ChildRef, MAX_DEPTH, MAX_LEAF_TRIANGLES, Node2};
use glam::Vec3;
use rayon::prelude::*;

pub(super) static ENTRY: BuilderEntry = BuilderEntry {
    name: "binned",
    about: "top-down by binned surface-area heuristic, 32 bins on each axis",
    build,
};

/// Bins on each axis; half of them for small ranges, where emptying bins is what costs.
const BINS: usize = 32;
const SMALL_RANGE: usize = 64;

/// Cost of entering an inner node, in units of a triangle test.
const TRAVERSAL_COST: f32 = 1.0;

/// A leaf may hold more only where its triangles cannot be told apart.
const MAX_SAH_LEAF: usize = 8;

/// Ranges that are worth another thread, and those that several threads should bin.
const PARALLEL_RANGE: usize = 4096;
const PARALLEL_BINNING: usize = 1 << 16;

/// A triangle's box, with its index in the mesh.
#[derive(Clone, Copy)]
struct Primitive {
    bounds: Aabb,
    id: u32,
}

const EMPTY_NODE: Node2 =
    Node2 { bounds: [Aabb::EMPTY; 2], children: [ChildRef::UNUSED; 2], counts: [0; 2] };

fn build(mesh: &TriangleMesh) -> Bvh2 {
    let mut primitives: Vec<Primitive> = (0..mesh.len())
        .into_par_iter()
        .map(|i| Primitive { bounds: mesh.triangle(i).bounds(), id: i as u32 })
        .collect();
    let mut nodes = vec![EMPTY_NODE; mesh.len().saturating_sub(1)];
    let bounds = bounds_of(&primitives);
    let root = (!mesh.is_empty()).then(|| {
        let range = Range { first_slot: 0, first_node: 0, depth: 0, bounds };
        split(&mut primitives, &mut nodes, range)
    });
    let root = close_up(&mut nodes, root);
    let triangle_ids: Vec<u32> = primitives.iter().map(|p| p.id).collect();
    let triangles = triangle_ids.par_iter().map(|&i| mesh.triangle(i as usize)).collect();
    Bvh2::new(nodes, root, bounds, triangles, triangle_ids)
}

/// Where a range of primitives lies: its first slot among them, the first node slot that it owns,
/// the inner nodes above it, and its box.
#[derive(Clone, Copy)]
struct Range {
    first_slot: usize,
    first_node: usize,
    depth: usize,
    bounds: Aabb,
}

fn split(primitives: &mut [Primitive], nodes: &mut [Node2], range: Range) -> ChildRef {
    let count = primitives.len();
    let leaf = ChildRef::leaf(range.first_slot, count.min(MAX_LEAF_TRIANGLES));
    if count == 1 {
        return leaf;
    }
    // From here on halving must lead to leaves before the depth runs out.
    let must_halve = MAX_DEPTH - range.depth <= count.ilog2() as usize + 1;
    let best = if must_halve { None } else { best_split(primitives, &range.bounds) };
    let (middle, bounds) = match best {
        Some(best) => {
            let leaf_cost = count as f32 * range.bounds.half_area() as f32;
            if count <= MAX_SAH_LEAF && leaf_cost <= best.cost {
                return leaf;
            }
            (best.partition(primitives), best.bounds)
        }
        None if count <= MAX_SAH_LEAF => return leaf,
        None => halve(primitives, &range.bounds),
    };
    let (left, right) = primitives.split_at_mut(middle);
    let (node, below) = nodes.split_first_mut().expect("a range owns count - 1 node slots");
    let (left_nodes, right_nodes) = below.split_at_mut(middle - 1);
    let [left_range, right_range] =
        [(0, 1, bounds[0]), (middle, middle, bounds[1])].map(|(slots, node_slots, bounds)| Range {
            first_slot: range.first_slot + slots,
            first_node: range.first_node + node_slots,
            depth: range.depth + 1,
            bounds,
        });
    let children = if count > PARALLEL_RANGE {
        rayon::join(
            || split(left, left_nodes, left_range),
            || split(right, right_nodes, right_range),
        )
    } else {
        (split(left, left_nodes, left_range), split(right, right_nodes, right_range))
    };
    *node = Node2 {
        bounds,
        children: [children.0, children.1],
        counts: [middle as u32, (count - middle) as u32],
    };
    ChildRef::inner(range.first_node)
}

/// Splits in the middle of the longest axis, by number: for what the heuristic cannot tell apart.
fn halve(primitives: &mut [Primitive], bounds: &Aabb) -> (usize, [Aabb; 2]) {
    let axis = bounds.size().max_position();
    let middle = primitives.len() / 2;
    primitives.select_nth_unstable_by(middle, |a, b| {
        let centers = (a.bounds.center()[axis], b.bounds.center()[axis]);
        centers.0.total_cmp(&centers.1).then(a.id.cmp(&b.id))
    });
    let (left, right) = primitives.split_at(middle);
    (middle, [bounds_of(left), bounds_of(right)])
}

fn bounds_of(primitives: &[Primitive]) -> Aabb {
    primitives.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds))
}

/// Maps centres to bins; the same for binning and partition.
#[derive(Clone, Copy)]
struct Binning {
    origin: Vec3,
    scale: Vec3,
    bins: usize,
}

impl Binning {
    /// `None` where all centres are one.
    fn new(centers: &Aabb, count: usize) -> Option<Self> {
        let bins = if count < SMALL_RANGE { BINS / 2 } else { BINS };
        let size = centers.size();
        let scale = Vec3::from_array(size.to_array().map(|s| {
            // An axis on which nothing differs, or too little to divide by, has one bin.
            let scale = bins as f32 / s;
            if scale.is_finite() { scale } else { 0.0 }
        }));
        (scale != Vec3::ZERO).then_some(Self { origin: centers.min, scale, bins })
    }

    #[inline(always)]
    fn bin(&self, primitive: &Primitive, axis: usize) -> usize {
        let place = (primitive.bounds.center()[axis] - self.origin[axis]) * self.scale[axis];
        (place as usize).min(self.bins - 1)
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, count: 0 };

    fn merged(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }
}

type Bins = [[Bin; BINS]; 3];

fn fill_bins(primitives: &[Primitive], binning: &Binning) -> Bins {
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for primitive in primitives {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[binning.bin(primitive, axis)];
            bin.bounds = bin.bounds.union(primitive.bounds);
            bin.count += 1;
        }
    }
    bins
}

fn center_bounds(primitives: &[Primitive]) -> Aabb {
    Aabb::of_points(primitives.iter().map(|p| p.bounds.center()))
}

struct Split {
    axis: usize,
    /// The first bin of the right side.
    bin: usize,
    binning: Binning,
    bounds: [Aabb; 2],
    /// In triangle tests, times half the area of the parent.
    cost: f32,
}

/// The cheapest split between two bins; `None` where there is none, or areas overflow.
fn best_split(primitives: &[Primitive], bounds: &Aabb) -> Option<Split> {
    let parallel = primitives.len() >= PARALLEL_BINNING;
    let chunks = || primitives.par_chunks(PARALLEL_BINNING / 4);
    let centers = if parallel {
        chunks().map(center_bounds).reduce(|| Aabb::EMPTY, Aabb::union)
    } else {
        center_bounds(primitives)
    };
    let binning = Binning::new(&centers, primitives.len())?;
    let bins = if parallel {
        // Merging boxes and counts gives the same result in any order.
        chunks().map(|chunk| fill_bins(chunk, &binning)).reduce(
            || [[Bin::EMPTY; BINS]; 3],
            |a, b| std::array::from_fn(|k| std::array::from_fn(|i| a[k][i].merged(b[k][i]))),
        )
    } else {
        fill_bins(primitives, &binning)
    };
    let mut best: Option<Split> = None;
    for (axis, bins) in bins.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        let bins = &bins[..binning.bins];
        // right[i] holds bins i and up.
        let mut right = [Bin::EMPTY; BINS + 1];
        for i in (1..bins.len()).rev() {
            right[i] = right[i + 1].merged(bins[i]);
        }
        let mut left = Bin::EMPTY;
        for i in 1..bins.len() {
            left = left.merged(bins[i - 1]);
            let right = &right[i];
            if left.count == 0 || right.count == 0 {
                continue;
            }
            let weighted = |b: &Bin| half_area(&b.bounds) * b.count as f32;
            let cost = weighted(&left) + weighted(right) + TRAVERSAL_COST * half_area(bounds);
            if cost.is_finite() && best.as_ref().is_none_or(|b| cost < b.cost) {
                let bounds = [left.bounds, right.bounds];
                best = Some(Split { axis, bin: i, binning, bounds, cost });
            }
        }
    }
    best
}

/// In `f32`, as costs are only compared. The box is not empty.
fn half_area(bounds: &Aabb) -> f32 {
    let d = bounds.size();
    d.x * d.y + d.y * d.z + d.z * d.x
}

impl Split {
    /// Moves the left side to the front and returns its length.
    fn partition(&self, primitives: &mut [Primitive]) -> usize {
        let is_left = |p: &Primitive| self.binning.bin(p, self.axis) < self.bin;
        let (mut left, mut right) = (0, primitives.len());
        loop {
            while left < right && is_left(&primitives[left]) {
                left += 1;
            }
            while left < right && !is_left(&primitives[right - 1]) {
                right -= 1;
            }
            if left >= right {
                return left;
            }
            primitives.swap(left, right - 1);
        }
    }
}

/// Removes unused node slots, keeping the order of the others.
fn close_up(nodes: &mut Vec<Node2>, root: Option<ChildRef>) -> Option<ChildRef> {
    let used = |node: &Node2| node.counts[0] != 0;
    let mut moved_to = vec![0u32; nodes.len()];
    let mut next = 0;
    for (node, to) in nodes.iter().zip(&mut moved_to) {
        *to = next;
        next += u32::from(used(node));
    }
    nodes.retain(used);
    nodes.shrink_to_fit();
    let renumbered = |child: ChildRef| {
        if child.is_leaf() { child } else { ChildRef::inner(moved_to[child.node_index()] as usize) }
    };
    nodes.par_iter_mut().with_min_len(8192).for_each(|node| {
        node.children = node.children.map(renumbered);
    });
    root.map(renumbered)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    fn checked(mesh: &TriangleMesh) -> Bvh2 {
        let tree = build(mesh);
        tree.validate(mesh).unwrap();
        tree
    }

    #[test]
    fn trees_of_every_small_size_are_valid() {
        for count in 0..70 {
            checked(&Random::new(count as u64).mesh(count));
        }
    }

    #[test]
    fn a_large_tree_is_valid_better_than_chance_and_the_same_on_any_threads() {
        let mesh = Random::new(7).mesh(150_000);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| checked(&mesh))
        };
        let (one, four) = (on(1), on(4));
        assert_eq!(one.nodes, four.nodes);
        assert_eq!(one.triangle_ids, four.triangle_ids);
        assert!(one.sah_cost() < 0.01 * mesh.len() as f64, "{}", one.sah_cost());
    }

    #[test]
    fn coincident_triangles_are_halved() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let tree = checked(&TriangleMesh::new(corners, vec![[0, 1, 2]; 100_000]));
        assert!(tree.leaf_count() > 100_000 / MAX_LEAF_TRIANGLES);
    }

    #[test]
    fn geometric_growth_does_not_run_out_of_depth() {
        // Each triangle is as large as all before it: the heuristic peels them off one by one.
        let mut corners = Vec::new();
        for i in 0..110 {
            let p = Vec3::splat((f64::from(i) - 60.0).exp2() as f32);
            corners.extend([p, p * 1.5, p * Vec3::new(1.5, 1.0, 1.2)]);
        }
        let triangles = (0..110).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        checked(&TriangleMesh::new(corners, triangles));
    }

    #[test]
    fn areas_that_overflow_fall_back_to_halving() {
        let mut random = Random::new(3);
        let corners: Vec<Vec3> = (0..300).map(|_| random.point() * 1e37).collect();
        let triangles = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        checked(&TriangleMesh::new(corners, triangles));
    }
}

//! Orders learned from recorded rays: what SRDH (Feltman, Lee and Fatahalian, "SRDH: Specializing
//! BVH Construction and Traversal Order Using Representative Shadow Ray Sets", High Performance
//! Graphics, 2012) decides at each node of a given tree, and what the criterion of Ogaki and
//! Derouet-Jourdan ("An N-ary BVH Child Node Sorting Technique for Occlusion Tests", Journal of
//! Computer Graphics Techniques 5(2), 2016) decides.
//!
//! Each ray is taken through everything that its line meets, from the leaves up: which children
//! stop it, and what visiting a child costs under the orders chosen below. Only rays that meet both
//! children and are stopped by one of them tell the orders apart. Nodes with few such rays keep the
//! order that areas give (`p-over-c`).

use super::{DependsOn, OrderContext, OrderEntry, Scores, p_over_c};
use crate::intersect::PreparedRay;
use crate::ray::Ray;
use crate::tree::{Bvh2, ChildRef, NodeBits, Plan};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

pub(super) static EXACT: OrderEntry = OrderEntry {
    name: "trained",
    about: "the cheaper order for recorded rays at each node",
    needs_training: true,
    plan_bvh2: |tree, context| plan(tree, context, Evidence::exact_second_first),
    depends_on: DependsOn::Everything,
    box_score: None,
    plan_kd: None,
    scores: None,
    score_part: None,
    at_split: None,
};

pub(super) static BY_RATIO: OrderEntry = OrderEntry {
    name: "trained-ratio",
    about: "the child that stops the most recorded rays for its cost first",
    needs_training: true,
    plan_bvh2: |tree, context| plan(tree, context, Evidence::ratio_second_first),
    depends_on: DependsOn::Everything,
    box_score: None,
    plan_kd: None,
    scores: Some(scores),
    score_part: None,
    at_split: None,
};

/// Rays are taken at even strides from larger sets. The authors of SRDH come within 6 % of the full
/// set's gain with the rays of 16 by 16 pixels.
const MOST_RAYS: usize = 1 << 17;

/// Fewer deciding rays say less than areas do.
const LEAST_EVIDENCE: u32 = 8;

/// Rays that are worth another thread.
const PARALLEL_RAYS: usize = 256;

/// Whether child 1 should come first; `None` where areas know better.
type Decision = fn(&Evidence) -> Option<bool>;

fn plan(tree: &Bvh2, context: &OrderContext<'_>, decide: Decision) -> Plan {
    let by_areas = p_over_c::second_first(tree);
    let Some(set) = context.training else { return Plan::Fixed(by_areas) };
    let stride = set.len().div_ceil(MOST_RAYS).max(1);
    Plan::Fixed(learn(tree, by_areas, set.rays().iter().step_by(stride), decide).0)
}

/// Rays stopped over their cost, or what areas expect of a line where few rays decide: the same unit.
fn scores(tree: &Bvh2, context: &OrderContext<'_>) -> Scores {
    let by_areas = p_over_c::scores_of(tree);
    let Some(set) = context.training else { return by_areas };
    let stride = set.len().div_ceil(MOST_RAYS).max(1);
    let known = p_over_c::second_first(tree);
    let rays = set.rays().iter().step_by(stride);
    let ratios: Vec<_> =
        by_areas.iter().map(|scores| scores.map(|s| AtomicU64::new(s.to_bits()))).collect();
    learn_with(tree, known, rays, Evidence::ratio_second_first, Some(&ratios));
    let scores = ratios.into_iter();
    scores.map(|of_node| of_node.map(|bits| f64::from_bits(bits.into_inner()))).collect()
}

/// The order of all nodes, `known` where rays do not decide, and what each ray that meets the tree
/// visits under it.
fn learn<'a>(
    tree: &Bvh2,
    known: NodeBits,
    rays: impl Iterator<Item = &'a Ray>,
    decide: Decision,
) -> (NodeBits, Vec<Visit>) {
    learn_with(tree, known, rays, decide, None)
}

/// As [`learn`]; where rays decide, each child's stopped rays over their cost go to `ratios`, as bits.
fn learn_with<'a>(
    tree: &Bvh2,
    known: NodeBits,
    rays: impl Iterator<Item = &'a Ray>,
    decide: Decision,
    ratios: Option<&[[AtomicU64; 2]]>,
) -> (NodeBits, Vec<Visit>) {
    let Some(root) = tree.root else { return (known, Vec::new()) };
    let rays: Vec<PreparedRay> = rays
        .filter_map(|ray| PreparedRay::new(ray, &tree.bounds))
        .filter(|ray| ray.enter(&tree.bounds).is_some())
        .collect();
    let second_first = (0..tree.nodes.len()).map(|i| AtomicBool::new(known.get(i))).collect();
    let all: Vec<u32> = (0..rays.len() as u32).collect();
    let lesson = Lesson { tree, rays, second_first, decide, ratios };
    let visits = lesson.visit(root, &all);
    let second_first = lesson.second_first;
    let bits = NodeBits::from_fn(second_first.len(), |i| second_first[i].load(Ordering::Relaxed));
    (bits, visits)
}

/// What a ray finds in a subtree whose box it meets.
#[derive(Clone, Copy, Debug)]
struct Visit {
    nodes: u32,
    triangles: u32,
    stopped: bool,
}

impl Visit {
    /// In visits of a node; a triangle test takes about as long.
    fn cost(&self) -> f64 {
        f64::from(self.nodes) + f64::from(self.triangles)
    }
}

/// What the rays at a node say of its children.
#[derive(Clone, Copy, Debug, Default)]
struct Evidence {
    /// Rays that meet both children and are stopped by one or both.
    deciding: u32,
    /// For each child first: cost of all rays that meet both children.
    cost_if_first: [f64; 2],
    /// For each child: rays stopped, and cost of visiting it, over all rays that meet it.
    stopped: [f64; 2],
    cost: [f64; 2],
}

impl Evidence {
    fn add(&mut self, visits: [Option<Visit>; 2]) {
        for (side, visit) in visits.iter().enumerate() {
            if let Some(visit) = visit {
                self.stopped[side] += f64::from(u8::from(visit.stopped));
                self.cost[side] += visit.cost();
            }
        }
        if let [Some(a), Some(b)] = visits {
            self.deciding += u32::from(a.stopped || b.stopped);
            for (side, (first, second)) in [(a, b), (b, a)].into_iter().enumerate() {
                self.cost_if_first[side] += first.cost();
                if !first.stopped {
                    self.cost_if_first[side] += second.cost();
                }
            }
        }
    }

    fn exact_second_first(&self) -> Option<bool> {
        let [first, second] = self.cost_if_first;
        self.decides(first, second)
    }

    fn ratio_second_first(&self) -> Option<bool> {
        self.decides(self.stopped[1] * self.cost[0], self.stopped[0] * self.cost[1])
    }

    /// Whether the first of two figures is larger; `None` if they are equal or from too few rays.
    fn decides(&self, a: f64, b: f64) -> Option<bool> {
        (self.deciding >= LEAST_EVIDENCE && a != b).then_some(a > b)
    }
}

struct Lesson<'a> {
    tree: &'a Bvh2,
    rays: Vec<PreparedRay>,
    second_first: Vec<AtomicBool>,
    decide: Decision,
    ratios: Option<&'a [[AtomicU64; 2]]>,
}

impl Lesson<'_> {
    /// Decides on all nodes from `child` down and returns what each of `rays`, which meet its box,
    /// visits there.
    fn visit(&self, child: ChildRef, rays: &[u32]) -> Vec<Visit> {
        if rays.is_empty() {
            return Vec::new();
        }
        if child.is_leaf() {
            return rays.iter().map(|&ray| self.visit_leaf(child, ray)).collect();
        }
        let index = child.node_index();
        let node = &self.tree.nodes[index];
        let met = |ray: &PreparedRay, side: usize| ray.enter(&node.bounds[side]).is_some();
        let meets: Vec<[bool; 2]> = rays
            .iter()
            .map(|&ray| &self.rays[ray as usize])
            .map(|ray| [met(ray, 0), met(ray, 1)])
            .collect();
        let of_side = |side: usize| -> Vec<u32> {
            rays.iter().zip(&meets).filter(|(_, meets)| meets[side]).map(|(&ray, _)| ray).collect()
        };
        let visit = |side: usize| self.visit(node.children[side], &of_side(side));
        let [left, right] = if rays.len() > PARALLEL_RAYS {
            rayon::join(|| visit(0), || visit(1)).into()
        } else {
            [visit(0), visit(1)]
        };
        let (mut left, mut right) = (left.into_iter(), right.into_iter());
        let mut found = |meets: &[bool; 2]| {
            [if meets[0] { left.next() } else { None }, if meets[1] { right.next() } else { None }]
        };
        let pairs: Vec<[Option<Visit>; 2]> = meets.iter().map(&mut found).collect();
        let mut evidence = Evidence::default();
        for pair in &pairs {
            evidence.add(*pair);
        }
        if let Some(second_first) = (self.decide)(&evidence) {
            self.second_first[index].store(second_first, Ordering::Relaxed);
            for (side, ratio) in self.ratios.iter().flat_map(|all| all[index].iter().enumerate()) {
                let stopped = evidence.stopped[side] / evidence.cost[side].max(1.0);
                ratio.store(stopped.to_bits(), Ordering::Relaxed);
            }
        }
        let first = usize::from(self.second_first[index].load(Ordering::Relaxed));
        pairs.iter().map(|pair| in_turn([pair[first], pair[1 - first]])).collect()
    }

    fn visit_leaf(&self, leaf: ChildRef, ray: u32) -> Visit {
        let triangles = &self.tree.triangles[leaf.leaf_slots()];
        let hit = triangles.iter().position(|t| self.rays[ray as usize].triangle(t).is_some());
        let tested = hit.map_or(triangles.len(), |i| i + 1);
        Visit { nodes: 1, triangles: tested as u32, stopped: hit.is_some() }
    }
}

/// A node, then those of its children that the ray meets, until one stops it.
fn in_turn(children: [Option<Visit>; 2]) -> Visit {
    let mut all = Visit { nodes: 1, triangles: 0, stopped: false };
    for child in children.into_iter().flatten() {
        if !all.stopped {
            all.nodes += child.nodes;
            all.triangles += child.triangles;
            all.stopped = child.stopped;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::order::nary::{NodeRay, best_order};
    use crate::ray::VisitCounts;
    use crate::ray_set::RaySet;
    use crate::test_random::Random;
    use crate::trace::single::any_hit;
    use crate::{build, order};

    fn set(random: &mut Random, count: usize) -> RaySet {
        let rays: Vec<_> = (0..count).map(|_| random.ray()).collect();
        let mut set = RaySet::default();
        set.push_batch(&rays);
        set
    }

    fn counted(tree: &Bvh2, plan: &Plan, set: &RaySet) -> VisitCounts {
        let mut counts = VisitCounts::default();
        for ray in set.rays() {
            any_hit(tree, tree.root, plan, crate::intersect::Fast, ray, &mut counts);
        }
        counts
    }

    #[test]
    fn rays_visit_what_the_model_says_and_less_than_under_other_orders() {
        let mut random = Random::new(71);
        let mesh = random.mesh(4000);
        let set = set(&mut random, 6000);
        let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
        let mut cost_of = [0.0; 2];
        for (entry, cost) in [&EXACT, &BY_RATIO].into_iter().zip(&mut cost_of) {
            let context = OrderContext { training: Some(&set), ..OrderContext::new(&mesh) };
            let plan = (entry.plan_bvh2)(&tree, &context);
            let counts = counted(&tree, &plan, &set);
            let decide: Decision = if std::ptr::eq(entry, &EXACT) {
                Evidence::exact_second_first
            } else {
                Evidence::ratio_second_first
            };
            let known = p_over_c::second_first(&tree);
            let (bits, visits) = learn(&tree, known, set.rays().iter(), decide);
            assert_eq!(Plan::Fixed(bits), plan, "{}", entry.name);
            let nodes: u32 = visits.iter().map(|v| v.nodes).sum();
            let triangles: u32 = visits.iter().map(|v| v.triangles).sum();
            assert_eq!([nodes, triangles], [counts.nodes, counts.triangles], "{}", entry.name);
            *cost = f64::from(nodes + triangles);
        }
        assert!(cost_of[0] <= cost_of[1] * 1.001, "{cost_of:?}");
        for name in ["random", "node-sato", "prim-num", "prim-sato-avg", "rtsah", "p-over-c"] {
            let plan = (order::find(name).unwrap().plan_bvh2)(&tree, &OrderContext::new(&mesh));
            let counts = counted(&tree, &plan, &set);
            assert!(cost_of[0] < f64::from(counts.nodes + counts.triangles), "{name}: {counts:?}");
        }
    }

    #[test]
    fn without_rays_areas_decide() {
        let mesh = Random::new(72).mesh(2000);
        let tree = (build::find("binned").unwrap().build)(&mesh, build::Leaves::Fit);
        let empty = RaySet::default();
        let context = OrderContext { training: Some(&empty), ..OrderContext::new(&mesh) };
        let learned = (EXACT.plan_bvh2)(&tree, &context);
        assert_eq!(learned, Plan::Fixed(p_over_c::second_first(&tree)));
    }

    #[test]
    fn the_choice_is_that_of_the_dynamic_program() {
        let mut random = Random::new(73);
        for _ in 0..300 {
            let mut evidence = Evidence::default();
            let mut node_rays = Vec::new();
            for _ in 0..40 {
                let mut any = || {
                    random.bits().is_multiple_of(2).then(|| Visit {
                        nodes: 1 + (random.bits() % 5) as u32,
                        triangles: (random.bits() % 5) as u32,
                        stopped: random.bits().is_multiple_of(3),
                    })
                };
                let visits = [any(), any()];
                evidence.add(visits);
                let mut ray = NodeRay::default();
                for (side, visit) in visits.iter().enumerate() {
                    if let Some(visit) = visit {
                        ray.add(side, visit.cost(), visit.stopped);
                    }
                }
                node_rays.push(ray);
            }
            let [a, b] = evidence.cost_if_first;
            if a != b && evidence.deciding >= LEAST_EVIDENCE {
                let first = usize::from(best_order(&node_rays, 2).0[0]);
                assert_eq!(evidence.exact_second_first(), Some(first == 1));
            }
        }
    }
}

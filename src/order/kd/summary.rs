//! Counts and areas of the triangles in both cells of every node with two children, each triangle
//! once: what the builder's own lists would say, in one pass over the finished tree.
//!
//! The pass goes backwards, so that children come before their parents: subtrees that are done wait
//! on a stack, the one with the lowest index on top, and a node takes the two topmost.
//!
//! Adding up leaves would count a triangle once for each leaf that lists it. But a triangle that
//! two successive leaves (of those that list it) have in common is counted twice exactly in the
//! nodes above both: subtracting it in the lowest of these, and so in all, leaves it counted once.
//! That is one step for each reference instead of one for each reference and level. The lowest node
//! above the current leaf and a later one is the node that will take the waiting subtree with the
//! later leaf in it as its upper child.

use crate::tree::{KD_MAX_DEPTH, KdTree};
use rayon::prelude::*;

/// The triangles in a cell, each once and with its whole area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubtreeSummary {
    /// How many.
    pub count: u32,
    /// Sum of their areas, in scene units squared.
    pub area_sum: f64,
    /// Largest of their areas.
    pub area_max: f32,
}

/// The summaries of the lower and upper cell of each node with two children, by its index; of other
/// nodes, that of nothing.
pub fn summaries(tree: &KdTree) -> Vec<[SubtreeSummary; 2]> {
    let mut all = vec![Default::default(); tree.nodes.len()];
    for_each_pair::<true, true>(tree, |index, sides| all[index] = sides);
    all
}

/// A subtree that waits for its parent.
#[derive(Clone, Copy, Default)]
struct Done {
    summary: SubtreeSummary,
    /// Area that it has in common with the leaves since.
    common: f64,
}

/// Waiting subtrees that are compared without asking how that goes.
const AT_ONCE: usize = 4;

/// At the bottom are some that nothing is in: they end every search.
const STACK: usize = AT_ONCE + 1 + KD_MAX_DEPTH + 1;

/// The place of the waiting subtree with the leaf `later` in it; the topmost for 0. Mostly it is
/// among the topmost, but no processor foresees which: so there are no branches up to there.
#[inline(always)]
fn place_of(later: u32, roots: &[u32; STACK], waiting: usize) -> usize {
    let mut place = waiting - 1;
    loop {
        let below = &roots[place - AT_ONCE..place];
        let steps: usize = below.iter().map(|&root| usize::from(root <= later)).sum();
        place -= steps;
        if steps < AT_ONCE {
            return place;
        }
    }
}

#[derive(Clone, Copy)]
struct Seen {
    area: f32,
    /// The last leaf that listed the triangle; 0, which is a leaf only if it is the root, for none.
    leaf: u32,
}

/// Calls `visit` with the index of each node with two children and the summaries of its cells,
/// children before parents. Sums and maxima of areas are 0 unless `SUMS` and `MAXIMA` ask for them.
pub(super) fn for_each_pair<const SUMS: bool, const MAXIMA: bool>(
    tree: &KdTree,
    mut visit: impl FnMut(usize, [SubtreeSummary; 2]),
) {
    let seen = tree.triangles.par_iter().with_min_len(8192);
    let mut seen: Vec<Seen> = seen.map(|t| Seen { area: t.area() as f32, leaf: 0 }).collect();
    let mut stack = [Done::default(); STACK];
    // Their roots, falling: the last is the topmost.
    let mut roots = [u32::MAX; STACK];
    let mut waiting = AT_ONCE + 1;
    for (index, (node, &count)) in tree.nodes.iter().zip(&tree.counts).enumerate().rev() {
        if node.is_leaf() {
            let mut summary = SubtreeSummary { count, ..SubtreeSummary::default() };
            for &slot in &tree.references[node.leaf_range()] {
                let seen = &mut seen[slot as usize];
                if MAXIMA {
                    summary.area_max = larger(summary.area_max, seen.area);
                }
                if SUMS {
                    let area = f64::from(seen.area);
                    summary.area_sum += area;
                    let later = std::mem::replace(&mut seen.leaf, index as u32);
                    // That of a new triangle goes to the bottom, where no subtree is.
                    let place = place_of(later, &roots, waiting) * usize::from(later != 0);
                    stack[place].common += area;
                }
            }
            stack[waiting] = Done { summary, common: 0.0 };
            roots[waiting] = index as u32;
            waiting += 1;
        } else if !node.is_single() {
            let [Done { summary: upper, common, .. }, Done { summary: lower, .. }] =
                [stack[waiting - 2], stack[waiting - 1]];
            visit(index, [lower, upper]);
            let mut summary = SubtreeSummary { count, ..SubtreeSummary::default() };
            if MAXIMA {
                summary.area_max = larger(lower.area_max, upper.area_max);
            }
            if SUMS {
                // Rounding must not make it less than either side's.
                let sides = larger(lower.area_sum, upper.area_sum);
                summary.area_sum = larger(lower.area_sum + upper.area_sum - common, sides);
            }
            waiting -= 1;
            stack[waiting - 1] = Done { summary, common: 0.0 };
            roots[waiting - 1] = index as u32;
        }
    }
}

/// The larger number: one instruction, unlike `max`, which looks out for NaN.
#[inline(always)]
fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::kd_sah::{Splits, build};
    use crate::test_random::Random;

    #[test]
    fn each_triangle_counts_once() {
        for (count, splits) in [(1, Splits::Perfect), (300, Splits::Boxes), (900, Splits::Perfect)]
        {
            let mesh = Random::new(45).mesh(count);
            let tree = build(&mesh, splits).unwrap();
            let summaries = summaries(&tree);
            for (index, sides) in summaries.iter().enumerate() {
                if !tree.nodes[index].has_two() {
                    assert_eq!(*sides, [SubtreeSummary::default(); 2]);
                    continue;
                }
                for (child, summary) in tree.children(index).iter().zip(sides) {
                    let list = child.map_or_else(Vec::new, |c| listed(&tree, c));
                    let areas = list.iter().map(|&s| tree.triangles[s as usize].area() as f32);
                    let sum: f64 = areas.clone().map(f64::from).sum();
                    let max = areas.fold(0.0, f32::max);
                    assert_eq!((summary.count as usize, summary.area_max), (list.len(), max));
                    assert!((summary.area_sum - sum).abs() <= 1e-12 * sum.max(1.0), "{index}");
                }
            }
        }
    }

    /// The distinct slots below a node.
    fn listed(tree: &KdTree, index: usize) -> Vec<u32> {
        let node = tree.nodes[index];
        let mut list = if node.is_leaf() {
            tree.references[node.leaf_range()].to_vec()
        } else {
            tree.children(index).into_iter().flatten().flat_map(|c| listed(tree, c)).collect()
        };
        list.sort_unstable();
        list.dedup();
        list
    }
}

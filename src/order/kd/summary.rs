//! Counts and areas of the triangles in both cells of every inner node, each triangle once: what
//! the builder's own lists would say, in one pass over the finished tree.
//!
//! Adding up leaves would count a triangle once for each leaf that lists it. But a triangle that
//! two successive leaves (of those that list it) have in common is counted twice exactly in the
//! nodes above both: subtracting it in the lowest of these, and so in all, leaves it counted once.
//! That is one step for each reference instead of one for each reference and level.

use crate::tree::{KD_MAX_DEPTH, KdNode, KdTree};
use rayon::prelude::*;

/// The triangles in a cell, each once and with its whole area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubtreeSummary {
    /// How many.
    pub count: u32,
    /// Sum of their areas, in scene units squared.
    pub area_sum: f64,
    /// Largest of their areas.
    pub area_max: f64,
}

/// The summaries of the lower and upper cell of each inner node, by its index; of leaves, and of
/// empty cells, that of nothing.
pub fn summaries(tree: &KdTree) -> Vec<[SubtreeSummary; 2]> {
    let mut all = vec![Default::default(); tree.nodes.len()];
    for_each_inner(tree, |index, sides| all[index] = sides);
    all
}

/// Calls `visit` with the index of each inner node and the summaries of its cells, children before
/// parents.
pub(super) fn for_each_inner(tree: &KdTree, visit: impl FnMut(usize, [SubtreeSummary; 2])) {
    if tree.nodes.is_empty() {
        return;
    }
    let seen = tree.triangles.par_iter().with_min_len(8192);
    let mut pass = Pass {
        nodes: &tree.nodes,
        counts: &tree.counts,
        references: &tree.references,
        seen: seen.map(|t| Seen { area: t.area(), leaf: 0 }).collect(),
        above: [(0, 0.0); KD_MAX_DEPTH],
        depth: 0,
        found: visit,
    };
    pass.visit(0);
}

#[derive(Clone, Copy)]
struct Seen {
    area: f64,
    /// One more than the last leaf that listed the triangle; 0 for none yet.
    leaf: u32,
}

struct Pass<'a, F> {
    nodes: &'a [KdNode],
    counts: &'a [u32],
    references: &'a [u32],
    seen: Vec<Seen>,
    /// The inner nodes above, and the area that their two sides have in common.
    above: [(u32, f64); KD_MAX_DEPTH],
    depth: usize,
    found: F,
}

impl<F: FnMut(usize, [SubtreeSummary; 2])> Pass<'_, F> {
    fn visit(&mut self, index: usize) -> SubtreeSummary {
        let node = self.nodes[index];
        let count = self.counts[index];
        if node.is_leaf() {
            let (area_sum, area_max) = self.visit_leaf(index, node);
            return SubtreeSummary { count, area_sum, area_max };
        }
        self.above[self.depth] = (index as u32, 0.0);
        self.depth += 1;
        let mut sides = [SubtreeSummary::default(); 2];
        if node.is_single() {
            sides[usize::from(node.only_upper())] = self.visit(index + 1);
        } else {
            sides[0] = self.visit(index + 1);
            sides[1] = self.visit(node.upper_child());
        }
        self.depth -= 1;
        (self.found)(index, sides);
        let [lower, upper] = sides;
        let common = self.above[self.depth].1;
        // Rounding must not make it less than either side's.
        let area_sum =
            (lower.area_sum + upper.area_sum - common).max(lower.area_sum).max(upper.area_sum);
        SubtreeSummary { count, area_sum, area_max: lower.area_max.max(upper.area_max) }
    }

    fn visit_leaf(&mut self, index: usize, node: KdNode) -> (f64, f64) {
        let (mut sum, mut max) = (0.0, 0.0f64);
        for &slot in &self.references[node.leaf_range()] {
            let Seen { area, leaf } = &mut self.seen[slot as usize];
            sum += *area;
            max = max.max(*area);
            let last = std::mem::replace(leaf, index as u32 + 1);
            if last != 0 {
                // In depth-first order, the nodes above this leaf that are also above the last one
                // are those that do not come after it; mostly the lowest of them is close by.
                let above = self.above[..self.depth].iter_mut().rev();
                if let Some(both) = above.into_iter().find(|a| a.0 < last) {
                    both.1 += *area;
                }
            }
        }
        (sum, max)
    }
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
                if tree.nodes[index].is_leaf() {
                    assert_eq!(*sides, [SubtreeSummary::default(); 2]);
                    continue;
                }
                for (child, summary) in tree.children(index).iter().zip(sides) {
                    let list = child.map_or_else(Vec::new, |c| listed(&tree, c));
                    let areas = list.iter().map(|&s| tree.triangles[s as usize].area());
                    let (sum, max) = (areas.clone().sum::<f64>(), areas.fold(0.0, f64::max));
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

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
    let mut pass = Pass::<true, true>::new(tree);
    for index in (0..tree.nodes.len()).rev() {
        all[index] = pass.step(index).unwrap_or_default();
    }
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

#[derive(Clone, Copy)]
struct Seen {
    area: f32,
    /// The last leaf that listed the triangle; 0, which is a leaf only if it is the root, for none.
    leaf: u32,
}

/// The pass, from the last node to the first. Sums and maxima of areas are 0 unless `SUMS` and
/// `MAXIMA` ask for them.
pub(super) struct Pass<'a, const SUMS: bool, const MAXIMA: bool> {
    tree: &'a KdTree,
    seen: Vec<Seen>,
    /// Subtrees that wait for their parents, the topmost last, and their roots, which fall.
    stack: [Done; STACK],
    roots: [u32; STACK],
    /// The summary of the topmost: not in the stack, as the next node wants it at once.
    top: SubtreeSummary,
    waiting: usize,
}

impl<'a, const SUMS: bool, const MAXIMA: bool> Pass<'a, SUMS, MAXIMA> {
    /// Before the last node.
    pub(super) fn new(tree: &'a KdTree) -> Self {
        let seen = tree.triangles.par_iter().with_min_len(8192);
        Self {
            tree,
            seen: seen.map(|t| Seen { area: t.area() as f32, leaf: 0 }).collect(),
            stack: [Done::default(); STACK],
            roots: [u32::MAX; STACK],
            top: SubtreeSummary::default(),
            waiting: AT_ONCE + 1,
        }
    }

    /// Takes the node at `index`, the one before that of the last call. Of one with two children,
    /// the summaries of its cells.
    #[inline(always)]
    pub(super) fn step(&mut self, index: usize) -> Option<[SubtreeSummary; 2]> {
        let (node, count) = (self.tree.nodes[index], self.tree.counts[index]);
        let mut summary = SubtreeSummary { count, ..SubtreeSummary::default() };
        if node.is_leaf() {
            for &slot in &self.tree.references[node.leaf_range()] {
                let seen = &mut self.seen[slot as usize];
                if MAXIMA {
                    summary.area_max = larger(summary.area_max, seen.area);
                }
                if SUMS {
                    summary.area_sum += f64::from(seen.area);
                    let seen = std::mem::replace(seen, Seen { leaf: index as u32, ..*seen });
                    self.note_common(seen);
                }
            }
            self.stack[self.waiting - 1].summary = self.top;
            self.stack[self.waiting].common = 0.0;
            self.top = summary;
            self.roots[self.waiting] = index as u32;
            self.waiting += 1;
            return None;
        }
        if node.is_single() {
            return None;
        }
        let place = self.waiting - 2;
        let (lower, Done { summary: upper, common }) = (self.top, self.stack[place]);
        if MAXIMA {
            summary.area_max = larger(lower.area_max, upper.area_max);
        }
        if SUMS {
            // Rounding must not make it less than either side's.
            let sides = larger(lower.area_sum, upper.area_sum);
            summary.area_sum = larger(lower.area_sum + upper.area_sum - common, sides);
        }
        self.top = summary;
        self.stack[place].common = 0.0;
        self.roots[place] = index as u32;
        self.waiting = place + 1;
        Some([lower, upper])
    }

    /// Notes the area of a triangle of the current leaf that another leaf has listed as well: with
    /// the waiting subtree that has that leaf in it. Mostly it is among the topmost, but no
    /// processor foresees which, or which triangles are new: so there are no branches up to there.
    #[inline(always)]
    fn note_common(&mut self, seen: Seen) {
        let mut place = self.waiting - 1;
        loop {
            let below = &self.roots[place - AT_ONCE..place];
            let steps: usize = below.iter().map(|&root| usize::from(root <= seen.leaf)).sum();
            place -= steps;
            if steps < AT_ONCE {
                break;
            }
        }
        let is_known = u64::from(seen.leaf != 0).wrapping_neg();
        self.stack[place].common += f64::from_bits(f64::from(seen.area).to_bits() & is_known);
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

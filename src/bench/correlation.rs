//! Whether large boxes and cells hold large triangles, and few: what NodeSATO and PrimNumTO assume.

use super::{Experiment, ExperimentEntry, Subject, distinct};
use crate::Result;
use crate::chart::{Axis, Body, HeatTable, Series, Xy};
use crate::geometry::Triangle;
use crate::order::kd::summaries;
use crate::report::table;
use crate::results::Output;
use crate::tree::{Bvh2, ChildRef, KdTree};
use serde::Serialize;
use std::fmt::Write;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "correlation",
    about: "whether children with large surfaces hold large triangles, and fewer of them (E9)",
    of_the_paper: true,
    start: |_| Box::new(Correlation::default()),
};

/// A child of a node: its surface area and what it holds.
#[derive(Clone, Copy, Debug)]
struct Child {
    area: f64,
    triangles: f64,
    mean_triangle_area: f64,
    largest_triangle_area: f64,
}

/// One tree. Coefficients are of ranks (Spearman), over children at all depths, which are dominated
/// by depth, and over differences between siblings, which is what an order decides by.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    structure: &'static str,
    nodes: usize,
    area_with_mean_triangle: f64,
    area_with_largest_triangle: f64,
    area_with_triangle_count: f64,
    siblings_area_with_mean_triangle: f64,
    siblings_area_with_largest_triangle: f64,
    siblings_area_with_triangle_count: f64,
}

/// A figure of a row.
type Figure = fn(&Row) -> f64;

#[derive(Default)]
struct Correlation {
    rows: Vec<Row>,
    /// By scene and structure, some of the children.
    samples: Vec<(String, &'static str, Vec<Child>)>,
}

/// Children in a chart.
const SHOWN: usize = 6000;

impl Correlation {
    fn add(&mut self, scene: &str, structure: &'static str, pairs: &[[Child; 2]]) {
        let children: Vec<Child> = pairs.iter().flatten().copied().collect();
        let over_children =
            |value: fn(&Child) -> f64| spearman(children.iter().map(|c| [c.area, value(c)]));
        // As logarithms of ratios, so that all depths count alike.
        let over_siblings = |value: fn(&Child) -> f64| {
            let ratio = |[a, b]: &[Child; 2], of: fn(&Child) -> f64| (of(a) / of(b)).ln();
            spearman(pairs.iter().map(|pair| [ratio(pair, |c| c.area), ratio(pair, value)]))
        };
        self.rows.push(Row {
            scene: scene.into(),
            structure,
            nodes: pairs.len(),
            area_with_mean_triangle: over_children(|c| c.mean_triangle_area),
            area_with_largest_triangle: over_children(|c| c.largest_triangle_area),
            area_with_triangle_count: over_children(|c| c.triangles),
            siblings_area_with_mean_triangle: over_siblings(|c| c.mean_triangle_area),
            siblings_area_with_largest_triangle: over_siblings(|c| c.largest_triangle_area),
            siblings_area_with_triangle_count: over_siblings(|c| c.triangles),
        });
        // A few slivers of cells would take up most of the chart.
        let mut areas: Vec<f64> = children.iter().map(|c| c.area).collect();
        areas.sort_by(f64::total_cmp);
        let least = areas.get(areas.len() / 500).copied().unwrap_or_default();
        let stride = children.len().div_ceil(SHOWN).max(1);
        let some = children.into_iter().filter(|c| c.area >= least).step_by(stride).collect();
        self.samples.push((scene.into(), structure, some));
    }
}

impl Experiment for Correlation {
    fn steps(&self) -> usize {
        2
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        let scene = &subject.scene().name;
        self.add(scene, "bvh2", &bvh2_pairs(&subject.bvh2()?.tree));
        step();
        self.add(scene, "kd", &kd_pairs(&subject.kd()?.tree));
        step();
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        output.rows(ENTRY.name, &self.rows)?;
        let columns: [(&str, Figure); 6] = [
            ("siblings: mean triangle", |r| r.siblings_area_with_mean_triangle),
            ("siblings: largest triangle", |r| r.siblings_area_with_largest_triangle),
            ("siblings: triangle count", |r| r.siblings_area_with_triangle_count),
            ("all: mean triangle", |r| r.area_with_mean_triangle),
            ("all: largest triangle", |r| r.area_with_largest_triangle),
            ("all: triangle count", |r| r.area_with_triangle_count),
        ];
        let mut text = String::new();
        for structure in distinct(self.rows.iter().map(|r| r.structure)) {
            let rows: Vec<_> = self.rows.iter().filter(|r| r.structure == structure).collect();
            let header = ["rank correlation of a child's area with"]
                .into_iter()
                .chain(columns.iter().map(|c| c.0));
            let mut table = table(header.map(|h| h.replace(": ", ":\n")));
            let values: Vec<Vec<f64>> =
                rows.iter().map(|row| columns.iter().map(|c| c.1(row)).collect()).collect();
            for (row, values) in rows.iter().zip(&values) {
                let values = values.iter().map(|v| format!("{v:.3}"));
                table.add_row(std::iter::once(row.scene.clone()).chain(values));
            }
            let _ = writeln!(text, "{structure}\n{}\n", table.trim_fmt());
            output.chart(
                &format!("correlation-{structure}"),
                &format!("Do larger children hold larger triangles? {structure}"),
                "Rank correlation of the surface area of children with what they hold: between \
                 siblings (ratios), which is what an order decides by, and over all children.",
                Body::HeatTable(HeatTable {
                    axis: Axis::linear("rank correlation").with_reference(0.0),
                    row_title: "scene".into(),
                    rows: rows.iter().map(|r| r.scene.clone()).collect(),
                    column_title: "area with".into(),
                    columns: columns.iter().map(|c| c.0.to_string()).collect(),
                    values,
                    decimals: Some(2),
                }),
            )?;
        }
        for scene in distinct(self.samples.iter().map(|s| &s.0)) {
            let of_scene = self.samples.iter().filter(|s| s.0 == *scene);
            let series = of_scene.map(|(_, structure, children)| {
                let points = children.iter().map(|c| [c.area, c.mean_triangle_area]);
                Series::points(*structure, points)
            });
            output.chart(
                &format!("correlation-{scene}"),
                &format!("Surface area of children and their triangles: {scene}"),
                "Children of inner nodes (boxes of the binary tree, cells of the kd-tree), a sample \
                 without the smallest 0.2 %. Depth is in here as well: deep children are small.",
                Body::Xy(Xy {
                    x_axis: Axis::log("surface area of the child [scene units²]"),
                    y_axis: Axis::log("mean area of its triangles [scene units²]"),
                    series: series.collect(),
                }),
            )?;
        }
        Ok(text)
    }
}

/// Count, sum and largest of areas.
#[derive(Clone, Copy, Default)]
struct Areas {
    count: f64,
    sum: f64,
    largest: f64,
}

impl Areas {
    fn child(&self, area: f64) -> Child {
        Child {
            area,
            triangles: self.count,
            mean_triangle_area: self.sum / self.count,
            largest_triangle_area: self.largest,
        }
    }
}

/// The children of every node.
fn bvh2_pairs(tree: &Bvh2) -> Vec<[Child; 2]> {
    let mut below = vec![Areas::default(); tree.nodes.len()];
    let mut pairs = Vec::with_capacity(tree.nodes.len());
    // Parents come before their children.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let of = |child: ChildRef| {
            if !child.is_leaf() {
                return below[child.node_index()];
            }
            let areas = tree.triangles[child.leaf_slots()].iter().map(Triangle::area);
            areas.fold(Areas::default(), |all, area| Areas {
                count: all.count + 1.0,
                sum: all.sum + area,
                largest: all.largest.max(area),
            })
        };
        let [a, b] = node.children.map(of);
        below[index] = Areas {
            count: a.count + b.count,
            sum: a.sum + b.sum,
            largest: a.largest.max(b.largest),
        };
        pairs
            .push([a.child(node.bounds[0].surface_area()), b.child(node.bounds[1].surface_area())]);
    }
    pairs
}

/// The cells of every node with two children.
fn kd_pairs(tree: &KdTree) -> Vec<[Child; 2]> {
    let summaries = summaries(tree);
    let mut pairs = Vec::new();
    tree.walk(|index, cell, _| {
        let node = tree.nodes[index];
        if node.has_two() {
            let cells = KdTree::split_cell(cell, node);
            pairs.push([0, 1].map(|side| {
                let held = summaries[index][side];
                let areas = Areas {
                    count: f64::from(held.count),
                    sum: held.area_sum,
                    largest: f64::from(held.area_max),
                };
                areas.child(cells[side].surface_area())
            }));
        }
    });
    pairs
}

/// The rank correlation of pairs (Spearman, 1904); those with a figure that is not finite are left
/// out, equal figures share their mean rank. NaN where there is nothing to correlate.
fn spearman(pairs: impl Iterator<Item = [f64; 2]>) -> f64 {
    let pairs: Vec<[f64; 2]> = pairs.filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let [x, y] = [0, 1].map(|k| ranks(&pairs.iter().map(|p| p[k]).collect::<Vec<_>>()));
    let mean = 0.5 * (pairs.len() as f64 - 1.0);
    let sum = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    sum(&x, &y) / (sum(&x, &x) * sum(&y, &y)).sqrt()
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = first as f64 + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|&i| ranks[i] = rank);
        first += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlations() {
        let of = |pairs: &[[f64; 2]]| spearman(pairs.iter().copied());
        assert!((of(&[[1.0, 2.0], [2.0, 30.0], [3.0, 400.0]]) - 1.0).abs() < 1e-12);
        assert!((of(&[[1.0, 9.0], [2.0, 3.0], [f64::NAN, 0.0], [3.0, 1.0]]) + 1.0).abs() < 1e-12);
        // With ties: Pearson's coefficient of the mean ranks.
        let tied = of(&[[1.0, 1.0], [1.0, 2.0], [2.0, 2.0]]);
        assert!((tied - 0.5).abs() < 1e-12, "{tied}");
        assert!(of(&[[1.0, 1.0]]).is_nan());
    }

    #[test]
    fn areas_below_children_are_those_of_their_triangles() {
        let (_, tree) = super::super::example::tree();
        let pairs = bvh2_pairs(&tree);
        let [small, large] = pairs[1];
        assert_eq!((small.triangles, small.mean_triangle_area), (4.0, 0.5));
        assert_eq!((large.triangles, large.largest_triangle_area), (2.0, 0.5 * 39.0 * 39.0));
        assert!(large.area > small.area);
    }
}

//! How many nodes an order treats as NodeSATO does: the traversal-order similarity of the slides.

use super::{Experiment, ExperimentEntry, Subject, distinct};
use crate::Result;
use crate::chart::{Axis, Body, HeatTable};
use crate::order::ORDERS;
use crate::report::table;
use crate::results::Output;
use crate::tree::{Bvh2, KdTree, NodeBits, Plan};
use serde::Serialize;
use std::fmt::Write;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "similarity",
    about: "share of nodes whose children each order visits as NodeSATO does (E5)",
    of_the_paper: true,
    start: |_| Box::new(Similarity { rows: Vec::new() }),
};

/// One order on one tree. Nodes whose children are equally large are left out.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    structure: &'static str,
    order: String,
    /// Nodes that count.
    nodes: usize,
    /// Nodes left out.
    ties: usize,
    /// Share of the nodes with the same child first.
    equal_share: f64,
    /// The same, each node weighted by its surface area: by how many random lines come to it.
    equal_share_by_area: f64,
}

/// A node with an order to decide: its index and surface area.
type Node = (usize, f64);

/// A figure of a row.
type Figure = fn(&Row) -> f64;

struct Similarity {
    rows: Vec<Row>,
}

impl Similarity {
    /// Adds a row for each plan that is the same for every ray.
    fn compare(
        &mut self,
        scene: &str,
        structure: &'static str,
        nodes: &[Node],
        ties: usize,
        plans: &[(&str, Plan)],
    ) {
        let fixed: Vec<(&str, &NodeBits)> = plans
            .iter()
            .filter_map(|(name, plan)| match plan {
                Plan::Fixed(bits) => Some((*name, bits)),
                Plan::Near | Plan::Far => None,
            })
            .collect();
        let Some((_, sato)) = fixed.iter().find(|(name, _)| *name == "node-sato") else { return };
        let all_area: f64 = nodes.iter().map(|n| n.1).sum();
        for (order, bits) in &fixed {
            let equal = nodes.iter().filter(|(index, _)| bits.get(*index) == sato.get(*index));
            let (count, area) =
                equal.fold((0usize, 0.0), |(count, area), node| (count + 1, area + node.1));
            self.rows.push(Row {
                scene: scene.into(),
                structure,
                order: (*order).into(),
                nodes: nodes.len(),
                ties,
                equal_share: count as f64 / nodes.len().max(1) as f64,
                equal_share_by_area: if all_area > 0.0 { area / all_area } else { f64::NAN },
            });
        }
    }
}

/// The nodes of a binary tree that are no ties, and how many are.
fn bvh2_nodes(tree: &Bvh2) -> (Vec<Node>, usize) {
    let areas = |i: usize| tree.nodes[i].bounds.map(|b| b.half_area());
    let nodes: Vec<Node> = (0..tree.nodes.len())
        .filter(|&i| areas(i)[0] != areas(i)[1])
        .map(|i| (i, tree.nodes[i].bounds[0].union(tree.nodes[i].bounds[1]).surface_area()))
        .collect();
    let ties = tree.nodes.len() - nodes.len();
    (nodes, ties)
}

/// The nodes of a kd-tree with two children that are no ties, and how many are.
fn kd_nodes(tree: &KdTree) -> (Vec<Node>, usize) {
    let (mut nodes, mut ties) = (Vec::new(), 0);
    tree.walk(|index, cell, _| {
        let node = tree.nodes[index];
        if node.has_two() {
            // Cells share the plane: the longer one is the larger one.
            let (axis, split) = (node.axis(), f64::from(node.split()));
            let tie = split - f64::from(cell.min[axis]) == f64::from(cell.max[axis]) - split;
            ties += usize::from(tie);
            if !tie {
                nodes.push((index, cell.surface_area()));
            }
        }
    });
    (nodes, ties)
}

impl Experiment for Similarity {
    fn steps(&self) -> usize {
        2 * ORDERS.len()
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        let context = subject.order_context()?;
        let scene = &subject.scene().name;
        let bvh2 = subject.bvh2()?;
        let mut plans = Vec::new();
        for order in ORDERS {
            plans.push((order.name, (order.plan_bvh2)(&bvh2.tree, &context)));
            step();
        }
        let (nodes, ties) = bvh2_nodes(&bvh2.tree);
        self.compare(scene, "bvh2", &nodes, ties, &plans);
        let kd = subject.kd()?;
        plans.clear();
        for order in ORDERS {
            plans.extend(order.plan_kd.map(|plan| (order.name, plan(&kd.tree, &context))));
            step();
        }
        let (nodes, ties) = kd_nodes(&kd.tree);
        self.compare(scene, "kd", &nodes, ties, &plans);
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        output.rows(ENTRY.name, &self.rows)?;
        let mut text = String::new();
        let weightings: [(&str, &str, Figure); 2] = [
            ("each node once", "nodes", |r| r.equal_share),
            ("weighted by surface area", "area", |r| r.equal_share_by_area),
        ];
        for structure in distinct(self.rows.iter().map(|r| r.structure)) {
            let rows: Vec<_> = self.rows.iter().filter(|r| r.structure == structure).collect();
            let orders = distinct(rows.iter().map(|r| &r.order).filter(|o| *o != "node-sato"));
            let scenes = distinct(rows.iter().map(|r| &r.scene));
            for (weighting, short, value) in weightings {
                let percent = |order: &str, scene: &str| {
                    let row = rows.iter().find(|r| r.order == order && r.scene == scene);
                    row.map_or(f64::NAN, |r| 100.0 * value(r))
                };
                let mut table = table(
                    ["same child first as NodeSATO [%]"]
                        .into_iter()
                        .chain(scenes.iter().map(|s| s.as_str())),
                );
                let mut values = Vec::new();
                for order in &orders {
                    let row: Vec<f64> = scenes.iter().map(|scene| percent(order, scene)).collect();
                    let texts = row.iter().map(|v| format!("{v:.1}"));
                    table.add_row(std::iter::once(order.to_string()).chain(texts));
                    values.push(row);
                }
                let _ = writeln!(text, "{structure}, {weighting}\n{}\n", table.trim_fmt());
                output.chart(
                    &format!("similarity-{structure}-{short}"),
                    &format!("Nodes ordered as by NodeSATO: {structure}, {weighting}"),
                    "Share of the nodes with the same child first, in per cent; nodes with equally \
                     large children are left out. A coin gives 50.",
                    Body::HeatTable(HeatTable {
                        axis: Axis::linear("same child first [%]").with_reference(50.0),
                        row_title: "order".into(),
                        rows: orders.iter().map(ToString::to_string).collect(),
                        column_title: "scene".into(),
                        columns: scenes.iter().map(ToString::to_string).collect(),
                        values,
                        decimals: Some(1),
                    }),
                )?;
            }
        }
        Ok(text)
    }
}

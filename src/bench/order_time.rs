//! How long each order takes to compute, on one thread: Table 1 of the slides.

use super::{Experiment, ExperimentEntry, Settings, Subject, distinct};
use crate::Result;
use crate::chart::{Axis, Bar, BarLayout, Bars, Better, Body, Group};
use crate::measure::{Summary, interleaved};
use crate::order::{ORDERS, OrderContext};
use crate::report::table;
use crate::results::Output;
use crate::tree::{NodeBits, Plan};
use crate::{Error, order};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "order-time",
    about: "time to compute each order on one thread, beside the paper's Table 1 (E1, E2, E3)",
    of_the_paper: true,
    start: |settings| Box::new(OrderTime { settings: settings.clone(), rows: Vec::new() }),
};

/// One order on one tree.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    triangles: usize,
    structure: &'static str,
    /// Inner nodes with two children: those that an order decides on.
    nodes: usize,
    order: String,
    order_ms: f64,
    order_ms_min: f64,
    order_ms_max: f64,
    ns_per_node: f64,
    /// The paper's figure for its scene of that name; where `paper_is_bound`, what it lies below.
    paper_ms: Option<f64>,
    paper_is_bound: Option<bool>,
}

/// A cell of the paper's table, orders and scenes by our names.
#[derive(Clone, Debug, Deserialize)]
struct PaperCell {
    scene: String,
    structure: String,
    order: String,
    relation: String,
    order_ms: f64,
}

/// From the slides of "SATO: Surface-Area Traversal Order for Shadow Ray Tracing" (Nah, 2013).
const PAPER: &str = include_str!("paper_table1.csv");

fn paper_table() -> Vec<PaperCell> {
    let mut reader = csv::Reader::from_reader(PAPER.as_bytes());
    reader.deserialize().map(|cell| cell.expect("the table is part of the program")).collect()
}

/// An order that is timed: its name and how it is computed.
type Contender<'a> = (String, Box<dyn Fn() -> Plan + 'a>);

struct OrderTime {
    settings: Settings,
    rows: Vec<Row>,
}

impl OrderTime {
    fn time(
        &mut self,
        subject: &Subject<'_>,
        structure: &'static str,
        nodes: usize,
        contenders: &[Contender<'_>],
        step: &dyn Fn(),
    ) {
        let times = interleaved(contenders.len(), self.settings.rounds, |index| {
            let start = Instant::now();
            black_box(contenders[index].1());
            let ms = start.elapsed().as_secs_f64() * 1e3;
            step();
            ms
        });
        let paper = paper_table();
        for ((order, _), times) in contenders.iter().zip(&times) {
            let ms = Summary::of(times);
            let cell = paper.iter().find(|cell| {
                (cell.scene.as_str(), cell.structure.as_str(), &cell.order)
                    == (subject.scene().name.as_str(), structure, order)
            });
            self.rows.push(Row {
                scene: subject.scene().name.clone(),
                triangles: subject.scene().mesh.len(),
                structure,
                nodes,
                order: order.clone(),
                order_ms: ms.median,
                order_ms_min: ms.min,
                order_ms_max: ms.max,
                ns_per_node: ms.median * 1e6 / nodes.max(1) as f64,
                paper_ms: cell.map(|c| c.order_ms),
                paper_is_bound: cell.map(|c| c.relation == "<"),
            });
        }
    }
}

/// What NodeSATO takes if the builder notes nothing: every box of the finished tree is read again.
const FROM_BOXES: &str = "node-sato-from-boxes";

/// Orders that take time; the ray decides the others.
fn computed_orders() -> impl Iterator<Item = &'static order::OrderEntry> {
    ORDERS.iter().copied().filter(|o| !["near", "far"].contains(&o.name))
}

impl Experiment for OrderTime {
    fn steps(&self) -> usize {
        let kd = computed_orders().filter(|o| o.plan_kd.is_some()).count();
        (computed_orders().count() + 1 + kd) * (self.settings.rounds + 1)
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        let one_thread = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .map_err(|e| Error::Usage(format!("cannot start a thread: {e}")))?;
        let (bvh2, kd) = (subject.bvh2()?, subject.kd()?);
        let context: OrderContext<'_> = subject.order_context()?;
        let (bvh2, kd, one_thread) = (&bvh2.tree, &kd.tree, &one_thread);
        let mut contenders: Vec<Contender<'_>> = Vec::new();
        for order in computed_orders() {
            let plan = move || one_thread.install(|| (order.plan_bvh2)(bvh2, &context));
            contenders.push((order.name.into(), Box::new(plan)));
        }
        let from_boxes =
            || NodeBits::from_fn(bvh2.nodes.len(), |i| bvh2.nodes[i].second_is_larger());
        let plan = move || Plan::Fixed(one_thread.install(from_boxes));
        contenders.push((FROM_BOXES.into(), Box::new(plan)));
        self.time(subject, "bvh2", bvh2.nodes.len(), &contenders, step);
        contenders.clear();
        for order in computed_orders() {
            let Some(plan_kd) = order.plan_kd else { continue };
            let plan = move || one_thread.install(|| plan_kd(kd, &context));
            contenders.push((order.name.into(), Box::new(plan)));
        }
        let nodes = kd.nodes.iter().filter(|n| n.has_two()).count();
        self.time(subject, "kd", nodes, &contenders, step);
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        output.rows(ENTRY.name, &self.rows)?;
        let mut text = String::new();
        for structure in distinct(self.rows.iter().map(|r| r.structure)) {
            let rows: Vec<_> = self.rows.iter().filter(|r| r.structure == structure).collect();
            let orders = distinct(rows.iter().map(|r| &r.order));
            let scenes = distinct(rows.iter().map(|r| &r.scene));
            let cell = |order: &str, scene: &str| {
                rows.iter().find(|r| r.order == order && r.scene == scene)
            };
            let mut table =
                table(["order [ms]"].into_iter().chain(scenes.iter().map(|s| s.as_str())));
            for order in &orders {
                let ours = scenes.iter().map(|scene| {
                    cell(order, scene).map_or_else(|| "-".into(), |r| format!("{:.2}", r.order_ms))
                });
                table.add_row(std::iter::once(order.to_string()).chain(ours));
                let paper: Vec<String> = scenes
                    .iter()
                    .map(|scene| cell(order, scene).map_or_else(String::new, |r| paper_text(r)))
                    .collect();
                if paper.iter().any(|p| !p.is_empty()) {
                    table.add_row(std::iter::once("  paper".to_string()).chain(paper));
                }
            }
            let most = rows.iter().max_by_key(|r| r.nodes).map_or(0, |r| r.nodes);
            let _ = writeln!(text, "{structure} (up to {most} nodes)\n{}\n", table.trim_fmt());
            let of_paper = |o: &str| rows.iter().any(|r| r.order == o && r.paper_ms.is_some());
            let charted: Vec<&String> = orders.iter().copied().filter(|o| of_paper(o)).collect();
            output.chart(
                &format!("order-time-{structure}"),
                &format!("Time to compute an order, {structure}, one thread"),
                "Bars: median, with extremes. The paper's figures (3.4 GHz Core i7, 2013) are of its own \
                 scenes of like size; some are only known to lie below 0.1 ms.",
                chart(&scenes, &charted, &cell),
            )?;
        }
        Ok(text)
    }
}

fn paper_text(row: &Row) -> String {
    let less = if row.paper_is_bound == Some(true) { "<" } else { "" };
    row.paper_ms.map_or_else(String::new, |ms| format!("{less}{ms:.1}"))
}

/// A panel for each scene, a bar for each order and one for the paper's figure.
fn chart<'a>(
    scenes: &[&String],
    orders: &[&String],
    cell: &dyn Fn(&str, &str) -> Option<&'a &'a Row>,
) -> Body {
    let series = orders.iter().flat_map(|o| [o.to_string(), format!("{o} (paper)")]).collect();
    let group = |scene: &&String| {
        let bars = orders.iter().flat_map(|order| {
            let row = cell(order, scene);
            let ours = row.map_or(Bar::from(f64::NAN), |r| Bar {
                value: r.order_ms,
                range: Some([r.order_ms_min, r.order_ms_max]),
            });
            [ours, Bar::from(row.and_then(|r| r.paper_ms).unwrap_or(f64::NAN))]
        });
        Group::new(scene.as_str(), bars)
    };
    Body::Bars(Bars {
        axis: Axis::log("order time [ms]"),
        series,
        groups: scenes.iter().map(group).collect(),
        layout: BarLayout::Panels,
        better: Better::Lower,
        ..Bars::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_table_names_orders_and_scenes_that_exist() {
        let table = paper_table();
        assert_eq!(table.len(), 66);
        for cell in &table {
            assert!(order::find(&cell.order).is_some(), "{cell:?}");
            assert!(super::super::PAPER_SCENES.contains(&cell.scene.as_str()), "{cell:?}");
            assert!(["bvh2", "kd"].contains(&cell.structure.as_str()), "{cell:?}");
            assert!(cell.order_ms > 0.0 && ["=", "<"].contains(&cell.relation.as_str()));
        }
    }
}

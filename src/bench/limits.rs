//! Where an order cannot help: rays that nothing stops, and triangles of equal size.

use super::speed_up::{Row, Traversal, measured, traversals};
use super::{Experiment, ExperimentEntry, Settings, Subject, distinct};
use crate::chart::{Axis, Bar, Bars, Body, Group};
use crate::report::table;
use crate::results::Output;
use crate::{Result, scene};
use serde::Serialize;
use std::fmt::Write;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "limits",
    about: "ratios near 1: unoccluded rays, and a soup of equal triangles (E10)",
    of_the_paper: true,
    start: |settings| Box::new(Limits { settings: settings.clone(), rows: Vec::new() }),
};

/// Fixed orders and, first, the one that they are compared with. A coin costs what NodeSATO does at
/// run time, so that it shows what the order itself is worth, and what not asking the ray is.
const ORDERS: [&str; 3] = ["random", "near", "node-sato"];

/// The scene of equal triangles.
const SOUP: &str = "equal-soup";

#[derive(Clone, Debug, Serialize)]
struct LimitRow {
    limit: &'static str,
    scene: String,
    rays: String,
    structure: String,
    trace: String,
    order: String,
    ray_count: usize,
    occluded_share: f64,
    trace_ms: f64,
    /// How many times faster than a random order, round by round.
    speed_up_over_random: f64,
    speed_up_over_random_min: f64,
    speed_up_over_random_max: f64,
    nodes_per_ray: f64,
    nodes_to_random: f64,
}

struct Limits {
    settings: Settings,
    rows: Vec<LimitRow>,
}

fn limit_traversals() -> Vec<Traversal> {
    traversals().into_iter().map(|t| Traversal { orders: ORDERS.to_vec(), ..t }).collect()
}

impl Limits {
    fn add(&mut self, limit: &'static str, rows: Vec<Row>) {
        self.rows.extend(rows.into_iter().map(|row| LimitRow {
            limit,
            scene: row.scene,
            rays: row.rays,
            structure: row.structure,
            trace: row.trace,
            order: row.order,
            ray_count: row.ray_count,
            occluded_share: row.occluded_share,
            trace_ms: row.trace_ms,
            speed_up_over_random: row.speed_up,
            speed_up_over_random_min: row.speed_up_min,
            speed_up_over_random_max: row.speed_up_max,
            nodes_per_ray: row.nodes_per_ray,
            nodes_to_random: row.nodes_to_near,
        }));
    }

    fn measure_on(
        &mut self,
        limit: &'static str,
        subset: &'static str,
        subject: &Subject<'_>,
        step: &dyn Fn(),
    ) -> Result<()> {
        for traversal in limit_traversals() {
            let rows = measured(subject, &traversal, &[subset], self.settings.rounds, step)?;
            self.add(limit, rows);
        }
        Ok(())
    }
}

impl Experiment for Limits {
    fn steps(&self) -> usize {
        let classes = crate::render::Pass::ALL.len();
        limit_traversals().len() * ORDERS.len() * classes * (self.settings.rounds + 2)
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        // The soup is the same whatever the scenes: once, before the first.
        if self.rows.is_empty() && subject.scene().name != SOUP {
            let soup = scene::load(SOUP)?;
            let settings = self.settings.clone();
            let subject = Subject::new(&soup, &settings);
            self.measure_on("equal triangles", "occluded", &subject, &|| {})?;
        }
        let is_soup = subject.scene().name == SOUP;
        let (limit, subset) =
            if is_soup { ("equal triangles", "occluded") } else { ("unoccluded rays", "open") };
        self.measure_on(limit, subset, subject, step)
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        output.rows(ENTRY.name, &self.rows)?;
        let mut text = String::new();
        for limit in distinct(self.rows.iter().map(|r| r.limit)) {
            let rows: Vec<_> = self.rows.iter().filter(|r| r.limit == limit).collect();
            let mut table = table([
                "scene",
                "rays",
                "traversal",
                "order",
                "over random",
                "min",
                "max",
                "nodes to random",
            ]);
            for row in rows.iter().filter(|r| r.order != ORDERS[0]) {
                table.add_row([
                    row.scene.clone(),
                    row.rays.clone(),
                    format!("{} {}", row.structure, row.trace),
                    row.order.clone(),
                    format!("{:.3}", row.speed_up_over_random),
                    format!("{:.3}", row.speed_up_over_random_min),
                    format!("{:.3}", row.speed_up_over_random_max),
                    format!("{:.4}", row.nodes_to_random),
                ]);
            }
            let _ = writeln!(text, "{limit}\n{}\n", table.trim_fmt());
            output.chart(
                &format!("limits-{}", limit.replace(' ', "-")),
                &format!("Speed-up over a random order: {limit}"),
                "Median, with extremes over rounds; 1 is no gain. Front to back also asks the ray at \
                 every node, fixed orders do not.",
                chart(&rows),
            )?;
        }
        Ok(text)
    }
}

/// A group for each scene, kind of rays and traversal, a bar for each order but the first.
fn chart(rows: &[&LimitRow]) -> Body {
    let cells = distinct(rows.iter().map(|r| (&r.scene, &r.rays, &r.structure, &r.trace)));
    let groups = cells.iter().map(|&cell| {
        let bars = ORDERS[1..].iter().map(|order| {
            let row = rows
                .iter()
                .find(|r| (&r.scene, &r.rays, &r.structure, &r.trace) == cell && r.order == *order);
            row.map_or(Bar::from(f64::NAN), |r| Bar {
                value: r.speed_up_over_random,
                range: Some([r.speed_up_over_random_min, r.speed_up_over_random_max]),
            })
        });
        let (scene, rays, structure, trace) = cell;
        Group::new(format!("{scene}, {rays}: {structure} {trace}"), bars)
    });
    Body::Bars(Bars {
        axis: Axis::log("speed-up over random").with_reference(1.0),
        series: ORDERS[1..].iter().map(ToString::to_string).collect(),
        groups: groups.collect(),
        ..Bars::default()
    })
}

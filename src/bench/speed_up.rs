//! How much faster shadow rays are under each order than front to back, by structure and traversal,
//! for occluded and unoccluded rays apart: the average speed-up of the slides.

use super::{Experiment, ExperimentEntry, Settings, Subject, distinct};
use crate::backend::{Accelerator, BackendSpec};
use crate::chart::{Axis, Body, HeatTable};
use crate::measure::{Summary, count, geometric_mean, interleaved, ratios, trace};
use crate::order::ORDERS;
use crate::ray::VisitCounts;
use crate::ray_set::{RaySet, occluded_count};
use crate::report::table;
use crate::results::Output;
use crate::{Error, Result};
use serde::Serialize;
use std::fmt::Write;

pub(super) static ENTRY: ExperimentEntry = ExperimentEntry {
    name: "speed-up",
    about: "shadow-ray time under each order against front to back, occluded and open rays apart (E4)",
    of_the_paper: true,
    start: |settings| {
        Box::new(SpeedUp { settings: settings.clone(), traversals: traversals(), rows: Vec::new() })
    },
};

/// The rays of a class that are measured together.
pub(super) const SUBSETS: [&str; 3] = ["all", "occluded", "open"];

/// One order in one traversal on one part of a class of rays.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    pub(super) triangles: usize,
    pub(super) rays: String,
    pub(super) subset: &'static str,
    pub(super) structure: String,
    pub(super) trace: String,
    pub(super) order: String,
    pub(super) ray_count: usize,
    /// Of the class, whatever the part.
    pub(super) occluded_share: f64,
    pub(super) trace_ms: f64,
    pub(super) trace_ms_min: f64,
    pub(super) trace_ms_max: f64,
    pub(super) mrays_per_s: f64,
    /// How many times faster than `order=near` in the same traversal, round by round.
    pub(super) speed_up: f64,
    pub(super) speed_up_min: f64,
    pub(super) speed_up_max: f64,
    pub(super) nodes_per_ray: f64,
    pub(super) triangles_per_ray: f64,
    /// Nodes visited per node visited front to back.
    pub(super) nodes_to_near: f64,
}

/// A structure and a way through it, with every order that it knows, front to back first.
pub(super) struct Traversal {
    pub(super) structure: &'static str,
    pub(super) trace: &'static str,
    pub(super) orders: Vec<&'static str>,
}

impl Traversal {
    pub(super) fn spec(&self, order: &str) -> Result<BackendSpec> {
        format!("{}:order={order},trace={}", self.structure, self.trace).parse()
    }

    pub(super) fn name(&self) -> String {
        format!("{} {}", self.structure, self.trace)
    }
}

/// Those of the paper. The catalogue of orders begins with front to back.
pub(super) fn traversals() -> Vec<Traversal> {
    let all: Vec<_> = ORDERS.iter().map(|o| o.name).collect();
    let of_kd = ORDERS.iter().filter(|o| o.plan_kd.is_some()).map(|o| o.name).collect();
    vec![
        Traversal { structure: "bvh2", trace: "single", orders: all.clone() },
        Traversal { structure: "bvh2", trace: "packet", orders: all },
        Traversal { structure: "kd", trace: "single", orders: of_kd },
    ]
}

struct SpeedUp {
    settings: Settings,
    traversals: Vec<Traversal>,
    rows: Vec<Row>,
}

impl Experiment for SpeedUp {
    fn steps(&self) -> usize {
        let contenders: usize = self.traversals.iter().map(|t| t.orders.len()).sum();
        let classes = crate::render::Pass::ALL.len();
        contenders * classes * (SUBSETS.len() * (self.settings.rounds + 1) + 1)
    }

    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()> {
        for traversal in &self.traversals {
            let rows = measured(subject, traversal, &SUBSETS, self.settings.rounds, step)?;
            self.rows.extend(rows);
        }
        Ok(())
    }

    fn finish(&self, output: &mut Output) -> Result<String> {
        output.rows(ENTRY.name, &self.rows)?;
        let mut text = averages(&self.rows, &self.traversals);
        for traversal in &self.traversals {
            for subset in SUBSETS {
                let what = Selection { traversal, subset };
                text += &by_scene(output, &self.rows, &what)?;
            }
        }
        Ok(text)
    }
}

/// All orders of a traversal on the rays of a subject, the first being the one that others are
/// compared with.
pub(super) fn measured(
    subject: &Subject<'_>,
    traversal: &Traversal,
    subsets: &[&'static str],
    rounds: usize,
    step: &dyn Fn(),
) -> Result<Vec<Row>> {
    let recording = subject.recording()?;
    let mut backends: Vec<Box<dyn Accelerator>> = Vec::new();
    for order in &traversal.orders {
        backends.push(subject.lab().build(&traversal.spec(order)?)?);
    }
    let mut rows = Vec::new();
    for pass in recording.passes().iter().filter(|pass| !pass.rays().is_empty()) {
        let set = pass.rays();
        let mut answers = set.no_answers();
        trace(&*backends[0], set, &mut answers);
        let occluded_share = occluded_count(&answers) as f64 / set.len() as f64;
        let counts = backends
            .iter()
            .map(|backend| {
                step();
                count(&**backend, set).expect("native backends count")
            })
            .collect::<Vec<_>>();
        let is_occluded: Vec<bool> = set.each_answer(&answers).collect();
        let [open, occluded] = set.split_by(&answers);
        for &subset in subsets {
            let part = match subset {
                "occluded" => &occluded,
                "open" => &open,
                _ => set,
            };
            if part.is_empty() {
                continue;
            }
            let times = timed(&backends, part, rounds, step).map_err(|order| {
                let (scene, order) = (&subject.scene().name, traversal.orders[order]);
                Error::CheckFailed(format!(
                    "{scene}: {} answers otherwise under {order}",
                    traversal.name()
                ))
            })?;
            let chosen = |counts: &[VisitCounts]| {
                let in_part =
                    |i: &usize| subset == "all" || is_occluded[*i] == (subset == "occluded");
                mean_visits((0..counts.len()).filter(in_part).map(|i| counts[i]))
            };
            let near = chosen(&counts[0]);
            for ((order, times_ms), counts) in traversal.orders.iter().zip(&times).zip(&counts) {
                let ms = Summary::of(times_ms);
                let speed_up = ratios(&times[0], times_ms);
                let [nodes, triangles] = chosen(counts);
                rows.push(Row {
                    scene: subject.scene().name.clone(),
                    triangles: subject.scene().mesh.len(),
                    rays: pass.pass().name().into(),
                    subset,
                    structure: traversal.structure.into(),
                    trace: traversal.trace.into(),
                    order: (*order).into(),
                    ray_count: part.len(),
                    occluded_share,
                    trace_ms: ms.median,
                    trace_ms_min: ms.min,
                    trace_ms_max: ms.max,
                    mrays_per_s: part.len() as f64 / (1e3 * ms.median),
                    speed_up: speed_up.median,
                    speed_up_min: speed_up.min,
                    speed_up_max: speed_up.max,
                    nodes_per_ray: nodes,
                    triangles_per_ray: triangles,
                    nodes_to_near: nodes / near[0],
                });
            }
        }
    }
    Ok(rows)
}

/// Times of all backends; the index of one that answers otherwise than the first.
fn timed(
    backends: &[Box<dyn Accelerator>],
    set: &RaySet,
    rounds: usize,
    step: &dyn Fn(),
) -> std::result::Result<Vec<Vec<f64>>, usize> {
    let (mut expected, mut answers) = (Vec::new(), set.no_answers());
    let mut wrong = None;
    let times = interleaved(backends.len(), rounds, |index| {
        let ms = trace(&*backends[index], set, &mut answers);
        if expected.is_empty() {
            expected.clone_from(&answers);
        } else if expected != answers {
            wrong = Some(index);
        }
        step();
        ms
    });
    wrong.map_or(Ok(times), Err)
}

fn mean_visits(counts: impl Iterator<Item = VisitCounts>) -> [f64; 2] {
    let (mut rays, mut sums) = (0u64, [0u64; 2]);
    for count in counts {
        rays += 1;
        sums[0] += u64::from(count.nodes);
        sums[1] += u64::from(count.triangles);
    }
    sums.map(|sum| sum as f64 / rays.max(1) as f64)
}

/// Which rows a table is of.
struct Selection<'a> {
    traversal: &'a Traversal,
    subset: &'static str,
}

impl Selection<'_> {
    fn rows<'a>(&self, rows: &'a [Row], order: &str) -> impl Iterator<Item = &'a Row> {
        let (structure, trace) = (self.traversal.structure, self.traversal.trace);
        let (subset, order) = (self.subset, order.to_string());
        rows.iter().filter(move |r| {
            r.structure == structure && r.trace == trace && r.subset == subset && r.order == order
        })
    }
}

/// Geometric means over all scenes and classes of rays: order by traversal.
fn averages(rows: &[Row], traversals: &[Traversal]) -> String {
    let header = |corner: &str| {
        let columns =
            traversals.iter().flat_map(|t| SUBSETS.map(|subset| format!("{}\n{subset}", t.name())));
        table(std::iter::once(corner.to_string()).chain(columns))
    };
    let (mut speed_ups, mut nodes) = (header("speed-up\nover near"), header("nodes\nto near"));
    for order in ORDERS.iter().map(|o| o.name) {
        let mean = |value: &dyn Fn(&Row) -> f64| -> Vec<String> {
            let columns = traversals.iter().flat_map(|traversal| {
                SUBSETS.map(|subset| {
                    let selection = Selection { traversal, subset };
                    geometric_mean(selection.rows(rows, order).map(value))
                })
            });
            let text = |m: Option<f64>| m.map_or_else(|| "-".into(), |m| format!("{m:.3}"));
            std::iter::once(order.to_string()).chain(columns.map(text)).collect()
        };
        speed_ups.add_row(mean(&|r| r.speed_up));
        nodes.add_row(mean(&|r| r.nodes_to_near));
    }
    format!(
        "geometric means over scenes and classes of rays\n{}\n\n{}\n\n",
        speed_ups.trim_fmt(),
        nodes.trim_fmt()
    )
}

/// Speed-ups of one traversal on one part of the rays: order by scene and class, as table and chart.
fn by_scene(output: &mut Output, rows: &[Row], what: &Selection<'_>) -> Result<String> {
    let (traversal, subset) = (what.traversal, what.subset);
    let of_traversal: Vec<&Row> =
        traversal.orders.iter().flat_map(|order| what.rows(rows, order)).collect();
    let cells = distinct(of_traversal.iter().map(|r| (&r.scene, &r.rays)));
    if cells.is_empty() {
        return Ok(String::new());
    }
    let share = |(scene, rays): &(&String, &String)| {
        let row = of_traversal.iter().find(|r| (&r.scene, &r.rays) == (*scene, *rays));
        row.map_or(f64::NAN, |r| 100.0 * r.occluded_share)
    };
    let value = |order: &str, cell: &(&String, &String)| {
        let row = what.rows(rows, order).find(|r| (&r.scene, &r.rays) == *cell);
        row.map_or(f64::NAN, |r| r.speed_up)
    };
    let of_cell = |cell: &(&String, &String)| -> Vec<f64> {
        traversal.orders.iter().map(|order| value(order, cell)).collect()
    };
    let mut values: Vec<Vec<f64>> = cells.iter().map(of_cell).collect();
    let mean = |order: usize| geometric_mean(values.iter().map(|row| row[order]));
    let means = (0..traversal.orders.len()).map(|order| mean(order).unwrap_or(f64::NAN)).collect();
    values.push(means);
    output.chart(
        &format!("speed-up-{}-{}-{subset}", traversal.structure, traversal.trace),
        &format!("Speed-up over front to back: {}, {subset} rays", traversal.name()),
        "Time front to back over time under each order, on the same rays; above 1 is faster. Orders \
         can help occluded rays only.",
        Body::HeatTable(HeatTable {
            axis: Axis::log("speed-up").with_reference(1.0),
            row_title: "scene and rays".into(),
            rows: cells
                .iter()
                .map(|cell| format!("{} {} ({:.0} % occluded)", cell.0, cell.1, share(cell)))
                .chain(["geometric mean".to_string()])
                .collect(),
            column_title: "order".into(),
            columns: traversal.orders.iter().map(ToString::to_string).collect(),
            values,
            decimals: Some(2),
        }),
    )?;
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}, {subset} rays: speed-up over near, mean of the classes of rays\n",
        traversal.name()
    );
    let scenes = distinct(cells.iter().map(|cell| cell.0));
    let header = ["order"].into_iter().chain(scenes.iter().map(|s| s.as_str()));
    let mut table = table(header);
    for order in &traversal.orders {
        let of_scene = |scene: &&String| {
            let rows = what.rows(rows, order).filter(|r| r.scene == **scene);
            geometric_mean(rows.map(|r| r.speed_up)).map_or("-".into(), |m| format!("{m:.2}"))
        };
        let values = scenes.iter().map(of_scene);
        table.add_row(std::iter::once((*order).to_string()).chain(values));
    }
    let _ = writeln!(text, "{}\n", table.trim_fmt());
    Ok(text)
}

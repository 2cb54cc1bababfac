//! The comparison as text for a terminal.

use super::{ClassReport, CompareReport};
use comfy_table::{CellAlignment, Table, presets};
use std::fmt::Write;

/// A table without lines: the first column to the left, numbers to the right.
pub(crate) fn table(header: impl IntoIterator<Item = impl Into<comfy_table::Cell>>) -> Table {
    let mut table = Table::new();
    let header: Vec<comfy_table::Cell> = header.into_iter().map(Into::into).collect();
    table.load_style(presets::NOTHING).set_header(header);
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        column.set_cell_alignment(if index == 0 {
            CellAlignment::Left
        } else {
            CellAlignment::Right
        });
    }
    table
}

fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.digits$}"))
}

/// The whole report: builds, then a block for each class of rays.
pub fn compare_text(report: &CompareReport) -> String {
    let mut text = String::new();
    let scene = &report.scene;
    let _ = writeln!(
        text,
        "{}: {} triangles, {} vertices",
        scene.name, scene.triangles, scene.vertices
    );
    if let Some(primary) = &report.primary {
        let [width, height] = primary.size;
        let _ = writeln!(
            text,
            "{width}x{height} pixels, {} camera rays ({:.1} % hit, found by {}), {} samples each; \
             {} threads on {}; median of {} interleaved rounds",
            primary.rays,
            100.0 * primary.hit_share,
            primary.backend,
            primary.spp,
            report.provenance.threads,
            report.provenance.cpu,
            report.rounds,
        );
    }
    let mut builds = table(["backend", "build ms", "order ms", "memory MB", "SAH cost", ""]);
    for backend in &report.backends {
        let build = &backend.build;
        builds.add_row([
            backend.spec.clone(),
            format!("{:.1}", build.build_ms),
            format!("{:.2}", build.order_ms),
            format!("{:.1}", build.memory_bytes as f64 / 1e6),
            optional(build.sah_cost, 1),
            build.notes.join("; "),
        ]);
    }
    if let Some(column) = builds.column_mut(5) {
        column.set_cell_alignment(CellAlignment::Left);
    }
    let _ = writeln!(text, "\n{}", builds.trim_fmt());
    for class in &report.classes {
        let _ = writeln!(text, "\n{}", class_text(class));
    }
    text
}

fn class_text(class: &ClassReport) -> String {
    let mut text = format!(
        "{}: {} rays, {:.1} % occluded",
        class.class,
        class.rays,
        100.0 * class.occluded_share
    );
    if class.rays_skipped > 0 {
        let _ = write!(text, ", {} samples needed no ray", class.rays_skipped);
    }
    let mut results = table([
        "backend",
        "ms",
        "min",
        "max",
        "Mrays/s",
        "ratio",
        "nodes/ray",
        "occluded",
        "open",
        "triangles/ray",
    ]);
    for result in &class.results {
        results.add_row([
            result.backend.clone(),
            format!("{:.1}", result.trace_ms.median),
            format!("{:.1}", result.trace_ms.min),
            format!("{:.1}", result.trace_ms.max),
            format!("{:.2}", result.mrays_per_s),
            format!("{:.2}", result.ratio_to_first.median),
            optional(result.nodes_per_ray, 2),
            optional(result.nodes_per_occluded_ray, 2),
            optional(result.nodes_per_unoccluded_ray, 2),
            optional(result.triangles_per_ray, 2),
        ]);
    }
    let _ = writeln!(text, "\n{}", results.trim_fmt());
    for result in &class.results {
        if let (Some(double), Some(exact)) =
            (result.double_tests_per_million, result.exact_tests_per_million)
            && double + exact > 0.0
        {
            let _ = writeln!(
                text,
                "{}: of a million rays f32 left {:.0} tests to f64, and that {exact:.1} to integers",
                result.backend,
                double + exact
            );
        }
    }
    for agreement in &class.agreement {
        let [a, b] = &agreement.backends;
        let _ = match agreement.differing_rays {
            0 => writeln!(text, "{a} and {b} agree on every ray"),
            n => writeln!(
                text,
                "{a} and {b} differ on {n} rays ({:.2} in a million)",
                agreement.differing_per_million
            ),
        };
    }
    if let Some(judgement) = &class.judgement {
        text += &judgement.text();
    }
    text.truncate(text.trim_end().len());
    text
}

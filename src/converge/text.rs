//! The record as text for a terminal.

use super::ratios::{Bound, MeanRatio, MeanReport};
use super::reference::Origin;
use super::renderer::RendererSpec;
use super::rows::{CellReport, ConvergeReport, PointRow, RatioRow};
use crate::report::table;
use comfy_table::{CellAlignment, Table};
use std::fmt::Write;

/// References are warned of that have more than this part of the smallest error.
const REFERENCE_PART: f64 = 0.05;

/// A block for each scene and pass at most samples, then the means over all.
pub fn converge_text(report: &ConvergeReport) -> String {
    let settings = &report.settings;
    let mut text = format!(
        "up to {} samples, {} seeds each, renderers in turn; {} threads on {}\n\
         ratios: how many times better, with 95 % intervals; time of whole images without building, with \
         most samples; squared error in the longest time that both were given; time to the smallest \
         error that both come down to\n\n",
        settings.spp, settings.seeds, report.provenance.threads, report.provenance.cpu
    );
    for renderer in &report.renderers {
        let _ = writeln!(text, "{}: {}", renderer.label, renderer.full());
    }
    for cell in &report.cells {
        text += &cell_text(report, cell);
    }
    if !report.means.is_empty() {
        text += &means_text(report);
        text += &last_text(report);
    }
    text.truncate(text.trim_end().len());
    text
}

fn cell_text(report: &ConvergeReport, cell: &CellReport) -> String {
    let mut text = String::new();
    let reference = &cell.reference;
    let [width, height] = cell.size;
    let origin = match &reference.origin {
        Origin::Rendered => format!("rendered in {:.1} s", reference.ms / 1e3),
        Origin::Kept => "kept from an earlier run".into(),
        Origin::Replaced(why) => {
            format!("rendered again in {:.1} s, the file was damaged: {why}", reference.ms / 1e3)
        }
    };
    let _ = writeln!(
        text,
        "\n{}, {}: {} of {width}x{height} pixels see a surface; error: {}\nreference: {} x {} samples, \
         {origin}, own RMSE {:.2e}{}",
        cell.scene,
        cell.pass,
        cell.pixels,
        cell.unit,
        reference.parts,
        reference.samples_per_part,
        reference.rmse,
        reference
            .part_of_smallest_error
            .map_or(String::new(), |part| format!(", {:.1} % of the smallest below", 100.0 * part)),
    );
    if reference.part_of_smallest_error.is_some_and(|part| part > REFERENCE_PART) {
        let _ = writeln!(
            text,
            "warning: that is more than {:.0} %: --reference-factor makes it smaller",
            100.0 * REFERENCE_PART
        );
    }
    let of_cell = |scene: &str, pass: &str| scene == cell.scene && pass == cell.pass;
    let mut rows = table([
        "renderer",
        "samples",
        "RMSE",
        "relMSE",
        "FLIP",
        "slope",
        "ms",
        "tracing",
        "1/(var s)",
        "rays",
        "left out",
        "pixels differ",
    ]);
    for (renderer, slope) in report.renderers.iter().zip(&cell.slopes) {
        let is_own = |p: &&PointRow| of_cell(&p.scene, p.pass) && p.renderer == renderer.label;
        let Some(point) = report.points.iter().rfind(is_own) else { continue };
        let differing: Vec<usize> =
            report.points.iter().filter(is_own).filter_map(|p| p.differing_pixels).collect();
        rows.add_row([
            point.renderer.clone(),
            point.samples.to_string(),
            format!("{:.3e}", point.rmse),
            format!("{:.3e}", point.relative_mse),
            format!("{:.4}", point.flip),
            slope
                .slope
                .map_or("-".into(), |s| format!("{:.2} ±{:.2}", s.value, 0.5 * (s.high - s.low))),
            format!("{:.1}", point.total_ms),
            format!("{:.0} %", 100.0 * point.tracing_share),
            point.efficiency_per_s.map_or("-".into(), |e| format!("{e:.2e}")),
            point.rays.to_string(),
            point.rays_skipped.to_string(),
            if differing.is_empty() {
                "-".into()
            } else {
                differing.iter().sum::<usize>().to_string()
            },
        ]);
    }
    let _ = writeln!(text, "\n{}", rows.trim_fmt());
    for renderer in &report.renderers {
        let own = report
            .skipped
            .iter()
            .filter(|row| of_cell(&row.scene, row.pass) && row.renderer == renderer.label);
        for (is_traced, what) in [(false, "left out"), (true, "shortened")] {
            let kinds = own.clone().filter(|row| row.is_traced == is_traced);
            let kinds: Vec<String> =
                kinds.map(|row| format!("{} {:.1} %", row.skip, 100.0 * row.share)).collect();
            if !kinds.is_empty() {
                let _ = writeln!(text, "{} {what}: {}", renderer.label, kinds.join(", "));
            }
        }
    }
    let mut ratios = table(RATIO_HEADER);
    for row in report.at_end.iter().filter(|row| of_cell(&row.scene, row.pass)) {
        ratios.add_row([
            row.renderer.clone(),
            row.against.clone(),
            with_ends(
                Bound::Measured,
                row.same_samples,
                row.same_samples_low,
                row.same_samples_high,
            ),
            format!("{:.2}", row.same_samples_tracing),
            with_ends(
                row.equal_time_bound,
                row.equal_time,
                row.equal_time_low,
                row.equal_time_high,
            ),
            with_ends(
                row.equal_error_bound,
                row.equal_error,
                row.equal_error_low,
                row.equal_error_high,
            ),
        ]);
    }
    names_to_the_left(&mut ratios);
    if report.renderers.len() > 1 {
        let _ = writeln!(text, "\n{}", ratios.trim_fmt());
    }
    text
}

const RATIO_HEADER: [&str; 6] = [
    "renderer",
    "against",
    "same samples, time",
    "in tracing",
    "equal time, squared error",
    "equal error, time",
];

fn means_text(report: &ConvergeReport) -> String {
    let mut text = format!(
        "\nhow many times better, geometric means over {} scenes and passes\n",
        report.cells.len()
    );
    let mut rows = table(RATIO_HEADER);
    for mean in &report.means {
        let MeanReport { renderer, against, .. } = mean;
        rows.add_row([
            renderer.clone(),
            against.clone(),
            mean_ratio(mean.same_samples.as_ref(), report.cells.len()),
            mean.same_samples_tracing.map_or("-".into(), |r| format!("{r:.2}")),
            mean_ratio(mean.equal_time.as_ref(), report.cells.len()),
            mean_ratio(mean.equal_error.as_ref(), report.cells.len()),
        ]);
    }
    names_to_the_left(&mut rows);
    let _ = writeln!(text, "\n{}", rows.trim_fmt());
    let bounds = |m: &Option<MeanRatio>| m.as_ref().is_some_and(|m| m.bounds > 0);
    if report.means.iter().any(|m| bounds(&m.equal_time) || bounds(&m.equal_error)) {
        text += "in (): how many of them are bounds, since the curves do not reach as far\n";
    }
    text
}

/// The second column holds names, too.
fn names_to_the_left(table: &mut Table) {
    if let Some(column) = table.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Left);
    }
}

fn mean_ratio(mean: Option<&MeanRatio>, cells: usize) -> String {
    let Some(mean) = mean else { return "-".into() };
    let ratio = mean.ratio;
    let mut text = with_ends(mean.bound, Some(ratio.value), Some(ratio.low), Some(ratio.high));
    if mean.bounds > 0 {
        let _ = write!(text, " ({})", mean.bounds);
    }
    if mean.count < cells {
        let _ = write!(text, " of {}", mean.count);
    }
    text
}

/// The last renderer against each other, scene by scene and pass by pass.
fn last_text(report: &ConvergeReport) -> String {
    let (Some(last), true) = (report.renderers.last(), report.cells.len() > 1) else {
        return String::new();
    };
    let others = &report.renderers[..report.renderers.len() - 1];
    let column = |what: &'static str| others.iter().map(move |o| format!("{what}\n{}", o.label));
    let header = ["scene".to_string(), "pass".into()].into_iter();
    let header = header.chain(column("same samples")).chain(column("equal error"));
    let mut rows = table(header);
    for cell in &report.cells {
        let ratio = |other: &RendererSpec, figure: fn(&RatioRow) -> (Bound, Option<f64>)| {
            let is_asked = |row: &&RatioRow| {
                (&row.scene, row.pass) == (&cell.scene, cell.pass)
                    && (&row.renderer, &row.against) == (&last.label, &other.label)
            };
            let (bound, value) = report.at_end.iter().find(is_asked).map(figure)?;
            value.map(|value| format!("{}{}", bound.sign(), short(value)))
        };
        let shown = |ratio: Option<String>| ratio.unwrap_or_else(|| "-".into());
        let same = others.iter().map(|o| ratio(o, |r| (Bound::Measured, r.same_samples)));
        let equal = others.iter().map(|o| ratio(o, |r| (r.equal_error_bound, r.equal_error)));
        let names = [cell.scene.clone(), cell.pass.to_string()].into_iter();
        rows.add_row(names.chain(same.chain(equal).map(shown)));
    }
    names_to_the_left(&mut rows);
    format!("\n{}, times as fast\n\n{}\n", last.label, rows.trim_fmt())
}

/// A ratio with the ends of its interval.
fn with_ends(bound: Bound, value: Option<f64>, low: Option<f64>, high: Option<f64>) -> String {
    match (value, low, high) {
        (Some(value), Some(low), Some(high)) => {
            format!("{}{} [{}, {}]", bound.sign(), short(value), short(low), short(high))
        }
        _ => "-".into(),
    }
}

/// Three digits.
fn short(value: f64) -> String {
    let digits = if value >= 99.95 { 0 } else { usize::from(value < 9.995) + 1 };
    format!("{value:.digits$}")
}

//! The record as text for a terminal.

use super::AnimateReport;
use crate::report::table;
use std::fmt::Write;

/// What was run, the times of each backend, and where backends differ.
pub fn animate_text(report: &AnimateReport) -> String {
    let [width, height] = report.size;
    let [start, end] = report.frames;
    let mut text = format!(
        "{}: {} triangles, {} of {} objects move\n\
         frames {start} to {}, {width}x{height} pixels, {} samples each ({}); {} threads on {}; medians \
         of {} interleaved rounds\n\n",
        report.scene.name,
        report.scene.triangles,
        report.moving_objects,
        report.objects,
        end - 1,
        report.spp,
        report.passes.join(", "),
        report.provenance.threads,
        report.provenance.cpu,
        report.rounds,
    );
    let mut times = table([
        "backend",
        "first build",
        "refit",
        "rotate",
        "build",
        "order",
        "update",
        "trace",
        "frame",
        "again",
        "ratio",
        "again ratio",
        "order %",
        "Mrays/s",
        "MB",
    ]);
    for total in &report.totals {
        let each = |sum: f64| format!("{:.2}", sum / total.frames as f64);
        times.add_row([
            total.backend.clone(),
            format!("{:.2}", total.first_build_ms),
            each(total.refit_ms),
            each(total.rotation_ms),
            each(total.build_ms),
            each(total.order_ms),
            each(total.update_ms),
            each(total.first_trace_ms),
            each(total.frame_ms),
            each(total.trace_ms),
            format!("{:.2}", total.frame_ratio_to_first),
            format!("{:.2}", total.trace_ratio_to_first),
            format!("{:.2}", 100.0 * total.order_share),
            format!("{:.2}", total.mrays_per_s),
            total.most_memory_bytes.map_or("-".into(), |b| format!("{:.1}", b as f64 / 1e6)),
        ]);
    }
    let _ = writeln!(text, "{}", times.trim_fmt());
    text += "milliseconds, means over the frames after the first; a frame is its update and the first \
             answering of its\nrays, with what that builds on demand; again: later rounds; ratios: how \
             many times faster than the first backend\n\n";
    let first = &report.totals[0].backend;
    for total in &report.totals[1..] {
        let own = &total.backend;
        let _ = match total.differing_rays {
            0 => writeln!(text, "{first} and {own} agree on every ray"),
            rays => writeln!(
                text,
                "{first} and {own} differ on {rays} rays ({:.2} in a million)",
                total.differing_per_million
            ),
        };
    }
    text.truncate(text.trim_end().len());
    text
}

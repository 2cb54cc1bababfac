//! Charts over the frames, and of the means.

use super::{FrameRow, Plan, TotalRow};
use crate::Result;
use crate::chart::{Axis, Bars, Better, Body, Group, Series, Xy};
use crate::report::BackendReport;
use crate::results::Output;

/// A value of a row; absent where the backend does not know it.
type Value = fn(&FrameRow) -> Option<f64>;

/// Draws them all; those of the trees' quality only if it was asked for and known.
pub(super) fn write(
    output: &mut Output,
    scene: &str,
    plan: &Plan,
    backends: &[BackendReport],
    rows: &[FrameRow],
    totals: &[TotalRow],
) -> Result<()> {
    let [width, height] = plan.render.size;
    let about = format!(
        "{scene}: {width}x{height} pixels, {} samples each, {} threads",
        plan.render.spp,
        rayon::current_num_threads()
    );
    let timed = format!("{about}; without the first frame, for which trees are built");
    let later = plan.frames.start + 1;
    let times: [(&str, &str, &str, Value); 3] = [
        ("frame-time", "Time of a frame", "update and tracing [ms]", |row| Some(row.frame_ms)),
        ("update-time", "Time of an update", "update [ms]", |row| Some(row.update_ms)),
        ("trace-time", "Time of a frame's rays", "tracing, after an update [ms]", |row| {
            Some(row.first_trace_ms)
        }),
    ];
    for (name, title, axis, value) in times {
        let series = lines(backends, rows, later, value);
        output.chart(name, title, &timed, over_frames(Axis::log(axis), series))?;
    }
    let qualities: [(&str, &str, &str, Value); 2] = [
        ("sah-cost", "How much worse than a new tree", "SAH cost over that of a new tree", |row| {
            row.relative_sah_cost
        }),
        ("stale-order", "How old the order is", "share of nodes in an old order", |row| {
            row.stale_order
        }),
    ];
    for (name, title, axis, value) in qualities {
        let series = lines(backends, rows, plan.frames.start, value);
        if !series.is_empty() {
            output.chart(name, title, &about, over_frames(Axis::linear(axis), series))?;
        }
    }
    let mean = |value: fn(&TotalRow) -> f64| {
        totals.iter().map(move |total| value(total) / total.frames as f64)
    };
    let bars = Bars {
        axis: Axis::linear("mean over frames [ms]"),
        series: totals.iter().map(|total| total.backend.clone()).collect(),
        groups: vec![
            Group::new("update", mean(|total| total.update_ms)),
            Group::new("of it, order", mean(|total| total.order_ms)),
            Group::new("tracing", mean(|total| total.first_trace_ms)),
            Group::new("tracing again", mean(|total| total.trace_ms)),
            Group::new("whole frame", mean(|total| total.frame_ms)),
        ],
        better: Better::Lower,
        own_axes: true,
        ..Bars::default()
    };
    output.chart("mean-time", "Mean time of a frame and its parts", &timed, Body::Bars(bars))
}

/// A line for each backend that knows the value, from frame `from` on.
fn lines(backends: &[BackendReport], rows: &[FrameRow], from: usize, value: Value) -> Vec<Series> {
    let line = |backend: &BackendReport| {
        let own = rows.iter().filter(|row| row.backend == backend.spec && row.frame >= from);
        let points: Vec<_> = own.filter_map(|row| Some([row.frame as f64, value(row)?])).collect();
        (!points.is_empty()).then(|| Series::line(&backend.spec, points))
    };
    backends.iter().filter_map(line).collect()
}

fn over_frames(y_axis: Axis, series: Vec<Series>) -> Body {
    Body::Xy(Xy { x_axis: Axis::linear("frame"), y_axis, series })
}

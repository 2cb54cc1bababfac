//! What a run finds out, as records.

use super::Traced;
use crate::backend::{TreeQuality, UpdateStats};
use crate::measure::Summary;
use crate::report::{BackendReport, Provenance, SceneReport};
use serde::Serialize;

/// The whole record.
#[derive(Clone, Debug, Serialize)]
pub struct AnimateReport {
    /// What made this report.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// The scene.
    pub scene: SceneReport,
    /// Objects that it consists of.
    pub objects: usize,
    /// Those that move.
    pub moving_objects: usize,
    /// The first frame, and the one after the last.
    pub frames: [usize; 2],
    /// Rounds of tracing in each frame after the first, which counts for the frame.
    pub rounds: usize,
    /// Image width and height in pixels.
    pub size: [u32; 2],
    /// Shading samples for each camera sample.
    pub spp: u32,
    /// Camera samples for each pixel.
    pub camera_samples: u32,
    /// Which rays were traced.
    pub passes: Vec<&'static str>,
    /// What followed the scene, with what building for the first frame took.
    pub backends: Vec<BackendReport>,
    /// One for each frame and backend.
    pub rows: Vec<FrameRow>,
    /// One for each backend.
    pub totals: Vec<TotalRow>,
    /// Files beside this one.
    pub files: Vec<String>,
}

/// One backend in one frame. Times are wall-clock, in milliseconds; those of updates are what building
/// took in the first frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    /// The frame, counted from 0 at the first of the scene.
    pub frame: usize,
    /// The backend's spec as given.
    pub backend: String,
    /// All of the update, by the clock around it.
    pub update_ms: f64,
    /// Of it, bringing boxes and triangles up to date, as the backend says.
    pub refit_ms: f64,
    /// Of it, putting parts of the tree elsewhere.
    pub rotation_ms: f64,
    /// Of it, building anew.
    pub build_ms: f64,
    /// Of it, bringing the traversal order up to date.
    pub order_ms: f64,
    /// Whether the whole tree was built anew.
    pub rebuilt: bool,
    /// Nodes whose children were exchanged.
    pub rotations: u64,
    /// Nodes whose order was looked at.
    pub order_nodes: u64,
    /// Answering the frame's shadow rays for the first time, with what is built on demand.
    pub first_trace_ms: f64,
    /// Answering them again: median of the rounds.
    pub trace_ms: f64,
    /// The least of the rounds.
    pub trace_ms_min: f64,
    /// The most of the rounds.
    pub trace_ms_max: f64,
    /// The update, and answering rays for the first time.
    pub frame_ms: f64,
    /// Shadow rays.
    pub rays: u64,
    /// Share of them that it calls occluded.
    pub occluded_share: f64,
    /// Million rays per second, from the median of the rounds.
    pub mrays_per_s: f64,
    /// Expected cost of a random line by the surface-area heuristic; with what follows, only if it was
    /// asked for and the backend knows.
    pub sah_cost: Option<f64>,
    /// That of a tree built anew.
    pub fresh_sah_cost: Option<f64>,
    /// The first over the second.
    pub relative_sah_cost: Option<f64>,
    /// Share of the nodes whose order is no longer what it would be if it were set anew.
    pub stale_order: Option<f64>,
    /// Bytes of the structure.
    pub memory_bytes: Option<u64>,
    /// Rays that the first backend answers differently.
    pub differing_rays: u64,
}

impl FrameRow {
    pub(super) fn new(
        frame: usize,
        backend: &str,
        update_ms: f64,
        update: &UpdateStats,
        traced: &Traced,
        quality: Option<TreeQuality>,
    ) -> Self {
        let share =
            |count: u64| if traced.rays == 0 { 0.0 } else { count as f64 / traced.rays as f64 };
        let trace_ms = traced.trace_ms.median;
        let known = quality.as_ref();
        let (sah_cost, fresh) =
            (known.and_then(|q| q.sah_cost), known.and_then(|q| q.fresh_sah_cost));
        Self {
            frame,
            backend: backend.to_string(),
            update_ms,
            refit_ms: update.refit_ms,
            rotation_ms: update.rotation_ms,
            build_ms: update.build_ms,
            order_ms: update.order_ms,
            rebuilt: update.rebuilt,
            rotations: update.rotations,
            order_nodes: update.order_nodes,
            first_trace_ms: traced.first_ms,
            trace_ms,
            trace_ms_min: traced.trace_ms.min,
            trace_ms_max: traced.trace_ms.max,
            frame_ms: update_ms + traced.first_ms,
            rays: traced.rays,
            occluded_share: share(traced.occluded),
            mrays_per_s: rays_per_ms(traced.rays, trace_ms) / 1e3,
            sah_cost,
            fresh_sah_cost: fresh,
            relative_sah_cost: sah_cost.zip(fresh).map(|(own, fresh)| own / fresh),
            stale_order: known.and_then(|q| q.stale_order),
            memory_bytes: known.map(|q| q.memory_bytes),
            differing_rays: traced.differing,
        }
    }
}

/// 0 where there were none.
fn rays_per_ms(rays: u64, ms: f64) -> f64 {
    if rays == 0 { 0.0 } else { rays as f64 / ms }
}

/// One backend over all frames after the first. Times are sums, in milliseconds, unless they say
/// otherwise.
#[derive(Clone, Debug, Serialize)]
pub struct TotalRow {
    /// The backend's spec as given.
    pub backend: String,
    /// Frames that are summed up.
    pub frames: usize,
    /// Building for the first frame, with the order; not in the sums.
    pub first_build_ms: f64,
    /// Updates.
    pub update_ms: f64,
    /// Of them, boxes and triangles.
    pub refit_ms: f64,
    /// Of them, parts of trees put elsewhere.
    pub rotation_ms: f64,
    /// Of them, building anew.
    pub build_ms: f64,
    /// Of them, traversal orders.
    pub order_ms: f64,
    /// Answering rays for the first time, with what is built on demand.
    pub first_trace_ms: f64,
    /// Answering them again.
    pub trace_ms: f64,
    /// Updates, and answering rays for the first time.
    pub frame_ms: f64,
    /// Median over frames of the update.
    pub median_update_ms: f64,
    /// Median over frames of answering rays again.
    pub median_trace_ms: f64,
    /// Median over frames of the update and answering rays for the first time.
    pub median_frame_ms: f64,
    /// How many times faster than the first backend, by `frame_ms`.
    pub frame_ratio_to_first: f64,
    /// How many times faster than the first backend, by `trace_ms`.
    pub trace_ratio_to_first: f64,
    /// Share of the order in `frame_ms`.
    pub order_share: f64,
    /// Frames for which the whole tree was built anew.
    pub rebuilds: usize,
    /// Nodes whose children were exchanged.
    pub rotations: u64,
    /// Shadow rays.
    pub rays: u64,
    /// Million rays per second, from `trace_ms`.
    pub mrays_per_s: f64,
    /// Rays that the first backend answers differently, in all frames.
    pub differing_rays: u64,
    /// The same, among a million.
    pub differing_per_million: f64,
    /// Most bytes of the structure in any frame, if that was asked for.
    pub most_memory_bytes: Option<u64>,
}

impl TotalRow {
    /// One for each backend.
    pub(super) fn all(backends: &[BackendReport], rows: &[FrameRow], first: usize) -> Vec<Self> {
        let mut totals: Vec<Self> =
            backends.iter().map(|backend| Self::of(&backend.spec, rows, first)).collect();
        let first = totals[0].clone();
        for total in &mut totals {
            total.frame_ratio_to_first = first.frame_ms / total.frame_ms;
            total.trace_ratio_to_first = first.trace_ms / total.trace_ms;
        }
        totals
    }

    fn of(backend: &str, rows: &[FrameRow], first: usize) -> Self {
        let own = || rows.iter().filter(|row| row.backend == backend);
        let later: Vec<&FrameRow> = own().filter(|row| row.frame != first).collect();
        let all = |value: fn(&FrameRow) -> f64| later.iter().map(move |row| value(row));
        let sum = |value| all(value).sum::<f64>();
        let median = |value| Summary::of(&all(value).collect::<Vec<_>>()).median;
        let rays = later.iter().map(|row| row.rays).sum();
        let (differing_rays, all_rays) = own().fold((0, 0), |(differing, rays), row| {
            (differing + row.differing_rays, rays + row.rays)
        });
        let (trace_ms, frame_ms) = (sum(|row| row.trace_ms), sum(|row| row.frame_ms));
        let order_ms = sum(|row| row.order_ms);
        Self {
            backend: backend.to_string(),
            frames: later.len(),
            first_build_ms: own().filter(|row| row.frame == first).map(|row| row.update_ms).sum(),
            update_ms: sum(|row| row.update_ms),
            refit_ms: sum(|row| row.refit_ms),
            rotation_ms: sum(|row| row.rotation_ms),
            build_ms: sum(|row| row.build_ms),
            order_ms,
            first_trace_ms: sum(|row| row.first_trace_ms),
            trace_ms,
            frame_ms,
            median_update_ms: median(|row| row.update_ms),
            median_trace_ms: median(|row| row.trace_ms),
            median_frame_ms: median(|row| row.frame_ms),
            frame_ratio_to_first: 1.0,
            trace_ratio_to_first: 1.0,
            order_share: order_ms / frame_ms,
            rebuilds: later.iter().filter(|row| row.rebuilt).count(),
            rotations: later.iter().map(|row| row.rotations).sum(),
            rays,
            mrays_per_s: rays_per_ms(rays, trace_ms) / 1e3,
            differing_rays,
            differing_per_million: rays_per_ms(differing_rays, all_rays.max(1) as f64) * 1e6,
            most_memory_bytes: own().filter_map(|row| row.memory_bytes).max(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(frame: usize, backend: &str, update_ms: f64, trace_ms: f64) -> FrameRow {
        let order_ms = update_ms / 4.0;
        let update = UpdateStats { refit_ms: update_ms - order_ms, order_ms, ..Default::default() };
        let traced = Traced {
            first_ms: 2.0 * trace_ms,
            trace_ms: Summary::of(&[trace_ms]),
            answers: Vec::new(),
            rays: 1000,
            occluded: 250,
            differing: 1,
        };
        let quality = TreeQuality {
            sah_cost: Some(6.0),
            fresh_sah_cost: Some(4.0),
            stale_order: None,
            memory_bytes: 10 * frame as u64,
        };
        FrameRow::new(frame, backend, update_ms, &update, &traced, Some(quality))
    }

    #[test]
    fn sums_leave_out_the_first_frame() {
        let mut rows = Vec::new();
        for frame in 3..6 {
            // The first is far slower.
            let factor = if frame == 3 { 100.0 } else { 1.0 };
            rows.push(row(frame, "a", 8.0 * factor, 4.0 * factor));
            rows.push(row(frame, "b", 4.0 * factor, 2.0 * factor));
        }
        let backend = |spec: &str| BackendReport {
            spec: spec.into(),
            full_spec: spec.into(),
            build: Default::default(),
        };
        let [a, b] = TotalRow::all(&[backend("a"), backend("b")], &rows, 3).try_into().unwrap();
        assert_eq!((a.frames, a.update_ms, a.trace_ms, a.frame_ms), (2, 16.0, 8.0, 32.0));
        assert_eq!((a.first_build_ms, a.median_frame_ms, a.order_ms), (800.0, 16.0, 4.0));
        assert_eq!((a.frame_ratio_to_first, a.trace_ratio_to_first), (1.0, 1.0));
        assert_eq!((b.frame_ratio_to_first, b.trace_ratio_to_first), (2.0, 2.0));
        assert_eq!(a.first_trace_ms, 16.0);
        assert_eq!((a.rays, a.differing_rays, a.differing_per_million), (2000, 3, 1000.0));
        assert_eq!((a.most_memory_bytes, a.rebuilds), (Some(50), 0));
        assert!((a.order_share - 4.0 / 32.0).abs() < 1e-12);
        assert!((a.mrays_per_s - 0.25).abs() < 1e-12);
        assert_eq!((rows[0].relative_sah_cost, rows[0].occluded_share), (Some(1.5), 0.25));
    }
}

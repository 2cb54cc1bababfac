//! The numerical stress suite: nasty geometry and nasty rays for every backend, each answer held
//! against the arbiter's. What `sato stress` runs.
//!
//! A new case is a line in [`CASES`] and its entry in the file of its family.

mod cases;
mod random;
mod report;
mod save;
mod shapes;
mod trial;

pub use cases::{CASES, CaseEntry, RaySource, Stage, find};
pub use random::Random;
pub use report::{BackendWrong, CaseReport, CaseResult, StressReport, stress_text};

use crate::backend::BackendSpec;
use crate::backend::catalogue::varied_specs;
use crate::report::Provenance;
use crate::{Error, Result};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use trial::Trial;

/// What to run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The cases.
    pub cases: Vec<&'static CaseEntry>,
    /// The backends that answer.
    pub backends: Vec<BackendSpec>,
    /// Answers to judge, over all cases and backends: a ray that one backend answers is one.
    pub answers: u64,
    /// Begin no more rays after this time.
    pub time_limit: Option<Duration>,
    /// Seed of meshes, rays and random orders.
    pub seed: u64,
    /// Folder for the first wrong rays of each case and backend, with their scenes.
    pub folder: Option<PathBuf>,
}

/// Everything that answers in this build: natively every order, builder, traversal and mode of the
/// catalogue, as [`varied_specs`], and Embree's modes at its default settings.
pub fn all_backends() -> Vec<BackendSpec> {
    let is_tried = |spec: &BackendSpec| {
        let others = spec.entry().keys.iter().filter(|k| k.name != "mode");
        is_native(spec) || others.into_iter().all(|k| spec.value(k.name) == k.default)
    };
    varied_specs().into_iter().filter(is_tried).collect()
}

/// Whether it is one of ours.
pub fn is_native(spec: &BackendSpec) -> bool {
    spec.name() != "embree"
}

/// Whether its answers are promised to be right.
pub fn is_exact(spec: &BackendSpec) -> bool {
    is_native(spec) && spec.find_value("mode") == Some("exact")
}

/// Told of the share that is done, and of the case under way.
pub type Progress<'a> = &'a dyn Fn(f64, &str);

/// Runs the cases on the current rayon pool. Every case gets its share of the answers, and of the
/// time that is left when it begins.
///
/// # Errors
/// A backend that cannot be built, a file that cannot be written. Wrong answers are none: see
/// [`check`].
pub fn run(settings: &Settings, progress: Progress<'_>) -> Result<StressReport> {
    let start = Instant::now();
    let specs = &settings.backends;
    let per_case = settings.answers / (settings.cases.len() * specs.len()).max(1) as u64;
    let mut cases = Vec::new();
    for (index, case) in settings.cases.iter().enumerate() {
        let left = settings.cases.len() - index;
        let deadline = settings
            .time_limit
            .map(|limit| Instant::now() + limit.saturating_sub(start.elapsed()) / left as u32);
        let trial = Trial { case, settings, deadline };
        let done = |share: f64| {
            progress((index as f64 + share) / settings.cases.len() as f64, case.name);
        };
        cases.push(trial.run(per_case.max(1), &done)?);
    }
    let provenance = Provenance::new(rayon::current_num_threads(), settings.seed);
    Ok(StressReport::new(provenance, settings, cases, start.elapsed()))
}

/// Whether no exact native backend was ever wrong.
///
/// # Errors
/// [`Error::CheckFailed`] naming the first that was.
pub fn check(report: &StressReport) -> Result<()> {
    let wrong = report.totals.iter().find(|t| t.is_exact && t.wrong.total() > 0);
    wrong.map_or(Ok(()), |total| {
        Err(Error::CheckFailed(format!(
            "{}: {} false hits and {} missed hits in {} answers that should be exact",
            total.backend, total.wrong.false_hits, total.wrong.missed_hits, total.answers
        )))
    })
}

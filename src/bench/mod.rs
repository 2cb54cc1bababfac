//! The experiments of "SATO: Surface-Area Traversal Order for Shadow Ray Tracing" (Nah and
//! Manocha, Computer Graphics Forum 33(6), 2014), and native backends beside Embree, on any scenes:
//! what `sato bench` runs.
//!
//! Scenes come one after the other, so that each is loaded once, its trees are built once and its
//! rays are recorded once, whatever the experiments. A new experiment is a file here with its entry,
//! and a line in [`EXPERIMENTS`].

mod correlation;
pub mod example;
mod limits;
mod order_time;
mod peers;
mod similarity;
mod speed_up;
mod subject;

pub use subject::Subject;

use crate::backend::BackendSpec;
use crate::report::{Provenance, SceneReport};
use crate::results::Output;
use crate::scene::{self, Scene};
use crate::{Error, Result};
use serde::Serialize;
use std::path::PathBuf;

/// One experiment.
pub struct ExperimentEntry {
    /// As typed.
    pub name: &'static str,
    /// What it measures, in a line.
    pub about: &'static str,
    /// Whether it is one of the paper's, which run if none is named and know their contenders.
    /// Others run by name only and take [`Settings::backends`] too.
    pub of_the_paper: bool,
    /// Begins it.
    pub start: fn(&Settings) -> Box<dyn Experiment>,
}

/// An experiment under way: it gathers rows scene by scene.
pub trait Experiment {
    /// Asked before anything is loaded.
    ///
    /// # Errors
    /// If it cannot run in this build of the program.
    fn check(&self) -> Result<()> {
        Ok(())
    }

    /// Steps that one scene takes, about: for the progress bar.
    fn steps(&self) -> usize;

    /// Measures on one scene, on the current rayon pool; `step` is told after each step.
    ///
    /// # Errors
    /// If a backend cannot be built or answers otherwise than another.
    fn measure(&mut self, subject: &Subject<'_>, step: &dyn Fn()) -> Result<()>;

    /// Writes tables and charts, and returns what to print of them.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    fn finish(&self, output: &mut Output) -> Result<String>;
}

/// All experiments, in the order in which they run.
pub static EXPERIMENTS: &[&ExperimentEntry] = &[
    &order_time::ENTRY,
    &speed_up::ENTRY,
    &similarity::ENTRY,
    &example::ENTRY,
    &correlation::ENTRY,
    &limits::ENTRY,
    &peers::ENTRY,
];

/// The counterparts of the paper's six static scenes, in its order.
pub const PAPER_SCENES: [&str; 6] =
    ["mad-science", "carnival", "bedroom", "atrium", "ship", "shadow-overlap"];

/// The experiment called `name`.
pub fn find(name: &str) -> Option<&'static ExperimentEntry> {
    EXPERIMENTS.iter().copied().find(|e| e.name == name)
}

/// How to measure.
#[derive(Clone, Debug, Serialize)]
pub struct Settings {
    /// Timed rounds, after a warm-up.
    pub rounds: usize,
    /// Width and height of the picture whose shadow rays are recorded.
    pub size: [u32; 2],
    /// Shadow rays of each kind for a camera ray.
    pub spp: u32,
    /// Seed of all samples and of random orders.
    pub seed: u64,
    /// Contenders besides those that an experiment has; the paper's experiments take none.
    pub backends: Vec<BackendSpec>,
}

/// What to run, and where the results go.
#[derive(Debug)]
pub struct Plan {
    /// The experiments.
    pub experiments: Vec<&'static ExperimentEntry>,
    /// Scenes as [`scene::load`] takes them.
    pub scenes: Vec<String>,
    /// How to measure.
    pub settings: Settings,
    /// The folder for the results.
    pub folder: PathBuf,
}

impl std::fmt::Debug for ExperimentEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// Told of the steps done, of how many in all, and of the scene that is measured.
pub type Progress<'a> = &'a dyn Fn(usize, usize, &str);

/// The whole record.
#[derive(Serialize)]
struct BenchReport {
    #[serde(flatten)]
    provenance: Provenance,
    settings: Settings,
    scenes: Vec<SceneReport>,
    /// The rows of each experiment by its name.
    experiments: serde_json::Map<String, serde_json::Value>,
    files: Vec<String>,
}

/// Runs the experiments on the current rayon pool and returns what to print. The folder then holds
/// `report.json` with every row, `report.txt`, and a CSV file and charts of each experiment.
///
/// # Errors
/// A backend that this build lacks, a scene that cannot be loaded, a backend that fails, backends
/// that answer differently, a file that cannot be written. Nothing is written before all is measured.
pub fn run(plan: &Plan, progress: Progress<'_>) -> Result<String> {
    let mut experiments: Vec<_> =
        plan.experiments.iter().map(|entry| (entry, (entry.start)(&plan.settings))).collect();
    experiments.iter().try_for_each(|(_, experiment)| experiment.check())?;
    let scenes = plan.scenes.iter().map(check_scene).collect::<Result<Vec<_>>>()?;
    let steps: usize = experiments.iter().map(|(_, e)| e.steps()).sum::<usize>() * scenes.len();
    let done = std::cell::Cell::new(0);
    let mut reports = Vec::new();
    for reference in scenes {
        let scene = scene::load(reference)?;
        reports.push(SceneReport::new(&scene));
        let subject = Subject::new(&scene, &plan.settings);
        for (_, experiment) in &mut experiments {
            let expected = done.get() + experiment.steps();
            experiment.measure(&subject, &|| {
                done.set(done.get() + 1);
                progress(done.get(), steps, &scene.name);
            })?;
            done.set(expected);
        }
    }
    let mut output = Output::new(plan.folder.clone(), &scene_names(&reports));
    let mut text = String::new();
    for (entry, experiment) in &experiments {
        text += &format!("{}: {}\n\n", entry.name, entry.about);
        text += experiment.finish(&mut output)?.trim_end();
        text += "\n\n\n";
    }
    let text = text.trim_end().to_string();
    output.write_text("report.txt", &text)?;
    let (experiments, files) = output.into_record();
    let report = BenchReport {
        provenance: Provenance::new(rayon::current_num_threads(), plan.settings.seed),
        settings: plan.settings.clone(),
        scenes: reports,
        experiments,
        files,
    };
    crate::report::write_json(&plan.folder.join("report.json"), &report)?;
    Ok(text)
}

/// Refuses a scene that cannot be loaded before an hour is spent on others.
fn check_scene(reference: &String) -> Result<&String> {
    if scene::generate::find(reference).is_none() {
        scene::load(reference)?;
    }
    Ok(reference)
}

fn scene_names(scenes: &[SceneReport]) -> Vec<String> {
    scenes.iter().map(|s| s.name.clone()).collect()
}

/// Each different value once, in the order of appearance.
fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for value in values {
        if !all.contains(&value) {
            all.push(value);
        }
    }
    all
}

/// Whether there is nothing to measure on: no camera ray hits, or no ray is needed.
fn nothing_to_trace(scene: &Scene) -> Error {
    Error::Usage(format!("{}: no camera ray hits anything that needs a shadow ray", scene.name))
}

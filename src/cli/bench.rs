//! `sato bench`: the paper's experiments, and native backends beside Embree.

use super::options::{Run, parse_backend};
use super::{print, progress};
use crate::backend::BackendSpec;
use crate::bench::{self, EXPERIMENTS, ExperimentEntry, PAPER_SCENES, Plan, Settings};
use crate::render::RenderSettings;
use crate::{Error, Result};
use clap::Args;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Experiments [default: the paper's]; `sato list` has a line on each
    #[arg(value_name = "EXPERIMENT", value_parser = parse_experiment)]
    experiments: Vec<&'static ExperimentEntry>,
    /// Scene file (.toml), mesh (.obj, .obj.zst) or generator; repeat for more [default: the six
    /// counterparts of the paper's scenes]
    #[arg(long, value_name = "SCENE")]
    scene: Vec<String>,
    /// Backend to try beside those that `peers` has; repeat for more
    #[arg(long, value_name = "SPEC", value_parser = parse_backend)]
    backend: Vec<BackendSpec>,
    /// Folder for tables, charts and the report
    #[arg(long, short, value_name = "FOLDER", default_value = "out/bench")]
    output: PathBuf,
    /// Timed rounds, after a warm-up [default: 11, or 3 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: Option<u32>,
    /// Width and height of the picture whose shadow rays are recorded [default: 256 144, or 64 36
    /// with --quick]
    #[arg(long, num_args = 2, value_names = ["W", "H"])]
    size: Option<Vec<u32>>,
    /// Shadow rays of each kind for a camera ray [default: 4, or 16, as `sato render` has, without the
    /// paper's experiments and --quick]
    #[arg(long, value_name = "N")]
    spp: Option<u32>,
    /// Small and short, to see that all works: few rays, few rounds and, unless scenes are named,
    /// the smaller three of the six
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    run: Run,
}

/// Those of the six that take least time.
const QUICK_SCENES: [&str; 3] = ["mad-science", "atrium", "ship"];

fn parse_experiment(name: &str) -> std::result::Result<&'static ExperimentEntry, String> {
    bench::find(name).ok_or_else(|| {
        let names: Vec<_> = EXPERIMENTS.iter().map(|e| e.name).collect();
        format!("one of: {}", names.join(", "))
    })
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| bench(arguments))
}

fn bench(arguments: &Arguments) -> Result<()> {
    let Arguments { run, quick, .. } = arguments;
    let experiments = if arguments.experiments.is_empty() {
        EXPERIMENTS.iter().copied().filter(|e| e.of_the_paper).collect()
    } else {
        arguments.experiments.clone()
    };
    if !arguments.backend.is_empty() && experiments.iter().all(|e| e.of_the_paper) {
        let takers = EXPERIMENTS.iter().filter(|e| !e.of_the_paper).map(|e| e.name);
        let takers: Vec<_> = takers.collect();
        return Err(Error::Usage(format!("--backend: only taken by: {}", takers.join(", "))));
    }
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    let scenes: Vec<String> = match (&arguments.scene, quick) {
        (scenes, _) if !scenes.is_empty() => scenes.clone(),
        (_, true) => names(&QUICK_SCENES),
        (_, false) => names(&PAPER_SCENES),
    };
    let default_size = if *quick { [64, 36] } else { [256, 144] };
    let is_small = *quick || experiments.iter().any(|e| e.of_the_paper);
    let settings = Settings {
        rounds: arguments.rounds.unwrap_or(if *quick { 3 } else { 11 }) as usize,
        size: arguments.size.as_ref().map_or(default_size, |s| [s[0], s[1]]),
        spp: arguments.spp.unwrap_or(if is_small { 4 } else { RenderSettings::DEFAULT_SPP }),
        seed: run.seed,
        backends: arguments.backend.clone(),
    };
    let plan = Plan { experiments, scenes, settings, folder: arguments.output.clone() };
    let bar = progress::bar("bench", 0, run.quiet);
    let text = bench::run(&plan, &|done, total, scene| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
        bar.set_message(scene.to_string());
    })?;
    bar.finish_and_clear();
    if let Some(path) = &run.json {
        let report = plan.folder.join("report.json");
        std::fs::copy(&report, path).map_err(Error::io(path))?;
    }
    if run.quiet {
        return Ok(());
    }
    print(&format!(
        "{text}\n\nIn {}: report.json, report.txt, CSV and charts",
        plan.folder.display()
    ))
}

//! `sato stress`: nasty geometry and rays, every answer judged.

use super::options::{Run, parse_backend};
use super::{print, progress};
use crate::backend::BackendSpec;
use crate::report::write_json;
use crate::stress::{self, CASES, CaseEntry, Settings, stress_text};
use crate::{Error, Result};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Answers to judge, spread evenly over cases and backends: a ray that one backend answers is
    /// one answer, and all backends answer the same rays
    #[arg(long, value_name = "N", default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    rays: u64,
    /// Stop early after about so long; every case gets some rays
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time_limit: Option<Duration>,
    /// Backend to try; repeat it [default: every native order, builder, traversal and mode, and
    /// Embree's modes if this program has it]
    #[arg(long, value_name = "SPEC", value_parser = parse_backend)]
    backend: Vec<BackendSpec>,
    /// Case to run; repeat it [default: all]; `sato list` has a line on each
    #[arg(long, value_name = "NAME", value_parser = parse_case)]
    case: Vec<&'static CaseEntry>,
    /// Folder for the first wrong rays of each case and backend, with their scene: `sato rays
    /// replay` asks again
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,
    #[command(flatten)]
    run: Run,
}

fn parse_case(name: &str) -> std::result::Result<&'static CaseEntry, String> {
    stress::find(name).ok_or_else(|| {
        let names: Vec<_> = CASES.iter().map(|c| c.name).collect();
        format!("one of: {}", names.join(", "))
    })
}

fn parse_seconds(text: &str) -> std::result::Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if seconds.is_nan() || seconds <= 0.0 {
        return Err("a time is more than 0 seconds".into());
    }
    Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string())
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| stress(arguments))
}

fn stress(arguments: &Arguments) -> Result<()> {
    let run = &arguments.run;
    if let Some(spec) = arguments.backend.iter().find(|s| s.entry().unavailable.is_some()) {
        let message = spec.entry().unavailable.unwrap_or_default().into();
        return Err(Error::Backend { backend: spec.to_string(), message });
    }
    let or_all = |asked: &[_], all: Vec<_>| if asked.is_empty() { all } else { asked.to_vec() };
    let settings = Settings {
        cases: if arguments.case.is_empty() { CASES.to_vec() } else { arguments.case.clone() },
        backends: or_all(&arguments.backend, stress::all_backends()),
        answers: arguments.rays,
        time_limit: arguments.time_limit,
        seed: run.seed,
        folder: arguments.output.clone(),
    };
    const STEPS: u64 = 10_000;
    let bar = progress::bar("stress", STEPS, run.quiet);
    let report = stress::run(&settings, &|share, case| {
        bar.set_position((share * STEPS as f64) as u64);
        bar.set_message(case.to_string());
    })?;
    bar.finish_and_clear();
    if let Some(path) = &run.json {
        write_json(path, &report)?;
    }
    if !run.quiet {
        let mut text = stress_text(&report);
        if let Some(folder) = &settings.folder {
            let files: usize = report.cases.iter().map(|c| c.files.len()).sum();
            text += &format!("\n{files} files of scenes and wrong rays in {}", folder.display());
        }
        print(&text)?;
    }
    stress::check(&report)
}

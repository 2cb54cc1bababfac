//! `sato animate`: backends that follow a moving scene, frame by frame.

use super::options::{Picture, Run, load_scene, parse_backend, parse_pass, parse_rate, passes};
use super::{metadata, print, progress};
use crate::animate::{self, AnimateReport, Plan, animate_text};
use crate::backend::BackendSpec;
use crate::backend::catalogue::BACKENDS;
use crate::render::Pass;
use crate::report::write_json;
use crate::{Error, Result};
use clap::Args;
use std::ops::Range;
use std::path::PathBuf;

/// Shadow rays of each kind for a camera ray, unless asked otherwise: a frame's are kept in memory.
const SAMPLES: u32 = 4;

/// What is compared unless asked otherwise, as far as this build has it.
const DEFAULTS: [&str; 6] = [
    "bvh8",
    "lazy",
    "embree:quality=medium,update=refit",
    "embree:quality=medium,update=refit,geometries=objects",
    "embree:quality=low,update=rebuild",
    "embree:quality=medium,update=rebuild",
];

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Scene file (.toml) that says how its geometry moves, or the name of a generator that does
    scene: String,
    /// Backend that follows the scene; repeat it. The first makes the pictures, and is the one that
    /// others are measured against: see `sato list` [default: bvh8, lazy, and four ways of Embree's
    /// where this build has it]
    #[arg(long, value_name = "SPEC", value_parser = parse_backend)]
    backend: Vec<BackendSpec>,
    /// Frames to go through, from A to before B; N stands for 0..N [default: all of the scene's]
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<Range<usize>>,
    /// Folder for tables, charts, pictures and the report
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Kinds of rays (ao, ao-unbounded, shadow) [default: shadow, or ao without lights]
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = parse_pass)]
    rays: Vec<Pass>,
    /// Timed rounds of tracing in each frame, after the one that counts for it
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: u32,
    /// Tell how good trees and orders are in each frame, and their memory; slower, as new trees may be
    /// built to compare with, but never within a time
    #[arg(long)]
    quality: bool,
    /// Write no pictures
    #[arg(long)]
    no_images: bool,
    /// Exit with status 3 if a backend differs from the first on more than RATE rays in a million
    #[arg(long, value_name = "RATE", num_args = 0..=1, default_missing_value = "0", value_parser = parse_rate)]
    require_agreement: Option<f64>,
    #[command(flatten)]
    picture: Picture,
    #[command(flatten)]
    run: Run,
}

fn parse_frames(text: &str) -> std::result::Result<Range<usize>, String> {
    let number = |text: &str| {
        text.parse::<usize>().map_err(|_| format!("'{text}' is no number: give A..B or N"))
    };
    match text.split_once("..") {
        Some((start, end)) => Ok(number(start)?..number(end)?),
        None => Ok(0..number(text)?),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| follow(arguments))
}

fn follow(arguments: &Arguments) -> Result<()> {
    let run = &arguments.run;
    if arguments.picture.frame.is_some() {
        let message = "--frame names one picture: give the frames to follow as --frames A..B";
        return Err(Error::Usage(message.into()));
    }
    let scene = load_scene(&arguments.scene, None, run.quiet)?;
    let backends =
        if arguments.backend.is_empty() { defaults()? } else { arguments.backend.clone() };
    let usual = if scene.lights.is_empty() { Pass::AmbientOcclusion } else { Pass::Shadow };
    let passes = passes(&arguments.rays, &[usual], &scene);
    let mut render = arguments.picture.settings(&scene, run.seed, passes, SAMPLES)?;
    if arguments.picture.size.is_none() {
        render.size = [1024, 768];
    }
    let all = || 0..scene.motion.as_ref().map_or(0, |motion| motion.frames);
    let plan = Plan {
        frames: arguments.frames.clone().unwrap_or_else(all),
        render,
        rounds: arguments.rounds as usize,
        quality: arguments.quality,
        pictures: (!arguments.no_images).then(|| metadata(&scene, &backends[0])),
        folder: arguments.output.clone(),
        backends,
    };
    let bar = progress::bar("animate", 0, run.quiet);
    let report = animate::run(&scene, &plan, &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    if let Some(path) = &run.json {
        write_json(path, &report)?;
    }
    if !run.quiet {
        let pictures = if arguments.no_images { "" } else { ", pictures in frames" };
        print(&format!(
            "{}\n\nIn {}: animate.json, report.txt, CSV, charts{pictures}",
            animate_text(&report),
            plan.folder.display()
        ))?;
    }
    check_agreement(arguments.require_agreement, &report)
}

fn defaults() -> Result<Vec<BackendSpec>> {
    let specs: Vec<BackendSpec> =
        DEFAULTS.iter().map(|text| text.parse()).collect::<Result<_>>()?;
    let missing = |name: &str| BACKENDS.iter().any(|e| e.name == name && e.unavailable.is_some());
    Ok(specs.into_iter().filter(|spec| !missing(spec.name())).collect())
}

fn check_agreement(most: Option<f64>, report: &AnimateReport) -> Result<()> {
    let Some(most) = most else { return Ok(()) };
    let worst = report
        .totals
        .iter()
        .max_by(|a, b| a.differing_per_million.total_cmp(&b.differing_per_million))
        .filter(|total| total.differing_per_million > most);
    match worst {
        Some(total) => Err(Error::CheckFailed(format!(
            "{} and {} differ on {} rays, {:.3} in a million; at most {most} were allowed",
            report.totals[0].backend,
            total.backend,
            total.differing_rays,
            total.differing_per_million
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_range_or_a_number() {
        assert_eq!(parse_frames("3..7"), Ok(3..7));
        assert_eq!(parse_frames("12"), Ok(0..12));
        for text in ["", "x", "3..", "..7", "-1", "1..2..3", "1.5"] {
            assert!(parse_frames(text).unwrap_err().contains("A..B"), "{text}");
        }
    }

    #[test]
    fn defaults_are_what_this_build_has() {
        let count = if cfg!(feature = "embree") { DEFAULTS.len() } else { 2 };
        assert_eq!(defaults().unwrap().len(), count);
    }
}

//! `sato rays`: record shadow rays to a file, give recorded rays to backends.

use super::options::{Judging, Picture, Run, load_scene, parse_backend, parse_pass, passes};
use super::{print, progress};
use crate::backend::BackendSpec;
use crate::lab::Lab;
use crate::measure::{contest, steps};
use crate::ray_set::{RayFile, RaySet};
use crate::render::{Pass, record};
use crate::report::{
    BackendReport, ClassReport, CompareReport, Provenance, SceneReport, compare_text, write_json,
};
use crate::{Error, Result};
use clap::{Args, Subcommand};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Subcommand, Debug)]
pub(super) enum Command {
    /// Record the shadow rays of a picture
    Record(Record),
    /// Time backends on recorded rays and compare their answers
    Replay(Replay),
}

#[derive(Args, Debug)]
pub(super) struct Record {
    /// Scene file (.toml), mesh (.obj, .obj.zst) or the name of a generator
    scene: String,
    /// The file to write
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Kinds of rays (ao, ao-unbounded, shadow) [default: all]
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = parse_pass)]
    rays: Vec<Pass>,
    /// Backend that answers the camera rays
    #[arg(long, value_name = "SPEC", default_value = "bvh2", value_parser = parse_backend)]
    backend: BackendSpec,
    #[command(flatten)]
    picture: Picture,
    #[command(flatten)]
    run: Run,
}

#[derive(Args, Debug)]
pub(super) struct Replay {
    /// File of recorded rays
    file: PathBuf,
    /// The scene [default: the one that the file names]
    #[arg(long)]
    scene: Option<String>,
    /// Frame of a moving scene, counted from 0 [default: the one that the file names]
    #[arg(long, value_name = "N")]
    frame: Option<usize>,
    /// Backend to ask; repeat to compare. The first is the one that others are measured against
    #[arg(long, value_name = "SPEC", value_parser = parse_backend, required = true)]
    backend: Vec<BackendSpec>,
    /// Timed rounds, after a warm-up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: u32,
    #[command(flatten)]
    judging: Judging,
    #[command(flatten)]
    run: Run,
}

pub(super) fn run(command: &Command) -> Result<()> {
    match command {
        Command::Record(arguments) => arguments.run.on_pool(|| record_rays(arguments)),
        Command::Replay(arguments) => arguments.run.on_pool(|| replay(arguments)),
    }
}

fn record_rays(arguments: &Record) -> Result<()> {
    let Record { run, picture, .. } = arguments;
    let scene = load_scene(&arguments.scene, picture.frame, run.quiet)?;
    let passes = passes(&arguments.rays, &Pass::ALL, &scene);
    let settings = picture.settings(&scene, run.seed, passes, 4)?;
    let accelerator = Lab::new(&scene, run.seed).build(&arguments.backend)?;
    let recording = record(&scene, &*accelerator, &settings, None)?;
    let classes: Vec<_> = recording
        .passes()
        .iter()
        .map(|p| (p.pass().name().to_string(), p.rays().clone()))
        .collect();
    let rays: usize = classes.iter().map(|(_, set)| set.len()).sum();
    let about = crate::report::command_line().join(" ");
    let file = RayFile { scene: arguments.scene.clone(), frame: picture.frame, about, classes };
    file.write(&arguments.output)?;
    if run.quiet {
        return Ok(());
    }
    print(&format!("{rays} rays in {}", arguments.output.display()))
}

fn replay(arguments: &Replay) -> Result<()> {
    let run = &arguments.run;
    let file = RayFile::read(&arguments.file)?;
    let rays: usize = file.classes.iter().map(|(_, set)| set.len()).sum();
    if rays == 0 {
        return Err(Error::input(&arguments.file, "holds no ray"));
    }
    let reference = arguments.scene.as_ref().unwrap_or(&file.scene);
    let scene = load_scene(reference, arguments.frame.or(file.frame), run.quiet)?;
    let lab = Lab::new(&scene, run.seed);
    let mut built = Vec::new();
    for spec in &arguments.backend {
        built.push(lab.build(spec)?);
    }
    let contenders: Vec<_> = built.iter().map(|b| &**b).collect();
    let specs: Vec<_> = arguments.backend.iter().map(ToString::to_string).collect();
    let rounds = arguments.rounds as usize;
    let sets: Vec<_> = file.classes.iter().filter(|(_, set)| !set.is_empty()).collect();
    let total = sets.len() * steps(contenders.len(), rounds);
    let bar = progress::bar("replay", total as u64, run.quiet);
    let mut classes = Vec::new();
    let mut disputed = String::new();
    for (name, set) in sets {
        let outcome = contest(&contenders, set, rounds, true, &|| bar.inc(1));
        let judgement = &arguments.judging.judge(&lab, &[(set, &outcome)])?[0];
        classes.push(ClassReport::new(name, set, 0, &specs, &outcome).judged(judgement, &specs));
        let answers: Vec<_> = outcome.performances.iter().map(|p| p.answers.as_slice()).collect();
        describe_disputed(&mut disputed, name, set, &specs, &answers);
    }
    bar.finish_and_clear();
    let report = CompareReport {
        provenance: Provenance::new(rayon::current_num_threads(), run.seed),
        scene: SceneReport::new(&scene),
        rounds,
        primary: None,
        backends: BackendReport::all(&arguments.backend, &contenders),
        classes,
        files: Vec::new(),
    };
    if let Some(path) = &run.json {
        write_json(path, &report)?;
    }
    if run.quiet {
        return Ok(());
    }
    print(&format!("{}\n{}\n{disputed}", file.about, compare_text(&report)))
}

/// The first rays that contenders disagree on, one by one.
fn describe_disputed(
    text: &mut String,
    class: &str,
    set: &RaySet,
    specs: &[String],
    answers: &[&[u64]],
) {
    const SHOWN: usize = 10;
    let each: Vec<Vec<bool>> = answers.iter().map(|a| set.each_answer(a).collect()).collect();
    let is_disputed = |&ray: &usize| each.iter().any(|a| a[ray] != each[0][ray]);
    let disputed: Vec<usize> = (0..set.len()).filter(is_disputed).collect();
    for &index in disputed.iter().take(SHOWN) {
        let ray = &set.rays()[index];
        let occluded_for: Vec<&str> =
            specs.iter().zip(&each).filter(|(_, a)| a[index]).map(|(s, _)| s.as_str()).collect();
        let _ = writeln!(
            text,
            "{class} ray {index}: origin {:?} direction {:?} t [{:?}, {:?}] is occluded for {}",
            ray.origin.to_array(),
            ray.direction.to_array(),
            ray.t_min,
            ray.t_max,
            occluded_for.join(" and "),
        );
    }
    if disputed.len() > SHOWN {
        let _ = writeln!(text, "{class}: and {} more", disputed.len() - SHOWN);
    }
}

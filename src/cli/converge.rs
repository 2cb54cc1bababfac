//! `sato converge`: error against samples and against time.

use super::options::{Run, parse_pass};
use super::{print, progress};
use crate::Result;
use crate::converge::{self, PRESETS, Plan, RendererSpec, Settings, converge_text};
use crate::render::Pass;
use crate::report::write_json;
use clap::Args;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Scene files (.toml), meshes (.obj, .obj.zst) or names of generators
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<String>,
    /// What to compare, each with those before it; repeat it: 'BACKEND [sampler=NAME]
    /// [light-sampling=NAME] [skip=NAMES]', or the name of one of the renderers that `sato list`
    /// has [default: all of these]
    #[arg(long, value_name = "SPEC", value_parser = parse_renderer)]
    renderer: Vec<RendererSpec>,
    /// What to render, each on its own (ao, ao-unbounded, shadow) [default: ao,shadow]
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = parse_pass)]
    passes: Vec<Pass>,
    /// Width and height of the images in pixels
    #[arg(long, num_args = 2, value_names = ["W", "H"], default_values_t = [256, 144])]
    size: Vec<u32>,
    /// Most samples in a pixel: images have 1, 2, 4 and so on up to these
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    spp: u32,
    /// Images at each number of samples, each with a seed of its own: intervals come from their
    /// spread, and are a little narrow below 16
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: u32,
    /// Samples of the reference for each of the most samples
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    reference_factor: u32,
    /// Folder where references are kept for later runs [default: references in the output folder]
    #[arg(long, value_name = "FOLDER")]
    references: Option<PathBuf>,
    /// Length of finite ambient-occlusion rays, in scene units [default: each scene's]
    #[arg(long, value_name = "LENGTH")]
    ao_radius: Option<f32>,
    /// Folder for tables, charts, pictures and the report
    #[arg(long, short, value_name = "FOLDER", default_value = "out/converge")]
    output: PathBuf,
    #[command(flatten)]
    run: Run,
}

fn parse_renderer(text: &str) -> std::result::Result<RendererSpec, String> {
    text.parse::<RendererSpec>().map_err(|e| e.to_string())
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| measure(arguments))
}

fn measure(arguments: &Arguments) -> Result<()> {
    let run = &arguments.run;
    let renderers = if arguments.renderer.is_empty() {
        PRESETS.iter().map(|preset| preset.name.parse()).collect::<Result<_>>()?
    } else {
        arguments.renderer.clone()
    };
    let references = arguments.references.clone();
    let plan = Plan {
        scenes: arguments.scenes.clone(),
        passes: arguments.passes.clone(),
        renderers,
        settings: Settings {
            size: [arguments.size[0], arguments.size[1]],
            spp: arguments.spp,
            seeds: arguments.seeds,
            seed: run.seed,
            reference_factor: arguments.reference_factor,
            ao_radius: arguments.ao_radius,
        },
        references: references.unwrap_or_else(|| arguments.output.join("references")),
        folder: arguments.output.clone(),
    };
    const STEPS: u64 = 10_000;
    let bar = progress::bar("converge", STEPS, run.quiet);
    let report = converge::run(&plan, &|share, what| {
        bar.set_position((share * STEPS as f64) as u64);
        bar.set_message(what.to_string());
    })?;
    bar.finish_and_clear();
    if let Some(path) = &run.json {
        write_json(path, &report)?;
    }
    if run.quiet {
        return Ok(());
    }
    let text = converge_text(&report);
    print(&format!(
        "{text}\n\nIn {}: report.json, report.txt, CSV, charts and pictures",
        plan.folder.display()
    ))
}

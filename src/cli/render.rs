//! `sato render`: one picture.

use super::options::{Picture, Run, load_scene, parse_backend, parse_pass, parse_skips, passes};
use super::{print, progress};
use crate::backend::{BackendSpec, BuildStats};
use crate::image_file::{self, heat_map, tone_map};
use crate::lab::Lab;
use crate::parts::Visited;
use crate::render::{
    Adaptive, Pass, RenderOptions, RenderSettings, RenderStats, Skip, Skips, render, seen_part,
};
use crate::report::{Provenance, SceneReport, write_json};
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Shadow rays of each kind for a camera ray, unless asked otherwise.
const SAMPLES: u32 = 16;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Scene file (.toml), mesh (.obj, .obj.zst) or the name of a generator
    scene: String,
    /// What traces: see `sato list`
    #[arg(long, value_name = "SPEC", default_value = "bvh8", value_parser = parse_backend)]
    backend: BackendSpec,
    /// OpenEXR file to write, with a PNG beside it [default: the scene's name .exr]
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// What to render (ao, ao-unbounded, shadow) [default: ao,shadow]
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = parse_pass)]
    passes: Vec<Pass>,
    /// Layers to make, each a name: picture, shadow, irradiance, depth, normal, ao, ao-unbounded,
    /// shadow.LIGHT, samples.CLASS; what none of them needs is not computed [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    layers: Option<Vec<String>>,
    /// Give pixels as many samples as they need, at most MOST and --spp on the mean, by a pilot of a
    /// quarter more; without bias. Adds layers that say how many
    #[arg(long, value_name = "MOST")]
    adaptive: Option<u32>,
    /// Count the nodes that shadow rays visit and add them as a layer and a PNG; slower
    #[arg(long)]
    heat_map: bool,
    /// What to leave out where the picture is the same without it: all, none, or names with commas
    /// between (see `sato list`)
    #[arg(long, value_name = "WHAT", default_value = "all", value_parser = parse_skips)]
    skip: Skips,
    /// Print rays traced and skipped, and time spent
    #[arg(long)]
    stats: bool,
    #[command(flatten)]
    picture: Picture,
    #[command(flatten)]
    run: Run,
}

/// What `--json` records.
#[derive(Serialize)]
struct RenderReport<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    scene: SceneReport,
    backend: String,
    build: &'a BuildStats,
    size: [u32; 2],
    spp: u32,
    camera_samples: u32,
    ao_radius: f32,
    sampler: &'static str,
    light_sampling: &'static str,
    skip: String,
    triangles_left_out: u64,
    /// Most samples of a pixel, where sampling is adaptive.
    adaptive: Option<u32>,
    /// The layers asked for; all if absent.
    layers: Option<&'a [String]>,
    render: &'a RenderStats,
    /// Of backends that build on the way.
    visited: Option<Visited>,
    files: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| render_scene(arguments))
}

fn render_scene(arguments: &Arguments) -> Result<()> {
    let run = &arguments.run;
    let output = arguments.output.as_deref();
    if let Some(path) = output.filter(|p| p.extension().is_none_or(|e| e != "exr")) {
        return Err(Error::Usage(format!("-o {}: the name must end in .exr", path.display())));
    }
    let scene = load_scene(&arguments.scene, arguments.picture.frame, run.quiet)?;
    let passes = passes(&arguments.passes, &[Pass::AmbientOcclusion, Pass::Shadow], &scene);
    let settings = RenderSettings {
        adaptive: arguments.adaptive.map(|most| Adaptive { most }),
        layers: arguments.layers.clone(),
        ..arguments.picture.settings(&scene, run.seed, passes, SAMPLES)?
    };
    settings.check_for(&scene)?;
    let part = arguments.skip.has(Skip::UnseenGeometry).then(|| seen_part(&scene, &settings));
    let part = part.flatten();
    let triangles_left_out = part.as_ref().map_or(0, |(_, count)| *count);
    let seen = part.as_ref().map_or(&scene, |(seen, _)| seen);
    let accelerator = Lab::new(seen, run.seed).build(&arguments.backend)?;
    let bar = progress::bar("render", 0, run.quiet);
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let options = RenderOptions {
        count_visits: arguments.heat_map,
        skip: arguments.skip,
        progress: Some(&progress),
        ..RenderOptions::default()
    };
    let rendering = render(seen, &*accelerator, &settings, &options)?;
    bar.finish_and_clear();
    let output =
        output.map_or_else(|| PathBuf::from(format!("{}.exr", scene.name)), Path::to_path_buf);
    let mut metadata = settings.metadata();
    metadata.extend(super::metadata(&scene, &arguments.backend));
    let mut files = vec![output.clone()];
    image_file::write_exr(&output, &rendering.film, &metadata)?;
    if rendering.film.has_picture() {
        files.push(output.with_extension("png"));
        image_file::write_png(&files[1], &tone_map(&rendering.film))?;
    }
    if let Some(nodes) = rendering.film.channel("nodes", "Y") {
        // Outliers must not push all else into one colour.
        let mut sorted = nodes.to_vec();
        sorted.sort_by(f32::total_cmp);
        let most = sorted[(sorted.len() - 1) * 99 / 100].max(1.0);
        let file = output.with_extension("nodes.png");
        image_file::write_png(&file, &heat_map(settings.size, nodes, most))?;
        files.push(file);
    } else if arguments.heat_map && !run.quiet {
        eprintln!("sato: warning: {} cannot count what it visits: no heat map", arguments.backend);
    }
    let files: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let build = accelerator.build_stats();
    if let Some(path) = &run.json {
        let report = RenderReport {
            provenance: Provenance::new(rayon::current_num_threads(), run.seed),
            scene: SceneReport::new(&scene),
            backend: arguments.backend.full(),
            build,
            size: settings.size,
            spp: settings.spp,
            camera_samples: settings.camera_samples,
            ao_radius: settings.ao_radius,
            sampler: settings.sampler.name,
            light_sampling: settings.light_sampling.name(),
            skip: arguments.skip.to_string(),
            triangles_left_out,
            adaptive: arguments.adaptive,
            layers: settings.layers.as_deref(),
            render: &rendering.stats,
            visited: accelerator.visited(),
            files: files.clone(),
        };
        write_json(path, &report)?;
    }
    if run.quiet {
        return Ok(());
    }
    let mut text = String::new();
    if arguments.stats {
        text = stats_text(arguments, &settings, build, &rendering.stats);
        if let Some(visited) = accelerator.visited() {
            text += &visited_text(&visited);
        }
        if triangles_left_out > 0 {
            let of = scene.mesh.len();
            let _ = writeln!(
                text,
                "{triangles_left_out} of {of} triangles not built: no ray meets them"
            );
        }
    }
    print(&(text + &files.join("\n")))
}

fn visited_text(visited: &Visited) -> String {
    let share = |part: u64, all: u64| 100.0 * part as f64 / all.max(1) as f64;
    format!(
        "built on the way: {} of {} parts, with {:.1} % of the triangles and {} nodes, in {:.1} ms \
         summed over threads; {:.1} MB in the end\n",
        visited.parts_ready,
        visited.parts,
        share(visited.triangles_ready, visited.triangles),
        visited.nodes,
        visited.build_ms,
        visited.memory_bytes as f64 / 1e6
    )
}

fn stats_text(
    arguments: &Arguments,
    settings: &RenderSettings,
    build: &BuildStats,
    stats: &RenderStats,
) -> String {
    let mut text = format!(
        "{}: built in {:.1} ms, ordered in {:.2} ms, {:.1} MB\n",
        arguments.backend,
        build.build_ms,
        build.order_ms,
        build.memory_bytes as f64 / 1e6
    );
    let [width, height] = settings.size;
    let _ = writeln!(
        text,
        "{width}x{height}, {} samples: {:.1} ms on {} threads; camera rays {:.1} ms, shadow rays \
         {:.1} ms, summed over threads{}",
        settings.spp,
        stats.total_ms,
        stats.threads,
        stats.primary_ms,
        stats.shadow_ms,
        if arguments.heat_map { " (a counting run: no measure of speed)" } else { "" },
    );
    let _ = writeln!(text, "camera: {} rays, {} hit", stats.primary_rays, stats.primary_hits);
    for class in &stats.classes {
        let _ = write!(
            text,
            "{}: {} rays traced, {:.1} % occluded, {} from below the root, {} stopped by what \
             stopped others",
            class.name,
            class.rays,
            100.0 * class.occluded_share,
            class.rays_from_entries,
            class.rays_by_occluders
        );
        if let (Some(nodes), Some(triangles)) = (class.nodes_per_ray, class.triangles_per_ray) {
            let _ = write!(text, ", {nodes:.2} nodes and {triangles:.2} triangles a ray");
        }
        text.push('\n');
        let all = (class.rays + class.rays_skipped).max(1) as f64;
        if class.rays_skipped > 0 {
            let share = 100.0 * class.rays_skipped as f64 / all;
            let by = class.skipped.iter().map(|s| format!("{} {}", s.rays, s.by));
            let by = by.collect::<Vec<_>>().join(", ");
            let _ = writeln!(text, "  {} not traced, {share:.1} %: {by}", class.rays_skipped);
        }
        if let Some(adaptive) = &class.adaptive {
            let _ = writeln!(
                text,
                "  adaptive: {} to {} samples a pixel, {:.2} on the mean; pilot: {} rays traced, {} not",
                adaptive.samples_min,
                adaptive.samples_max,
                adaptive.samples_mean,
                adaptive.pilot_rays,
                adaptive.pilot_rays_skipped
            );
        }
    }
    if settings.adaptive.is_some() {
        let _ = writeln!(text, "pilot: {:.1} ms, camera rays again among them", stats.pilot_ms);
    }
    if !stats.layers_left_out.is_empty() {
        let _ = writeln!(
            text,
            "layers left out: {}; {:.1} MB not written",
            stats.layers_left_out.join(", "),
            stats.bytes_left_out as f64 / 1e6
        );
    }
    if !stats.classes_left_out.is_empty() {
        let _ = writeln!(
            text,
            "not traced, as no layer needs it: {}",
            stats.classes_left_out.join(", ")
        );
    }
    text
}

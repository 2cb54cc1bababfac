//! `sato compare`: backends on the same recorded rays, with images, agreement and a report.

use super::options::{
    Judging, Picture, Run, load_scene, parse_backend, parse_pass, parse_rate, passes,
};
use super::{metadata, print, progress};
use crate::backend::{Accelerator, BackendSpec};
use crate::image_file::{differences, tone_map, write_exr, write_png};
use crate::lab::Lab;
use crate::measure::{Judgement, Outcome, contest, steps};
use crate::output::write_atomically;
use crate::ray::VisitCounts;
use crate::ray_set::{RayFile, RaySet};
use crate::render::{Film, Pass, Recording, record};
use crate::report::{
    AgreementReport, BackendReport, ClassReport, CompareReport, PrimaryReport, Provenance,
    SceneReport, compare_text, write_json,
};
use crate::scene::Scene;
use crate::{Error, Result};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Shadow rays of each kind for a camera ray, unless asked otherwise: all of them are kept in memory.
const SAMPLES: u32 = 4;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Scene file (.toml), mesh (.obj, .obj.zst) or the name of a generator
    scene: String,
    /// Backend to compare; repeat it. The first answers the camera rays and is the one that others
    /// are measured against: see `sato list`
    #[arg(long, value_name = "SPEC", value_parser = parse_backend, required = true)]
    backend: Vec<BackendSpec>,
    /// Folder for images, report and rays in dispute [default: out/ and the scene's name]
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Kinds of rays (ao, ao-unbounded, shadow) [default: all]
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = parse_pass)]
    rays: Vec<Pass>,
    /// Timed rounds, after a warm-up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: u32,
    /// Exit with status 3 if two backends differ on more than RATE rays in a million
    #[arg(long, value_name = "RATE", num_args = 0..=1, default_missing_value = "0", value_parser = parse_rate)]
    require_agreement: Option<f64>,
    #[command(flatten)]
    judging: Judging,
    #[command(flatten)]
    picture: Picture,
    #[command(flatten)]
    run: Run,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    arguments.run.on_pool(|| compare(arguments))
}

fn compare(arguments: &Arguments) -> Result<()> {
    let run = &arguments.run;
    let scene = load_scene(&arguments.scene, arguments.picture.frame, run.quiet)?;
    let passes = passes(&arguments.rays, &Pass::ALL, &scene);
    let settings = arguments.picture.settings(&scene, run.seed, passes, SAMPLES)?;
    let lab = Lab::new(&scene, run.seed);
    let mut built = Vec::new();
    for spec in &arguments.backend {
        built.push(lab.build(spec)?);
    }
    let contenders: Vec<&dyn Accelerator> = built.iter().map(|b| &**b).collect();

    let bar = progress::bar("camera rays", 0, run.quiet);
    let recording = record(
        &scene,
        contenders[0],
        &settings,
        Some(&|done, total| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        }),
    )?;
    bar.finish_and_clear();
    if recording.passes().iter().all(|p| p.rays().is_empty()) {
        return Err(Error::Usage(format!(
            "{}: no camera ray hits anything that needs a shadow ray",
            arguments.scene
        )));
    }

    let rounds = arguments.rounds as usize;
    let total = recording.passes().len() * steps(contenders.len(), rounds);
    let bar = progress::bar("shadow rays", total as u64, run.quiet);
    let outcomes: Vec<Outcome> = recording
        .passes()
        .iter()
        .map(|pass| contest(&contenders, pass.rays(), rounds, true, &|| bar.inc(1)))
        .collect();
    bar.finish_and_clear();
    let sets = recording.passes().iter().map(|pass| pass.rays());
    let answered: Vec<_> = sets.zip(&outcomes).collect();
    let judgements = arguments.judging.judge(&lab, &answered)?;

    let folder = arguments.output.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));
    let mut files = Files { folder, names: Vec::new() };
    write_images(&mut files, arguments, &scene, &recording, &outcomes)?;
    write_differences(&mut files, arguments, &recording, &outcomes, &judgements)?;

    let specs: Vec<_> = arguments.backend.iter().map(ToString::to_string).collect();
    let classes: Vec<ClassReport> = recording
        .passes()
        .iter()
        .zip(&outcomes)
        .zip(&judgements)
        .filter(|((pass, _), _)| !pass.rays().is_empty())
        .map(|((pass, outcome), judgement)| {
            let (name, skipped) = (pass.pass().name(), pass.rays_skipped());
            ClassReport::new(name, pass.rays(), skipped, &specs, outcome).judged(judgement, &specs)
        })
        .collect();
    let rays = recording.primary_rays();
    let mut report = CompareReport {
        provenance: Provenance::new(rayon::current_num_threads(), run.seed),
        scene: SceneReport::new(&scene),
        rounds,
        primary: Some(PrimaryReport {
            backend: specs[0].clone(),
            size: settings.size,
            spp: settings.spp,
            camera_samples: settings.camera_samples,
            rays,
            hit_share: recording.primary_hits() as f64 / rays as f64,
        }),
        backends: BackendReport::all(&arguments.backend, &contenders),
        classes,
        files: Vec::new(),
    };
    let (text_file, json_file) = (files.path("report.txt"), files.path("report.json"));
    report.files.clone_from(&files.names);
    let text = compare_text(&report);
    write_atomically(text_file, |out| out.write_all(text.as_bytes()))?;
    write_json(&json_file, &report)?;
    if let Some(path) = &run.json {
        write_json(path, &report)?;
    }
    if !run.quiet {
        let list = files.names.join(", ");
        print(&format!("{text}\nIn {}: {list}", files.folder.display()))?;
    }
    check_agreement(arguments.require_agreement, &report.classes)
}

/// The output folder, and what was written there.
struct Files {
    folder: PathBuf,
    names: Vec<String>,
}

impl Files {
    fn path(&mut self, name: &str) -> PathBuf {
        self.names.push(name.to_string());
        self.folder.join(name)
    }
}

/// An EXR and a PNG of what each backend makes of the rays.
fn write_images(
    files: &mut Files,
    arguments: &Arguments,
    scene: &Scene,
    recording: &Recording,
    outcomes: &[Outcome],
) -> Result<()> {
    for (index, spec) in arguments.backend.iter().enumerate() {
        let film = film_of(recording, outcomes, index);
        let mut facts = recording.settings().metadata();
        facts.extend(metadata(scene, spec));
        let stem = format!("{}-{}", index + 1, file_stem(spec));
        write_exr(&files.path(&format!("{stem}.exr")), &film, &facts)?;
        write_png(&files.path(&format!("{stem}.png")), &tone_map(&film))?;
    }
    Ok(())
}

/// Where any two backends differ: an image, and the rays for replay, with those of the sample that
/// all are wrong on.
fn write_differences(
    files: &mut Files,
    arguments: &Arguments,
    recording: &Recording,
    outcomes: &[Outcome],
    judgements: &[Judgement],
) -> Result<()> {
    let size = recording.settings().size;
    let mut marks = vec![0u32; size[0] as usize * size[1] as usize];
    let mut classes = Vec::new();
    for (index, (pass, judgement)) in recording.passes().iter().zip(judgements).enumerate() {
        let disputed = &judgement.disputed;
        for (mark, rays) in marks.iter_mut().zip(recording.rays_per_pixel(index, disputed)) {
            *mark += rays;
        }
        let picked = |rays: &[usize]| {
            let mut set = RaySet::default();
            for &ray in rays {
                set.push_batch(&pass.rays().rays()[ray..=ray]);
            }
            set
        };
        let name = pass.pass().name();
        classes.push((name.to_string(), picked(disputed)));
        if !judgement.shared_errors.is_empty() {
            classes.push((format!("{name}, all wrong"), picked(&judgement.shared_errors)));
        }
    }
    let film = film_of(recording, outcomes, 0);
    let background = ["ao", "ao-unbounded", "shadow"]
        .into_iter()
        .find_map(|layer| film.channel(layer, "Y"))
        .expect("a recording has a pass");
    let image = differences(size, background, &marks);
    write_png(&files.path("difference.png"), &image)?;
    let film = film.with_layer("differing-rays", marks.iter().map(|&m| m as f32).collect());
    write_exr(&files.path("difference.exr"), &film, &recording.settings().metadata())?;
    let rays = RayFile {
        frame: arguments.picture.frame,
        scene: arguments.scene.clone(),
        about: format!("rays in dispute of: {}", crate::report::command_line().join(" ")),
        classes,
    };
    rays.write(&files.path("differing.rays"))
}

/// What a backend makes of the rays, with the nodes that they visit if it counts them.
fn film_of(recording: &Recording, outcomes: &[Outcome], backend: usize) -> Film {
    let performances = outcomes.iter().map(|o| &o.performances[backend]);
    let answers: Vec<_> = performances.clone().map(|p| p.answers.clone()).collect();
    let counts: Option<Vec<Vec<VisitCounts>>> = performances.map(|p| p.counts.clone()).collect();
    recording.film(&answers, counts.as_deref())
}

/// The spec as part of a file name.
fn file_stem(spec: &BackendSpec) -> String {
    spec.to_string().replace([':', ',', '='], "-")
}

fn check_agreement(most: Option<f64>, classes: &[ClassReport]) -> Result<()> {
    let Some(most) = most else { return Ok(()) };
    let pairs = classes.iter().flat_map(|c| c.agreement.iter().map(move |a| (&c.class, a)));
    let worst =
        pairs.max_by(|a, b| a.1.differing_per_million.total_cmp(&b.1.differing_per_million));
    match worst {
        Some((
            class,
            AgreementReport { backends: [a, b], differing_rays, differing_per_million },
        )) if *differing_per_million > most => Err(Error::CheckFailed(format!(
            "{a} and {b} differ on {differing_rays} {class} rays, {differing_per_million:.3} \
                 in a million; at most {most} were allowed"
        ))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_plain() {
        let spec: BackendSpec = "bvh2:order=near,builder=binned".parse().unwrap();
        assert!(!file_stem(&spec).contains([':', ',', '=', '/']), "{}", file_stem(&spec));
    }
}

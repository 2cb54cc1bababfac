//! Error against samples and against time: renderers (backend, sampler, light sampling, skipping)
//! on the same scenes, held against one reference. What `sato converge` runs.
//!
//! Each pass is rendered on its own, so that time and error belong together, with one camera ray
//! through the middle of each pixel: what converges is the shadow rays' share.

mod cache;
mod pictures;
mod ratios;
mod reference;
mod renderer;
mod rows;
mod text;
mod trial;
mod view;

pub use ratios::{Bound, MeanRatio, MeanReport};
pub use reference::{Origin, ReferenceReport};
pub use renderer::{PRESETS, Preset, RendererSpec};
pub use rows::{CellReport, ConvergeReport, PointRow, RatioRow, SkippedRow, SlopeReport};
pub use text::converge_text;

use crate::backend::{Accelerator, BackendSpec};
use crate::lab::Lab;
use crate::render::{Pass, RenderSettings};
use crate::report::{Provenance, SceneReport, write_json};
use crate::results::Output;
use crate::scene::{self, Scene};
use crate::{Error, Result};
use ratios::{Pair, Ratios};
use rows::Cell;
use serde::Serialize;
use std::path::PathBuf;
use trial::Contender;

/// How to measure.
#[derive(Clone, Debug, Serialize)]
pub struct Settings {
    /// Width and height of the images in pixels.
    pub size: [u32; 2],
    /// Most samples in a pixel; images have 1, 2, 4 and so on up to these.
    pub spp: u32,
    /// Images at each number of samples, each with a seed of its own, at least 1.
    pub seeds: u32,
    /// The first of the seeds.
    pub seed: u64,
    /// Samples of the reference for each of `spp`, at least 1.
    pub reference_factor: u32,
    /// Length of finite ambient-occlusion rays, where it is not each scene's own.
    pub ao_radius: Option<f32>,
}

impl Settings {
    /// Numbers of samples: powers of two, and the most.
    pub fn sample_counts(&self) -> Vec<u32> {
        let powers = (0..32).map(|power| 1u32 << power).take_while(|&count| count < self.spp);
        powers.chain([self.spp]).collect()
    }

    fn reference_samples(&self) -> u64 {
        u64::from(self.spp) * u64::from(self.reference_factor)
    }
}

/// What to run, and where the results go.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Scenes as [`scene::load`] takes them.
    pub scenes: Vec<String>,
    /// Passes; those of [`Plan::DEFAULT_PASSES`] that a scene has if there is none.
    pub passes: Vec<Pass>,
    /// What is compared, at least one.
    pub renderers: Vec<RendererSpec>,
    /// How to measure.
    pub settings: Settings,
    /// The folder for the results.
    pub folder: PathBuf,
    /// The folder where references are kept.
    pub references: PathBuf,
}

impl Plan {
    /// Ambient occlusion up to a radius, and shadows.
    pub const DEFAULT_PASSES: [Pass; 2] = [Pass::AmbientOcclusion, Pass::Shadow];

    fn check(&self) -> Result<()> {
        let labels: Vec<&str> = self.renderers.iter().map(|r| r.label.as_str()).collect();
        if let Some(twice) = first_twice(&labels) {
            return Err(Error::Usage(format!("renderer '{twice}' is given twice")));
        }
        if let Some(spec) =
            self.renderers.iter().map(|r| &r.backend).find(|b| b.entry().unavailable.is_some())
        {
            let message = spec.entry().unavailable.unwrap_or_default().into();
            return Err(Error::Backend { backend: spec.to_string(), message });
        }
        let Settings { spp, seeds, reference_factor, .. } = self.settings;
        if spp == 0 || seeds == 0 || reference_factor == 0 {
            return Err(Error::Usage("samples, seeds and factor must be at least 1".into()));
        }
        Ok(())
    }

    fn passes_of(&self, scene: &Scene) -> Vec<Pass> {
        if !self.passes.is_empty() {
            return self.passes.clone();
        }
        let all = Pass::all_of(scene);
        Self::DEFAULT_PASSES.into_iter().filter(|pass| all.contains(pass)).collect()
    }

    /// The settings of a scene's images of one pass, checked; samples and seeds are each image's.
    fn render_settings(&self, scene: &Scene, pass: Pass) -> Result<RenderSettings> {
        let own = RenderSettings::of_scene(scene);
        let settings = RenderSettings {
            size: self.settings.size,
            spp: self.settings.spp,
            ao_radius: self.settings.ao_radius.unwrap_or(own.ao_radius),
            passes: vec![pass],
            ..own
        };
        settings.check()?;
        if pass == Pass::Shadow && scene.lights.is_empty() {
            let name = &scene.name;
            return Err(Error::Usage(format!("scene {name} has no light: it has no shadow pass")));
        }
        Ok(settings)
    }
}

fn first_twice<'a>(names: &[&'a str]) -> Option<&'a str> {
    names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)).map(|(_, name)| *name)
}

/// Told of the share that is done, and of the scene and pass under way.
pub type Progress<'a> = &'a dyn Fn(f64, &str);

/// Measures everything on the current rayon pool. The folder then holds `report.json` with every
/// row, `report.txt`, `points.csv`, `ratios.csv`, `at-end.csv`, `skipped.csv` and, of each scene and pass, charts of the error
/// over samples and over time and pictures at equal time.
///
/// # Errors
/// A backend that this build lacks, a scene that cannot be loaded or whose pictures are empty, a file
/// that cannot be written. Scenes are loaded once before anything is rendered, and results are written
/// when all is measured; references are kept as they come.
pub fn run(plan: &Plan, progress: Progress<'_>) -> Result<ConvergeReport> {
    plan.check()?;
    let mut jobs = Vec::new();
    for reference in &plan.scenes {
        let scene = scene::load(reference)?;
        for pass in plan.passes_of(&scene) {
            plan.render_settings(&scene, pass)?;
            jobs.push((scene.name.clone(), pass));
        }
    }
    let labels: Vec<String> =
        jobs.iter().map(|(scene, pass)| format!("{scene}, {}", pass.name())).collect();
    if let Some(twice) = first_twice(&labels.iter().map(String::as_str).collect::<Vec<_>>()) {
        return Err(Error::Usage(format!(
            "{twice}: to be measured twice; give each scene and pass once"
        )));
    }
    let names: Vec<String> = jobs.iter().map(|job| job.0.clone()).collect();
    let mut output = Output::new(plan.folder.clone(), &names);
    let (mut cells, mut scenes) = (Vec::new(), Vec::new());
    let mut charts = Vec::new();
    for reference in &plan.scenes {
        let scene = scene::load(reference)?;
        scenes.push(SceneReport::new(&scene));
        let lab = Lab::new(&scene, plan.settings.seed);
        let accelerators = Accelerators::build(plan, &lab)?;
        for pass in plan.passes_of(&scene) {
            let done = cells.len();
            let step = |share: f64| {
                let share = (done as f64 + share) / jobs.len() as f64;
                progress(share, &format!("{}, {}", scene.name, pass.name()));
            };
            let job = Job { plan, scene: &scene, pass, stream: done as u64 };
            let (cell, drawn) = job.run(&accelerators, &step)?;
            cells.push(cell);
            charts.push(drawn);
        }
    }
    let points: Vec<PointRow> = cells.iter().flat_map(|c| c.points.clone()).collect();
    let ratios: Vec<RatioRow> = cells.iter().flat_map(|c| c.ratio_rows(&plan.renderers)).collect();
    let skipped: Vec<SkippedRow> = cells.iter().flat_map(|c| c.skipped.clone()).collect();
    let at_end: Vec<RatioRow> = cells.iter().flat_map(|c| c.end_rows(&plan.renderers)).collect();
    output.rows("points", &points)?;
    output.rows("ratios", &ratios)?;
    output.rows("skipped", &skipped)?;
    output.rows("at-end", &at_end)?;
    for (cell, strip) in cells.iter().zip(charts) {
        pictures::write(&mut output, cell, plan, strip)?;
    }
    let mut report = ConvergeReport {
        provenance: Provenance::new(rayon::current_num_threads(), plan.settings.seed),
        settings: plan.settings.clone(),
        scenes,
        renderers: plan.renderers.clone(),
        means: means(&plan.renderers, &cells),
        cells: cells.into_iter().map(|c| c.report).collect(),
        points,
        skipped,
        ratios,
        at_end,
        files: Vec::new(),
    };
    output.write_text("report.txt", &converge_text(&report))?;
    report.files = output.into_record().1;
    write_json(&plan.folder.join("report.json"), &report)?;
    Ok(report)
}

/// Every renderer against every earlier one, over all cells.
fn means(renderers: &[RendererSpec], cells: &[Cell]) -> Vec<MeanReport> {
    let pairs = cells.first().map_or(&[][..], |cell| &cell.pairs);
    let mean = |(index, pair): (usize, &Pair)| {
        let all: Vec<&Ratios> = cells.iter().map(|cell| &cell.pairs[index].at_end).collect();
        MeanReport::new(&renderers[pair.own].label, &renderers[pair.other].label, &all)
    };
    pairs.iter().enumerate().map(mean).collect()
}

/// What traces references.
fn reference_backend() -> Result<BackendSpec> {
    "bvh8".parse()
}

/// The backends of one scene, each built once, whoever traces with it.
struct Accelerators(Vec<(String, Box<dyn Accelerator>)>);

impl Accelerators {
    fn build(plan: &Plan, lab: &Lab<'_>) -> Result<Self> {
        let mut all = Self(Vec::new());
        let reference = reference_backend()?;
        for spec in plan.renderers.iter().map(|r| &r.backend).chain([&reference]) {
            if all.find(spec).is_none() {
                all.0.push((spec.full(), lab.build(spec)?));
            }
        }
        Ok(all)
    }

    fn find(&self, spec: &BackendSpec) -> Option<&dyn Accelerator> {
        let name = spec.full();
        self.0.iter().find(|(other, _)| *other == name).map(|(_, accelerator)| &**accelerator)
    }

    /// # Panics
    /// If it is not of this plan.
    fn of(&self, spec: &BackendSpec) -> &dyn Accelerator {
        self.find(spec).expect("all of the plan are built")
    }
}

/// One scene and pass.
struct Job<'a> {
    plan: &'a Plan,
    scene: &'a Scene,
    pass: Pass,
    /// Number of the cell.
    stream: u64,
}

impl Job<'_> {
    fn run(
        &self,
        accelerators: &Accelerators,
        step: &dyn Fn(f64),
    ) -> Result<(Cell, pictures::Strip)> {
        let Self { plan, scene, pass, stream } = *self;
        let renderers = &plan.renderers;
        let settings = plan.render_settings(scene, pass)?;
        let samples = plan.settings.reference_samples();
        let judge = accelerators.of(&reference_backend()?);
        // Samples are steps, roughly: the reference's too.
        let each: u64 = plan.settings.sample_counts().iter().map(|&n| u64::from(n)).sum();
        let images = each * u64::from(plan.settings.seeds) * renderers.len() as u64;
        let all = (samples + images) as f64;
        let reference =
            reference::reference(scene, judge, &settings, samples, &plan.references, &|share| {
                step(share * samples as f64 / all);
            })?;
        let contenders: Vec<Contender<'_>> = renderers
            .iter()
            .map(|spec| Contender { spec, accelerator: accelerators.of(&spec.backend) })
            .collect();
        let done = std::cell::Cell::new(0);
        let trial = trial::run(scene, &contenders, &settings, &plan.settings, &reference, &|n| {
            done.set(done.get() + u64::from(n));
            step((samples + done.get()) as f64 / all);
        })?;
        let strip =
            pictures::strip(scene, &contenders, &settings, &plan.settings, &reference, &trial)?;
        let cell = Cell::new(&scene.name, pass, renderers, &trial.measured, &reference, stream);
        Ok((cell, strip))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_counts_double_up_to_the_most() {
        let counts = |spp| {
            let settings = Settings {
                size: [1, 1],
                spp,
                seeds: 1,
                seed: 0,
                reference_factor: 64,
                ao_radius: None,
            };
            settings.sample_counts()
        };
        assert_eq!(counts(1), [1]);
        assert_eq!(counts(8), [1, 2, 4, 8]);
        assert_eq!(counts(12), [1, 2, 4, 8, 12]);
        assert_eq!(counts(u32::MAX).len(), 33);
    }
}

//! One case: its rays are made and judged once, and every backend answers all of them.

use super::report::{CaseReport, CaseResult};
use super::save::Saved;
use super::{CaseEntry, Random, Settings, Stage};
use crate::Result;
use crate::arbiter::{Arbiter, is_ray};
use crate::backend::{BackendSpec, BuildContext, SharedTrees, build};
use crate::geometry::{TriangleMesh, Vec3};
use crate::measure::{WrongAnswers, trace, true_answers, verdicts};
use crate::ray::Ray;
use crate::ray_set::{RaySet, occluded_count};
use crate::scene::{Camera, Defaults, Scene};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Rays that are answered together: a tile of 8x8 pixels with 4 samples.
const BATCH_RAYS: usize = 256;
/// Rays of the first round of a stage where time is limited; later rounds have more.
const FIRST_RAYS: usize = 1 << 12;
/// Most rays kept in memory at once.
const MOST_RAYS: usize = 1 << 20;
/// Most triangle tests of one stage by a backend without a tree: it answers fewer rays.
const MOST_TESTS: usize = 1 << 28;
/// Rays that orders may learn from.
const TRAINING_RAYS: usize = 500;
/// Wrong answers of one round that are looked into; all are counted.
const MOST_EXPLAINED: usize = 1 << 14;

pub(super) struct Trial<'a> {
    pub(super) case: &'static CaseEntry,
    pub(super) settings: &'a Settings,
    pub(super) deadline: Option<Instant>,
}

impl Trial<'_> {
    /// Runs `rays` rays through every backend, spread over the stages.
    pub(super) fn run(&self, rays: u64, progress: &dyn Fn(f64)) -> Result<CaseReport> {
        let stages = (self.case.stages)(self.settings.seed)?;
        let specs = &self.settings.backends;
        let mut report = CaseReport::new(self.case, specs);
        for (index, stage) in stages.iter().enumerate() {
            let left = (stages.len() - index) as u64;
            let wanted = (rays.saturating_sub(report.rays) / left).clamp(1, stage.most_rays);
            let deadline = self.deadline.map(|deadline| {
                let now = Instant::now();
                now + deadline.saturating_duration_since(now) / left as u32
            });
            let done = |share: f64| progress((index as f64 + share) / stages.len() as f64);
            self.run_stage(stage, wanted, deadline, &mut report, &done)?;
        }
        Ok(report)
    }

    fn run_stage(
        &self,
        stage: &Stage,
        wanted: u64,
        deadline: Option<Instant>,
        report: &mut CaseReport,
        progress: &dyn Fn(f64),
    ) -> Result<()> {
        let scene = scene_of(self.case.name, &stage.mesh);
        let trees = SharedTrees::of(&scene);
        let failed = |message| crate::Error::Backend { backend: self.case.name.into(), message };
        let judged = trees.uncut().map_err(failed)?;
        let arbiter = Arbiter::new(&judged.tree);
        let mut saved = Saved::default();
        // Each round builds each backend again, so that few are in memory at once.
        let mut size = if deadline.is_some() { FIRST_RAYS } else { MOST_RAYS };
        let mut done = 0u64;
        let mut last = Duration::ZERO;
        while done < wanted {
            let begun = Instant::now();
            // A round that may well end late is not begun; the first one is.
            if done > 0 && deadline.is_some_and(|deadline| begun + last * 2 > deadline) {
                report.is_complete = false;
                break;
            }
            let count = (size as u64).min(wanted - done) as usize;
            let set = self.rays(stage, done, count);
            self.run_round(&scene, &trees, &arbiter, &set, done, report, &mut saved, &|share| {
                progress((done as f64 + share * count as f64) / wanted as f64);
            })?;
            done += count as u64;
            size = (size * 2).min(MOST_RAYS);
            last = begun.elapsed();
        }
        report.rays += done;
        if let Some(folder) = &self.settings.folder {
            report.files.extend(saved.write(folder, self.case.name, stage, &scene)?);
        }
        Ok(())
    }

    #[expect(clippy::too_many_arguments, reason = "what a round is about and what it adds to")]
    fn run_round(
        &self,
        scene: &Scene,
        trees: &SharedTrees,
        arbiter: &Arbiter<'_>,
        set: &RaySet,
        first: u64,
        report: &mut CaseReport,
        saved: &mut Saved,
        progress: &dyn Fn(f64),
    ) -> Result<()> {
        let truth = true_answers(arbiter, set);
        report.occluded += occluded_count(&truth) as u64;
        let training = training_of(set);
        let specs = &self.settings.backends;
        let mut wrong_rays = Vec::new();
        for (index, spec) in specs.iter().enumerate() {
            let most = most_rays(spec, scene).saturating_sub(first as usize);
            let part = if most < set.len() { Some(first_rays(set, most)) } else { None };
            let asked = part.as_ref().unwrap_or(set);
            let context = BuildContext {
                scene,
                trees,
                threads: rayon::current_num_threads(),
                seed: self.settings.seed,
                training: Some(&training),
            };
            let mut answers = asked.no_answers();
            if !asked.is_empty() {
                trace(&*build(spec, &context)?, asked, &mut answers);
            }
            report.results[index].answers += asked.len() as u64;
            // Whole batches, so that the words are those of the first rays.
            wrong_rays.push(asked.differing(&answers, &truth[..answers.len()]));
            progress((index + 1) as f64 / specs.len() as f64);
        }
        let mut all: Vec<usize> = wrong_rays.iter().flatten().copied().collect();
        all.sort_unstable();
        all.dedup();
        all.truncate(MOST_EXPLAINED);
        let explained = verdicts(arbiter, set, &all);
        let occluded: Vec<bool> =
            if all.is_empty() { Vec::new() } else { set.each_answer(&truth).collect() };
        for ((result, rays), spec) in report.results.iter_mut().zip(&wrong_rays).zip(specs) {
            let mut wrong = WrongAnswers::default();
            for ray in rays {
                wrong.count(occluded[*ray]);
                if let Some(verdict) = explained.get(ray) {
                    wrong.explain(verdict);
                }
            }
            saved.keep(spec, rays.iter().map(|&ray| set.rays()[ray]));
            result.add(&wrong);
        }
        Ok(())
    }

    /// Rays `first` to `first + count` of a stage, whatever rounds they come in.
    fn rays(&self, stage: &Stage, first: u64, count: usize) -> RaySet {
        let name = format!("{}/{}", self.case.name, stage.label);
        let rays: Vec<Ray> = (first..first + count as u64)
            .into_par_iter()
            .map(|ray| {
                let mut random = Random::new(self.settings.seed, &name, ray + 1);
                (stage.ray)(&stage.mesh, &mut random)
            })
            .collect();
        in_batches(&rays)
    }
}

fn in_batches(rays: &[Ray]) -> RaySet {
    let mut set = RaySet::default();
    rays.chunks(BATCH_RAYS).for_each(|batch| set.push_batch(batch));
    set
}

/// The first `most` rays of the set, to whole batches.
fn first_rays(set: &RaySet, most: usize) -> RaySet {
    in_batches(&set.rays()[..most / BATCH_RAYS * BATCH_RAYS])
}

/// Most rays of a stage that a backend is given.
fn most_rays(spec: &BackendSpec, scene: &Scene) -> usize {
    if spec.name() == "brute" {
        (MOST_TESTS / scene.mesh.len().max(1)).max(BATCH_RAYS)
    } else {
        usize::MAX
    }
}

fn training_of(set: &RaySet) -> RaySet {
    let rays: Vec<Ray> =
        set.rays().iter().filter(|ray| is_ray(ray)).take(TRAINING_RAYS).copied().collect();
    in_batches(&rays)
}

/// A scene around the mesh: backends look at nothing else.
fn scene_of(name: &str, mesh: &TriangleMesh) -> Scene {
    Scene {
        name: name.into(),
        mesh: mesh.clone().into(),
        camera: Camera { eye: Vec3::Z, look_at: Vec3::ZERO, up: Vec3::Y, fov_degrees: 60.0 },
        lights: Vec::new(),
        defaults: Defaults { ao_radius: 1.0, size: [64, 64] },
        motion: None,
        warnings: Vec::new(),
    }
}

impl CaseResult {
    fn add(&mut self, wrong: &WrongAnswers) {
        self.wrong.merge(wrong);
    }
}

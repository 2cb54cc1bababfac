//! Options that several subcommands share, and what they stand for.

use crate::arbiter::Arbiter;
use crate::backend::BackendSpec;
use crate::lab::Lab;
use crate::measure::{Judgement, Outcome, judge};
use crate::ray_set::RaySet;
use crate::render::{LightSampling, Pass, RenderSettings, SamplerEntry, Skips};
use crate::scene::{self, Scene};
use crate::{Error, Result};
use clap::Args;
use std::path::PathBuf;

/// How to run: threads, seed, output.
#[derive(Args, Debug)]
pub(super) struct Run {
    /// Threads that build and trace; 0 stands for all processors
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Seed of all samples and of random orders
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Write the report as JSON to FILE
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Print errors only
    #[arg(long, short)]
    pub quiet: bool,
}

impl Run {
    /// Does `work` on a pool of the threads asked for.
    pub(super) fn on_pool<T: Send>(&self, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
        const MOST: usize = 1024;
        if self.threads > MOST {
            return Err(Error::Usage(format!("--threads {}: at most {MOST}", self.threads)));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()
            .map_err(|e| Error::Usage(format!("--threads {}: {e}", self.threads)))?;
        pool.install(work)
    }
}

/// What picture to take.
#[derive(Args, Debug)]
pub(super) struct Picture {
    /// Frame of a moving scene, counted from 0 [default: the first]
    #[arg(long, value_name = "N")]
    pub frame: Option<usize>,
    /// Width and height in pixels [default: the scene's]
    #[arg(long, num_args = 2, value_names = ["W", "H"])]
    pub size: Option<Vec<u32>>,
    /// Shadow rays of each kind for a camera ray; powers of two are best [default: 16, or 4 where
    /// rays are recorded]
    #[arg(long, value_name = "N")]
    pub spp: Option<u32>,
    /// Camera rays in a pixel: 1 goes through its centre, more smooth the edges
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub camera_samples: u32,
    /// Length of finite ambient-occlusion rays, in scene units [default: the scene's]
    #[arg(long, value_name = "LENGTH")]
    pub ao_radius: Option<f32>,
    /// Where samples come from: see `sato list`
    #[arg(long, value_name = "NAME", default_value = "sobol", value_parser = parse_sampler)]
    pub sampler: &'static SamplerEntry,
    /// How points on lights are chosen (solid-angle, area)
    #[arg(long, value_name = "NAME", default_value = "solid-angle", value_parser = parse_light_sampling)]
    pub light_sampling: LightSampling,
}

impl Picture {
    /// The settings for `scene`, checked; `default_spp` samples unless asked otherwise.
    pub(super) fn settings(
        &self,
        scene: &Scene,
        seed: u64,
        passes: Vec<Pass>,
        default_spp: u32,
    ) -> Result<RenderSettings> {
        let settings = RenderSettings {
            size: self.size.as_ref().map_or(scene.defaults.size, |s| [s[0], s[1]]),
            spp: self.spp.unwrap_or(default_spp),
            camera_samples: self.camera_samples,
            seed,
            ao_radius: self.ao_radius.unwrap_or(scene.defaults.ao_radius),
            passes,
            sampler: self.sampler,
            light_sampling: self.light_sampling,
            adaptive: None,
            layers: None,
        };
        settings.check()?;
        Ok(settings)
    }
}

/// What the arbiter is asked.
#[derive(Args, Debug)]
pub(super) struct Judging {
    /// Rays of each kind that all backends agree on and that are judged by exact arithmetic, as are
    /// all in dispute; chosen by the seed
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub judge: usize,
}

impl Judging {
    /// Judges the answers to each set of rays. The tree is built for it if no backend has it.
    pub(super) fn judge(
        &self,
        lab: &Lab<'_>,
        answered: &[(&RaySet, &Outcome)],
    ) -> Result<Vec<Judgement>> {
        let failed = |message| Error::Backend { backend: "arbiter".into(), message };
        let built = lab.trees().uncut().map_err(failed)?;
        let arbiter = Arbiter::new(&built.tree);
        let one = |&(set, outcome): &(&RaySet, &Outcome)| {
            judge(&arbiter, set, outcome, self.judge, lab.seed())
        };
        Ok(answered.iter().map(one).collect())
    }
}

/// The passes asked for; without any, all that the scene has.
pub(super) fn passes(asked: &[Pass], default: &[Pass], scene: &Scene) -> Vec<Pass> {
    if asked.is_empty() {
        let all = Pass::all_of(scene);
        default.iter().copied().filter(|pass| all.contains(pass)).collect()
    } else {
        asked.to_vec()
    }
}

/// Loads a scene, as it is in `frame` if one is asked for, and prints its warnings.
pub(super) fn load_scene(reference: &str, frame: Option<usize>, quiet: bool) -> Result<Scene> {
    let scene = scene::load(reference)?;
    if !quiet {
        for warning in &scene.warnings {
            eprintln!("sato: warning: {warning}");
        }
    }
    let Some(frame) = frame else { return Ok(scene) };
    scene.at_frame(frame).ok_or_else(|| {
        let has = match &scene.motion {
            Some(motion) if motion.frames > 1 => format!("frames 0 to {}", motion.frames - 1),
            Some(_) => "frame 0 only".into(),
            None => "no frames, as nothing moves".into(),
        };
        Error::Usage(format!("--frame {frame}: {reference} has {has}"))
    })
}

/// Parses a `--backend`; for clap.
pub(super) fn parse_backend(text: &str) -> std::result::Result<BackendSpec, String> {
    text.parse::<BackendSpec>().map_err(|e| e.to_string())
}

/// Parses a pass; for clap.
pub(super) fn parse_pass(text: &str) -> std::result::Result<Pass, String> {
    text.parse::<Pass>().map_err(|e| e.to_string())
}

/// Parses a sampler; for clap.
pub(super) fn parse_sampler(text: &str) -> std::result::Result<&'static SamplerEntry, String> {
    SamplerEntry::find(text).map_err(|e| e.to_string())
}

/// Parses a way to sample lights; for clap.
pub(super) fn parse_light_sampling(text: &str) -> std::result::Result<LightSampling, String> {
    text.parse::<LightSampling>().map_err(|e| e.to_string())
}

/// Parses what to leave out; for clap.
pub(super) fn parse_skips(text: &str) -> std::result::Result<Skips, String> {
    text.parse::<Skips>().map_err(|e| e.to_string())
}

/// Parses a rate; for clap.
pub(super) fn parse_rate(text: &str) -> std::result::Result<f64, String> {
    let rate: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if rate >= 0.0 { Ok(rate) } else { Err("a rate is at least 0".into()) }
}

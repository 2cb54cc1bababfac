//! What `sato compare` and `sato rays replay` find out.

use super::{JudgementReport, Provenance};
use crate::backend::{Accelerator, BackendSpec, BuildStats};
use crate::measure::{Judgement, Outcome, Summary};
use crate::ray_set::RaySet;
use crate::scene::Scene;
use serde::Serialize;

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct CompareReport {
    /// What made this report.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// What was looked at.
    pub scene: SceneReport,
    /// Rounds that count; a warm-up round comes before them.
    pub rounds: usize,
    /// The primary rays that the shadow rays start from; absent where rays came from a file.
    pub primary: Option<PrimaryReport>,
    /// The contenders, in the order given.
    pub backends: Vec<BackendReport>,
    /// The results, by class of rays.
    pub classes: Vec<ClassReport>,
    /// Files written beside the report, relative to its folder.
    pub files: Vec<String>,
}

/// The scene that was looked at.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// Its name.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Vertices.
    pub vertices: usize,
    /// Bytes of the mesh that all backends share.
    pub mesh_memory_bytes: usize,
    /// What was repaired or dropped while loading.
    pub warnings: Vec<String>,
}

/// The primary rays.
#[derive(Clone, Debug, Serialize)]
pub struct PrimaryReport {
    /// The backend that answered them, once for all contenders.
    pub backend: String,
    /// Image width and height in pixels.
    pub size: [u32; 2],
    /// Shading samples for each camera sample.
    pub spp: u32,
    /// Camera samples for each pixel.
    pub camera_samples: u32,
    /// Camera rays.
    pub rays: u64,
    /// Share of them that hit something.
    pub hit_share: f64,
}

/// One contender.
#[derive(Clone, Debug, Serialize)]
pub struct BackendReport {
    /// Its spec as given.
    pub spec: String,
    /// Its spec with every key written out.
    pub full_spec: String,
    /// What building it took.
    #[serde(flatten)]
    pub build: BuildStats,
}

/// All results for one class of rays.
#[derive(Clone, Debug, Serialize)]
pub struct ClassReport {
    /// Name of the class.
    pub class: String,
    /// Rays that every contender answered.
    pub rays: u64,
    /// Samples that needed no ray, as they cannot contribute.
    pub rays_skipped: u64,
    /// Share of the rays that the first contender calls occluded. An order cannot help the others.
    pub occluded_share: f64,
    /// One entry for each contender.
    pub results: Vec<ClassResult>,
    /// One entry for each pair of contenders.
    pub agreement: Vec<AgreementReport>,
    /// What the arbiter says of the answers, if it was asked.
    pub judgement: Option<JudgementReport>,
}

/// One contender on one class of rays.
#[derive(Clone, Debug, Serialize)]
pub struct ClassResult {
    /// The contender's spec as given.
    pub backend: String,
    /// Time to answer all rays.
    pub trace_ms: Summary,
    /// Million rays per second, from the median time.
    pub mrays_per_s: f64,
    /// How many times faster than the first contender, round by round.
    pub ratio_to_first: Summary,
    /// Rays called occluded.
    pub occluded: u64,
    /// Nodes visited per ray, mean of all rays; absent where the backend cannot count.
    pub nodes_per_ray: Option<f64>,
    /// Nodes visited per occluded ray.
    pub nodes_per_occluded_ray: Option<f64>,
    /// Nodes visited per unoccluded ray.
    pub nodes_per_unoccluded_ray: Option<f64>,
    /// Triangles tested per ray, mean of all rays.
    pub triangles_per_ray: Option<f64>,
    /// Of a million rays, triangle tests that `f32` left in doubt and `f64` settled; in exact mode.
    pub double_tests_per_million: Option<f64>,
    /// Of a million rays, triangle tests that integers settled; in exact mode.
    pub exact_tests_per_million: Option<f64>,
}

/// How two contenders agree.
#[derive(Clone, Debug, Serialize)]
pub struct AgreementReport {
    /// The pair's specs as given.
    pub backends: [String; 2],
    /// Rays that only one of them calls occluded.
    pub differing_rays: u64,
    /// The same, among a million rays.
    pub differing_per_million: f64,
}

impl SceneReport {
    /// The figures of `scene`.
    pub fn new(scene: &Scene) -> Self {
        Self {
            name: scene.name.clone(),
            triangles: scene.mesh.len(),
            vertices: scene.mesh.vertices().len(),
            mesh_memory_bytes: scene.mesh.memory_bytes(),
            warnings: scene.warnings.clone(),
        }
    }
}

impl BackendReport {
    /// One for each contender.
    pub fn all(specs: &[BackendSpec], contenders: &[&dyn Accelerator]) -> Vec<Self> {
        let one = |(spec, contender): (&BackendSpec, &&dyn Accelerator)| Self {
            spec: spec.to_string(),
            full_spec: spec.full(),
            build: contender.build_stats().clone(),
        };
        specs.iter().zip(contenders).map(one).collect()
    }
}

impl ClassReport {
    /// The outcome of a contest between backends of these specs.
    pub fn new(
        class: &str,
        set: &RaySet,
        rays_skipped: u64,
        specs: &[String],
        outcome: &Outcome,
    ) -> Self {
        let share = |n: usize| if set.is_empty() { 0.0 } else { n as f64 / set.len() as f64 };
        let results = specs.iter().zip(&outcome.performances).map(|(spec, p)| ClassResult {
            backend: spec.clone(),
            trace_ms: p.trace_ms,
            mrays_per_s: set.len() as f64 / (1e3 * p.trace_ms.median),
            ratio_to_first: p.ratio_to_first,
            occluded: p.occluded as u64,
            nodes_per_ray: p.visits.map(|v| v.nodes_per_ray),
            nodes_per_occluded_ray: p.visits.and_then(|v| v.nodes_per_occluded_ray),
            nodes_per_unoccluded_ray: p.visits.and_then(|v| v.nodes_per_unoccluded_ray),
            triangles_per_ray: p.visits.map(|v| v.triangles_per_ray),
            double_tests_per_million: p.visits.map(|v| v.double_tests_per_million),
            exact_tests_per_million: p.visits.map(|v| v.exact_tests_per_million),
        });
        let agreement = outcome.agreement.iter().map(|a| AgreementReport {
            backends: a.pair.map(|i| specs[i].clone()),
            differing_rays: a.differing.len() as u64,
            differing_per_million: a.per_million(),
        });
        Self {
            class: class.to_string(),
            rays: set.len() as u64,
            rays_skipped,
            occluded_share: outcome.performances.first().map_or(0.0, |p| share(p.occluded)),
            results: results.collect(),
            agreement: agreement.collect(),
            judgement: None,
        }
    }

    /// With what the arbiter says.
    #[must_use]
    pub fn judged(mut self, judgement: &Judgement, specs: &[String]) -> Self {
        self.judgement = Some(JudgementReport::new(judgement, self.rays as usize, specs));
        self
    }
}

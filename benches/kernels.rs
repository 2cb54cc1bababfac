//! Micro-benchmarks: any-hit kernels and builders, each alone, on one small scene.
//!
//! `cargo bench` runs all, `cargo bench -- shadow` those whose name says so. Kernels run on one thread
//! and are checked against each other first; builders run on all threads. To compare backends use
//! `sato compare` or `sato bench peers`, whose rounds are interleaved: these here are not.

use divan::Bencher;
use divan::counter::ItemsCount;
use sato::backend::{Accelerator, SharedTrees};
use sato::build::{self, BUILDERS, Leaves, WideCosts, kd_sah};
use sato::geometry::TriangleMesh;
use sato::intersect::Mode;
use sato::lab::Lab;
use sato::order::{self, OrderContext, Scores};
use sato::ray::RayBatch;
use sato::ray_set::RaySet;
use sato::render::{Pass, RenderSettings, record};
use sato::scene::{self, Scene};
use sato::trace::shaft::Entry;
use sato::trace::wide::{self, Instructions, Query, Scratch, Structure, Way};
use sato::tree::{Bvh2, Bvh8};
use std::sync::{Arc, LazyLock, Mutex};

/// Walls beside fine detail, 66 thousand triangles.
const SCENE: &str = "atrium";
const SIZE: [u32; 2] = [128, 72];
const SPP: u32 = 2;

/// That of `bvh8` by default.
const ORDER: &str = "p-over-c";

fn main() {
    divan::main();
}

type Run = dyn Fn(&RaySet, &mut [u64]) + Send + Sync;

/// Something that answers all rays of a set, batch by batch, on this thread.
struct Kernel {
    name: String,
    run: Box<Run>,
}

/// What is measured, made once.
struct Bench {
    scene: Scene,
    /// With leaves of single triangles, which collapsing wants.
    binary: Bvh2,
    scores: Scores,
    kernels: Vec<Kernel>,
    rays: Vec<(Pass, RaySet)>,
}

static BENCH: LazyLock<Bench> = LazyLock::new(Bench::new);

impl Bench {
    fn new() -> Self {
        let scene = scene::load(SCENE).expect("a generator's scene");
        let lab = Lab::new(&scene, 0);
        let backend = |spec: &str| -> Box<dyn Accelerator> {
            lab.build(&spec.parse().expect("a spec")).expect("a native backend")
        };
        let passes = Pass::all_of(&scene);
        let picture =
            RenderSettings { size: SIZE, spp: SPP, passes, ..RenderSettings::of_scene(&scene) };
        let recording = record(&scene, &*backend("bvh2"), &picture, None).expect("rays");
        let rays: Vec<_> =
            recording.passes().iter().map(|pass| (pass.pass(), pass.rays().clone())).collect();

        let binary = (BUILDERS[0].build)(&scene.mesh, Leaves::Wide);
        let scores = scores(&binary, &scene);
        let tree = Arc::new(collapse(&binary, &scores));
        let mut kernels = Vec::new();
        for instructions in Instructions::all() {
            for (way, name) in [(Way::Single, "single"), (Way::Stream, "stream")] {
                kernels.push(Kernel {
                    name: format!("bvh8 {name}, {}", instructions.name()),
                    run: wide_kernel(instructions, way, Arc::clone(&tree), Arc::clone(&scene.mesh)),
                });
            }
        }
        for spec in ["bvh8", "bvh8:mode=fast", "bvh2:trace=single", "bvh2:trace=packet", "kd"] {
            let backend = backend(spec);
            let run = move |rays: &RaySet, answers: &mut [u64]| {
                for (batch, words) in rays.batches_with(answers) {
                    backend.occluded(&batch, words);
                }
            };
            kernels.push(Kernel { name: spec.into(), run: Box::new(run) });
        }
        let bench = Self { scene, binary, scores, kernels, rays };
        bench.check();
        bench
    }

    /// A kernel that is fast and wrong is no kernel.
    fn check(&self) {
        for (pass, rays) in &self.rays {
            let answers = self.kernels.iter().map(|kernel| {
                let mut answers = rays.no_answers();
                (kernel.run)(rays, &mut answers);
                (&kernel.name, answers)
            });
            let answers: Vec<_> = answers.collect();
            for (name, others) in &answers {
                let differing = rays.differing(&answers[0].1, others).len();
                assert_eq!(differing, 0, "{name} on {}: rays that differ", pass.name());
            }
        }
    }
}

fn scores(tree: &Bvh2, scene: &Scene) -> Scores {
    let order = order::find(ORDER).and_then(|order| order.scores).expect("an order by scores");
    order(tree, &OrderContext::new(&scene.mesh))
}

fn collapse(tree: &Bvh2, scores: &Scores) -> Bvh8 {
    build::collapse(tree, WideCosts::default(), |node, side| scores[node][side])
}

fn wide_kernel(
    instructions: Instructions,
    way: Way,
    tree: Arc<Bvh8>,
    mesh: Arc<TriangleMesh>,
) -> Box<Run> {
    let scratch = Mutex::new(Scratch::default());
    Box::new(move |rays, answers| {
        let mut scratch = scratch.lock().expect("no kernel panics");
        let query = Query {
            structure: Structure::Tree(&tree),
            mesh: &mesh,
            way,
            mode: Mode::Exact,
            entry: &Entry::WHOLE,
            stratum: Some(0),
        };
        for (RayBatch { rays }, words) in rays.batches_with(answers) {
            wide::any_hit(instructions, &query, rays, words, &mut scratch);
        }
    })
}

fn kernel_names() -> impl Iterator<Item = &'static str> {
    BENCH.kernels.iter().map(|kernel| kernel.name.as_str())
}

/// Times a kernel on the rays of a pass; throughput is in rays.
fn any_hit(bencher: Bencher<'_, '_>, pass: Pass, kernel: &str) {
    let kernel = BENCH.kernels.iter().find(|k| k.name == kernel).expect("one of the names");
    let (_, rays) = BENCH.rays.iter().find(|rays| rays.0 == pass).expect("the scene has a light");
    bencher
        .counter(ItemsCount::new(rays.len()))
        .with_inputs(|| rays.no_answers())
        .bench_local_refs(|answers| (kernel.run)(rays, answers));
}

#[divan::bench(args = kernel_names(), sample_count = 50, max_time = 3)]
fn ao(bencher: Bencher<'_, '_>, kernel: &str) {
    any_hit(bencher, Pass::AmbientOcclusion, kernel);
}

#[divan::bench(args = kernel_names(), sample_count = 50, max_time = 3)]
fn ao_unbounded(bencher: Bencher<'_, '_>, kernel: &str) {
    any_hit(bencher, Pass::AmbientOcclusionUnbounded, kernel);
}

#[divan::bench(args = kernel_names(), sample_count = 50, max_time = 3)]
fn shadow(bencher: Bencher<'_, '_>, kernel: &str) {
    any_hit(bencher, Pass::Shadow, kernel);
}

/// Throughput of building, in triangles.
fn triangles() -> ItemsCount {
    ItemsCount::new(BENCH.scene.mesh.len())
}

fn builder_names() -> impl Iterator<Item = &'static str> {
    BUILDERS.iter().map(|builder| builder.name)
}

#[divan::bench(args = builder_names(), sample_count = 10, max_time = 5)]
fn build_bvh2(bencher: Bencher<'_, '_>, builder: &str) {
    let builder = build::find(builder).expect("one of the names");
    bencher.counter(triangles()).bench_local(|| (builder.build)(&BENCH.scene.mesh, Leaves::Fit));
}

#[divan::bench(args = builder_names(), sample_count = 10, max_time = 5)]
fn build_single_triangles(bencher: Bencher<'_, '_>, builder: &str) {
    let builder = build::find(builder).expect("one of the names");
    let build = || (builder.build)(&BENCH.scene.mesh, Leaves::Wide);
    bencher.counter(triangles()).bench_local(build);
}

#[divan::bench(sample_count = 10, max_time = 5)]
fn build_kd(bencher: Bencher<'_, '_>) {
    let build = || {
        let trees = SharedTrees::of(&BENCH.scene);
        trees.kd(kd_sah::Splits::default()).expect("the scene is small")
    };
    bencher.counter(triangles()).bench_local(build);
}

#[divan::bench(sample_count = 20, max_time = 3)]
fn score_children(bencher: Bencher<'_, '_>) {
    bencher.counter(triangles()).bench_local(|| scores(&BENCH.binary, &BENCH.scene));
}

#[divan::bench(sample_count = 20, max_time = 3)]
fn collapse_to_bvh8(bencher: Bencher<'_, '_>) {
    bencher.counter(triangles()).bench_local(|| collapse(&BENCH.binary, &BENCH.scores));
}

//! What several test suites share.
#![allow(dead_code, unreachable_pub, reason = "each suite uses its part")]

pub mod random;

use sato::backend::catalogue::BACKENDS;
use sato::backend::{Accelerator, BackendSpec, BuildContext, SharedTrees, build};
use sato::geometry::{TriangleMesh, Vec3};
use sato::ray::{Ray, RayBatch, words_for};
use sato::ray_set::RaySet;
use sato::scene::{Camera, Defaults, Scene};

/// Orders to try with every builder. Builders know no orders and orders no builders, so that one of
/// each kind will do: by the ray, by area, by number, and of the leaves' triangles.
const ORDERS_FOR_EVERY_BUILDER: &[&str] = &["near", "node-sato", "prim-num", "rtsah"];

fn is_tried(spec: &BackendSpec) -> bool {
    let keys = spec.entry().keys.iter();
    let by_default = keys.clone().all(|k| k.name != "builder" || spec.value(k.name) == k.default);
    let order = spec.find_value("order");
    by_default || order.is_none_or(|order| ORDERS_FOR_EVERY_BUILDER.contains(&order))
}

/// As [`every_spec`], but few orders with builders that are not the default.
pub fn all_specs() -> Vec<BackendSpec> {
    every_spec().into_iter().filter(is_tried).collect()
}

/// Every spec that the catalogue offers in this build: all values of all keys.
pub fn every_spec() -> Vec<BackendSpec> {
    let mut specs = Vec::new();
    for entry in BACKENDS.iter().filter(|e| e.unavailable.is_none()) {
        let mut texts = vec![entry.name.to_string()];
        for (index, key) in entry.keys.iter().enumerate() {
            let separator = if index == 0 { ':' } else { ',' };
            let choices = (key.choices)();
            texts = texts
                .iter()
                .flat_map(|t| {
                    choices.iter().map(move |c| format!("{t}{separator}{}={}", key.name, c.name))
                })
                .collect();
        }
        // Combinations that do not exist are refused.
        specs.extend(texts.iter().filter_map(|t| t.parse::<BackendSpec>().ok()));
    }
    specs
}

/// A scene around `mesh`; backends look at nothing else.
pub fn scene_of(mesh: TriangleMesh) -> Scene {
    Scene {
        name: "test".into(),
        mesh: mesh.into(),
        camera: Camera { eye: Vec3::Z, look_at: Vec3::ZERO, up: Vec3::Y, fov_degrees: 60.0 },
        lights: Vec::new(),
        defaults: Defaults { ao_radius: 1.0, size: [64, 64] },
        warnings: Vec::new(),
    }
}

/// Builds `spec` on `scene`, on two threads, with rays to learn from.
pub fn built(spec: &BackendSpec, scene: &Scene) -> Box<dyn Accelerator> {
    let mut random = random::Random::new(1);
    let rays: Vec<_> = (0..500).map(|_| random.ray()).collect();
    let mut training = RaySet::default();
    training.push_batch(&rays);
    let trees = SharedTrees::of(scene);
    let context =
        BuildContext { scene, trees: &trees, threads: 2, seed: 1, training: Some(&training) };
    build(spec, &context).expect("builds")
}

/// The answers for all rays, as one batch.
pub fn occluded(accelerator: &dyn Accelerator, rays: &[Ray]) -> Vec<u64> {
    let mut words = vec![0; words_for(rays.len())];
    accelerator.occluded(&RayBatch { rays }, &mut words);
    words
}

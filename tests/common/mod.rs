//! What several test suites share.
#![allow(dead_code, unused_imports, unreachable_pub, reason = "each suite uses its part")]

pub mod files;
pub mod motion;
pub mod moving;
pub mod random;
pub mod truth;

pub use sato::backend::catalogue::{every_spec, varied_specs as all_specs};
use sato::backend::{Accelerator, BackendSpec, BuildContext, SharedTrees, build};
use sato::geometry::{TriangleMesh, Vec3};
use sato::ray::{Ray, RayBatch, words_for};
use sato::ray_set::RaySet;
use sato::scene::{Camera, Defaults, Scene};

/// A scene around `mesh`; backends look at nothing else.
pub fn scene_of(mesh: TriangleMesh) -> Scene {
    Scene {
        name: "test".into(),
        mesh: mesh.into(),
        camera: Camera { eye: Vec3::Z, look_at: Vec3::ZERO, up: Vec3::Y, fov_degrees: 60.0 },
        lights: Vec::new(),
        defaults: Defaults { ao_radius: 1.0, size: [64, 64] },
        motion: None,
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

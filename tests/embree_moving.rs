//! Embree following moving scenes, in every combination of its keys that says how.

#![cfg(feature = "embree")]

mod common;

use common::moving::moving_scene;
use common::random::Random;
use common::truth::{Truth, truth};
use common::{built, occluded, scene_of};
use sato::backend::{
    BackendSpec, BuildContext, MovingAccelerator, SharedTrees, UpdateStats, build_moving,
};
use sato::geometry::{TriangleMesh, Vec3};
use sato::ray::{Ray, bit};
use sato::scene::Scene;
use std::sync::Arc;

fn specs() -> Vec<BackendSpec> {
    let mut specs = Vec::new();
    for quality in ["low", "medium", "high"] {
        for following in ["", ",update=refit", ",scene=static"] {
            for geometries in ["one", "objects"] {
                for mode in ["fast", "robust,width=8"] {
                    let text = format!(
                        "embree:quality={quality},mode={mode},geometries={geometries}{following}"
                    );
                    specs.push(text.parse().unwrap());
                }
            }
        }
    }
    specs
}

fn follow(spec: &BackendSpec, scene: &Scene) -> Box<dyn MovingAccelerator> {
    let trees = SharedTrees::of(scene);
    let context = BuildContext { scene, trees: &trees, threads: 2, seed: 1, training: None };
    build_moving(spec, &context).expect("builds")
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let (origin, target) = (random.point(), random.point());
            let t_max = [1.0, 0.5, f32::INFINITY][i % 3];
            Ray::new(origin, target - origin, t_max)
        })
        .filter(|ray| ray.direction != Vec3::ZERO)
        .collect()
}

/// In each frame the answers are those of `f64`, where that is sure of them, so those of any other
/// backend and of an Embree that is built anew.
#[test]
fn every_combination_follows_every_frame() {
    let mut random = Random::new(71);
    let frames = 6;
    let scene = moving_scene(&mut random, frames);
    let motion = scene.motion.clone().unwrap();
    let rays = rays(&mut random, 1200);
    let specs = specs();
    let mut followers: Vec<_> = specs.iter().map(|spec| follow(spec, &scene)).collect();
    let mut changed = 0;
    let mut last: Option<Vec<u64>> = None;
    // Back to the start as well.
    for frame in [1, 2, 3, 4, 5, 0] {
        let mesh = Arc::new(motion.mesh_at(&scene.mesh, frame));
        let truths: Vec<_> = rays.iter().map(|ray| truth(ray, &mesh)).collect();
        let sure = truths.iter().filter(|(any, _)| *any != Truth::Unsure).count();
        assert!(sure * 100 > rays.len() * 95, "only {sure} of {} rays are clear", rays.len());
        let mut still = scene_of(TriangleMesh::default());
        still.mesh = Arc::clone(&mesh);
        let fresh = built(&"embree:mode=robust".parse().unwrap(), &still);
        let fresh = occluded(&*fresh, &rays);
        for (spec, follower) in specs.iter().zip(&mut followers) {
            follower.update(Arc::clone(&mesh)).unwrap();
            let accelerator = follower.accelerator();
            let words = occluded(accelerator, &rays);
            for (index, (ray, (any, closest))) in rays.iter().zip(&truths).enumerate() {
                if *any == Truth::Unsure {
                    continue;
                }
                let what = format!("{spec}, frame {frame}: {ray:?}");
                assert_eq!(bit(&words, index), *any != Truth::Miss, "{what}");
                assert_eq!(bit(&words, index), bit(&fresh, index), "{what}");
                let hit = accelerator.closest_hit(ray);
                if let Some((t, triangle)) = closest {
                    let hit = hit.unwrap_or_else(|| panic!("no hit: {what}"));
                    assert_eq!(hit.triangle, *triangle, "{what}");
                    assert!((f64::from(hit.t) - t).abs() < 1e-4, "{what}: {} for {t}", hit.t);
                } else if *any == Truth::Miss {
                    assert_eq!(hit, None, "{what}");
                }
            }
        }
        let differing = |last: Vec<u64>| last.iter().zip(&fresh).filter(|(a, b)| a != b).count();
        changed += last.map_or(0, differing);
        last = Some(fresh);
    }
    assert!(changed > 10, "the frames hardly differ");
}

#[test]
fn updates_say_what_they_did() {
    let mut random = Random::new(72);
    let scene = moving_scene(&mut random, 2);
    let motion = scene.motion.clone().unwrap();
    let update = |spec: &str| -> UpdateStats {
        let mut follower = follow(&spec.parse().unwrap(), &scene);
        follower.update(motion.mesh_at(&scene.mesh, 1).into()).unwrap()
    };
    for spec in ["embree:update=refit", "embree:update=refit,geometries=objects"] {
        let stats = update(spec);
        assert!(stats.refit_ms > 0.0 && stats.build_ms == 0.0 && !stats.rebuilt, "{stats:?}");
    }
    for (spec, rebuilt) in [
        ("embree", true),
        ("embree:quality=low,scene=static", true),
        ("embree:geometries=objects,scene=static", true),
        ("embree:geometries=objects", false),
    ] {
        let stats = update(spec);
        assert!(stats.build_ms > 0.0 && stats.refit_ms == 0.0, "{stats:?}");
        assert_eq!(stats.rebuilt, rebuilt, "{spec}");
    }
}

/// Embree sees all triangles of a scene that does not say how it moves, and follows them.
#[test]
fn scenes_without_motion_are_one_object_that_moves() {
    let mut random = Random::new(73);
    let scene = scene_of(random.mesh(50));
    let mut empty = follow(&"embree:update=refit".parse().unwrap(), &scene_of(<_>::default()));
    let far = Arc::new(scene.mesh.moved(|vertices| vertices.iter_mut().for_each(|v| v.x += 100.0)));
    for spec in specs() {
        let mut follower = follow(&spec, &scene);
        follower.update(Arc::clone(&far)).unwrap();
        let rays = [0, 7, 30].map(|i| {
            let [a, b, c] = far.triangle(i).0;
            Ray::new((a + b + c) / 3.0 - Vec3::X, Vec3::X, 2.0)
        });
        assert_ne!(occluded(follower.accelerator(), &rays), [0], "{spec}");
        let error = follower.update(Arc::default()).unwrap_err().to_string();
        assert!(error.contains("other triangles") && error.contains(&spec.to_string()), "{error}");
    }
    empty.update(Arc::default()).unwrap();
    assert_eq!(occluded(empty.accelerator(), &[Ray::new(Vec3::ZERO, Vec3::X, 1.0)]), [0]);
}

#[test]
fn memory_is_reported_and_does_not_grow_from_frame_to_frame() {
    let mut random = Random::new(74);
    let scene = moving_scene(&mut random, 10);
    let motion = scene.motion.clone().unwrap();
    for spec in specs() {
        let mut follower = follow(&spec, &scene);
        let bytes: Vec<u64> = (0..60)
            .map(|step| {
                let mesh = Arc::new(motion.mesh_at(&scene.mesh, step % 10));
                follower.update(Arc::clone(&mesh)).unwrap();
                assert!(Arc::strong_count(&mesh) <= 2, "{spec}");
                follower.quality().memory_bytes
            })
            .collect();
        let most = |steps: &[u64]| steps.iter().copied().max().unwrap();
        let (early, late) = (most(&bytes[10..30]), most(&bytes[40..]));
        assert!(early > 1000 && late <= early + early / 4, "{spec}: {bytes:?}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let error = "embree:update=refit,scene=static".parse::<BackendSpec>().unwrap_err().to_string();
    assert!(error.contains("no tree that could be refitted"), "{error}");
    let spec: BackendSpec = "embree:update=refit,quality=low".parse().unwrap();
    assert_eq!(spec.to_string(), "embree:quality=low,update=refit");
}

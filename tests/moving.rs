//! Backends that follow moving scenes, held against brute force on every frame.

mod common;

use common::motion::{MOTIONS, Way, moved};
use common::random::Random;
use common::{occluded, scene_of};
use sato::backend::{
    Accelerator, BackendSpec, BuildContext, Hints, MovingAccelerator, SharedTrees, build_moving,
};
use sato::build::BUILDERS;
use sato::dynamics::{Strategy, Upkeep};
use sato::geometry::{TriangleMesh, Vec3};
use sato::order::ORDERS;
use sato::ray::{Ray, RayBatch, VisitCounts, words_for};
use sato::ray_set::RaySet;
use sato::trace::shaft::{Budget, Entry, Shaft, View};
use std::sync::Arc;

fn moving(spec: &str, mesh: &TriangleMesh) -> sato::Result<Box<dyn MovingAccelerator>> {
    let scene = scene_of(mesh.clone());
    let trees = SharedTrees::of(&scene);
    let mut random = Random::new(1);
    let rays: Vec<_> = (0..500).map(|_| random.ray()).collect();
    let mut training = RaySet::default();
    training.push_batch(&rays);
    let training = Some(&training);
    let context = BuildContext { scene: &scene, trees: &trees, threads: 2, seed: 1, training };
    build_moving(&spec.parse::<BackendSpec>()?, &context)
}

/// From within the mesh's box, or from anywhere, through its triangles and past them.
fn rays(mesh: &TriangleMesh, seed: u64, count: usize) -> Vec<Ray> {
    let mut random = Random::new(seed);
    let bounds = mesh.bounds();
    let inside = |random: &mut Random| {
        let [x, y, z] = [random.unit(), random.unit(), random.unit()];
        bounds.min + (bounds.max - bounds.min) * Vec3::new(x, y, z)
    };
    (0..count)
        .map(|index| {
            if index % 4 == 0 || mesh.is_empty() {
                return random.ray();
            }
            let origin = inside(&mut random);
            let triangle = mesh.triangle(random.bits() as usize % mesh.len()).0;
            let target = match index % 4 {
                1 => inside(&mut random),
                2 => (triangle[0] + triangle[1] + triangle[2]) / 3.0,
                _ => triangle[index / 4 % 3],
            };
            let t_max =
                if random.bits().is_multiple_of(2) { f32::INFINITY } else { random.unit() * 2.0 };
            Ray::new(origin, target - origin, t_max)
        })
        .collect()
}

fn check_answers(what: &str, accelerator: &dyn Accelerator, brute: &dyn Accelerator, rays: &[Ray]) {
    let expected = occluded(brute, rays);
    assert_eq!(occluded(accelerator, rays), expected, "{what}");
    let mut counted = vec![0; words_for(rays.len())];
    let mut counts = vec![VisitCounts::default(); rays.len()];
    assert!(accelerator.occluded_counted(&RayBatch { rays }, &mut counted, &mut counts));
    assert_eq!(counted, expected, "{what}: counted");
    let mut hits = vec![None; rays.len()];
    accelerator.closest_hits(rays, &mut hits);
    for (ray, hit) in rays.iter().zip(hits) {
        let expected = brute.closest_hit(ray);
        assert_eq!(hit, expected, "{what}: {ray:?}");
        assert_eq!(accelerator.closest_hit(ray), expected, "{what}: {ray:?}");
    }
}

/// All specs of both layouts: builders, updates and upkeeps with each other; orders and ways to trace
/// take turns.
fn specs() -> Vec<String> {
    let mut specs = Vec::new();
    let mut turn = 0;
    for builder in BUILDERS {
        for strategy in Strategy::ALL {
            for upkeep in Upkeep::ALL {
                let keys = format!("update={},upkeep={}", strategy.name(), upkeep.name());
                for _ in 0..3 {
                    turn += 1;
                    let learns = upkeep == Upkeep::Selective;
                    let of_two: Vec<_> =
                        ORDERS.iter().filter(|o| !(o.needs_training && learns)).collect();
                    let of_eight: Vec<_> = ORDERS.iter().filter(|o| o.scores.is_some()).collect();
                    for (layout, orders, traces) in [
                        ("bvh2", of_two, ["single", "packet"]),
                        ("bvh8", of_eight, ["single", "stream"]),
                    ] {
                        let order = orders[turn % orders.len()].name;
                        let (builder, trace) = (builder.name, traces[turn % 2]);
                        specs.push(format!(
                            "{layout}:builder={builder},order={order},trace={trace},{keys}"
                        ));
                    }
                }
            }
        }
    }
    specs
}

#[test]
fn answers_are_those_of_brute_force_on_every_frame() {
    for (seed, count) in [(0x2a1, 0), (0x2a2, 1), (0x2a3, 120)] {
        let mesh = Random::new(seed).mesh(count);
        let frames: Vec<_> = MOTIONS
            .iter()
            .enumerate()
            .map(|(frame, way)| {
                let mesh = moved(&mesh, *way, seed + frame as u64);
                let rays = rays(&mesh, seed ^ frame as u64, 150);
                let brute = common::built(&"brute".parse().unwrap(), &scene_of(mesh.clone()));
                (Arc::new(mesh), rays, brute)
            })
            .collect();
        for spec in specs() {
            let mut backend = moving(&spec, &mesh).unwrap();
            for ((mesh, rays, brute), way) in frames.iter().zip(MOTIONS) {
                backend.update(Arc::clone(mesh)).unwrap();
                let what = format!("{spec} {count} {way:?}");
                check_answers(&what, backend.accelerator(), brute.as_ref(), rays);
                // Now and then a build is due.
                backend.traced(if *way == Way::Shuffle { 1e6 } else { 1.0 });
            }
        }
    }
}

/// Trees of several pieces, on one thread and on two: the same answers, trees and figures.
#[test]
fn threads_do_not_show() {
    let seed = 0x2b1;
    let mesh = Random::new(seed).mesh(15_000);
    for layout in ["bvh2", "bvh8"] {
        for (order, upkeep) in
            [("node-sato", "selective"), ("p-over-c", "selective"), ("prim-num", "full")]
        {
            let spec = format!("{layout}:order={order},update=rotate,upkeep={upkeep}");
            let follow = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut backend = moving(&spec, &mesh).unwrap();
                    let mut all = Vec::new();
                    for (way, frame) in [Way::Deform, Way::Explode, Way::Rest].iter().zip(0..) {
                        let mesh = Arc::new(moved(&mesh, *way, seed + frame));
                        let stats = backend.update(Arc::clone(&mesh)).unwrap();
                        let rays = rays(&mesh, seed ^ frame, 2000);
                        let accelerator = backend.accelerator();
                        let mut words = vec![0; words_for(rays.len())];
                        let mut counts = vec![VisitCounts::default(); rays.len()];
                        let batch = RayBatch { rays: &rays };
                        accelerator.occluded_counted(&batch, &mut words, &mut counts);
                        let visited: Vec<_> =
                            counts.iter().map(|c| (c.nodes, c.triangles)).collect();
                        let quality = backend.quality();
                        assert!(stats.rotations > 0 && !stats.rebuilt, "{spec}: {stats:?}");
                        all.push((
                            words,
                            visited,
                            [stats.rotations, stats.order_nodes],
                            (quality.sah_cost, quality.fresh_sah_cost, quality.stale_order),
                        ));
                    }
                    all
                })
            };
            assert!(follow(1) == follow(2), "{spec}");
        }
    }
}

/// What is said of a shaft through a tree that has moved is true of its rays, and so are answers from
/// the subtrees that it meets.
#[test]
fn looks_through_moved_trees_are_true() {
    let mut random = Random::new(0x2f1);
    let mesh = random.mesh(2000);
    let budget = Budget { nodes: 100, triangles: 50 };
    let mut views = [0; 3];
    let mut from_parts = 0;
    for spec in ["bvh2:update=rotate", "bvh8:update=rotate", "bvh8:builder=spatial,update=refit"] {
        let mut backend = moving(spec, &mesh).unwrap();
        for (way, frame) in [Way::Explode, Way::Deform, Way::Shuffle].iter().zip(0..) {
            let mesh = Arc::new(moved(&mesh, *way, frame));
            backend.update(Arc::clone(&mesh)).unwrap();
            let brute = common::built(&"brute".parse().unwrap(), &scene_of((*mesh).clone()));
            let accelerator = backend.accelerator();
            let bounds = accelerator.looks_within().unwrap();
            assert_eq!(bounds, mesh.bounds());
            for _ in 0..150 {
                let (origin, normal) = (random.point(), random.point().normalize_or(Vec3::X));
                let radius = [0.05, 0.3, f32::INFINITY][random.bits() as usize % 3];
                let origins = [origin];
                let normal_in_full = Some(normal.as_dvec3());
                let shaft = Shaft::hemisphere(&origins, normal_in_full, radius, &bounds).unwrap();
                let mut entry = Entry::WHOLE;
                let view = accelerator.look(&shaft, &Entry::WHOLE, budget, &mut entry);
                let rays: Vec<_> = (0..40)
                    .map(|_| {
                        let aim = random.point().normalize_or(normal);
                        let aim = if aim.dot(normal) < 0.01 { aim + normal * 1.1 } else { aim };
                        Ray::new(origin, aim.normalize(), radius)
                    })
                    .collect();
                let expected = occluded(brute.as_ref(), &rays);
                let hits: u32 = expected.iter().map(|word| word.count_ones()).sum();
                match view {
                    View::Open => assert_eq!(hits, 0, "{spec} {way:?} {origin}"),
                    View::Blocked => assert_eq!(hits, 40, "{spec} {way:?} {origin}"),
                    View::Partly => {
                        let mut answers = vec![0; words_for(rays.len())];
                        let batch = RayBatch { rays: &rays };
                        let hints = Hints { entry: &entry, stratum: Some(0) };
                        accelerator.occluded_with(&hints, &batch, &mut answers);
                        assert_eq!(answers, expected, "{spec} {way:?} {origin}");
                        from_parts += usize::from(entry.parts().is_some());
                    }
                }
                views[view as usize] += 1;
            }
        }
    }
    assert!(views[0] > 50 && views[2] > 50 && from_parts > 50, "{views:?} {from_parts}");
}

#[test]
fn slower_tracing_leads_to_a_new_tree() {
    let mesh = Arc::new(Random::new(0x2c1).mesh(500));
    for layout in ["bvh2", "bvh8"] {
        let update = |key: &str, traces_ms: [f64; 3]| {
            let mut backend = moving(&format!("{layout}:update={key}"), &mesh).unwrap();
            traces_ms.map(|trace_ms| {
                let stats = backend.update(Arc::clone(&mesh)).unwrap();
                backend.traced(trace_ms);
                assert_eq!(stats.rebuilt, stats.build_ms > 0.0, "{layout} {key}");
                stats.rebuilt
            })
        };
        assert_eq!(update("auto", [1.0, 1e9, 1.0]), [false, false, true], "{layout}");
        assert_eq!(update("auto", [1.0, 1.0, 1.0]), [false; 3], "{layout}");
        assert_eq!(update("rotate", [1.0, 1e9, 1.0]), [false; 3], "{layout}");
        assert_eq!(update("rebuild", [1.0; 3]), [true; 3], "{layout}");
    }
}

#[test]
fn what_is_known_of_a_tree_is_true() {
    let mesh = Random::new(0x2d1).mesh(5000);
    let exploded = Arc::new(moved(&mesh, Way::Explode, 3));
    for layout in ["bvh2", "bvh8"] {
        let quality = |update: &str, upkeep: &str| {
            let spec = format!("{layout}:order=node-sato,update={update},upkeep={upkeep}");
            let mut backend = moving(&spec, &mesh).unwrap();
            backend.update(Arc::clone(&exploded)).unwrap();
            backend.quality()
        };
        let [rebuilt, refit, rotated] =
            ["rebuild", "refit", "rotate"].map(|update| quality(update, "none"));
        // Sums follow the order of children.
        let is_equal = |a: Option<f64>, b: Option<f64>| {
            a.zip(b).is_some_and(|(a, b)| (a - b).abs() <= 1e-12 * b)
        };
        assert!(is_equal(rebuilt.sah_cost, rebuilt.fresh_sah_cost), "{layout}: {rebuilt:?}");
        assert!(is_equal(refit.fresh_sah_cost, rebuilt.sah_cost), "{layout}: {refit:?}");
        assert!(refit.sah_cost > rotated.sah_cost, "{layout}: {refit:?} {rotated:?}");
        assert!(rotated.sah_cost > rebuilt.sah_cost, "{layout}: {rotated:?} {rebuilt:?}");
        assert_eq!(rebuilt.stale_order, Some(0.0), "{layout}");
        assert!(rotated.stale_order > Some(0.01), "{layout}: {rotated:?}");
        let selective = quality("rotate", "selective");
        assert!(selective.stale_order < rotated.stale_order, "{layout}: {selective:?}");
        assert_eq!(quality("rotate", "full").stale_order, Some(0.0), "{layout}");
        assert!(selective.memory_bytes > 5000 * 40, "{layout}: {selective:?}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let mesh = Random::new(0x2e1).mesh(50);
    for layout in ["bvh2", "bvh8"] {
        let mut backend = moving(layout, &mesh).unwrap();
        let other = Arc::new(Random::new(0x2e2).mesh(51));
        let error = backend.update(other).unwrap_err().to_string();
        assert!(error.contains("51 triangles where there were 50"), "{error}");
    }
    let refused = |spec: &str| moving(spec, &mesh).err().expect(spec).to_string();
    assert!(refused("bvh2:order=trained").contains("upkeep=full"));
    assert!(refused("bvh2:update=never").contains("one of: rebuild"));
    assert!(refused("bvh8:upkeep=some").contains("one of: none"));
    moving("bvh2:order=trained,upkeep=full", &mesh).unwrap();
}

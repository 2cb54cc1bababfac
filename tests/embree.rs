//! The Embree backend, in every combination of its keys, against a brute force in `f64`.

#![cfg(feature = "embree")]

mod common;

use common::random::Random;
use common::truth::{Truth, truth};
use common::{all_specs, built, occluded, scene_of};
use sato::backend::BackendSpec;
use sato::geometry::{TriangleMesh, Vec3};
use sato::ray::{Ray, bit};
use sato::scene::Scene;

fn specs() -> Vec<BackendSpec> {
    let specs: Vec<_> = all_specs().into_iter().filter(|s| s.name() == "embree").collect();
    assert_eq!(specs.len(), 3 * 2 * 4 * 2);
    specs
}

/// Small triangles in a box, rays between points of it, and the truth about them.
struct Case {
    scene: Scene,
    rays: Vec<Ray>,
    truths: Vec<(Truth, Option<(f64, u32)>)>,
}

impl Case {
    fn new(seed: u64, triangles: u32, rays: usize) -> Self {
        let mut random = Random::new(seed);
        let mut vertices = Vec::new();
        for _ in 0..triangles {
            let center = random.point();
            for _ in 0..3 {
                vertices.push(center + random.point() * 0.25);
            }
        }
        let indices = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(vertices, indices);
        let rays: Vec<_> = (0..rays)
            .map(|i| {
                let (origin, target) = (random.point(), random.point());
                let t_max = [1.0, 0.3, f32::INFINITY][i % 3];
                Ray { t_min: 0.1 * (i % 2) as f32, ..Ray::new(origin, target - origin, t_max) }
            })
            .filter(|ray| ray.direction != Vec3::ZERO)
            .collect();
        let truths: Vec<_> = rays.iter().map(|ray| truth(ray, &mesh)).collect();
        let sure = truths.iter().filter(|(any, _)| *any != Truth::Unsure).count();
        assert!(sure * 100 > rays.len() * 95, "only {sure} of {} rays are clear", rays.len());
        let hits = truths.iter().filter(|(any, _)| matches!(any, Truth::Hit(_))).count();
        assert!(hits * 10 > rays.len() && hits * 10 < rays.len() * 9, "{hits} hits");
        Self { scene: scene_of(mesh), rays, truths }
    }

    fn assert_occluded(&self, what: &str, first: usize, words: &[u64], count: usize) {
        for index in 0..count {
            let (any, _) = self.truths[first + index];
            if any != Truth::Unsure {
                let expected = any != Truth::Miss;
                let ray = &self.rays[first + index];
                assert_eq!(bit(words, index), expected, "{what}: ray {index} of {count}, {ray:?}");
            }
        }
    }
}

#[test]
fn every_combination_agrees_with_brute_force() {
    let case = Case::new(21, 300, 4000);
    for spec in specs() {
        let backend = built(&spec, &case.scene);
        let words = occluded(&*backend, &case.rays);
        case.assert_occluded(&spec.to_string(), 0, &words, case.rays.len());
        for (ray, (any, closest)) in case.rays.iter().zip(&case.truths) {
            let hit = backend.closest_hit(ray);
            if let Some((t, triangle)) = closest {
                let hit = hit.unwrap_or_else(|| panic!("{spec}: no hit for {ray:?}"));
                assert_eq!(hit.triangle, *triangle, "{spec}: {ray:?}");
                assert!((f64::from(hit.t) - t).abs() < 1e-4, "{spec}: {} for {t}", hit.t);
            } else if *any == Truth::Miss {
                assert_eq!(hit, None, "{spec}: {ray:?}");
            }
        }
    }
}

#[test]
fn batches_of_every_size_fill_their_bits_and_no_others() {
    let case = Case::new(22, 200, 400);
    for width in [1, 4, 8, 16] {
        for flags in ["incoherent", "coherent"] {
            let spec = format!("embree:width={width},flags={flags}").parse().unwrap();
            let backend = built(&spec, &case.scene);
            for count in 0..=70 {
                let first = 3 * count;
                let words = occluded(&*backend, &case.rays[first..first + count]);
                case.assert_occluded(&spec.to_string(), first, &words, count);
                let unused = words.last().map_or(0, |w| w.checked_shr(count as u32 % 64).unwrap());
                assert!(count % 64 == 0 || unused == 0, "{spec}: bits beyond {count} rays");
            }
        }
    }
}

#[test]
fn an_empty_mesh_stops_nothing() {
    let scene = scene_of(TriangleMesh::default());
    let rays = [Ray::new(Vec3::ZERO, Vec3::X, f32::INFINITY); 5];
    for spec in specs() {
        let backend = built(&spec, &scene);
        assert_eq!(occluded(&*backend, &rays), [0], "{spec}");
        assert_eq!(backend.closest_hit(&rays[0]), None, "{spec}");
    }
}

#[test]
fn building_is_reported() {
    let scene = scene_of(Random::new(23).mesh(5000));
    let spec: BackendSpec = "embree:mode=robust,width=8".parse().unwrap();
    let backend = built(&spec, &scene);
    let stats = backend.build_stats();
    // The tree, with the triangles in its leaves; the shared buffers do not count.
    let per_triangle = stats.memory_bytes as f64 / scene.mesh.len() as f64;
    assert!((16.0..2000.0).contains(&per_triangle), "{per_triangle} bytes a triangle");
    assert!(stats.build_ms > 0.0 && stats.order_ms == 0.0);
    let notes = stats.notes.join("\n");
    println!("{notes}");
    for part in ["Embree 4.", "kernels", "mode=robust", "width=8", "2 build threads"] {
        assert!(notes.contains(part), "no {part} in: {notes}");
    }
}

#[test]
fn backends_live_and_die_apart() {
    let mut case = Case::new(24, 300, 1000);
    let one = built(&"embree".parse().unwrap(), &case.scene);
    let two = built(&"embree:quality=low,width=8".parse().unwrap(), &case.scene);
    drop(one);
    let three = built(&"embree:mode=robust,width=16".parse().unwrap(), &case.scene);
    // The backends keep the mesh alive, not the scene.
    case.scene = scene_of(TriangleMesh::default());
    for backend in [&two, &three] {
        let words = occluded(&**backend, &case.rays);
        case.assert_occluded("survivor", 0, &words, case.rays.len());
    }
    // On another thread than it was made.
    std::thread::spawn(move || drop(two)).join().unwrap();
    let words = occluded(&*three, &case.rays);
    case.assert_occluded("last", 0, &words, case.rays.len());
}

#[test]
fn threads_build_and_ask_at_once() {
    let case = Case::new(25, 300, 2000);
    let shared = built(&"embree:width=8".parse().unwrap(), &case.scene);
    std::thread::scope(|scope| {
        for width in [1, 4, 8, 16] {
            let (case, shared) = (&case, &shared);
            scope.spawn(move || {
                for _ in 0..5 {
                    let words = occluded(&**shared, &case.rays);
                    case.assert_occluded("shared", 0, &words, case.rays.len());
                    let spec = format!("embree:width={width}").parse().unwrap();
                    let words = occluded(&*built(&spec, &case.scene), &case.rays);
                    case.assert_occluded("own", 0, &words, case.rays.len());
                }
            });
        }
    });
}

/// Empty and NaN intervals miss. Of other rays that are not rays only an end is asked: Embree
/// makes no promise.
#[test]
fn rays_that_are_not_rays_come_to_an_end() {
    let case = Case::new(26, 300, 300);
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut strange = vec![Ray::new(Vec3::ZERO, Vec3::ZERO, 1.0)];
    for value in odd {
        for axis in 0..3 {
            let mut ray = case.rays[axis];
            ray.origin[axis] = value;
            strange.push(ray);
            let mut ray = case.rays[axis];
            ray.direction = Vec3::ZERO;
            ray.direction[axis] = value;
            strange.push(ray);
        }
    }
    let ray = case.rays.iter().zip(&case.truths).find(|(_, (any, _))| matches!(any, Truth::Hit(_)));
    let ray = *ray.expect("some ray hits").0;
    let empty = [
        Ray { t_max: f32::NAN, ..ray },
        Ray { t_max: f32::NEG_INFINITY, ..ray },
        Ray { t_max: -1.0, ..ray },
        Ray { t_min: 1.0, t_max: 0.5, ..ray },
    ];
    for spec in specs() {
        let backend = built(&spec, &case.scene);
        occluded(&*backend, &strange);
        for ray in &strange {
            backend.closest_hit(ray);
        }
        assert_eq!(occluded(&*backend, &empty), [0], "{spec}");
        assert!(empty.iter().all(|ray| backend.closest_hit(ray).is_none()), "{spec}");
    }
}

/// Embree advises flushing denormals to zero, which would change the native backends' answers.
#[test]
fn denormals_survive_on_the_caller_s_thread() {
    let case = Case::new(27, 300, 300);
    let backend = built(&"embree".parse().unwrap(), &case.scene);
    occluded(&*backend, &case.rays);
    let half = std::hint::black_box(f32::MIN_POSITIVE) * std::hint::black_box(0.5);
    assert!(half > 0.0);
}

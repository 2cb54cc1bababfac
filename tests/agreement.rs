//! Every native backend answers every ray as brute force does: all builders, orders and kernels.

mod common;

use common::random::Random;
use common::{all_specs, built, occluded, scene_of};
use sato::backend::BackendSpec;
use sato::geometry::{TriangleMesh, Vec3};
use sato::order::ORDERS;
use sato::ray::{Hit, Ray, RayBatch, VisitCounts, bit, words_for};
use sato::scene::Scene;

fn native_specs() -> Vec<BackendSpec> {
    all_specs().into_iter().filter(|s| s.name() != "embree" && s.name() != "brute").collect()
}

/// Any-hit, closest hit and counted answers of every native backend, against brute force in the same
/// mode.
fn assert_agreement(what: &str, scene: &Scene, rays: &[Ray]) {
    let brute = |mode: &str| built(&format!("brute:mode={mode}").parse().unwrap(), scene);
    let closest: Vec<_> = rays.iter().map(|r| brute("fast").closest_hit(r)).collect();
    for mode in ["fast", "exact"] {
        let expected = occluded(&*brute(mode), rays);
        if mode == "fast" {
            for (index, ray) in rays.iter().enumerate() {
                assert_eq!(bit(&expected, index), closest[index].is_some(), "{what}: {ray:?}");
            }
        }
        let specs = native_specs().into_iter().filter(|spec| spec.value("mode") == mode);
        assert_specs_agree(what, scene, rays, specs, &expected, &closest);
    }
}

fn assert_specs_agree(
    what: &str,
    scene: &Scene,
    rays: &[Ray],
    specs: impl Iterator<Item = BackendSpec>,
    expected: &[u64],
    closest: &[Option<Hit>],
) {
    for spec in specs {
        let backend = built(&spec, scene);
        let answers = occluded(&*backend, rays);
        let mut counted = vec![0; words_for(rays.len())];
        let mut counts = vec![VisitCounts::default(); rays.len()];
        assert!(backend.occluded_counted(&RayBatch { rays }, &mut counted, &mut counts));
        assert_eq!(answers, counted, "{what}, {spec}: a counting run answers otherwise");
        let mut together = vec![None; rays.len()];
        backend.closest_hits(rays, &mut together);
        assert_eq!(together, closest, "{what}, {spec}: closest hits of a batch");
        for (index, ray) in rays.iter().enumerate() {
            let blocked = bit(&answers, index);
            assert_eq!(blocked, bit(expected, index), "{what}, {spec}, ray {index}: {ray:?}");
            assert_eq!(backend.closest_hit(ray), closest[index], "{what}, {spec}: {ray:?}");
            assert!(!blocked || counts[index].triangles > 0, "{what}, {spec}: {ray:?}");
        }
    }
}

#[test]
fn random_meshes_and_rays() {
    let mut random = Random::new(11);
    for count in [0, 1, 2, 3, 5, 17, 100, 1000] {
        let scene = scene_of(random.mesh(count));
        let rays: Vec<_> = (0..3000).map(|_| random.ray()).collect();
        assert_agreement(&format!("{count} triangles"), &scene, &rays);
    }
}

#[test]
fn rays_aimed_at_vertices_and_edges() {
    let mut random = Random::new(12);
    let mesh = random.mesh(400);
    let rays: Vec<_> = (0..20_000)
        .map(|i| {
            let [a, b, _] = mesh.triangle(i % mesh.len()).0;
            let target = if i % 3 == 0 { a } else { a.lerp(b, random.unit()) };
            let origin = random.point();
            // To the target exactly, and beyond it.
            Ray::new(origin, target - origin, if i % 2 == 0 { 1.0 } else { f32::INFINITY })
        })
        .collect();
    assert_agreement("edges", &scene_of(mesh), &rays);
}

/// Rays in the planes of triangles, up to rounding, through them and beside them: there splits that
/// cut triangles would tell trees apart, if a hit asked for less than it does.
#[test]
fn rays_in_the_planes_of_triangles() {
    let mut random = Random::new(18);
    for count in [40, 400] {
        let mesh = random.mesh(count);
        let rays: Vec<_> = (0..20_000)
            .map(|i| {
                let [a, b, c] = mesh.triangle(i % mesh.len()).0;
                let mut weight = || random.unit() * 6.0 - 2.0;
                let mut point = || a + (b - a) * weight() + (c - a) * weight();
                let (origin, target) = (point(), point());
                Ray::new(origin, target - origin, f32::INFINITY)
            })
            .collect();
        assert_agreement(&format!("{count} planes"), &scene_of(mesh), &rays);
    }
}

/// A grid of axis-aligned squares: box planes, origins and directions all coincide.
#[test]
fn axis_parallel_rays_in_box_planes() {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for layer in 0..4u8 {
            let corner = |u: f32, v: f32| {
                let mut p = Vec3::ZERO;
                p[axis] = f32::from(layer);
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                p
            };
            let first = vertices.len() as u32;
            vertices.extend([corner(0., 0.), corner(3., 0.), corner(3., 3.), corner(0., 3.)]);
            triangles.push([first, first + 1, first + 2]);
            triangles.push([first, first + 2, first + 3]);
        }
    }
    let scene = scene_of(TriangleMesh::new(vertices, triangles));
    let places = [-1.0, -0.0, 0.0, 0.5, 1.0, 2.0, 3.0, 3.5];
    let zeros = [0.0, -0.0];
    let mut rays = Vec::new();
    for x in places {
        for y in places {
            for z in places {
                for axis in 0..3 {
                    for sign in [-1.0, 1.0] {
                        for zero in zeros {
                            let mut direction = Vec3::splat(zero);
                            direction[axis] = sign;
                            let t_max = if x == y { 1.0 } else { f32::INFINITY };
                            rays.push(Ray::new(Vec3::new(x, y, z), direction, t_max));
                        }
                    }
                }
            }
        }
    }
    assert_agreement("grid", &scene, &rays);
}

#[test]
fn rays_that_are_not_rays_miss() {
    let mut random = Random::new(13);
    let scene = scene_of(random.mesh(200));
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![Ray::new(Vec3::ZERO, Vec3::ZERO, 1.0)];
    for value in odd {
        for axis in 0..3 {
            let mut ray = random.ray();
            ray.origin[axis] = value;
            rays.push(ray);
            let mut ray = random.ray();
            ray.direction[axis] = value;
            rays.push(ray);
        }
    }
    rays.push(Ray { t_min: f32::NAN, ..random.ray() });
    rays.push(Ray { t_max: f32::NAN, ..random.ray() });
    rays.push(Ray { t_min: 1.0, t_max: 0.5, ..random.ray() });
    for spec in all_specs().iter().filter(|s| s.name() != "embree") {
        let backend = built(spec, &scene);
        assert_eq!(occluded(&*backend, &rays), [0], "{spec}");
        assert!(rays.iter().all(|r| backend.closest_hit(r).is_none()), "{spec}");
    }
}

#[test]
fn directions_of_any_length_and_negative_intervals() {
    let mut random = Random::new(14);
    let scene = scene_of(random.mesh(300));
    let rays: Vec<_> = (0..4000)
        .map(|i| {
            let length = ((i % 250) as f32 - 125.0).exp2();
            let ray = random.ray();
            let t_min = if i % 2 == 0 { -1.0 / length } else { 0.0 };
            let t_max = (1.0 / length).min(f32::MAX);
            Ray { direction: ray.direction * length, t_min, t_max, ..ray }
        })
        .collect();
    assert_agreement("lengths", &scene, &rays);
}

#[test]
fn scenes_far_from_the_origin_tiny_and_huge() {
    for (scale, offset) in [
        (1.0, Vec3::new(148_376.0, 1234.0, -223_423.0)),
        (1e-12, Vec3::ZERO),
        (1e12, Vec3::ZERO),
        (1e-3, Vec3::splat(1e6)),
    ] {
        let mut random = Random::new(15);
        let mesh = random.mesh(200);
        let moved = mesh.vertices().iter().map(|v| *v * scale + offset).collect();
        let scene = scene_of(TriangleMesh::new(moved, mesh.triangles().to_vec()));
        // Where digits are lost every ray goes to the slowest of tests, for each of all backends.
        let rays: Vec<_> = (0..1000)
            .map(|_| {
                let ray = random.ray();
                let origin = ray.origin * scale + offset;
                Ray { origin, direction: ray.direction * scale, ..ray }
            })
            .collect();
        assert_agreement(&format!("scale {scale}, offset {offset}"), &scene, &rays);
    }
}

/// An order cannot help a ray that nothing stops: it visits the same nodes under every order.
#[test]
fn unoccluded_rays_visit_the_same_nodes_under_every_order() {
    let mut random = Random::new(16);
    let scene = scene_of(random.mesh(3000));
    let rays: Vec<_> = (0..3000).map(|_| random.ray()).collect();
    let counts_of = |text: &str| {
        let backend = built(&text.parse().unwrap(), &scene);
        let mut words = vec![0; words_for(rays.len())];
        let mut counts = vec![VisitCounts::default(); rays.len()];
        backend.occluded_counted(&RayBatch { rays: &rays }, &mut words, &mut counts);
        (words, counts)
    };
    let kd_orders = ORDERS.iter().filter(|o| o.plan_kd.is_some());
    let all = [("bvh2", ORDERS.to_vec()), ("kd", kd_orders.copied().collect())];
    for (name, orders) in all {
        let (words, near) = counts_of(&format!("{name}:order=near"));
        let open: Vec<_> = (0..rays.len()).filter(|&i| !bit(&words, i)).collect();
        assert!(open.len() > 100, "{} rays pass", open.len());
        for order in orders {
            let (_, counts) = counts_of(&format!("{name}:order={}", order.name));
            assert!(open.iter().all(|&i| counts[i] == near[i]), "{name} {}", order.name);
        }
    }
}

/// No ray from inside a closed mesh gets out, aimed at vertices, edges or anywhere.
#[test]
fn closed_meshes_do_not_leak() {
    let (rings, sectors) = (24u16, 48u16);
    let mut vertices = vec![Vec3::Y, Vec3::NEG_Y];
    for ring in 1..rings {
        for sector in 0..sectors {
            let theta = f32::from(ring) / f32::from(rings) * std::f32::consts::PI;
            let phi = f32::from(sector) / f32::from(sectors) * std::f32::consts::TAU;
            let (s, c) = theta.sin_cos();
            vertices.push(Vec3::new(s * phi.cos(), c, s * phi.sin()));
        }
    }
    let at = |ring: u16, sector: u16| match ring {
        0 => 0,
        r if r == rings => 1,
        r => 2 + u32::from((r - 1) * sectors + sector % sectors),
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector + 1), at(ring + 1, sector)];
            triangles.extend(
                [[a, b, c], [a, c, d]]
                    .iter()
                    .filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]),
            );
        }
    }
    let mesh = TriangleMesh::new(vertices, triangles);
    let mut random = Random::new(17);
    let mut rays = Vec::new();
    for i in 0..300_000 {
        let [a, b, _] = mesh.triangle(i % mesh.len()).0;
        let origin = random.point() * 0.1;
        let target = match i % 3 {
            0 => a,
            1 => a.lerp(b, random.unit()),
            _ => origin + random.point() + Vec3::splat(1e-3),
        };
        rays.push(Ray::new(origin, target - origin, f32::INFINITY));
    }
    let scene = scene_of(mesh);
    let specs = [
        "brute",
        "bvh2",
        "bvh2:builder=spatial",
        "bvh8",
        "bvh8:trace=single",
        "kd",
        "kd:splits=boxes",
    ];
    for text in specs {
        let rays = if text == "brute" { &rays[..5000] } else { &rays[..] };
        let words = occluded(&*built(&text.parse().unwrap(), &scene), rays);
        let leaks = (0..rays.len()).filter(|&i| !bit(&words, i)).count();
        assert_eq!(leaks, 0, "{text}");
    }
}

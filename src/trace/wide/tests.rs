use super::*;
use crate::build::{self, WideCosts};
use crate::geometry::{Triangle, TriangleMesh, Vec3};
use crate::intersect::{Exact, Fast, PreparedRay, TriangleTest};
use crate::ray::{Hit, words_for};
use crate::test_random::Random;
use crate::trace::single;
use crate::tree::{Bvh2, Plan};
use std::cell::RefCell;

const WAYS: [Way; 3] = [Way::Automatic, Way::Single, Way::Stream];

fn trees(mesh: &TriangleMesh, costs: WideCosts) -> (Bvh2, Bvh8) {
    let binary = (build::find("binned").unwrap().build)(mesh, build::Leaves::Wide);
    let wide = build::collapse(&binary, costs, |node, side| (node % 7 + side) as f64);
    wide.validate(mesh).unwrap();
    (binary, wide)
}

/// One scratch for all batches, as a thread has it: what it remembers must change no answer.
fn answers(set: Instructions, query: &Query<'_>, rays: &[Ray]) -> Vec<u64> {
    thread_local! {
        static SCRATCH: RefCell<Scratch> = RefCell::default();
    }
    let mut occluded = vec![0; words_for(rays.len())];
    SCRATCH.with_borrow_mut(|scratch| any_hit(set, query, rays, &mut occluded, scratch));
    occluded
}

/// One scratch here too. What `hits` held before does not matter.
fn answers_closest(
    set: Instructions,
    (mesh, tree): (&TriangleMesh, &Bvh8),
    rays: &[Ray],
) -> Vec<Option<Hit>> {
    thread_local! {
        static SCRATCH: RefCell<Scratch> = RefCell::default();
    }
    let mut hits = vec![Some(Hit { t: 7.0, triangle: 7 }); rays.len()];
    SCRATCH.with_borrow_mut(|scratch| {
        closest_hits(set, Structure::Tree(tree), mesh, rays, &mut hits, scratch);
    });
    hits
}

fn bits(hit: Hit) -> (u32, u32) {
    (hit.t.to_bits(), hit.triangle)
}

fn assert_as_binary(
    mesh: &TriangleMesh,
    (binary, wide): (&Bvh2, &Bvh8),
    rays: &[Ray],
    closest: bool,
) -> Vec<u64> {
    let fast = assert_mode_as_binary(mesh, (binary, wide), rays, Fast);
    assert_mode_as_binary(mesh, (binary, wide), rays, Exact);
    for set in Instructions::all() {
        if closest {
            let together = answers_closest(set, (mesh, wide), rays);
            for (ray, together) in rays.iter().zip(together) {
                let expected = single::closest_hit(binary, ray).map(bits);
                let alone = closest_hit(set, Structure::Tree(wide), mesh, ray).map(bits);
                assert_eq!(alone, expected, "{set:?} {ray:?}");
                assert_eq!(together.map(bits), expected, "{set:?}, together: {ray:?}");
            }
        }
    }
    fast
}

fn assert_mode_as_binary<T: TriangleTest>(
    mesh: &TriangleMesh,
    (binary, tree): (&Bvh2, &Bvh8),
    rays: &[Ray],
    test: T,
) -> Vec<u64> {
    let mut expected = vec![0; words_for(rays.len())];
    for (index, ray) in rays.iter().enumerate() {
        let hit = single::any_hit(binary, binary.root, &Plan::Near, test, ray, &mut NoCount);
        expected[index / 64] |= u64::from(hit) << (index % 64);
    }
    for set in Instructions::all() {
        for way in WAYS {
            let answers = answers(
                set,
                &Query {
                    structure: Structure::Tree(tree),
                    mesh,
                    way,
                    mode: T::MODE,
                    entry: &Entry::WHOLE,
                    stratum: Some(0),
                },
                rays,
            );
            for (index, ray) in rays.iter().enumerate() {
                let bit = |words: &[u64]| words[index / 64] >> (index % 64) & 1;
                let case = (set, way, T::MODE, index, ray);
                assert_eq!(bit(&answers), bit(&expected), "{case:?}");
            }
        }
    }
    expected
}

/// Rays of all kinds: from near points or anywhere, along axes, aimed at edges and corners, of
/// extreme lengths and intervals, and those that are none.
pub(super) fn rays(random: &mut Random, mesh: &TriangleMesh, count: usize) -> Vec<Ray> {
    let (eye, target) = (random.point(), random.point());
    let coherent = random.bits().is_multiple_of(2);
    (0..count)
        .map(|_| {
            let mut ray = random.ray();
            if coherent {
                ray.origin = eye + random.point() * 0.02;
                ray.direction = target + random.point() * 0.2 - ray.origin;
            }
            let axis = (random.bits() % 3) as usize;
            match random.bits() % 32 {
                0 => ray.direction = Vec3::ZERO,
                1 => ray.direction[axis] = 0.0,
                2 => ray.direction[axis] = -0.0,
                3 => ray.direction = -ray.direction,
                4 => ray.t_max = f32::NAN,
                5 => ray.t_min = f32::NAN,
                6 => (ray.t_min, ray.t_max) = (f32::NEG_INFINITY, f32::INFINITY),
                7 => (ray.t_min, ray.t_max) = (f32::INFINITY, f32::INFINITY),
                8 => ray.origin[axis] = f32::INFINITY,
                9 => ray.direction[axis] = f32::NAN,
                10 => ray.direction *= 1e-30,
                11 => ray.direction *= 1e30,
                12 => ray.direction[axis] = f32::NEG_INFINITY,
                13 => (ray.t_min, ray.t_max) = (-1.0, 0.5),
                14..20 if !mesh.is_empty() => {
                    let index = (random.bits() % mesh.len() as u64) as usize;
                    let [a, b, _] = mesh.triangle(index).0;
                    let target = if axis == 0 { a } else { a.lerp(b, random.unit()) };
                    ray.direction = target - ray.origin;
                    ray.t_max = if axis == 1 { 1.0 } else { f32::INFINITY };
                }
                20..24 if !mesh.is_empty() => {
                    // From a triangle, as shadow rays start.
                    let index = (random.bits() % mesh.len() as u64) as usize;
                    let [a, b, c] = mesh.triangle(index).0;
                    ray.origin = a.lerp(b, random.unit()).lerp(c, random.unit());
                    ray.direction = random.point();
                }
                _ => {}
            }
            ray
        })
        .collect()
}

#[test]
fn all_kernels_answer_as_the_binary_tree_does() {
    let mut random = Random::new(0x0c7e7);
    let (mut hits, mut all) = (0, 0);
    for round in 0..120 {
        let mesh = random.mesh([1, 4, 9, 60, 1000, 4000][round % 6]);
        let triangle = [0.02, 0.15, 0.6][round % 3];
        let (binary, wide) = trees(&mesh, WideCosts { triangle, ..WideCosts::default() });
        for count in [0, 1, 63, 64, 65, 127, 128, 129, 300] {
            let rays = rays(&mut random, &mesh, count);
            let answers = assert_as_binary(&mesh, (&binary, &wide), &rays, count < 300);
            hits += answers.iter().map(|word| word.count_ones()).sum::<u32>();
            all += count;
        }
    }
    let share = f64::from(hits) / all as f64;
    assert!((0.2..0.9).contains(&share), "{share} of the rays hit");
}

/// Rays as of a tile, from near and far, through triangles that lie over each other, share edges or
/// have no area: many distances are the same, or almost.
#[test]
fn closest_hits_of_tiles_are_those_of_brute_force() {
    let mut random = Random::new(0x71e5);
    let (mut hits, mut ties) = (0, 0);
    for round in 0..160 {
        let mut triangles: Vec<_> = {
            let mesh = random.mesh([1, 6, 40, 300][round % 4]);
            (0..mesh.len()).map(|index| mesh.triangle(index)).collect()
        };
        for index in 0..triangles.len() {
            let [a, b, c] = triangles[index].0;
            match random.bits() % 5 {
                0 => triangles.push(Triangle([a, b, c])),
                1 => triangles.push(Triangle([c, b, a])),
                2 => triangles.push(Triangle([b, c, b + c - a])),
                3 => triangles.push(Triangle([a, a.lerp(b, 0.5), b])),
                // The same in another plane, by a few units in the last place.
                _ => triangles.push(Triangle([a, b, c].map(|v| v * (1.0 + 2.0 * f32::EPSILON)))),
            }
        }
        let vertices = triangles.iter().flat_map(|triangle| triangle.0).collect();
        let corners = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(vertices, corners);
        let (_, wide) = trees(&mesh, WideCosts::default());
        let eye = random.point() * [1.0, 4.0][round / 4 % 2];
        let aimed_at = triangles[(random.bits() % triangles.len() as u64) as usize].0;
        let target = (aimed_at[0] + aimed_at[1] + aimed_at[2]) / 3.0;
        let spread = [0.01, 0.2, 3.0][round % 3];
        let rays: Vec<_> = (0..256)
            .map(|pixel| {
                let (x, y) = ((pixel % 16) as f32 / 16.0 - 0.5, (pixel / 16) as f32 / 16.0 - 0.5);
                let mut ray =
                    Ray::new(eye, target + Vec3::new(x, y, x * y) * spread - eye, f32::INFINITY);
                if round % 5 == 0 {
                    ray.t_max = random.unit() * 2.0;
                }
                ray
            })
            .collect();
        let expected: Vec<_> = rays
            .iter()
            .map(|ray| {
                let prepared = PreparedRay::new(ray, &wide.bounds)?;
                let all = triangles.iter().zip(0..);
                let all = all.filter_map(|(triangle, id)| Some((prepared.triangle(triangle)?, id)));
                let mut all: Vec<_> = all.collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                ties += usize::from(all.len() > 1 && all[0].0 == all[1].0);
                let &(t, id) = all.first()?;
                Some(prepared.hit(t, id))
            })
            .collect();
        hits += expected.iter().flatten().count();
        for set in Instructions::all() {
            for count in [1, 7, 64, 128, 256] {
                let together = answers_closest(set, (&mesh, &wide), &rays[..count]);
                for (index, hit) in together.iter().enumerate() {
                    let (hit, expected) = (hit.map(bits), expected[index].map(bits));
                    assert_eq!(hit, expected, "{set:?}, round {round}: {:?}", rays[index]);
                }
            }
        }
    }
    assert!(hits > 10_000 && ties > 1_000, "{hits} hits, {ties} ties");
}

#[test]
fn no_triangles() {
    let mesh = TriangleMesh::default();
    let (binary, wide) = trees(&mesh, WideCosts::default());
    let rays = rays(&mut Random::new(5), &mesh, 100);
    assert_eq!(assert_as_binary(&mesh, (&binary, &wide), &rays, true), [0, 0]);
}

/// Triangles without area, and rays that are almost in the plane of the normal that such a triangle has
/// in a leaf: nothing is in their way.
#[test]
fn triangles_without_area_stop_no_ray() {
    let mut random = Random::new(0xf1a7);
    let on_grid = |point: Vec3| (point * 64.0).round() / 64.0;
    for _ in 0..400 {
        let (a, edge) = (on_grid(random.point()), on_grid(random.point()));
        let vertices = [0.0, 1.0, 2.0].map(|times| a + edge * times).to_vec();
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2]]);
        let (binary, wide) = trees(&mesh, WideCosts::default());
        let across = |v: Vec3| v - Vec3::splat((v.x + v.y + v.z) / 3.0);
        let rays: Vec<_> = (0..64)
            .map(|_| {
                let slope = 10f32.powf(random.unit() * 4.0 - 8.0);
                let direction = across(random.point()) + Vec3::splat(slope);
                let target = a + across(edge * random.unit() + random.point() * 0.01);
                Ray { origin: target - direction, direction, t_min: 0.0, t_max: f32::INFINITY }
            })
            .collect();
        assert_eq!(assert_as_binary(&mesh, (&binary, &wide), &rays, true), [0]);
    }
}

/// Far from the origin, tiny and huge: where slacks are all that is left, or numbers run out.
#[test]
fn scenes_of_any_scale_and_place() {
    for (scale, offset) in [
        (1.0, Vec3::new(148_376.0, 1234.0, -223_423.0)),
        (1e-3, Vec3::splat(1e6)),
        (1e-12, Vec3::ZERO),
        (1e-30, Vec3::ZERO),
        (1e-37, Vec3::ZERO),
        (1e12, Vec3::ZERO),
        (1e25, Vec3::splat(1e26)),
        (1e37, Vec3::ZERO),
    ] {
        let mut random = Random::new(0x5ca1e);
        let mesh = random.mesh(1500);
        let rays: Vec<_> = rays(&mut random, &mesh, 1200)
            .into_iter()
            .map(|ray| Ray {
                origin: ray.origin * scale + offset,
                direction: ray.direction * scale,
                ..ray
            })
            .collect();
        let moved = mesh.vertices().iter().map(|v| *v * scale + offset).collect();
        let mesh = TriangleMesh::new(moved, mesh.triangles().to_vec());
        let (binary, wide) = trees(&mesh, WideCosts::default());
        println!("scale {scale}, offset {offset}");
        assert_as_binary(&mesh, (&binary, &wide), &rays, true);
    }
}

#[test]
fn millions_of_rays_are_answered_alike_by_all_instructions_and_ways() {
    let mut random = Random::new(0x3111);
    let mesh = random.mesh(3000);
    let (_, wide) = trees(&mesh, WideCosts::default());
    let mut hits = 0;
    for _ in 0..250 {
        let rays = rays(&mut random, &mesh, 5000);
        for mode in [Mode::Fast, Mode::Exact] {
            let query = Query {
                structure: Structure::Tree(&wide),
                mesh: &mesh,
                way: Way::Stream,
                mode,
                entry: &Entry::WHOLE,
                stratum: Some(0),
            };
            let expected = answers(Instructions::PORTABLE, &query, &rays);
            for set in Instructions::all() {
                for way in [Way::Single, Way::Stream] {
                    let query = Query { way, ..query };
                    assert_eq!(answers(set, &query, &rays), expected, "{set:?} {mode:?} {way:?}");
                }
            }
            hits += expected.iter().map(|word| word.count_ones()).sum::<u32>();
        }
    }
    assert!(hits > 500_000, "{hits} hits");
}

/// A wall with gaps behind small triangles: most rays stop at few triangles, which learn and forget.
#[test]
fn what_stops_single_rays_is_tried_first_where_it_pays() {
    let mut random = Random::new(0x5176);
    let corner = |x: f32, y: f32| Vec3::new(x, y, -5.0);
    let mut vertices: Vec<Vec3> = Vec::new();
    for i in 0..6 {
        let x = 2.0 * i as f32 - 6.0;
        vertices.extend([corner(x, -9.0), corner(x + 1.9, -9.0), corner(x + 1.0, 20.0)]);
    }
    for _ in 0..200 {
        let a = random.point();
        vertices.extend([a, a + Vec3::X * 0.01, a + Vec3::Y * 0.01]);
    }
    let triangles = (0..vertices.len() as u32 / 3).map(|t| [0, 1, 2].map(|k| 3 * t + k));
    let mesh = TriangleMesh::new(vertices, triangles.collect());
    let (binary, wide) = trees(&mesh, WideCosts::default());
    let towards = |random: &mut Random, down: bool| -> Ray {
        let direction = Vec3::new(0.1 * random.unit(), 0.1 * random.unit(), -1.0);
        let direction = if down { direction } else { -direction };
        Ray { direction, ..Ray::new(random.point(), Vec3::Z, 100.0) }
    };
    for down in [true, false, true] {
        let rays: Vec<Ray> = (0..2000).map(|_| towards(&mut random, down)).collect();
        let expected: Vec<bool> = rays
            .iter()
            .map(|ray| single::any_hit(&binary, binary.root, &Plan::Near, Fast, ray, &mut NoCount))
            .collect();
        let hits = expected.iter().filter(|hit| **hit).count() as u64;
        for (set, stratum) in
            Instructions::all().into_iter().flat_map(|set| [(set, Some(2)), (set, None)])
        {
            let query = Query {
                structure: Structure::Tree(&wide),
                mesh: &mesh,
                way: Way::Automatic,
                mode: Mode::Fast,
                entry: &Entry::WHOLE,
                stratum,
            };
            let mut scratch = Scratch::default();
            let mut early = 0;
            // A call for each ray.
            for (ray, expected) in rays.iter().zip(&expected) {
                let mut occluded = [0];
                early += any_hit(set, &query, &[*ray], &mut occluded, &mut scratch);
                assert_eq!(occluded[0] != 0, *expected, "{} {ray:?}", set.name());
            }
            println!("{} {stratum:?}: {early} of {hits} rays early", set.name());
            assert!(stratum.is_some() || early == 0);
            assert!(stratum.is_none() || !down || early * 2 > hits, "{early} of {hits}");
            assert!(early <= hits);
        }
    }
}

use super::*;
use crate::order;
use crate::ray::{Ray, words_for};
use crate::scene::{Motion, Object};
use crate::test_random::Random;
use crate::trace::shaft::Entry;
use crate::trace::wide::{Instructions, Query, Scratch, Structure, Way, any_hit, closest_hit};
use glam::{Quat, Vec3};

fn score() -> ScoreAtSplit {
    order::find("node-sato").unwrap().at_split.unwrap()
}

fn answers(parts: &Parts, rays: &[Ray]) -> Vec<u64> {
    let query = Query {
        structure: Structure::TwoLevel(parts),
        mesh: parts.mesh(),
        way: Way::Automatic,
        mode: crate::intersect::Mode::Exact,
        entry: &Entry::WHOLE,
        stratum: Some(0),
    };
    let mut occluded = vec![0; words_for(rays.len())];
    any_hit(Instructions::detect(), &query, rays, &mut occluded, &mut Scratch::default());
    occluded
}

/// Any hit and closest hits, against a tree that is built anew.
fn assert_as_fresh(parts: &Parts, rays: &[Ray], what: &str) {
    let fresh = Parts::new(Arc::clone(parts.mesh()), score());
    assert_eq!(answers(parts, rays), answers(&fresh, rays), "{what}");
    let mesh = parts.mesh();
    let ids: Vec<u32> = (0..mesh.len() as u32).collect();
    let whole: Vec<_> = ids.chunks(crate::build::MOST_SMALL).collect();
    assert!(whole.len() <= 1, "one tree is enough to compare with");
    let tree = small_tree(mesh, &ids, score());
    for ray in &rays[..rays.len().min(500)] {
        let set = Instructions::detect();
        let expected = closest_hit(set, Structure::Tree(&tree), mesh, ray);
        let found = closest_hit(set, Structure::TwoLevel(parts), mesh, ray);
        assert_eq!(found, expected, "{what}: {ray:?}");
    }
    assert_is_sound(parts, what);
}

/// Every part's box is that of its triangles, and each triangle is in one tree at most, in a leaf whose
/// numbers are its own.
fn assert_is_sound(parts: &Parts, what: &str) {
    let mut seen = vec![false; parts.mesh.len()];
    for part in &parts.parts {
        let ids = &parts.triangle_ids[part.triangles.clone()];
        let boxes = ids.iter().map(|&id| parts.mesh.triangle(id as usize).bounds());
        assert_eq!(part.bounds, boxes.fold(Aabb::EMPTY, Aabb::union), "{what}");
        for &id in ids {
            assert!(!std::mem::replace(&mut seen[id as usize], true), "{what}: {id} twice");
        }
        let Some(made) = part.tree.get() else { continue };
        // As a tree of a mesh that has these triangles alone.
        let mut own = made.tree.clone();
        let place = |id: u32| ids.iter().position(|&i| i == id).expect("of this part") as u32;
        own.triangle_ids.iter_mut().for_each(|id| *id = place(*id));
        let corners = ids.iter().flat_map(|&id| parts.mesh.triangle(id as usize).0).collect();
        let triangles = (0..ids.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(corners, triangles);
        own.validate(&mesh).unwrap_or_else(|fault| panic!("{what}: {fault}"));
    }
    assert!(seen.into_iter().all(|seen| seen), "{what}: a triangle is in no part");
}

#[test]
fn nothing_is_built_before_rays_come_and_little_for_few() {
    let mut random = Random::new(91);
    let parts = Parts::new(Arc::new(random.mesh(50_000)), score());
    assert_eq!(parts.visited().parts_ready, 0);
    let corner = Ray::new(Vec3::splat(-5.0), Vec3::new(0.1, 0.2, 1.0), 3.0);
    answers(&parts, &[corner; 9]);
    let visited = parts.visited();
    assert!(visited.parts > 500 && visited.parts_ready * 10 < visited.parts, "{visited:?}");
    assert_eq!(visited.built, visited.parts_ready);
    assert_is_sound(&parts, "few rays");
}

/// Many threads ask for the same parts at the same time, within rayon's work as without: nobody waits
/// for himself, and each part is built once.
#[test]
fn threads_share_parts_without_building_any_twice() {
    let mut random = Random::new(92);
    let mesh = Arc::new(random.mesh(4000));
    let rays: Vec<_> = (0..4000).map(|_| random.ray()).collect();
    let expected = answers(&Parts::new(Arc::clone(&mesh), score()), &rays);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    for round in 0..20 {
        let parts = Parts::new(Arc::clone(&mesh), score());
        let all: Vec<Vec<u64>> =
            pool.install(|| (0..16).into_par_iter().map(|_| answers(&parts, &rays)).collect());
        assert!(all.iter().all(|answers| *answers == expected), "round {round}");
        let visited = parts.visited();
        assert_eq!(visited.built, visited.parts_ready, "round {round}");
    }
}

#[test]
fn parts_follow_what_moves() {
    let mut random = Random::new(93);
    for count in [1, 100, 3000] {
        for with_still in [false, true] {
            let mesh = Arc::new(random.mesh(count));
            let half = count / 2;
            let object = |triangles: Range<usize>, moves: bool| Object {
                vertices: 3 * triangles.start..3 * triangles.end,
                triangles,
                moves,
            };
            let objects = vec![object(0..half, false), object(half..count, true)];
            let motion = Motion { frames: 9, objects, poses: Vec::new() };
            let still = |mesh: &TriangleMesh, ids: &[u32]| {
                with_still.then(|| small_tree(mesh, ids, score()))
            };
            let mut parts = Parts::moving(Arc::clone(&mesh), Some(&motion), still, score());
            let mut cut_anew = 0;
            for frame in 0..9 {
                let what = format!("{count} triangles, still {with_still}, frame {frame}");
                let turn = Quat::from_rotation_y(frame as f32 * 0.2);
                let moved = mesh.moved(|vertices| {
                    for (index, vertex) in vertices.iter_mut().enumerate().skip(3 * half) {
                        *vertex = match frame {
                            // Rigid, deformed, flown apart, and all in one place.
                            0..3 => turn * *vertex + Vec3::X * frame as f32,
                            3..5 => *vertex * (1.0 + vertex.y * 0.1 * frame as f32),
                            5..7 => *vertex + random.point() * frame as f32,
                            7 => Vec3::ONE,
                            _ => *vertex * 1e6 + index as f32,
                        };
                    }
                });
                cut_anew += usize::from(parts.follow(Arc::new(moved)));
                let rays: Vec<_> = (0..2000).map(|_| random.ray()).collect();
                assert_as_fresh(&parts, &rays, &what);
            }
            assert!(count < 3000 || cut_anew > 0);
        }
    }
}

/// Trees are brought up to date while that keeps them good, and built anew where not.
#[test]
fn trees_are_kept_while_they_are_good() {
    let mut random = Random::new(94);
    let mesh = Arc::new(random.mesh(3000));
    let rays: Vec<_> = (0..2000).map(|_| random.ray()).collect();
    let mut parts = Parts::moving(Arc::clone(&mesh), None, |_, _| None, score());
    answers(&parts, &rays);
    parts.follow(Arc::new(mesh.moved(|all| all.iter_mut().for_each(|v| *v *= 1.01))));
    answers(&parts, &rays);
    let kept = parts.visited();
    assert!(kept.refitted > 20 && kept.built * 20 < kept.refitted, "{kept:?}");
    let shaken = mesh.moved(|all| all.iter_mut().for_each(|v| *v += random.point() * 0.02));
    parts.follow(Arc::new(shaken));
    answers(&parts, &rays);
    let shaken = parts.visited();
    assert!(shaken.refitted + shaken.built > 20, "{shaken:?}");
    let scattered = mesh.moved(|all| all.iter_mut().for_each(|v| *v = random.point()));
    assert!(parts.follow(Arc::new(scattered)), "parts are as large as the scene");
}

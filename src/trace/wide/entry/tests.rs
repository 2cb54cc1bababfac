//! What a look leaves out is in nobody's way: of all triangles that any ray of a run hits none is missing.

use super::super::numbers::Target;
use super::super::octants::EntryPoint;
use super::super::simd::{Portable, Simd};
use super::super::stream::Triangles;
use super::super::{
    Instructions, NoCount, Query, Scratch, Set, Structure, VisitCounts, Way, any_hit,
    any_hit_counted,
};
use super::{RUN, look};
use crate::build::{self, WideCosts};
use crate::geometry::{TriangleMesh, Vec3};
use crate::intersect::{Exact, Fast, Mode, PreparedRay, TriangleTest, hits_exactly};
use crate::ray::{Ray, words_for};
use crate::test_random::Random;
use crate::trace::shaft::{Entry, Gate};
use crate::trace::single;
use crate::tree::{Bvh2, Bvh8, ChildRef, Node8, Plan};

/// Rays that have something in common: from about one place to about another, as long as that takes or as far as
/// it goes, now and then from far out, or starting and ending on corners of the mesh.
fn alike(random: &mut Random, mesh: &TriangleMesh, count: usize) -> Vec<Ray> {
    let kind = random.bits() % 8;
    let (mut from, to) = (random.point(), random.point());
    if kind == 0 {
        from = from * 300.0 + 1000.0;
    }
    let mut size = || 10f32.powf(-4.0 * random.unit());
    let (from_size, to_size) = (size(), size());
    let sun = random.point().normalize_or(Vec3::X);
    let scale = [1.0, 1.0, 1e-3, 1e4][random.bits() as usize % 4];
    let around = |random: &mut Random, center: Vec3, size: f32| {
        let vertices = mesh.vertices();
        if kind == 1 && random.bits().is_multiple_of(2) {
            return vertices[random.bits() as usize % 16.min(vertices.len())];
        }
        center + (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5) * size
    };
    (0..count)
        .map(|_| {
            let origin = around(random, from, from_size);
            let end = around(random, to, to_size);
            let direction = (end - origin) * scale;
            let t_max = 1.0 / scale;
            match kind {
                2 => Ray::new(origin, around(random, sun, 0.01), f32::INFINITY),
                3 => Ray { t_min: t_max * 0.25, ..Ray::new(origin, direction, t_max) },
                4 => Ray { t_min: -t_max, ..Ray::new(origin, direction, t_max * random.unit()) },
                5 => Ray::new(origin, random.point(), random.unit() * 0.5),
                6 if random.bits().is_multiple_of(8) => {
                    Ray::new(origin, direction * f32::NAN, t_max)
                }
                _ => Ray::new(origin, direction, t_max),
            }
        })
        .collect()
}

fn trees(mesh: &TriangleMesh) -> (Bvh2, Bvh8) {
    let binary = (build::find("binned").unwrap().build)(mesh, build::Leaves::Wide);
    let costs = WideCosts { leaf: 0.3, triangle: 1.0 };
    let wide = build::collapse(&binary, costs, |node, side| (node % 7 + side) as f64);
    (binary, wide)
}

fn is_hit(
    mesh: &TriangleMesh,
    bounds: &crate::geometry::Aabb,
    ray: &Ray,
    id: usize,
    mode: Mode,
) -> bool {
    // Nobody asks of rays that hit nothing by definition.
    let Some(prepared) = PreparedRay::new(ray, bounds) else { return false };
    let triangle = mesh.triangle(id);
    match mode {
        Mode::Exact => hits_exactly(ray, &triangle).0,
        Mode::Fast => prepared.triangle(&triangle).is_some(),
    }
}

/// Marks all triangles below.
fn mark(tree: &Bvh8, child: ChildRef, marks: &mut [bool]) {
    if child.is_leaf() {
        tree.triangle_ids[child.leaf_slots()].iter().for_each(|&id| marks[id as usize] = true);
    } else {
        let node = &tree.nodes[child.node_index()];
        mark_below(tree, node, marks);
    }
}

/// Marks all triangles below the children of a node.
fn mark_below(tree: &Bvh8, node: &Node8, marks: &mut [bool]) {
    node.children[..node.len as usize].iter().for_each(|child| mark(tree, *child, marks));
}

/// Which triangles a look leaves to be met by rays that start at a node or the root.
fn left<S: Simd>(
    s: S,
    tree: &Bvh8,
    given: Option<&Node8>,
    rays: &[Ray],
    target: Target<'_>,
) -> (EntryPoint, Vec<bool>) {
    let places: Vec<u16> = (0..rays.len() as u16).collect();
    let mut entries: Vec<Node8> = Vec::new();
    let trees = Triangles { tree, number: 0 };
    let start =
        s.run(|| look(s, trees, given, rays, &places, target, &mut Gate::default(), &mut entries));
    let mut marks = vec![start == EntryPoint::Whole; target.mesh.len()];
    if let EntryPoint::From(index) = start {
        mark_below(tree, &entries[index], &mut marks);
    }
    (start, marks)
}

#[test]
fn no_hit_is_left_out() {
    let mut random = Random::new(0x4011);
    let (mut starts, mut hits) = ([0; 3], 0);
    for round in 0..1600 {
        let count = 3 + random.bits() as usize % 300;
        let mesh = random.mesh(count);
        let (_, tree) = trees(&mesh);
        let rays = alike(&mut random, &mesh, 128 + round % 9);
        let node = random.bits() as usize % tree.nodes.len().max(1);
        let given = tree.nodes.get(node).filter(|_| round % 3 == 0);
        let mut wanted = vec![given.is_none(); mesh.len()];
        given.iter().for_each(|node| mark_below(&tree, node, &mut wanted));
        for mode in [Mode::Exact, Mode::Fast] {
            let target = Target { bounds: &tree.bounds, mesh: &mesh, mode };
            let hit: Vec<bool> = (0..mesh.len())
                .map(|id| {
                    let mut rays = rays.iter();
                    wanted[id] && rays.any(|ray| is_hit(&mesh, &tree.bounds, ray, id, mode))
                })
                .collect();
            hits += hit.iter().filter(|hit| **hit).count();
            for set in Instructions::all() {
                let (start, marks) = match set.0 {
                    Set::Portable => left(Portable, &tree, given, &rays, target),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx2(avx2) | Set::Avx512(avx2, _) => {
                        left(avx2, &tree, given, &rays, target)
                    }
                };
                starts[match start {
                    EntryPoint::Whole => 0,
                    EntryPoint::From(_) => 1,
                    EntryPoint::Nowhere => 2,
                }] += 1;
                for (id, (hit, there)) in hit.iter().zip(&marks).enumerate() {
                    let name = set.name();
                    assert!(*there || !hit, "round {round}, {mode:?}, {name}: triangle {id}");
                }
            }
        }
    }
    println!("{hits} hits, {starts:?} looks");
    assert!(hits > 2000 && starts.iter().all(|&looks| looks > 200), "{hits} {starts:?}");
}

fn check<T: TriangleTest>(
    mesh: &TriangleMesh,
    (binary, wide): (&Bvh2, &Bvh8),
    rays: &[Ray],
    test: T,
) -> [usize; 2] {
    let expected: Vec<bool> = rays
        .iter()
        .map(|ray| single::any_hit(binary, binary.root, &Plan::Near, test, ray, &mut NoCount))
        .collect();
    let mut unvisited = 0;
    for set in Instructions::all() {
        let query = Query {
            structure: Structure::Tree(wide),
            mesh,
            way: Way::Automatic,
            mode: T::MODE,
            entry: &Entry::WHOLE,
            stratum: Some(0),
        };
        let mut scratch = Scratch::default();
        let mut occluded = vec![0; words_for(rays.len())];
        any_hit(set, &query, rays, &mut occluded, &mut scratch);
        for (index, (ray, expected)) in rays.iter().zip(&expected).enumerate() {
            let answer = occluded[index / 64] >> (index % 64) & 1 != 0;
            assert_eq!(answer, *expected, "{}: {ray:?}", set.name());
        }
        let mut counts = vec![VisitCounts::default(); rays.len()];
        let mut counted = vec![0; words_for(rays.len())];
        any_hit_counted(set, &query, rays, &mut counted, &mut scratch, &mut counts);
        assert_eq!(occluded, counted);
        unvisited += counts.iter().filter(|count| count.nodes == 0).count();
    }
    [expected.iter().filter(|hit| **hit).count(), unvisited]
}

#[test]
fn batches_are_answered_as_ray_by_ray() {
    let mut random = Random::new(0x4012);
    let mut seen = [0; 2];
    for _ in 0..120 {
        let count = 100 + random.bits() as usize % 3000;
        let mesh = random.mesh(count);
        let (binary, wide) = trees(&mesh);
        // Several octants, runs of all lengths, and what is left over of them.
        let mut rays = Vec::new();
        for _ in 0..1 + random.bits() % 4 {
            let count = random.bits() as usize % (2 * RUN);
            rays.extend(alike(&mut random, &mesh, 1 + count));
        }
        for [hits, unvisited] in [
            check(&mesh, (&binary, &wide), &rays, Exact),
            check(&mesh, (&binary, &wide), &rays, Fast),
        ] {
            seen[0] += hits;
            seen[1] += unvisited;
        }
    }
    println!("{seen:?} hits and rays without a visit");
    assert!(seen.iter().all(|&count| count > 5000), "{seen:?}");
}

use super::*;
use crate::build;
use crate::geometry::{TriangleMesh, Vec3};
use crate::intersect::{Exact, Fast};
use crate::test_random::Random;
use crate::trace::{NoCount, single};
use crate::tree::NodeBits;

fn tree(mesh: &TriangleMesh) -> Bvh2 {
    (build::find("binned").unwrap().build)(mesh, build::Leaves::Fit)
}

fn plans(tree: &Bvh2) -> [Plan; 3] {
    let some = NodeBits::from_fn(tree.nodes.len(), |i| i % 3 == 1);
    [Plan::Fixed(some), Plan::Near, Plan::Far]
}

fn assert_as_single(tree: &Bvh2, rays: &[Ray]) -> u64 {
    assert_mode_as_single(tree, rays, Exact);
    assert_mode_as_single(tree, rays, Fast)
}

fn assert_mode_as_single<T: TriangleTest>(tree: &Bvh2, rays: &[Ray], test: T) -> u64 {
    let expected = |plan: &Plan| {
        let hits =
            rays.iter().map(|ray| single::any_hit(tree, tree.root, plan, test, ray, &mut NoCount));
        hits.enumerate().fold(0, |mask, (i, hit)| mask | u64::from(hit) << i)
    };
    let plans = plans(tree);
    for plan in &plans {
        let expected = expected(plan);
        assert_eq!(any_hit(tree, plan, test, rays, NoCount), expected, "{plan:?} {rays:?}");
        let mut counts = vec![VisitCounts::default(); rays.len()];
        assert_eq!(any_hit(tree, plan, test, rays, counts.as_mut_slice()), expected, "{plan:?}");
        assert!((0..rays.len()).all(|i| expected >> i & 1 == 0 || counts[i].triangles > 0));
    }
    expected(&plans[0])
}

/// A tile's rays towards a light: similar directions, or towards all sides if `spread` is large.
fn tile(random: &mut Random, count: usize, spread: f32) -> Vec<Ray> {
    let (eye, target) = (random.point() * 2.0, random.point());
    let ray = |_| {
        let origin = eye + random.point() * 0.02;
        Ray::new(origin, target + random.point() * spread - origin, 1.0)
    };
    (0..count).map(ray).collect()
}

#[test]
fn packets_of_every_size_answer_as_single_rays_do() {
    let mut random = Random::new(0xaced);
    let (mut hits, mut rays_in_all) = (0, 0);
    for round in 0..600 {
        let mesh = random.mesh([1, 4, 60, 1000, 4000][round % 5]);
        let tree = tree(&mesh);
        for count in [1 + round % PACKET_SIZE, 1 + (random.bits() % 64) as usize, 64] {
            let spread = [0.05, 0.5, 4.0][(random.bits() % 3) as usize];
            let mut rays = tile(&mut random, count, spread);
            for ray in &mut rays {
                match random.bits() % 24 {
                    0 => ray.direction = Vec3::ZERO,
                    1 => ray.direction[(random.bits() % 3) as usize] = 0.0,
                    2 => ray.direction[(random.bits() % 3) as usize] = -0.0,
                    3 => ray.direction = -ray.direction,
                    4 => ray.t_max = f32::NAN,
                    5 => ray.t_max = f32::INFINITY,
                    6 => (ray.t_min, ray.t_max) = (f32::NEG_INFINITY, f32::INFINITY),
                    7 => (ray.t_min, ray.t_max) = (f32::INFINITY, f32::INFINITY),
                    8 => ray.origin[(random.bits() % 3) as usize] = f32::INFINITY,
                    9 => ray.direction *= 1e-30,
                    10 => *ray = random.ray(),
                    _ => {}
                }
            }
            hits += assert_as_single(&tree, &rays).count_ones() as usize;
            rays_in_all += count;
        }
    }
    let share = hits as f64 / rays_in_all as f64;
    assert!((0.05..0.9).contains(&share), "{share} of the rays hit");
}

#[test]
fn no_rays_and_no_triangles() {
    let mut random = Random::new(3);
    let rays = tile(&mut random, 64, 1.0);
    assert_eq!(assert_as_single(&tree(&TriangleMesh::default()), &rays), 0);
    assert_eq!(assert_as_single(&tree(&random.mesh(10)), &[]), 0);
}

/// Without hits an order decides nothing: it only says which subtree comes first.
#[test]
fn packets_that_nothing_stops_visit_the_same_nodes_under_every_plan() {
    let mut random = Random::new(0x0be7);
    let mut open = 0;
    for _ in 0..400 {
        let tree = tree(&random.mesh(300));
        let mut rays = tile(&mut random, 64, 0.2);
        rays.iter_mut().for_each(|ray| ray.t_max = 0.3);
        let counts = |plan| {
            let mut counts = vec![VisitCounts::default(); rays.len()];
            (any_hit(&tree, plan, Exact, &rays, counts.as_mut_slice()), counts)
        };
        let plans = plans(&tree);
        let (hits, expected) = counts(&plans[0]);
        if hits == 0 {
            open += usize::from(expected[0].nodes > 3);
            for plan in &plans[1..] {
                assert_eq!(counts(plan), (0, expected.clone()), "{plan:?}");
            }
        }
    }
    assert!(open > 50, "{open} packets pass");
}

//! The kd-tree against the binary tree: rays where planes are, and many of them.

mod common;

use common::random::Random;
use common::{built, occluded, scene_of};
use sato::build::kd_sah::{Splits, build};
use sato::geometry::{TriangleMesh, Vec3};
use sato::intersect::Exact;
use sato::order::{OrderContext, kd};
use sato::ray::{Ray, VisitCounts, bit};
use sato::trace;
use sato::tree::{KdTree, NodeBits, Plan};

/// Any-hit under all plans and closest hits of kd-trees, against the binary tree.
fn assert_agreement(what: &str, mesh: TriangleMesh, rays: &[Ray]) {
    let trees = [Splits::Perfect, Splits::Boxes].map(|s| (s, build(&mesh, s).unwrap()));
    let bvh2 = built(&"bvh2".parse().unwrap(), &scene_of(mesh));
    let expected = occluded(&*bvh2, rays);
    for (splits, tree) in &trees {
        let some = NodeBits::from_fn(tree.nodes.len(), |i| i % 3 == 1);
        let plans = [Plan::Fixed(some), Plan::Near, Plan::Far];
        for (index, ray) in rays.iter().enumerate() {
            let mut counts = VisitCounts::default();
            let plan = &plans[index % 3];
            let blocked = trace::kd::any_hit(tree, plan, Exact, ray, &mut counts);
            assert_eq!(blocked, bit(&expected, index), "{what}, {splits:?}, {plan:?}: {ray:?}");
            if index % 4 == 0 {
                let hit = trace::kd::closest_hit(tree, ray);
                assert_eq!(hit, bvh2.closest_hit(ray), "{what}, {splits:?}: {ray:?}");
            }
        }
    }
}

#[test]
fn a_million_rays() {
    let mut random = Random::new(61);
    let mesh = random.mesh(5000);
    let rays: Vec<_> = (0..500_000).map(|_| random.ray()).collect();
    assert_agreement("random", mesh, &rays);
}

/// Origins on planes, directions in planes, and both zeros.
#[test]
fn rays_in_split_planes() {
    let mut random = Random::new(62);
    let mesh = random.mesh(1500);
    let tree = build(&mesh, Splits::Perfect).unwrap();
    let planes: Vec<(usize, f32)> = inner_nodes(&tree).map(|n| (n.axis(), n.split())).collect();
    let rays: Vec<_> = (0..200_000)
        .map(|i| {
            let (axis, position) = planes[i % planes.len()];
            let mut ray = random.ray();
            ray.origin[axis] = position;
            match i % 5 {
                0 => {}
                1 => ray.direction[axis] = 0.0,
                2 => ray.direction[axis] = -0.0,
                // All but in the plane.
                3 => ray.direction[axis] = f32::from_bits(1 + (i % 7) as u32),
                _ => {
                    let other = planes[(i * 31) % planes.len()];
                    ray.origin[other.0] = other.1;
                    ray.direction = Vec3::splat(-0.0);
                    ray.direction[(axis + 1) % 3] = if i % 2 == 0 { 1.0 } else { -1.0 };
                }
            }
            if ray.direction == Vec3::ZERO {
                ray.direction = Vec3::X;
            }
            ray
        })
        .collect();
    assert_agreement("planes", mesh, &rays);
}

fn inner_nodes(tree: &KdTree) -> impl Iterator<Item = &sato::tree::KdNode> {
    tree.nodes.iter().filter(|n| !n.is_leaf())
}

/// A room of axis-aligned walls with boxes in it: everything lies in planes.
#[test]
fn rays_among_walls() {
    let mut random = Random::new(63);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..200u32 {
        let axis = (i % 3) as usize;
        let (low, mut high) = (random.point().round(), random.point().round());
        high[axis] = low[axis];
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |x: f32, y: f32| {
            let mut p = low;
            (p[u], p[v]) = (x, y);
            p
        };
        let first = vertices.len() as u32;
        vertices.extend([low, corner(high[u], low[v]), high, corner(low[u], high[v])]);
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    let mesh = TriangleMesh::new(vertices, triangles);
    let rays: Vec<_> = (0..100_000)
        .map(|i| {
            let mut ray = random.ray();
            if i % 2 == 0 {
                ray.origin = ray.origin.round();
            }
            ray
        })
        .collect();
    assert_agreement("walls", mesh, &rays);
}

/// Rays in the planes of triangles, up to rounding, through them and beside them: where the triangle
/// test and the distance from the plane need not know of the same point.
#[test]
fn rays_in_the_planes_of_triangles() {
    let mut random = Random::new(66);
    for count in [40, 400, 4000] {
        let mesh = random.mesh(count);
        let rays: Vec<_> = (0..100_000)
            .map(|i| {
                let [a, b, c] = mesh.triangle(i % mesh.len()).0;
                let mut weight = || random.unit() * 6.0 - 2.0;
                let mut point = || a + (b - a) * weight() + (c - a) * weight();
                let (origin, target) = (point(), point());
                Ray::new(origin, target - origin, f32::INFINITY)
            })
            .collect();
        assert_agreement(&format!("{count} planes"), mesh, &rays);
    }
}

#[test]
fn tiny_and_huge_scenes() {
    for exponent in [-140, -100, -40, 40, 100, 120] {
        let scale = f64::from(exponent).exp2() as f32;
        let mut random = Random::new(64);
        let mesh = random.mesh(300);
        let moved = mesh.vertices().iter().map(|v| *v * scale).collect();
        let rays: Vec<_> = (0..20_000)
            .map(|_| {
                let ray = random.ray();
                Ray { origin: ray.origin * scale, direction: ray.direction * scale, ..ray }
            })
            .collect();
        let mesh = TriangleMesh::new(moved, mesh.triangles().to_vec());
        assert_agreement(&format!("2^{exponent}"), mesh, &rays);
    }
}

/// An order cannot help a ray that nothing stops, and cannot change an answer.
#[test]
fn every_order_visits_the_same_cells_of_an_open_ray() {
    let mut random = Random::new(65);
    let mesh = random.mesh(2000);
    let rays: Vec<_> = (0..5000).map(|_| random.ray()).collect();
    let tree = build(&mesh, Splits::Perfect).unwrap();
    let trace_all = |plan: &Plan| -> Vec<_> {
        rays.iter()
            .map(|ray| {
                let mut counts = VisitCounts::default();
                let blocked = trace::kd::any_hit(&tree, plan, Exact, ray, &mut counts);
                (blocked, if blocked { VisitCounts::default() } else { counts })
            })
            .collect()
    };
    let near = trace_all(&Plan::Near);
    let context = OrderContext { seed: 3, ..OrderContext::new(&mesh) };
    let orders: [fn(&KdTree, &OrderContext<'_>) -> Plan; 5] =
        [kd::prim_num, kd::prim_num_most, kd::prim_sato_average, kd::prim_sato_max, kd::rtsah];
    for (index, order) in orders.iter().enumerate() {
        let plan = order(&tree, &context);
        assert!(trace_all(&plan) == near, "order {index}");
    }
}

//! Exact mode against the arbiter on arbitrary numbers: the scalar test, and every kernel on scenes of
//! a few triangles. `tests/stress.rs` has the cases that are known to be hard.

mod common;

use common::{built, occluded, scene_of};
use proptest::prelude::*;
use sato::arbiter::{exact_hits, is_ray};
use sato::backend::BackendSpec;
use sato::geometry::{Triangle, TriangleMesh, Vec3};
use sato::intersect::PreparedRay;
use sato::ray::{Ray, bit};

/// As large as coordinates of scenes may be.
const LARGEST: f32 = 1e18;

/// Whole numbers that often meet, or any bits.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (-4i8..=4).prop_map(f32::from),
        2 => (-4i8..=4).prop_map(|n| f32::from(n) * 0.1),
        2 => -1f32..1.0,
        1 => any::<u32>().prop_map(f32::from_bits),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    (number(), number(), number()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn corner() -> impl Strategy<Value = Vec3> {
    let in_range = |v: &Vec3| v.is_finite() && v.abs().max_element() <= LARGEST;
    vector().prop_filter("a scene's coordinates", in_range)
}

fn triangle() -> impl Strategy<Value = Triangle> {
    (corner(), corner(), corner()).prop_map(|(a, b, c)| Triangle([a, b, c]))
}

/// Anything, or aimed at a point of `triangle` as far as rounding allows.
fn ray_near(triangle: Triangle) -> impl Strategy<Value = Ray> {
    let end = || prop_oneof![number(), Just(0.0), Just(1.0), Just(f32::INFINITY)];
    (vector(), vector(), end(), end(), 0u8..4, 0u8..4).prop_map(
        move |(origin, direction, t_min, t_max, aim, corner)| {
            let [a, b, c] = triangle.0;
            let target = match corner {
                0 => a,
                1 => (a + b) * 0.5,
                2 => (a + b + c) / 3.0,
                _ => c,
            };
            let direction = if aim == 0 { direction } else { target - origin };
            Ray { origin, t_min, direction, t_max }
        },
    )
}

fn truth(ray: &Ray, triangles: &[Triangle]) -> bool {
    is_ray(ray) && triangles.iter().any(|triangle| exact_hits(ray, triangle))
}

fn mesh_of(triangles: &[Triangle]) -> TriangleMesh {
    let vertices = triangles.iter().flat_map(|t| t.0).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(vertices, indices)
}

fn kernels() -> Vec<BackendSpec> {
    ["brute", "bvh2", "bvh2:trace=packet", "bvh2:builder=spatial", "kd", "kd:splits=boxes", "bvh8"]
        .into_iter()
        .chain(["bvh8:trace=single", "bvh8:trace=stream"])
        .map(|spec| spec.parse().unwrap())
        .collect()
}

/// A triangle whose area rounds to none in `f64`: the products of its edges differ by `2^-54`.
#[test]
fn area_that_rounding_hides_is_there() {
    let last = 1.0 - 1.0 / (1u32 << 24) as f32;
    let corners = [
        Vec3::new(1.0 / (1u32 << 30) as f32, 0.0, 0.0),
        Vec3::ONE.with_z(0.0),
        Vec3::new(last, last, 0.0),
    ];
    let triangle = Triangle(corners);
    let scene = scene_of(mesh_of(&[triangle; 3]));
    let rays = corners.map(|corner| Ray::new(corner + Vec3::Z, -Vec3::Z, 2.0));
    assert!(rays.iter().all(|ray| truth(ray, &[triangle])));
    for spec in kernels() {
        assert_eq!(occluded(&*built(&spec, &scene), &rays), [0b111], "{spec}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100_000))]

    #[test]
    fn the_scalar_test_is_never_wrong(
        (triangle, ray) in triangle().prop_flat_map(|t| (Just(t), ray_near(t))),
    ) {
        let prepared = PreparedRay::new(&ray, &triangle.bounds());
        let hit = prepared.is_some_and(|ray| ray.hits_exactly(&triangle).0);
        prop_assert_eq!(hit, truth(&ray, &[triangle]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn no_kernel_is_ever_wrong(
        (triangles, rays) in prop::collection::vec(triangle(), 1..12).prop_flat_map(|triangles| {
            let last = triangles[triangles.len() - 1];
            let rays = prop_oneof![ray_near(triangles[0]), ray_near(last)];
            (Just(triangles), prop::collection::vec(rays, 1..40))
        }),
    ) {
        let scene = scene_of(mesh_of(&triangles));
        let expected: Vec<bool> = rays.iter().map(|ray| truth(ray, &triangles)).collect();
        for spec in kernels() {
            let answers = occluded(&*built(&spec, &scene), &rays);
            for (index, ray) in rays.iter().enumerate() {
                prop_assert_eq!(bit(&answers, index), expected[index], "{}: {:?}", spec, ray);
            }
        }
    }
}

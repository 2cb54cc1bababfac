use super::*;
use crate::test_random::Random;

fn unit_triangle() -> Triangle {
    Triangle([Vec3::ZERO, Vec3::X, Vec3::Y])
}

fn bounds() -> Aabb {
    Aabb { min: Vec3::splat(-4.0), max: Vec3::splat(4.0) }
}

fn t_of(ray: Ray, triangle: &Triangle) -> Option<f32> {
    let prepared = PreparedRay::new(&ray, &bounds().union(triangle.bounds()))?;
    prepared.triangle(triangle).map(|t| prepared.hit(t, 0).t)
}

fn down(x: f32, y: f32) -> Ray {
    Ray::new(Vec3::new(x, y, 1.0), Vec3::new(0.0, 0.0, -1.0), f32::INFINITY)
}

#[test]
fn the_triangle_is_closed_and_two_sided() {
    for (x, y) in [(0.25, 0.25), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)] {
        assert_eq!(t_of(down(x, y), &unit_triangle()), Some(1.0), "({x}, {y})");
        let [a, b, c] = unit_triangle().0;
        assert_eq!(t_of(down(x, y), &Triangle([a, c, b])), Some(1.0), "({x}, {y}) behind");
    }
    for (x, y) in [(-0.01, 0.5), (0.6, 0.6), (0.5, -0.01)] {
        assert_eq!(t_of(down(x, y), &unit_triangle()), None, "({x}, {y})");
    }
}

#[test]
fn the_interval_is_closed() {
    let hits =
        |t_min, t_max| t_of(Ray { t_min, t_max, ..down(0.25, 0.25) }, &unit_triangle()).is_some();
    assert!(hits(0.0, 1.0) && hits(1.0, 1.0) && hits(1.0, 2.0));
    assert!(!hits(0.0, 1.0f32.next_down()) && !hits(1.0f32.next_up(), 2.0));
    assert!(!hits(2.0, 1.0) && !hits(f32::NAN, 2.0) && !hits(0.0, f32::NAN));
}

#[test]
fn rays_that_hit_nothing_by_definition() {
    let good = down(0.25, 0.25);
    for direction in [Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::new(0.0, 0.0, f32::NEG_INFINITY)] {
        assert_eq!(t_of(Ray { direction, ..good }, &unit_triangle()), None);
    }
    let origin = Vec3::new(f32::INFINITY, 0.0, 0.0);
    assert_eq!(t_of(Ray { origin, ..good }, &unit_triangle()), None);
    // In the plane, and a triangle that is a line.
    let in_plane = Ray::new(Vec3::new(-1.0, 0.2, 0.0), Vec3::X, f32::INFINITY);
    assert_eq!(t_of(in_plane, &unit_triangle()), None);
    let line = Triangle([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]);
    assert_eq!(t_of(down(0.5, 0.0), &line), None);
}

#[test]
fn the_length_of_the_direction_does_not_matter() {
    for exponent in [-149, -140, -126, -100, -41, -40, 0, 40, 41, 100, 127] {
        let length = (f64::from(exponent)).exp2() as f32;
        let ray = Ray { direction: Vec3::new(0.0, 0.0, -length), ..down(0.25, 0.25) };
        let hit = t_of(ray, &unit_triangle());
        assert!(hit.is_some(), "2^{exponent}");
        if exponent > -127 && exponent < 127 {
            assert_eq!(hit, Some(1.0 / length), "2^{exponent}");
        }
    }
}

#[test]
fn signed_zeros_and_origins_on_box_planes() {
    let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    for zero in [0.0, -0.0] {
        for start in [0.0, 1.0] {
            let ray =
                Ray::new(Vec3::new(start, 0.5, -1.0), Vec3::new(zero, zero, 1.0), f32::INFINITY);
            let prepared = PreparedRay::new(&ray, &bounds).unwrap();
            assert!(prepared.enter(&bounds).is_some(), "{zero:?} {start}");
        }
    }
}

#[test]
fn a_larger_box_is_met_whenever_a_smaller_one_is() {
    let mut random = Random::new(0x5a70);
    for _ in 0..200_000 {
        let ray = random.ray();
        let inner = Aabb::of_points([random.point(), random.point()]);
        let outer = inner.with_point(random.point());
        let prepared = PreparedRay::new(&ray, &bounds()).unwrap();
        if let Some(entry) = prepared.enter(&inner) {
            let outer_entry = prepared.enter(&outer);
            assert!(outer_entry.is_some_and(|o| o <= entry), "{ray:?} {inner:?} {outer:?}");
        }
    }
}

/// Triangles near the origin and far from it, of every shape, with rays aimed at their edges, where
/// it is close.
fn aimed_at_edges(rounds: usize, mut check: impl FnMut(Ray, Triangle, Aabb)) {
    let mut random = Random::new(0x10ca1);
    for round in 0..rounds {
        let offset = if round % 2 == 0 { Vec3::ZERO } else { Vec3::new(1e5, -3e4, 7e3) };
        let mut triangle = Triangle([0; 3].map(|_| random.point() + offset));
        if round % 3 == 0 {
            // A needle.
            triangle.0[2] = triangle.0[0].lerp(triangle.0[1], random.unit()) + Vec3::splat(1e-6);
        }
        let [a, b, c] = triangle.0;
        let target = a.lerp(b, random.unit());
        let origin = match round % 5 {
            // In the triangle's plane but for rounding, in the triangle or beside it.
            0 => target + (c - a) * (random.unit() * 4.0 - 2.0),
            _ => random.point() + offset,
        };
        let ray =
            Ray { t_min: f32::NEG_INFINITY, ..Ray::new(origin, target - origin, f32::INFINITY) };
        let all = Aabb { min: bounds().min + offset, max: bounds().max + offset };
        check(ray, triangle, all.union(triangle.bounds()).with_point(origin));
    }
}

/// The padding is wide enough that the second condition of a hit does not reject what the first
/// accepts: no closed mesh springs a leak through it.
#[test]
fn the_box_does_not_reject_what_the_triangle_test_accepts() {
    let (mut accepted, mut outside) = (0, 0);
    aimed_at_edges(600_000, |ray, triangle, all| {
        let Some(prepared) = PreparedRay::new(&ray, &all) else { return };
        let Some(crossing) = watertight::plane_crossing(&ray, &triangle) else { return };
        if prepared.shear.passes_through(&triangle) {
            accepted += 1;
            outside += u32::from(crossing.inside.is_none());
            assert!(prepared.triangle(&triangle).is_some(), "{ray:?} {triangle:?}");
            // Even without the help of the exact point.
            let around = triangle.box_around(prepared.shear.passed_point(&triangle).unwrap());
            assert!(triangle.bounds().contains(&around), "{around:?} {triangle:?}");
            assert!(prepared.enter(&around).is_some(), "{ray:?} {triangle:?}");
        }
    });
    assert!(accepted > 150_000 && outside > 10_000, "{accepted}, {outside} outside");
}

/// Where the line passes through the triangle, and not just by its edge, the interval decides by the
/// distance of the plane alone, at any angle.
#[test]
fn the_box_does_not_cut_the_interval() {
    let mut tested = 0;
    aimed_at_edges(600_000, |ray, triangle, all| {
        let Some(crossing) = watertight::plane_crossing(&ray, &triangle) else { return };
        if crossing.inside.is_none() {
            return;
        }
        let t = crossing.t as f32;
        let ray = Ray { t_min: t.next_down(), t_max: t.next_up(), ..ray };
        let Some(prepared) = PreparedRay::new(&ray, &all) else { return };
        if prepared.shear.passes_through(&triangle) {
            tested += 1;
            assert_eq!(prepared.triangle(&triangle), Some(t + 0.0), "{ray:?} {triangle:?}");
        }
    });
    assert!(tested > 100_000, "{tested}");
}

#[test]
fn both_points_are_on_the_line() {
    let triangle = unit_triangle();
    for (x, y) in [(0.25, 0.5), (0.0, 0.0), (0.5, 0.5), (0.125, 0.0)] {
        let prepared = PreparedRay::new(&down(x, y), &bounds()).unwrap();
        let crossing = watertight::plane_crossing(&down(x, y), &triangle).unwrap();
        let point = Some(Vec3::new(x, y, 0.0).as_dvec3());
        assert_eq!((crossing.inside, prepared.shear.passed_point(&triangle)), (point, point));
    }
    assert!(watertight::plane_crossing(&down(0.6, 0.5), &triangle).unwrap().inside.is_none());
}

#[test]
fn eight_hits_at_once_are_those_of_one() {
    let mut random = Random::new(0x1a9e5);
    let (mut hits, mut asked) = (0, 0);
    for round in 0..40_000 {
        let scale = [1.0, 1e-3, 1e4, 1e-20, 1e15][round % 5];
        let offset = [0.0, 0.0, 1e3, 1e6][round % 4] * scale;
        let mut lanes = HitLanes::ZERO;
        let mut given = Vec::new();
        let mut scene = Aabb::EMPTY;
        for lane in 0..HIT_LANES {
            let mut point = || random.point() * scale + Vec3::splat(offset);
            let mut triangle = Triangle([point(), point(), point()]);
            if lane == 3 {
                // A needle.
                triangle.0[2] = triangle.0[0].lerp(triangle.0[1], 0.7) * 1.000_001;
            }
            let [a, b, c] = triangle.0;
            let target = a.lerp(b, random.unit()).lerp(c, random.unit());
            let mut ray = random.ray();
            ray.origin = ray.origin * scale + Vec3::splat(offset);
            ray.direction = (target - ray.origin) / scale * (random.unit() + 0.5);
            match random.bits() % 16 {
                0 => ray.direction.x = -0.0,
                1 => ray.direction = Vec3::Y,
                2 => ray.direction = -Vec3::Z,
                3 => ray.direction *= 1e-30,
                4 => ray.t_max = 0.7,
                5 => (ray.t_min, ray.t_max) = (f32::NEG_INFINITY, f32::INFINITY),
                _ => ray.t_max = f32::INFINITY,
            }
            scene = scene.union(triangle.bounds());
            lanes.set(lane, &ray, &triangle);
            given.push((ray, triangle));
        }
        let distances = lanes.distances(&scene);
        for ((ray, triangle), t) in given.iter().zip(distances) {
            let Some(prepared) = PreparedRay::new(ray, &scene) else { continue };
            // Only of triangles that the line passes through are lanes asked.
            let Some(expected) = prepared.triangle(triangle) else { continue };
            hits += 1;
            if t.is_nan() {
                asked += 1;
            } else {
                assert_eq!(t.to_bits(), expected.to_bits(), "{ray:?} {triangle:?}");
            }
        }
    }
    assert!(hits > 150_000 && asked < hits / 3, "{asked} of {hits} asked again");
}

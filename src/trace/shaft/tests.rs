//! What is told of a shaft against exact arithmetic, for each of many rays of it.

use super::*;
use crate::arbiter;
use crate::build::kd_sah::{self, Splits};
use crate::build::{self, WideCosts};
use crate::geometry::TriangleMesh;
use crate::ray::Ray;
use crate::test_random::Random;
use crate::tree::ChildRef;

const EPSILON: f64 = f32::EPSILON as f64;

/// What rays of a group have in common, and some of its rays, their directions rounded to `f32`.
struct Case {
    origins: Vec<Vec3>,
    normal: Option<DVec3>,
    target: Option<Target>,
    radius: f32,
    rays: Vec<Ray>,
    /// Length of its rays, roughly.
    size: f64,
}

impl Case {
    fn shaft(&self, scene: &Aabb) -> Option<Shaft<'_>> {
        match &self.target {
            None => Shaft::hemisphere(&self.origins, self.normal, self.radius, scene),
            Some(target) => Shaft::to_target(&self.origins, self.normal, target, scene),
        }
    }
}

impl Random {
    /// In `[low, high)`.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + f64::from(self.unit()) * (high - low)
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array([(); 3].map(|()| self.between(-1.0, 1.0)));
            if v.length() > 0.1 && v.length() <= 1.0 {
                return v.normalize();
            }
        }
    }

    /// Weights that sum to one, often of one corner or of an edge.
    fn weights(&mut self, len: usize) -> Vec<f64> {
        let only = (self.bits() % len as u64) as usize;
        let next = (only + 1) % len;
        let kind = self.bits() % 3;
        let mut weights: Vec<f64> = (0..len)
            .map(|i| match kind {
                0 => f64::from(i == only),
                1 if i != only && i != next => 0.0,
                _ => f64::from(self.unit()) + 1e-3,
            })
            .collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        weights
    }
}

fn reach(v: DVec3) -> f64 {
    v.abs().max_element()
}

/// Around `center`, rays about as long as `size`.
fn case(random: &mut Random, center: DVec3, size: f64) -> Case {
    let normal = random.direction();
    let count = if random.bits().is_multiple_of(2) { 1 } else { 2 + random.bits() as usize % 6 };
    let spread = size * 10f64.powf(random.between(-3.0, -0.3));
    let flat_group = random.bits().is_multiple_of(2);
    let origins: Vec<Vec3> = (0..count)
        .map(|_| {
            let mut offset = random.direction() * random.between(0.0, spread);
            if flat_group {
                offset -= normal * normal.dot(offset);
            }
            (center + offset).as_vec3()
        })
        .collect();
    let normal = (count == 1 || flat_group).then_some(normal);
    let origin = origins[0].as_dvec3();
    let mut new = Case { origins, normal, target: None, radius: f32::INFINITY, rays: vec![], size };
    let kind = random.bits() % 6;
    if kind < 2 {
        if kind == 0 {
            new.radius = (size * random.between(0.1, 1.0)) as f32;
        }
        while new.rays.len() < 24 {
            let direction = random.direction();
            let from = new.origins[random.bits() as usize % new.origins.len()];
            if normal.is_none_or(|normal| normal.dot(direction) > 5e-4) {
                new.rays.push(Ray::new(from, direction.as_vec3(), new.radius));
            }
        }
        return new;
    }
    let away = size * random.between(0.1, 1.0);
    let middle = origin + random.direction() * away;
    let extent = away * 10f64.powf(random.between(-4.0, 0.2));
    let (u, v) = (random.direction() * extent, random.direction() * extent);
    let (points, front) = match kind {
        // A parallelogram; a needle now and then.
        2 | 3 => {
            let v = if random.bits().is_multiple_of(8) { u + v * 1e-4 } else { v };
            let v = if kind == 2 { v - u * (u.dot(v) / u.length_squared()) } else { v };
            let normal = u.cross(v).normalize_or_zero();
            let normal = if normal.dot(origin - middle) < 0.0 { -normal } else { normal };
            (vec![middle, middle + u, middle + u + v, middle + v], Some(normal))
        }
        4 => (vec![middle], None),
        _ => (vec![middle, middle + u, middle + v, middle + random.direction() * extent], None),
    };
    let largest = points.iter().chain([&origin]).map(|p| reach(*p)).fold(0.0, f64::max);
    let rounding = 64.0 * EPSILON * 2.0 * largest;
    let radius = rounding + if kind == 4 { extent } else { 0.0 };
    for _ in 0..64 {
        let from = new.origins[random.bits() as usize % new.origins.len()];
        let from_exact = from.as_dvec3();
        let weights = random.weights(points.len());
        let on_target: DVec3 = points.iter().zip(&weights).map(|(p, w)| *p * *w).sum();
        let lift = match front {
            // As the renderer lifts its samples off a light's plane.
            Some(front) => {
                let height = front.dot(from_exact - points[0]);
                let extent = points.iter().map(|p| reach(*p - from_exact)).fold(0.0, f64::max);
                let offset = EPSILON * (4.0 * reach(on_target) + 32.0 * extent);
                front * offset.min(0.5 * height)
            }
            None => random.direction() * (radius - rounding),
        };
        let direction = on_target + lift - from_exact;
        let in_front = front.is_none_or(|front| front.dot(from_exact - points[0]) > 0.0);
        if in_front && normal.is_none_or(|normal| normal.dot(direction) > 0.0) {
            new.rays.push(Ray::new(from, direction.as_vec3(), 1.0));
        }
        if new.rays.len() == 24 {
            break;
        }
    }
    new.target = Some(match front {
        Some(front) => Target::flat(&points, radius, front),
        None => Target::new(&points, radius),
    });
    new
}

const TRIANGLE_KINDS: u64 = 9;

/// A triangle that means trouble.
fn triangle(random: &mut Random, case: &Case, kind: u64) -> Triangle {
    let ray = &case.rays[random.bits() as usize % case.rays.len()];
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let length = if case.target.is_some() { 1.0 } else { case.size };
    let along = match random.bits() % 4 {
        0 => 1.0,
        1 => 0.0,
        _ => random.between(0.0, 1.05),
    };
    let at = origin + direction * (length * along);
    let two =
        |random: &mut Random, size: f64| [random.direction() * size, random.direction() * size];
    let corners = match kind {
        // Small, around a point of a ray.
        0 => {
            let size = case.size * 10f64.powf(random.between(-6.0, -1.0));
            let [u, v] = two(random, size);
            [at + u, at + v, at - u - v]
        }
        // A sliver across a ray.
        1 => {
            let [u, v] = two(random, case.size);
            let width = 10f64.powf(random.between(-7.0, -3.0));
            [at - u, at + u, at + u * 0.5 + v * width]
        }
        // Huge.
        2 => {
            let size = case.size * 10f64.powf(random.between(1.0, 3.5));
            let [u, v] = two(random, size);
            [at + u, at + v, at - u - v]
        }
        // In the plane of the receivers.
        3 => {
            let normal = case.normal.unwrap_or(DVec3::Z);
            let size = case.size * random.between(0.1, 3.0);
            let flat = two(random, size).map(|d| d - normal * normal.dot(d));
            [origin + flat[0], origin + flat[1], origin - flat[0] - flat[1]]
        }
        // In the plane of the target.
        4 => match &case.target {
            Some(Target { points, .. }) if points.len == 4 => {
                let p = points.points;
                let [u, v] = [p[1] - p[0], p[3] - p[0]].map(|d| d * random.between(1.0, 9.0));
                [p[0] - u - v, p[0] + u * 3.0, p[0] + v * 3.0]
            }
            _ => [at, at + direction * 0.1, at + random.direction() * case.size],
        },
        // Beside a ray, by little, its plane along it.
        5 => {
            let side = random.direction().cross(direction).normalize_or_zero();
            let gap = case.size * 10f64.powf(random.between(-7.0, -3.0));
            let end = origin + direction * length;
            [origin + side * gap, end + side * gap, at + side * case.size * 0.3]
        }
        // Anywhere.
        6 => {
            let mut near = || origin + random.direction() * case.size;
            let p = near();
            let size = case.size * 0.2;
            [p, p + random.direction() * size, p + random.direction() * size]
        }
        // Across all of the shaft, or nearly.
        7 => {
            let [a, b] = plane_of(direction);
            let half = at * 0.5 + origin * 0.5;
            let size = case.size * random.between(0.05, 8.0);
            [half + a * size, half - a * size + b * size * 1.7, half - a * size - b * size * 1.7]
        }
        // Without area.
        _ => [at, at, at + random.direction() * case.size],
    };
    Triangle(corners.map(DVec3::as_vec3))
}

/// Two directions at right angles to a third.
fn plane_of(direction: DVec3) -> [DVec3; 2] {
    let a = direction.normalize_or_zero().any_orthonormal_vector();
    [a, a.cross(direction.normalize_or_zero())]
}

/// Eight times the same box.
fn planes(bounds: &Aabb) -> [[[f32; WIDTH]; 2]; 3] {
    [0, 1, 2].map(|axis| [[bounds.min[axis]; WIDTH], [bounds.max[axis]; WIDTH]])
}

/// Random shafts, boxes and triangles at many scales: nothing that a ray hits is overlooked, what is
/// said to block stops every ray, and most of what is out of the way is seen to be.
#[test]
fn views_are_true_of_every_ray() {
    let mut random = Random::new(0x5afe);
    let (mut judged, mut made) = (0, 0);
    // By kind of triangle: those that no ray hits and those seen to be out of the way; those that
    // all rays hit and those seen to stop all.
    let mut counts = [[0u32; 4]; TRIANGLE_KINDS as usize];
    for round in 0..4000 {
        let size = 10f64.powf(random.between(-3.0, 4.0));
        let center = random.direction() * size * [0.0, 1.0, 30.0, 1e3][random.bits() as usize % 4];
        let case = case(&mut random, center, size);
        if case.rays.is_empty() {
            continue;
        }
        let kinds = 0..TRIANGLE_KINDS;
        let triangles: Vec<_> = kinds.map(|kind| triangle(&mut random, &case, kind)).collect();
        let corners = triangles.iter().flat_map(|t| t.0);
        let scene = Aabb::of_points(corners.chain(case.origins.iter().copied()));
        made += 1;
        let Some(shaft) = case.shaft(&scene) else { continue };
        judged += 1;
        for (kind, triangle) in triangles.iter().enumerate() {
            let hits = case.rays.iter().filter(|ray| arbiter::hits(ray, triangle)).count();
            let view = shaft.view(triangle);
            let what = || format!("round {round}, kind {kind}: {shaft:?} {triangle:?}");
            assert!(hits == 0 || view != View::Open, "{hits} rays hit, {}", what());
            assert!(hits == case.rays.len() || view != View::Blocked, "{hits} hit, {}", what());
            let met = shaft.meets(&planes(&triangle.bounds()));
            assert!(met == 0 || met == 0xff);
            assert!(hits == 0 || met == 0xff, "the box of {}", what());
            let count = &mut counts[kind];
            count[0] += u32::from(hits == 0);
            count[1] += u32::from(hits == 0 && (view == View::Open || met == 0));
            count[2] += u32::from(hits == case.rays.len());
            count[3] += u32::from(view == View::Blocked);
        }
        // The smallest boxes around points of rays.
        for ray in &case.rays {
            let length = if case.target.is_some() { 1.0 } else { f64::from(case.radius).min(size) };
            let along = [0.0, 1.0, random.between(0.0, 1.0)][random.bits() as usize % 3] * length;
            let at = ray.origin.as_dvec3() + ray.direction.as_dvec3() * along;
            // The point itself is between the neighbours of its rounding.
            let near = at.as_vec3().to_array();
            let [min, max] = [f32::next_down, f32::next_up].map(|to| near.map(to).into());
            let bounds = Aabb { min, max };
            assert_eq!(shaft.meets(&planes(&bounds)), 0xff, "round {round}: {shaft:?} {ray:?}");
        }
    }
    println!("{judged} of {made} shafts; not hit, seen so, hit by all, seen so: {counts:?}");
    assert!(judged * 2 > made, "{judged} of {made} cases have a shaft");
    let share =
        |kind: usize, of: usize| f64::from(counts[kind][of + 1]) / f64::from(counts[kind][of]);
    assert!(share(6, 0) > 0.5, "{} of what lies beside shafts is seen so", share(6, 0));
    assert!(share(7, 2) > 0.2, "{} of what is in the way of all is seen so", share(7, 2));
}

/// The triangles below a part of a tree.
fn below(tree: &impl Hierarchy, part: &Part, found: &mut Vec<Triangle>) {
    if tree.is_leaf(part.child) {
        tree.triangles(part.child, &mut |triangle| {
            found.push(*triangle);
            true
        });
        return;
    }
    let mut children =
        Parts { planes: planes(&Aabb::EMPTY), children: [ChildRef::UNUSED; 8], len: 0 };
    tree.children(part, &mut children);
    for index in 0..children.len {
        let corner = |side: usize| Vec3::from_array(children.planes.map(|axis| axis[side][index]));
        let bounds = Aabb { min: corner(0), max: corner(1) };
        below(tree, &Part { child: children.children[index], bounds }, found);
    }
}

const BUDGETS: [Budget; 5] = [
    Budget { nodes: 0, triangles: 0 },
    Budget { nodes: 1, triangles: 1 },
    Budget { nodes: 3, triangles: 8 },
    Budget { nodes: 24, triangles: 32 },
    Budget { nodes: 10_000, triangles: 10_000 },
];

/// Looks through a tree for a case, and for each of its origins from where that ends.
fn check_looks(tree: &impl Hierarchy, mesh: &TriangleMesh, case: &Case, views: &mut [u32; 3]) {
    let triangles: Vec<_> = (0..mesh.len()).map(|i| mesh.triangle(i)).collect();
    let hits: Vec<Vec<&Triangle>> = case
        .rays
        .iter()
        .map(|ray| triangles.iter().filter(|t| arbiter::hits(ray, t)).collect())
        .collect();
    let mut check = |shaft: &Shaft<'_>,
                     from: &Entry,
                     budget,
                     entry: &mut Entry,
                     only: Option<Vec3>| {
        let view = look(tree, shaft, from, budget, entry);
        views[view as usize] += 1;
        let mut found = Vec::new();
        match entry.parts() {
            None => panic!("a look tells parts"),
            Some(parts) => {
                assert!(parts.len <= Entry::MOST);
                (0..parts.len).for_each(|index| below(tree, &parts.get(index), &mut found));
            }
        }
        for (ray, hits) in case.rays.iter().zip(&hits) {
            if only.is_some_and(|origin| origin != ray.origin) {
                continue;
            }
            match view {
                View::Open => assert!(hits.is_empty(), "{ray:?} hits {hits:?}"),
                View::Blocked => assert!(!hits.is_empty(), "{ray:?} hits nothing"),
                View::Partly => {}
            }
            assert!(hits.iter().all(|hit| found.contains(hit)), "{ray:?} starts beside {hits:?}");
        }
        view
    };
    let bounds = mesh.bounds();
    let Some(shaft) = case.shaft(&bounds) else { return };
    let (mut entry, mut inner) = (Entry::WHOLE, Entry::WHOLE);
    for budget in BUDGETS {
        check(&shaft, &Entry::WHOLE, budget, &mut entry, None);
        for &origin in &case.origins {
            let one =
                Case { origins: vec![origin], target: case.target.clone(), rays: vec![], ..*case };
            let Some(shaft) = one.shaft(&bounds) else { continue };
            for budget in BUDGETS {
                check(&shaft, &entry, budget, &mut inner, Some(origin));
            }
        }
    }
}

/// Trees of every kind, clipped ones too, with every budget, against all triangles of the mesh.
#[test]
fn looks_overlook_nothing_in_any_tree() {
    let mut random = Random::new(0x100c);
    for count in [1, 2, 40, 150] {
        let mesh = random.mesh(count);
        let cases: Vec<_> = (0..30)
            .map(|_| {
                let center = random.point().as_dvec3();
                let size = random.between(0.3, 6.0);
                case(&mut random, center, size)
            })
            .collect();
        let mut views = [0; 3];
        let mut each = |name: &str, look: &dyn Fn(&Case, &mut [u32; 3])| {
            let before = views;
            cases.iter().for_each(|case| look(case, &mut views));
            let gained: Vec<_> = views.iter().zip(before).map(|(n, before)| n - before).collect();
            println!("{count} triangles, {name}: {gained:?}");
        };
        for builder in build::BUILDERS {
            let binary = (builder.build)(&mesh, build::Leaves::Fit);
            each(builder.name, &|case, views| check_looks(&binary, &mesh, case, views));
            let binary = (builder.build)(&mesh, build::Leaves::Wide);
            let wide = build::collapse(&binary, WideCosts::default(), |node, side| {
                (node % 7 + side) as f64
            });
            let wide = WithMesh { tree: &wide, mesh: &mesh };
            each("collapsed", &|case, views| check_looks(&wide, &mesh, case, views));
        }
        for splits in [Splits::Perfect, Splits::Boxes] {
            let tree = kd_sah::build(&mesh, splits).unwrap();
            each("kd", &|case, views| check_looks(&Cells(&tree), &mesh, case, views));
        }
        assert!(views[View::Open as usize] > 500, "{views:?}");
        assert!(views[View::Partly as usize] > 500, "{views:?}");
    }
}

/// Sides of a target that is next to nothing have no direction that could be told.
#[test]
fn tiny_targets_have_no_sides() {
    let mut random = Random::new(0x717);
    for round in 0..2000 {
        let origin = (random.direction() * 0.1).as_vec3();
        let middle = origin.as_dvec3() + random.direction();
        let extent = 10f64.powf(random.between(-20.0, -8.0));
        let [u, v] = [random.direction() * extent, random.direction() * extent];
        let points = [middle, middle + u, middle + u + v, middle + v];
        let target = Target::new(&points, 1e-5);
        let scene = Aabb::of_points([Vec3::splat(-2.0), Vec3::splat(2.0)]);
        let shaft = Shaft::to_target(&[origin], None, &target, &scene).unwrap();
        let at = (origin.as_dvec3() * 0.5 + middle * 0.5).as_vec3();
        let bounds = Aabb { min: at - 1e-6, max: at + 1e-6 };
        assert_eq!(shaft.meets(&planes(&bounds)), 0xff, "round {round}: {shaft:?}");
    }
}

/// Numbers so small that directions lose digits when they are rounded have no shafts.
#[test]
fn shafts_keep_off_subnormal_numbers() {
    let small = Aabb::of_points([Vec3::ZERO, Vec3::splat(1e-36)]);
    let target = Target::new(&[DVec3::splat(1e-37)], 0.0);
    assert!(Shaft::to_target(&[Vec3::ZERO], None, &target, &small).is_none());
    let less_small = Aabb::of_points([Vec3::ZERO, Vec3::splat(1e-20)]);
    let target = Target::new(&[DVec3::splat(1e-20)], 0.0);
    assert!(Shaft::to_target(&[Vec3::ZERO], None, &target, &less_small).is_some());
}

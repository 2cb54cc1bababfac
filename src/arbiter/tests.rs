use super::*;
use crate::build;
use crate::geometry::{TriangleMesh, Vec3};
use crate::test_random::Random;
use proptest::prelude::*;

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

fn ray(origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Ray {
    Ray { origin, t_min, direction, t_max }
}

/// By all three ways, which must agree.
fn judged(ray: &Ray, triangle: &Triangle) -> bool {
    let pure = is_ray(ray) && exact_hits(ray, triangle);
    if is_ray(ray) {
        let filtered = FilterRay::new(ray).hits(triangle);
        assert!(filtered.is_none_or(|f| f == pure), "{ray:?} {triangle:?}: filter {filtered:?}");
    }
    assert_eq!(hits(ray, triangle), pure, "{ray:?} {triangle:?}");
    let tree = tree_of(&[*triangle]);
    assert_eq!(Arbiter::new(&tree).occluded(ray), pure, "{ray:?} {triangle:?}");
    pure
}

fn mesh_of(triangles: &[Triangle]) -> TriangleMesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(triangles.iter().flat_map(|t| t.0).collect(), indices)
}

fn tree_of(triangles: &[Triangle]) -> Bvh2 {
    (build::find("binned").unwrap().build)(&mesh_of(triangles), build::Leaves::Fit)
}

/// In the plane `z = height`, with corners at (0, 0), (4, 0) and (0, 4).
fn flat(height: f32) -> Triangle {
    Triangle([v(0., 0., height), v(4., 0., height), v(0., 4., height)])
}

const ALL_T: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

#[test]
fn the_border_belongs_to_the_triangle() {
    let down = |x, y| ray(v(x, y, 3.), v(0., -0., -2.), 0., f32::INFINITY);
    let cases = [
        (0., 0., true),
        (4., 0., true),
        (0., 4., true),
        (2., 0., true),
        (0., 1., true),
        (2., 2., true),
        (1., 1., true),
        (2f32.next_up(), 2., false),
        (2f32.next_down(), 2., true),
        (-f32::from_bits(1), 1., false),
        (f32::from_bits(1), 1., true),
        (4f32.next_up(), 0., false),
        (0., 4f32.next_up(), false),
        (-0., -0., true),
    ];
    for (x, y, expected) in cases {
        assert_eq!(judged(&down(x, y), &flat(0.)), expected, "{x} {y}");
        let [a, b, c] = flat(0.).0;
        assert_eq!(judged(&down(x, y), &Triangle([a, c, b])), expected, "turned: {x} {y}");
    }
}

#[test]
fn the_interval_is_closed_to_the_bit() {
    // The hit is at t = 1.5.
    let with = |t_min, t_max| judged(&ray(v(1., 1., 3.), v(0., 0., -2.), t_min, t_max), &flat(0.));
    let t = 1.5f32;
    assert!(with(t, t) && with(0., t) && with(t, f32::INFINITY) && with(ALL_T[0], ALL_T[1]));
    assert!(!with(0., t.next_down()) && !with(t.next_up(), f32::INFINITY));
    assert!(with(t.next_down(), t.next_up()));
    assert!(!with(f32::INFINITY, f32::INFINITY) && !with(ALL_T[0], ALL_T[0]));
    assert!(!with(f32::NAN, 9.) && !with(0., f32::NAN) && !with(2., 1.));
    // Behind the origin, where only a negative interval reaches; and at the origin.
    let up = |t_min, t_max| judged(&ray(v(1., 1., 3.), v(0., 0., 2.), t_min, t_max), &flat(0.));
    assert!(up(-1.5, -1.5) && up(-2., 0.) && !up(0., 9.) && !up((-1.5f32).next_up(), 9.));
    let on = |t_min, t_max| judged(&ray(v(1., 1., 0.), v(1., 1., 2.), t_min, t_max), &flat(0.));
    assert!(on(0., 1.) && on(-0., 0.) && on(-1., -0.) && !on(f32::from_bits(1), 1.));
    // A third cannot be written in binary: neither of its neighbours is the hit.
    let third = |t_min, t_max| judged(&ray(v(1., 1., 1.), v(0., 0., -3.), t_min, t_max), &flat(0.));
    let above = 1f32 / 3.;
    let below = above.next_down();
    assert!(f64::from(above) > 1. / 3. && f64::from(below) < 1. / 3.);
    assert!(third(below, above) && !third(above, 1.) && !third(0., below) && third(below, 1.));
}

#[test]
fn planes_lines_and_points_are_not_hit() {
    // In the plane, through the middle; parallel to it; and all but.
    assert!(!judged(&ray(v(-1., 1., 0.), v(1., 0., 0.), 0., 9.), &flat(0.)));
    assert!(!judged(&ray(v(-1., 1., 1.), v(1., 0., 0.), 0., 9.), &flat(0.)));
    let step = f32::from_bits(1);
    assert!(judged(&ray(v(-1., 1., -step), v(1., 0., step), 0., 9.), &flat(0.)));
    let (a, b, c) = (v(0., 0., 0.), v(4., 0., 0.), v(2., 0., 0.));
    for thin in [[a, b, c], [a, a, b], [a, a, a], [b, a, b]] {
        assert!(!judged(&ray(v(2., 0., 3.), v(0., 0., -1.), 0., 9.), &Triangle(thin)));
    }
    // One bit is enough to be hit.
    let thin = Triangle([a, b, v(2., step, 0.)]);
    assert!(judged(&ray(v(2., 0., 3.), v(0., 0., -1.), 0., 9.), &thin));
    assert!(!judged(&ray(v(2., -step, 3.), v(0., 0., -1.), 0., 9.), &thin));
}

#[test]
fn any_magnitude_is_judged() {
    for scale in [f32::from_bits(1), f32::MIN_POSITIVE, 1e-30, 1., 1e30, 2f32.powi(125)] {
        let triangle = Triangle(flat(0.).0.map(|p| p * scale));
        let down = |x: f32, y, t_max| ray(v(x, y, scale), v(0., 0., -scale), 0., t_max);
        assert!(judged(&down(0., 0., 1.), &triangle), "{scale:e}");
        assert!(judged(&down(2. * scale, 2. * scale, 1.), &triangle), "{scale:e}");
        assert!(!judged(&down(3. * scale, 2. * scale, 1.), &triangle), "{scale:e}");
        assert!(!judged(&down(scale, scale, 1f32.next_down()), &triangle), "{scale:e}");
    }
    let huge = Triangle([v(-1e38, -1e38, 3e38), v(3e38, -1e38, 3e38), v(-1e38, 3e38, 3e38)]);
    assert!(judged(&ray(v(0., 0., -3e38), v(0., 0., 1e-45), 0., f32::INFINITY), &huge));
    assert!(!judged(&ray(v(0., 0., -3e38), v(0., 0., 1e-45), 0., f32::MAX), &huge));
    assert!(judged(&ray(v(0., 0., -3e38), v(0., 0., 3e38), 0., 2.), &huge));
}

#[test]
fn what_is_no_ray_hits_nothing() {
    let good = ray(v(1., 1., 3.), v(0., 0., -1.), 0., 9.);
    assert!(judged(&good, &flat(0.)));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let (mut a, mut b) = (good, good);
            a.origin[axis] = bad;
            b.direction[axis] = bad;
            assert!(!judged(&a, &flat(0.)) && !judged(&b, &flat(0.)));
        }
    }
    assert!(!judged(&Ray { direction: Vec3::ZERO, ..good }, &flat(0.)));
    assert!(!judged(&Ray { direction: v(-0., 0., -0.), ..good }, &flat(0.)));
}

/// The same in whole numbers by another formulation: volumes between the line and the edges weight
/// the corners, and the weighted point's distance is measured along the direction.
fn by_volumes(
    origin: [i128; 3],
    direction: [i128; 3],
    corners: [[i128; 3]; 3],
    interval: [i128; 2],
) -> bool {
    let seen = corners.map(|p| [0, 1, 2].map(|i| p[i] - origin[i]));
    let dot = |a: [i128; 3], b: [i128; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let volume = |p: [i128; 3], q: [i128; 3]| {
        dot(direction, [(1, 2), (2, 0), (0, 1)].map(|(i, j)| p[i] * q[j] - p[j] * q[i]))
    };
    let weights = [volume(seen[1], seen[2]), volume(seen[2], seen[0]), volume(seen[0], seen[1])];
    let sum: i128 = weights.iter().sum();
    let one_side = weights.iter().all(|w| *w >= 0) || weights.iter().all(|w| *w <= 0);
    if !one_side || sum == 0 {
        return false;
    }
    let along: i128 = (0..3).map(|i| weights[i] * dot(seen[i], direction)).sum();
    // t = along / (sum |d|^2)
    let (along, unit) = (along * sum.signum(), sum.abs() * dot(direction, direction));
    interval[0] * unit <= along && along <= interval[1] * unit
}

fn grid_point(size: i32) -> impl Strategy<Value = [i32; 3]> {
    [-size..=size, -size..=size, -size..=size]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn volumes_between_line_and_edges_say_the_same(
        (origin, direction, corners, interval) in prop_oneof![Just(3), Just(40), Just(2000)]
            .prop_flat_map(|size| (
                grid_point(size),
                grid_point(size),
                [grid_point(size), grid_point(size), grid_point(size)],
                [-2..=3i32, -2..=3i32],
            )),
        exponent in prop_oneof![Just(0), Just(-149), Just(-130), Just(-60), Just(60), Just(115)],
    ) {
        let scale = f64::from(exponent).exp2();
        let scaled = |p: [i32; 3]| Vec3::from(p.map(|x| (f64::from(x) * scale) as f32));
        let tested = ray(
            scaled(origin),
            scaled(direction),
            interval[0] as f32,
            interval[1] as f32,
        );
        let triangle = Triangle(corners.map(scaled));
        let wide = |p: [i32; 3]| p.map(i128::from);
        let expected = direction != [0; 3]
            && by_volumes(
                wide(origin), wide(direction), corners.map(wide), interval.map(i128::from),
            );
        prop_assert_eq!(judged(&tested, &triangle), expected);
    }

    /// Any bits at all: the filter and the boxes say what rational numbers say.
    #[test]
    fn filter_and_boxes_agree_with_rational_numbers(
        bits in proptest::array::uniform17(prop_oneof![
            any::<u32>(),
            (any::<u32>(), 120u32..134).prop_map(|(b, e)| b & 0x807f_ffff | e << 23),
            any::<u32>().prop_map(|b| b & 0x8000_0007),
        ]),
        share_a_plane in any::<bool>(),
    ) {
        let at = |i: usize| f32::from_bits(bits[i]);
        let point = |i: usize| v(at(i), at(i + 1), at(i + 2));
        let mut corners = [point(8), point(11), point(14)];
        if share_a_plane {
            corners.iter_mut().for_each(|c| c.z = at(2));
        }
        prop_assume!(corners.iter().all(|c| c.is_finite()));
        judged(&ray(point(0), point(3), at(6), at(7)), &Triangle(corners));
    }
}

/// Rays at corners, edges and points of triangles, from places where differences are exact and where
/// they are not.
fn aimed(random: &mut Random, mesh: &TriangleMesh) -> Ray {
    let triangle = mesh.triangle((random.bits() % mesh.len() as u64) as usize);
    let [a, b, c] = triangle.0;
    let target = match random.bits() % 3 {
        0 => a,
        1 => a.lerp(b, random.unit()),
        _ => a.lerp(b, random.unit()).lerp(c, random.unit()),
    };
    let origin = random.point();
    let t_max = [1., 1f32.next_down(), 1f32.next_up(), f32::INFINITY];
    Ray::new(origin, target - origin, t_max[(random.bits() % 4) as usize])
}

#[test]
fn a_scene_is_judged_as_its_triangles_are() {
    let mut random = Random::new(0xa2b);
    let mut in_doubt = 0;
    for (offset, scale) in [(0., 1.), (1e6, 1.), (0., 1e-40), (0., 1e17), (100., 1e-3)] {
        for count in [0, 1, 7, 200] {
            let mesh = random.mesh(count);
            let moved = |p: Vec3| p * scale + Vec3::splat(offset);
            let triangles: Vec<_> =
                (0..mesh.len()).map(|i| Triangle(mesh.triangle(i).0.map(moved))).collect();
            let tree = tree_of(&triangles);
            let arbiter = Arbiter::new(&tree);
            for index in 0..1000 {
                let plain = if index % 2 == 0 || mesh.is_empty() {
                    random.ray()
                } else {
                    aimed(&mut random, &mesh)
                };
                let (origin, direction) = (moved(plain.origin), plain.direction * scale);
                let ray = Ray { origin, direction, ..plain };
                let expected = is_ray(&ray) && triangles.iter().any(|t| exact_hits(&ray, t));
                assert_eq!(arbiter.occluded(&ray), expected, "{offset} {scale} {ray:?}");
                assert_eq!(arbiter.explain(&ray).occluded, expected, "{ray:?}");
                let filter = FilterRay::new(&ray);
                in_doubt += triangles.iter().filter(|t| filter.hits(t).is_none()).count();
            }
        }
    }
    assert!(in_doubt > 100, "{in_doubt} triangles in doubt: rational numbers were hardly asked");
}

#[test]
fn the_filter_decides_nearly_all() {
    let mut random = Random::new(0xf11);
    let mesh = random.mesh(100);
    let (mut certain, mut all) = (0, 0);
    for _ in 0..2000 {
        let ray = Ray { origin: random.point() + v(0.1, 0.2, 0.3) * random.unit(), ..random.ray() };
        let filter = FilterRay::new(&ray);
        certain += (0..mesh.len()).filter(|&i| filter.hits(&mesh.triangle(i)).is_some()).count();
        all += mesh.len();
    }
    assert!(certain * 100 > all * 99, "{certain} of {all}");
}

#[test]
fn reasons_say_what_makes_a_ray_hard() {
    let down = |x, y| ray(v(x, y, 3.), v(0., 0., -2.), 0., f32::INFINITY);
    let explained = |triangle: Triangle, ray: Ray| {
        let tree = tree_of(&[triangle]);
        Arbiter::new(&tree).explain(&ray)
    };
    let clear = explained(flat(0.), down(1., 1.));
    assert_eq!((clear.occluded, clear.reason, clear.triangle), (true, Reason::Clear, Some(0)));
    assert!((clear.margin - 0.25).abs() < 1e-9, "{clear:?}");

    let edge = explained(flat(0.), down(2., -1e-6));
    assert_eq!((edge.occluded, edge.reason), (false, Reason::EdgeGraze));
    assert!((edge.margin - 0.25e-6).abs() < 1e-12, "{edge:?}");
    let corner = explained(flat(0.), down(0., 0.));
    assert_eq!((corner.occluded, corner.reason, corner.margin), (true, Reason::VertexGraze, 0.));

    let end = explained(flat(0.), Ray { t_max: 1.5f32.next_down(), ..down(1., 1.) });
    assert_eq!((end.occluded, end.reason), (false, Reason::IntervalEnd));
    assert!(end.margin > 0. && end.margin < 1e-7, "{end:?}");

    let along = ray(v(-1., 1., 0.), v(1., 0., 1e-6), 0., 9.);
    assert_eq!(explained(flat(0.), along).reason, Reason::NearParallel);
    let within = ray(v(-1., 1., 0.), v(1., 0., 0.), 0., 9.);
    let within = explained(flat(0.), within);
    assert_eq!((within.occluded, within.reason, within.margin), (false, Reason::NearParallel, 0.));

    let thin = Triangle([v(0., 0., 0.), v(4., 0., 0.), v(2., 0., 0.)]);
    assert_eq!(explained(thin, down(2., 0.)).reason, Reason::Degenerate);

    let far = v(1e6, 0., 0.);
    let moved = Triangle(flat(0.).0.map(|p| p + far));
    assert_eq!(explained(moved, down(1e6, 1.)).reason, Reason::FarFromOrigin);

    let nothing = explained(flat(0.), down(100., 100.));
    assert_eq!((nothing.occluded, nothing.triangle), (false, None));
    let no_ray = explained(flat(0.), Ray { t_max: f32::NAN, ..down(1., 1.) });
    assert_eq!((no_ray.occluded, no_ray.reason), (false, Reason::NotARay));
}

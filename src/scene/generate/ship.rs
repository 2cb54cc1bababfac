//! A three-master at a quay: few triangles, from the sea's to the rigging's.

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, at, barrel, camera, curve, light, mix, sin_cos, stand, turned, v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "ship",
    about: "4k triangles: three-master at a quay under the sun, sails and rigging over a flat sea",
    triangles: 4_000,
    generate,
};

/// Half the ship's length.
const HALF_LENGTH: f64 = 15.0;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    let sea = 250.0;
    shape.quad(v(-sea, 0.0, sea), v(sea, 0.0, sea), v(sea, 0.0, -sea), v(-sea, 0.0, -sea));
    hull(&mut shape);
    on_deck(&mut shape);
    for (x, height, yard) in [(-8.5, 14.0, 3.4), (0.5, 18.0, 4.6), (8.5, 16.0, 4.0)] {
        mast(&mut shape, x, height, yard);
    }
    stays(&mut shape);
    quay(&mut shape, seed);
    let sun = glam::vec3(-0.45, -0.55, 0.5).normalize();
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(18.0, 9.0, 30.0), v(1.5, 7.0, 2.5), 43.0),
        lights: vec![
            light(
                "sun",
                LightShape::Directional { direction: sun, angular_diameter_degrees: 2.0 },
                3.4,
                v(1.0, 0.95, 0.85),
            ),
            light(
                "sky",
                LightShape::Disk {
                    center: glam::vec3(0.0, 60.0, 0.0),
                    normal: -glam::Vec3::Y,
                    radius: 25.0,
                },
                5.0,
                v(0.75, 0.87, 1.0),
            ),
        ],
        ao_radius: 3.0,
        motion: None,
    }
}

/// Half the beam at `u` from stern (-1) to bow (1).
fn half_beam(u: f64) -> f64 {
    let blunt = if u < 0.0 { 0.35 } else { 1.0 };
    3.9 * (1.0 - blunt * u * u * u.abs()).max(0.0)
}

/// Height of the rail at `u`.
fn sheer(u: f64) -> f64 {
    2.9 + 1.5 * u * u - 0.5 * u
}

/// The hull's side at `u` along and `w` up, on the side of `side`.
fn side_point(u: f64, w: f64, side: f64, inset: f64) -> V {
    let flare = mix(0.35, 1.0, (w * (2.0 - w)).max(0.0).sqrt());
    let rake = if u > 0.0 { 1.6 * u * u * w } else { -0.9 * u * u * w };
    let z = (half_beam(u) * flare + 0.05 - inset).max(0.03);
    v(u * HALF_LENGTH + rake, mix(-0.8, sheer(u), w), side * z)
}

/// How far up the deck lies, as a share of the side's height.
const DECK: f64 = 0.76;

fn hull(s: &mut Shape) {
    for side in [-1.0, 1.0] {
        let cell = |a: f64| mix(-1.0, 1.0, if side > 0.0 { a } else { 1.0 - a });
        s.grid([16, 5], [false, false], |a, w| side_point(cell(a), w, side, 0.0));
        s.grid([16, 1], [false, false], |a, w| side_point(-cell(a), mix(DECK, 1.0, w), side, 0.2));
        let rail = curve(16, |t| side_point(mix(-1.0, 1.0, t), 1.0, side, 0.1) + v(0.0, 0.03, 0.0));
        s.tube(&rail, (0.16, 0.16), 4);
        let strake = curve(8, |t| side_point(mix(-0.995, 0.97, t), 0.66, side, -0.03));
        s.tube(&strake, (0.11, 0.07), 3);
        for k in 0..4 {
            let u = -0.36 + 0.19 * f64::from(k);
            let p = side_point(u, 0.8, side, 0.35);
            let gun = Shape::of(|s| {
                s.lathe(&[(0.16, 0.0), (0.11, 1.5), (0.06, 1.5), (0.05, 1.2)], 5);
            });
            let out = Place::from_mat3_translation(
                glam::DMat3::from_cols(V::X, V::Z * side, V::Y * -side),
                p,
            );
            s.add(&gun, out);
        }
    }
    // Deck, and the flat stern with its windows.
    s.grid([16, 1], [false, false], |a, w| {
        let u = mix(-1.0, 1.0, a);
        side_point(u, DECK, mix(1.0, -1.0, w), 0.0) - v(0.0, 0.0, mix(0.1, -0.1, w))
    });
    let rim: Vec<V> = (0..=5).map(|i| side_point(-1.0, f64::from(i) / 5.0, 1.0, 0.0)).collect();
    for pair in rim.windows(2) {
        let mirror = |p: V| v(p.x, p.y, -p.z);
        s.quad(pair[0], pair[1], mirror(pair[1]), mirror(pair[0]));
    }
    for k in -2..=2 {
        let p = side_point(-1.0, 0.86, 1.0, 0.0);
        let window = v(p.x - 0.02, p.y - 0.3, 0.75 * f64::from(k));
        s.block(window, v(0.2, 0.6, 0.45));
    }
}

fn deck_height(x: f64) -> f64 {
    side_point(x / HALF_LENGTH, DECK, 1.0, 0.0).y
}

fn on_deck(s: &mut Shape) {
    // Quarterdeck cabin and forecastle, deep enough to meet the curved deck everywhere.
    let cabin_top = 5.2;
    s.cuboid(v(-14.0, 2.6, -2.1), v(-10.0, cabin_top, 2.1));
    s.bevelled(v(-12.0, cabin_top - 0.02, 0.0), v(4.3, 0.18, 4.5), 0.05);
    s.cuboid(v(10.6, 2.0, -1.3), v(12.6, 4.4, 1.3));
    s.block(v(11.6, 4.38, 0.0), v(2.2, 0.14, 2.8));
    for (x, size) in [(-5.0, 1.5), (4.2, 1.8)] {
        s.block(v(x, deck_height(x) - 0.2, 0.0), v(size, 0.6, 1.5));
        s.block(v(x, deck_height(x) + 0.38, 0.0), v(size + 0.15, 0.1, 1.65));
    }
    let wheel = Shape::of(|s| {
        s.block(v(0.0, 0.0, 0.0), v(0.3, 1.1, 0.3));
        for k in 0..4 {
            let (sin, cos) = sin_cos(PI * 0.25 * f64::from(k));
            let spoke = v(0.0, 0.75 * cos, 0.75 * sin);
            let hub = v(0.25, 1.0, 0.0);
            s.rod(hub - spoke, hub + spoke, 0.035, 3);
        }
    });
    s.add(&wheel, stand(-11.5, cabin_top + 0.16, 0.0, 0.0));
    let lantern = Shape::of(|s| s.block(V::ZERO, v(0.4, 0.6, 0.4)));
    for z in [-1.6, 1.6] {
        s.cord(v(-13.9, cabin_top + 0.1, z), v(-13.9, cabin_top + 1.1, z), 0.06);
        s.add(&lantern, at(v(-13.9, cabin_top + 1.05, z)));
    }
    let boat = Shape::of(|s| {
        s.grid([8, 4], [false, false], |a, b| {
            let u = mix(-1.0, 1.0, a);
            let (sin, cos) = sin_cos(PI * (b - 0.5) * 1.02);
            v(1.9 * u, 0.7 - 0.7 * cos * (1.0 - 0.35 * u * u), -0.72 * sin * (1.02 - u * u * u * u))
        });
    });
    s.add(&boat, at(v(-2.4, deck_height(-2.4) - 0.02, 0.0)));
}

/// A mast at `x` with three square sails; `yard` is half the lowest yard.
fn mast(s: &mut Shape, x: f64, height: f64, yard: f64) {
    let deck = deck_height(x);
    let top = deck + height;
    s.tube(&[v(x, deck - 0.3, 0.0), v(x, top, 0.0)], (0.3, 0.09), 8);
    let nest = deck + 0.58 * height;
    let cup = Shape::of(|s| {
        s.lathe(&[(0.0, 0.0), (0.55, 0.02), (0.75, 0.5), (0.65, 0.5), (0.3, 0.1)], 6);
    });
    s.add(&cup, at(v(x, nest, 0.0)));
    s.tri(v(x, top - 0.05, 0.02), v(x - 1.7, top - 0.5, 0.3), v(x, top - 0.9, 0.02));
    let levels = [0.24, 0.55, 0.79, 0.95];
    for k in 0..4 {
        let half = yard * (1.0 - 0.22 * f64::from(k));
        let p = v(x + 0.36 - 0.05 * f64::from(k), deck + levels[k as usize] * height, 0.0);
        for side in [-1.0, 1.0] {
            s.tube(&[p, p + v(0.0, 0.0, half * 1.08 * side)], (0.13, 0.05), 4);
        }
        if k == 3 {
            continue;
        }
        let (next, above) = (half * 0.8, deck + levels[k as usize + 1] * height - 0.12);
        s.grid([5, 5], [false, false], |a, w| {
            let z = mix(half, next, w) * mix(1.0, -1.0, a);
            // Filled by the wind; the foot is cut in an arc.
            let belly = 1.5 * (4.0 * a * (1.0 - a)).sqrt() * (1.0 - w) * (0.35 + 1.6 * w);
            let foot = 0.45 * (1.0 - w) * 4.0 * a * (1.0 - a);
            v(p.x + 0.12 + belly, mix(p.y + 0.22 + foot, above, w), z)
        });
    }
    // Shrouds from the sides to the nest, with ratlines across.
    for side in [-1.0, 1.0] {
        let foot = |k: f64| side_point((x - 1.6 + 0.7 * k) / HALF_LENGTH, 1.0, side, 0.1);
        let head = v(x, nest + 0.05, 0.5 * side);
        for k in 0..4 {
            s.cord(foot(f64::from(k)), head, 0.035);
        }
        for r in 1..7 {
            let t = f64::from(r) / 8.5;
            let end = |k: f64| foot(k) + (head - foot(k)) * t;
            s.cord(end(0.0), end(3.0), 0.022);
        }
        s.cord(v(x, nest, 0.7 * side), v(x, top - 1.2, 0.0), 0.03);
    }
}

fn stays(s: &mut Shape) {
    let tip = v(22.5, 7.2, 0.0);
    s.tube(&[v(13.0, 3.6, 0.0), tip], (0.28, 0.1), 7);
    let top = |x: f64, height: f64, share: f64| v(x, deck_height(x) + height * share, 0.0);
    let lines = [
        (tip, top(8.5, 16.0, 0.97)),
        (v(19.0, 5.9, 0.0), top(8.5, 16.0, 0.62)),
        (top(8.5, 16.0, 0.5), top(0.5, 18.0, 0.94)),
        (top(0.5, 18.0, 0.45), top(-8.5, 14.0, 0.95)),
        (v(-14.8, 4.9, 0.0), top(-8.5, 14.0, 0.97)),
    ];
    for (a, b) in lines {
        s.cord(a, b, 0.035);
    }
    // Two jibs on the forestays and a gaff sail on the mizzen.
    let mut jib = |a: V, b: V, clew: V| {
        s.grid([4, 4], [false, false], |p, q| {
            // A triangle with its corner b cut a little, so that no cell is degenerate.
            let luff = a + (b - a) * (0.96 * q);
            let leech = clew + (b - clew) * (0.96 * q);
            let belly = 0.7 * p * (1.0 - p) * (1.0 - q);
            luff + (leech - luff) * p + v(0.0, 0.0, belly)
        });
    };
    jib(v(20.5, 8.0, 0.0), v(10.4, 16.8, 0.0), v(14.8, 7.0, 0.5));
    jib(v(17.4, 6.7, 0.0), v(10.0, 11.6, 0.0), v(12.6, 6.2, -0.4));
    let x = -8.5;
    let deck = deck_height(x);
    s.tube(&[v(x - 0.2, deck + 2.9, 0.0), v(x - 6.5, deck + 3.4, 0.8)], (0.14, 0.07), 5);
    s.tube(&[v(x - 0.2, deck + 7.2, 0.0), v(x - 5.2, deck + 9.2, 0.6)], (0.11, 0.06), 5);
    s.grid([5, 5], [false, false], |p, q| {
        let low = v(x - 0.5, deck + 3.1, 0.0) + v(-5.6, 0.4, 0.72) * p;
        let high = v(x - 0.5, deck + 7.15, 0.0) + v(-4.3, 1.75, 0.5) * p;
        low + (high - low) * q + v(0.0, 0.0, 1.6 * p * (1.0 - p) * (1.2 - q))
    });
}

/// A quay on the lee side, where the shadows of the sails fall.
fn quay(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "quay");
    let (top, near) = (1.5, 6.2);
    s.cuboid(v(-30.0, -3.0, near), v(19.0, top, 40.0));
    s.bevelled(v(-5.5, top - 0.05, near + 0.2), v(49.0, 0.22, 0.6), 0.05);
    let bollard = Shape::of(|s| {
        s.lathe(&[(0.28, 0.0), (0.2, 0.55), (0.34, 0.7), (0.24, 0.85), (0.0, 0.86)], 6);
    });
    for x in [-16.0, -6.0, 5.0, 15.0] {
        s.add(&bollard, stand(x, top, near + 1.3, 0.0));
    }
    for (x, u) in [(-16.0, -0.93), (15.0, 0.75)] {
        let (a, b) = (v(x, top + 0.6, near + 1.3), side_point(u, 0.97, 1.0, 0.0));
        let rope = curve(6, |t| a + (b - a) * t - V::Y * (2.2 * t * (1.0 - t)));
        s.tube(&rope, (0.05, 0.05), 3);
    }
    let cask = barrel(0.48, 1.25, 6);
    for (x, z) in [(4.2, 9.1), (5.3, 9.4), (4.6, 10.2), (-9.0, 12.0)] {
        s.add(&cask, stand(x, top, z, rng.angle()));
    }
    for (x, z, size) in [(10.4, 9.6, 1.5), (12.2, 10.2, 1.2), (10.8, 11.5, 1.1), (-3.0, 10.0, 1.3)]
    {
        let crate_box = Shape::of(|s| {
            s.block(V::ZERO, V::splat(size));
        });
        s.add(&crate_box, stand(x, top, z, rng.range(0.0, TAU)));
    }
    let lid = Shape::of(|s| s.block(V::ZERO, V::splat(0.9)));
    s.add(&lid, turned(v(10.5, top + 1.497, 9.6), 0.7));
    // Sheer-legs: a crane of three spars.
    let head = v(-14.5, 10.0, 7.6);
    for foot in [v(-17.5, top - 0.1, 9.0), v(-11.5, top - 0.1, 9.0), v(-14.5, top - 0.1, 15.0)] {
        s.tube(&[foot, head + (head - foot) * 0.03], (0.22, 0.14), 6);
    }
    s.cord(head, v(head.x, 3.2, head.z), 0.04);
    s.add(&barrel(0.4, 1.0, 6), at(v(head.x, 2.25, head.z)));
}

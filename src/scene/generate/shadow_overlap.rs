//! Thousands of finely cut things on cords between the lights and a floor of two triangles.

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, aimed_quad, at, camera, curve, down_quad, leaf, light, mix,
    plant, sin_cos, stand, tilted, turned, v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "shadow-overlap",
    about: "2M triangles: ornaments hung from a pergola, their shadows overlapping on one floor",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 2_000_000;
/// Half the pergola's length and width.
const HALF: f64 = 12.0;
/// Height of its slats.
const TOP: f64 = 7.0;
/// Slats, and things hung from each.
const SLATS: u32 = 32;
const HUNG: u32 = 26;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    let floor = 16.0;
    let p = |x: f64, z: f64| v(x * floor, 0.0, z * floor);
    shape.quad(p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0), p(-1.0, -1.0));
    pergola(&mut shape);
    garden(&mut shape, seed);
    hang(&mut shape, seed);
    fallen(&mut shape, seed);
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(-11.0, 2.8, 12.9), v(0.0, 1.8, 0.0), 52.0),
        lights: vec![
            light(
                "north",
                aimed_quad(v(-6.0, 13.0, -9.0), V::ZERO, 0.8, 0.8),
                1900.0,
                v(1.0, 0.9, 0.75),
            ),
            light(
                "south",
                aimed_quad(v(9.0, 12.0, 7.0), V::ZERO, 0.6, 0.6),
                2600.0,
                v(0.75, 0.88, 1.0),
            ),
            light("top", down_quad(v(0.0, 14.0, 0.0), 0.5, 0.5), 2900.0, V::ONE),
            light(
                "lantern",
                LightShape::Sphere { center: glam::vec3(-4.6, 5.9, 5.4), radius: 0.12 },
                1000.0,
                v(1.0, 0.8, 0.55),
            ),
        ],
        ao_radius: 0.8,
        motion: None,
    }
}

/// The x of slat `i`.
fn slat(i: u32) -> f64 {
    mix(-HALF + 0.4, HALF - 0.4, f64::from(i) / f64::from(SLATS - 1))
}

fn pergola(s: &mut Shape) {
    let post = Shape::of(|s| {
        s.bevelled(V::ZERO, v(0.5, 0.3, 0.5), 0.04);
        s.bevelled(v(0.0, 0.29, 0.0), v(0.3, TOP - 0.6, 0.3), 0.03);
        s.bevelled(v(0.0, TOP - 0.5, 0.0), v(0.44, 0.2, 0.44), 0.03);
    });
    for x in [-HALF, 0.0, HALF] {
        for z in [-HALF, 0.0, HALF] {
            s.add(&post, stand(x, 0.0, z, 0.0));
        }
    }
    for z in [-HALF, 0.0, HALF] {
        s.bevelled(v(0.0, TOP - 0.302, z), v(2.0 * HALF + 1.0, 0.3, 0.2), 0.02);
    }
    for i in 0..SLATS {
        s.bevelled(v(slat(i), TOP - 0.01, 0.0), v(0.06, 0.18, 2.0 * HALF + 0.8), 0.008);
    }
}

/// Pedestals with plants and balls, and benches: big casters and receivers.
fn garden(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "garden");
    let pedestal = Shape::of(|s| {
        s.bevelled(V::ZERO, v(0.9, 0.12, 0.9), 0.02);
        s.bevelled(v(0.0, 0.118, 0.0), v(0.64, 0.66, 0.64), 0.02);
        s.bevelled(v(0.0, 0.776, 0.0), v(0.8, 0.1, 0.8), 0.02);
    });
    for (i, (x, z)) in [
        (-6.0, 6.0),
        (-2.0, 2.5),
        (4.0, 4.0),
        (-7.0, -1.5),
        (1.0, -4.0),
        (7.5, -3.0),
        (-3.5, -7.5),
        (3.0, 9.0),
    ]
    .into_iter()
    .enumerate()
    {
        s.add(&pedestal, stand(x, 0.0, z, rng.angle()));
        let top = v(x, 0.874, z);
        if i % 2 == 0 {
            s.icosphere(top + V::Y * 0.438, 0.44, 5);
        } else {
            s.add(&plant(&mut rng, 1.3, 24, 14, 5), at(top));
        }
    }
}

/// A closed knot on a torus, `2 p`-fold about the upright axis.
fn knot(radius: f64, (p, q): (f64, f64), thick: f64, [around, across]: [u32; 2]) -> Shape {
    let point = |t: f64| {
        let ((s, c), (sq, cq)) = (sin_cos(TAU * p * t), sin_cos(TAU * q * t));
        let r = radius * (0.66 + 0.27 * cq);
        v(r * c, 0.27 * radius * sq, r * s)
    };
    Shape::of(|s| {
        // The frame comes from the torus the knot winds about, so the seam closes by itself.
        s.grid([across, around], [true, true], |u, w| {
            let here = point(w);
            let ahead = point(w + 1e-4) - here;
            let ahead = ahead / ahead.length();
            let (sin_p, cos_p) = sin_cos(TAU * p * w);
            let outward = here - v(cos_p, 0.0, sin_p) * (0.66 * radius);
            let outward = outward - ahead * ahead.dot(outward);
            let outward = outward / outward.length();
            let (su, cu) = sin_cos(TAU * u);
            here + (outward * cu + ahead.cross(outward) * su) * thick
        });
    })
}

/// The ornaments, all within 0.33 of the origin and with a hook at `(0, 0.33, 0)`.
fn ornaments() -> Vec<Shape> {
    let upright = tilted(V::ZERO, 0.0, PI * 0.5, 0.0);
    let hook = |s: &mut Shape, from: f64| s.rod(v(0.0, from, 0.0), v(0.0, 0.335, 0.0), 0.008, 6);
    vec![
        Shape::of(|s| {
            s.add(&knot(0.3, (2.0, 3.0), 0.045, [110, 9]), upright);
            hook(s, 0.25);
        }),
        Shape::of(|s| {
            s.add(&knot(0.3, (3.0, 4.0), 0.03, [140, 7]), upright);
            hook(s, 0.25);
        }),
        // Rings in rings, each on the one outside.
        Shape::of(|s| {
            for (k, radius) in [0.28, 0.21, 0.14].into_iter().enumerate() {
                let ring = Shape::of(|s| s.torus(V::ZERO, radius, 0.022, 44, 8));
                s.add(&ring, turned(V::ZERO, 0.9 * k as f64) * upright);
            }
            s.icosphere(V::ZERO, 0.07, 2);
            s.rod(v(0.0, 0.06, 0.0), v(0.0, 0.335, 0.0), 0.006, 5);
        }),
        // A lantern of staves.
        Shape::of(|s| {
            for k in 0..24 {
                let (sin, cos) = sin_cos(TAU * f64::from(k) / 24.0);
                let stave = curve(10, |t| {
                    let (up, out) = sin_cos(PI * (t - 0.5));
                    let r = 0.04 + 0.24 * out;
                    v(r * cos, 0.27 * up, r * sin)
                });
                s.tube(&stave, (0.009, 0.009), 4);
            }
            for (y, r) in [(0.27, 0.045), (-0.27, 0.045), (0.0, 0.285)] {
                s.torus(v(0.0, y, 0.0), r, 0.012, 32, 6);
            }
            hook(s, 0.26);
            s.cylinder(0.04, 0.24, 0.262, 12);
        }),
        // A ball of leaves.
        Shape::of(|s| {
            let leaf = leaf(3, 0.7, 0.3);
            let mut rng = Rng::new(0, "leaf ball");
            for _ in 0..190 {
                let d = rng.direction();
                let place = tilted(d * 0.17, rng.angle(), rng.range(-1.2, 1.2), 0.0);
                s.add(&leaf, place * Place::from_scale(V::splat(0.14)));
            }
            s.icosphere(V::ZERO, 0.165, 2);
            hook(s, 0.15);
        }),
        // A faceted drop under a bead.
        Shape::of(|s| {
            s.turned_body(-0.3, 0.2, [24, 36], |t| {
                if t == 0.0 || t == 1.0 {
                    0.0
                } else {
                    0.46 * t * (1.0 - t * t).sqrt() * (1.0 - 0.3 * t)
                }
            });
            s.ball(v(0.0, 0.24, 0.0), 0.05, 16, 10);
            hook(s, 0.27);
        }),
    ]
}

fn hang(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "hang");
    let ornaments = ornaments();
    let spacing = 2.0 * (HALF - 0.5) / f64::from(HUNG);
    for i in 0..SLATS {
        for k in 0..HUNG {
            let x = slat(i);
            let z = -HALF + 0.5 + spacing * (f64::from(k) + rng.range(0.47, 0.53));
            let post = |t: f64| t.abs() < 0.55 || t.abs() > HALF - 0.55;
            let lantern = (x + 4.6) * (x + 4.6) + (z - 5.4) * (z - 5.4) < 0.4;
            if (post(x) && post(z)) || lantern {
                continue;
            }
            let y = rng.range(2.9, 6.2);
            let place = turned(v(x, y, z), rng.angle());
            if (i * 7 + k * 5) % 23 == 0 {
                // A panel instead: few triangles, a big shadow.
                let panel =
                    Shape::of(|s| s.bevelled(v(0.0, -0.5, 0.0), v(0.58, 0.85, 0.02), 0.004));
                s.add(&panel, place);
            } else {
                s.add(&ornaments[rng.below(ornaments.len())], place);
            }
            s.cord(v(x, y + 0.325, z), v(x, TOP, z), 0.005);
        }
    }
}

/// What the budget leaves lies on the floor as leaves.
fn fallen(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "fallen");
    let leaf = leaf(3, 0.6, 0.12);
    while s.len() + leaf.len() <= TRIANGLES {
        let p = v(rng.range(-15.5, 15.5), 0.012, rng.range(-15.5, 15.5));
        let place = tilted(p, rng.angle(), rng.range(-0.1, 0.15), rng.range(-0.15, 0.15));
        s.add(&leaf, place * Place::from_scale(V::splat(rng.range(0.03, 0.09))));
    }
}

//! A colonnaded court in two storeys, open to the sky: big walls, floor and roof around columns,
//! arches, drapes and plants.

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, at, camera, chair, down_quad, leaf, light, mix, noise, plant,
    sin, sin_cos, stand, table, tilted, turned, v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "atrium",
    about: "66k triangles: two-storey colonnaded court with drapes, open to the sun (Sponza's kind)",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 66_000;
/// Half the court, to the columns' axes.
const COURT: (f64, f64) = (12.0, 4.8);
/// Width of the walks around the court.
const WALK: f64 = 3.6;
/// Bays along x and z.
const BAYS: (u32, u32) = (8, 3);
/// Heights: the lower arches spring, the gallery's floor, the upper arches spring, the roof.
const SPRING: f64 = 3.3;
const GALLERY: f64 = 5.2;
const UPPER_SPRING: f64 = 7.9;
const ROOF: f64 = 9.6;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    shell(&mut shape);
    colonnades(&mut shape);
    walls(&mut shape);
    drapes(&mut shape, seed);
    court(&mut shape, seed);
    fallen_leaves(&mut shape, seed);
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(-10.9, 2.3, -2.6), v(0.0, 4.0, 0.75), 66.0),
        lights: vec![
            light(
                "sun",
                LightShape::Directional {
                    direction: glam::vec3(0.38, -0.82, -0.42).normalize(),
                    angular_diameter_degrees: 1.5,
                },
                6.0,
                v(1.0, 0.93, 0.8),
            ),
            light("sky", down_quad(v(0.0, ROOF + 2.5, 0.0), 26.0, 12.0), 4.0, v(0.7, 0.85, 1.0)),
        ],
        ao_radius: 1.5,
        motion: None,
    }
}

/// Calls `visit` with the places of all bays around the court: the bay's middle on the columns'
/// axis with z pointing out of the court, and the bay's width.
fn around(mut visit: impl FnMut(Place, f64)) {
    let (x, z) = COURT;
    let (long, short) = (2.0 * x / f64::from(BAYS.0), 2.0 * z / f64::from(BAYS.1));
    for i in 0..BAYS.0 {
        let along = -x + long * (f64::from(i) + 0.5);
        visit(turned(v(along, 0.0, z), 0.0), long);
        visit(turned(v(along, 0.0, -z), PI), long);
    }
    for i in 0..BAYS.1 {
        let along = -z + short * (f64::from(i) + 0.5);
        visit(turned(v(x, 0.0, along), PI * 0.5), short);
        visit(turned(v(-x, 0.0, along), -PI * 0.5), short);
    }
}

/// Where columns stand: at every joint between bays, corners included.
fn joints() -> Vec<V> {
    let (x, z) = COURT;
    let mut places = Vec::new();
    for i in 0..=BAYS.0 {
        let along = mix(-x, x, f64::from(i) / f64::from(BAYS.0));
        places.extend([v(along, 0.0, z), v(along, 0.0, -z)]);
    }
    for i in 1..BAYS.1 {
        let along = mix(-z, z, f64::from(i) / f64::from(BAYS.1));
        places.extend([v(x, 0.0, along), v(-x, 0.0, along)]);
    }
    places
}

/// A horizontal ring of four slabs around the court.
fn ring(s: &mut Shape, inner: f64, outer: f64, low: f64, high: f64) {
    let (x, z) = COURT;
    for side in [-1.0, 1.0] {
        let (a, b) = (side * (z + inner), side * (z + outer));
        s.cuboid(v(-x - outer, low, a.min(b)), v(x + outer, high, a.max(b)));
        let (a, b) = (side * (x + inner), side * (x + outer));
        s.cuboid(v(a.min(b), low, -z - inner), v(a.max(b), high, z + inner));
    }
}

fn shell(s: &mut Shape) {
    let (x, z) = (COURT.0 + WALK, COURT.1 + WALK);
    s.room(v(-x, 0.0, -z), v(x, ROOF + 0.2, z), 0b10_0000);
    // Gallery floor and roof reach 2 cm into the walls; cornices run inside the court.
    ring(s, -0.3, WALK + 0.02, GALLERY, GALLERY + 0.3);
    ring(s, -0.42, -0.28, GALLERY + 0.06, GALLERY + 0.22);
    ring(s, -0.35, WALK + 0.02, ROOF, ROOF + 0.35);
    ring(s, -0.55, -0.33, ROOF + 0.12, ROOF + 0.42);
    ring(s, -0.2, 0.1, ROOF + 0.34, ROOF + 0.95);
    // A step up from the court to the walks, and a basin's kerb.
    ring(s, -0.55, WALK + 0.01, -0.1, 0.12);
}

/// A column of `height` with base and capital.
fn column(height: f64, radius: f64, sides: u32) -> Shape {
    let r = radius;
    Shape::of(|s| {
        s.block(V::ZERO, v(2.9 * r, 0.16, 2.9 * r));
        let h = height;
        let profile = [
            (1.3 * r, 0.155),
            (1.42 * r, 0.2),
            (1.3 * r, 0.25),
            (r, 0.32),
            (r, 0.4 * h),
            (0.86 * r, h - 0.62),
            (0.98 * r, h - 0.6),
            (0.88 * r, h - 0.55),
            (1.0 * r, h - 0.4),
            (1.35 * r, h - 0.2),
            (1.4 * r, h - 0.15),
        ];
        s.lathe(&profile, sides);
        // Leaves on the capital.
        let petal = leaf(2, 0.6, 0.45);
        for k in 0..6 {
            let angle = TAU * f64::from(k) / 6.0;
            let (sin, cos) = sin_cos(angle);
            let place = tilted(v(0.9 * r * sin, h - 0.5, 0.9 * r * cos), angle, -1.1, 0.0);
            s.add(&petal, place * Place::from_scale(V::splat(0.34)));
        }
        s.bevelled(v(0.0, h - 0.16, 0.0), v(3.0 * r, 0.16, 3.0 * r), 0.02);
    })
}

fn colonnades(s: &mut Shape) {
    let step = 0.12;
    let lower = column(SPRING - step, 0.3, 16);
    let upper = column(UPPER_SPRING - GALLERY - 0.3, 0.2, 12);
    for p in joints() {
        s.add(&lower, stand(p.x, step, p.z, 0.0));
        s.add(&upper, stand(p.x, GALLERY + 0.3, p.z, 0.0));
        // A keystone block above every column hides the joint of two arches.
        s.block(v(p.x, SPRING - 0.005, p.z), v(0.5, GALLERY - SPRING + 0.04, 0.56));
        s.block(v(p.x, UPPER_SPRING - 0.005, p.z), v(0.34, ROOF - UPPER_SPRING + 0.04, 0.42));
    }
    let baluster = Shape::of(|s| {
        s.lathe(&[(0.05, 0.0), (0.03, 0.1), (0.06, 0.28), (0.025, 0.55), (0.045, 0.7)], 6);
    });
    around(|place, width| {
        let depth = 0.44;
        let lower = Shape::of(|s| {
            let radius = 0.5 * width - 0.3;
            s.arch(width, GALLERY - SPRING + 0.02, depth, radius, 18);
            s.arch_moulding(radius + 0.09, 0.05, -0.5 * depth, [18, 5]);
        });
        s.add(&lower, place * at(v(0.0, SPRING, 0.0)));
        let upper = Shape::of(|s| {
            let radius = 0.5 * width - 0.24;
            s.arch(width, ROOF - UPPER_SPRING + 0.02, depth * 0.75, radius, 14);
            s.arch_moulding(radius + 0.07, 0.04, -0.375 * depth, [14, 4]);
        });
        s.add(&upper, place * at(v(0.0, UPPER_SPRING, 0.0)));
        // The gallery's balustrade.
        let y = GALLERY + 0.3;
        let rail = Shape::of(|s| {
            let clear = width - 0.42;
            s.bevelled(v(0.0, 0.75, 0.0), v(clear + 0.1, 0.09, 0.2), 0.02);
            s.block(v(0.0, -0.004, 0.0), v(clear + 0.08, 0.07, 0.18));
            for i in 0..7 {
                let x = clear * ((f64::from(i) + 0.5) / 7.0 - 0.5);
                s.add(&baluster, at(v(x, 0.06, 0.0)));
            }
        });
        s.add(&rail, place * at(v(0.0, y, 0.0)));
    });
}

/// Doors, pilasters and lamps on the outer walls.
fn walls(s: &mut Shape) {
    let lantern = Shape::of(|s| {
        s.rod(v(0.0, 0.0, 0.3), v(0.0, 0.12, -0.02), 0.015, 6);
        s.lathe(
            &[(0.0, -0.38), (0.07, -0.34), (0.1, -0.05), (0.13, -0.04), (0.03, 0.06), (0.0, 0.07)],
            8,
        );
    });
    around(|place, width| {
        let wall = place * at(v(0.0, 0.0, WALK)) * turned(V::ZERO, PI);
        for (floor, tall, wide) in [(0.12, 2.9, 1.3), (GALLERY + 0.3, 2.5, 1.0)] {
            let door = Shape::of(|s| {
                s.bevelled(v(0.0, -0.002, 0.0), v(wide, tall, 0.12), 0.02);
                for x in [-1.0, 1.0] {
                    s.block(v(x * (0.5 * wide + 0.09), -0.003, 0.0), v(0.2, tall + 0.05, 0.26));
                    for y in [0.12, 0.55] {
                        let panel = v(wide * 0.36, tall * 0.36, 0.05);
                        s.block(v(x * wide * 0.24, y * tall * 0.93, 0.05), panel);
                    }
                }
                s.block(v(0.0, tall + 0.04, 0.01), v(wide + 0.6, 0.18, 0.36));
            });
            s.add(&door, wall * at(v(0.0, floor, 0.0)));
            s.add(&lantern, wall * at(v(0.5 * width - 0.1, floor + 2.3, 0.0)));
        }
    });
}

fn drapes(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "drapes");
    let mut bay = 0;
    around(|place, width| {
        bay += 1;
        let inner = place * turned(V::ZERO, PI);
        if bay % 2 == 0 || bay > 2 * BAYS.0 {
            // A banner hung over the balustrade into the court.
            let wide = width * 0.36;
            let top = GALLERY + 1.2;
            let (a, b) = (rng.angle(), rng.range(1.9, 2.7));
            let cloth = Shape::of(|s| {
                s.grid([8, 14], [false, false], |u, w| {
                    let x = mix(-0.5, 0.5, u) * wide;
                    let wave = 0.05 * w * sin(9.0 * u + a + 2.0 * w) + 0.03 * w * sin(5.0 * w + a);
                    v(x, top - b * w, 0.47 + 0.04 * w + wave)
                });
            });
            s.add(&cloth, inner);
            let from = v(-0.55 * wide, top, 0.46);
            let bar = Shape::of(|s| {
                s.rod(from, v(-from.x, from.y, from.z), 0.025, 8);
                for x in [-0.4, 0.4] {
                    s.rod(v(x * wide, top, 0.46), v(x * wide, top - 0.12, 0.0), 0.02, 6);
                }
            });
            s.add(&bar, inner);
        } else {
            // A curtain across the lower arch, drawn to one side.
            let side = if rng.unit() < 0.5 { 0.0 } else { 0.5 };
            let clear = width - 0.7;
            let start = v(-0.5 * clear + side * clear, 0.0, -0.32);
            let bottom_top = (0.17, SPRING + 0.02);
            s.curtain(&mut rng, 0.5 * clear, bottom_top, (6, 0.08), [28, 8], place * at(start));
            let rod = Shape::of(|s| {
                s.rod(v(-0.5 * width, SPRING, 0.0), v(0.5 * width, SPRING, 0.0), 0.025, 8);
            });
            s.add(&rod, place * at(v(0.0, 0.03, -0.32)));
        }
    });
}

fn court(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "court");
    // A fountain in the middle: basin, stem and bowl.
    let fountain = Shape::of(|s| {
        s.lathe(
            &[
                (1.9, 0.0),
                (1.9, 0.1),
                (1.7, 0.12),
                (1.7, 0.5),
                (1.8, 0.55),
                (1.8, 0.62),
                (1.5, 0.62),
                (1.5, 0.42),
                (0.0, 0.42),
            ],
            32,
        );
        s.lathe(
            &[
                (0.35, 0.4),
                (0.16, 0.55),
                (0.13, 1.0),
                (0.2, 1.25),
                (0.75, 1.5),
                (0.8, 1.56),
                (0.72, 1.56),
                (0.1, 1.4),
                (0.07, 1.8),
                (0.16, 1.9),
                (0.0, 2.05),
            ],
            32,
        );
    });
    s.add(&fountain, stand(0.6, 0.0, 0.0, 0.0));
    for (x, z) in [(-7.2, 3.4), (-3.6, -3.4), (5.0, -3.3), (5.0, 3.3), (9.5, -2.5), (9.5, 2.5)] {
        let size = rng.range(1.5, 2.1);
        s.add(&plant(&mut rng, size, 7, 8, 2), stand(x, 0.0, z, 0.0));
    }
    // A table with chairs, and urns.
    s.add(&table(1.2, 0.74, 0.9), stand(-5.6, 0.0, 1.7, 0.35));
    s.add(&chair(), stand(-6.5, 0.0, 1.9, PI * 0.5 + 0.2));
    s.add(&chair(), stand(-4.6, 0.0, 1.2, -PI * 0.5 + 0.5));
    let urn = Shape::of(|s| {
        s.lathe(
            &[
                (0.22, 0.0),
                (0.22, 0.08),
                (0.1, 0.14),
                (0.3, 0.5),
                (0.34, 0.75),
                (0.16, 0.95),
                (0.24, 1.05),
                (0.2, 1.05),
                (0.12, 0.95),
                (0.0, 0.9),
            ],
            16,
        );
    });
    for (x, z) in [(-8.9, -3.3), (-1.5, 3.2), (2.6, -3.4), (-10.2, 3.5)] {
        s.add(&urn, stand(x, 0.0, z, 0.0));
    }
    // A wooden bench, and a rug thrown over the table as a cloth.
    s.add(&table(1.8, 0.45, 0.42), stand(-6.2, 0.0, -3.4, 0.0));
    let cloth = Shape::of(|s| {
        s.grid([24, 18], [false, false], |a, b| {
            let (x, z) = (mix(-0.85, 0.85, a), mix(-0.68, 0.68, b));
            let over = |t: f64, half: f64| (t.abs() - half).max(0.0);
            let (dx, dz) = (over(x, 0.605), over(z, 0.455));
            let down = (dx * dx + dz * dz).sqrt();
            let flare = 0.12 + 0.05 * sin(16.0 * (x + z));
            let pull = |t: f64, d: f64| t - if t < 0.0 { -d } else { d } * (1.0 - flare);
            let lift = 0.752 + 0.003 * noise(seed, 5.0 * x, 5.0 * z);
            v(pull(x, dx), lift - 0.95 * down, pull(z, dz))
        });
    });
    s.add(&cloth, turned(v(-5.6, -0.002, 1.7), 0.35));
    let jug =
        [(0.0, 0.0), (0.06, 0.0), (0.1, 0.12), (0.05, 0.24), (0.07, 0.3), (0.06, 0.3), (0.0, 0.2)];
    let jug = Shape::of(|s| s.lathe(&jug, 24));
    s.add(&jug, stand(-5.7, 0.756, 1.75, 0.0));
}

/// What the budget leaves goes into leaves under the plants and along the steps.
fn fallen_leaves(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "leaves");
    let leaf = leaf(3, 0.6, 0.15);
    while s.len() + leaf.len() <= TRIANGLES {
        let spread = rng.unit() * rng.unit();
        let side = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let p = v(rng.range(-11.2, 11.2), 0.008, side * (4.1 - 3.6 * spread));
        let place = tilted(p + V::Y * 0.01, rng.angle(), rng.range(0.0, 0.15), 0.0);
        s.add(&leaf, place * Place::from_scale(V::splat(rng.range(0.04, 0.1))));
    }
}

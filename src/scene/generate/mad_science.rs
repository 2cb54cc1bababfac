//! A closed laboratory: bare walls and a floor of two triangles around glassware, coils, pipes and
//! a covered patient.

mod machines;

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, at, book_row, bottle, camera, chest, down_quad, flask, light,
    mix, noise, sin, sin_cos, spline, stand, table, tilted, turned, v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "mad-science",
    about: "80k triangles: closed laboratory with flasks, coils, pipes, machines and a patient",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 80_000;
/// Half the room's width and depth, and its height.
const ROOM: V = v(5.0, 3.7, 4.0);
/// Top of the benches.
const BENCH: f64 = 0.92;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    shape.room(v(-ROOM.x, 0.0, -ROOM.z), ROOM, 0);
    beams(&mut shape);
    bench(&mut shape, seed);
    shelf(&mut shape, seed);
    patient(&mut shape, seed);
    machines::tesla_coil(&mut shape, v(-2.5, 0.0, -0.9));
    machines::boiler(&mut shape, v(4.0, 0.0, -2.2));
    machines::console(&mut shape, seed);
    machines::pipes(&mut shape);
    clutter(&mut shape, seed);
    shards(&mut shape, seed);
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(-3.5, 1.75, 3.2), v(0.6, 0.98, -1.3), 60.0),
        lights: vec![
            light("panel", down_quad(v(-1.6, 3.42, 1.4), 1.2, 0.6), 110.0, v(0.9, 1.0, 0.9)),
            light(
                "lamp",
                LightShape::Disk {
                    center: glam::vec3(0.9, 2.28, 0.1),
                    normal: -glam::Vec3::Y,
                    radius: 0.26,
                },
                130.0,
                v(1.0, 0.95, 0.85),
            ),
            light(
                "spark",
                LightShape::Point { position: glam::vec3(-2.05, 2.3, -0.55) },
                16.0,
                v(0.6, 0.7, 1.0),
            ),
        ],
        ao_radius: 0.5,
        motion: None,
    }
}

fn beams(s: &mut Shape) {
    for x in [-3.4, 0.0, 3.4] {
        s.block(v(x, ROOM.y - 0.2, 0.0), v(0.24, 0.21, 2.0 * ROOM.z + 0.02));
    }
    // The light panel hangs from two rods; the light itself is a hand's breadth below.
    s.bevelled(v(-1.6, 3.43, 1.4), v(1.3, 0.06, 0.7), 0.01);
    for x in [-2.1, -1.1] {
        s.rod(v(x, 3.48, 1.4), v(x, ROOM.y + 0.01, 1.4), 0.01, 6);
    }
    for (foot, size) in [
        (v(0.0, -0.002, -ROOM.z + 0.01), v(2.0 * ROOM.x - 0.02, 0.12, 0.03)),
        (v(ROOM.x - 0.01, -0.002, 0.0), v(0.03, 0.12, 2.0 * ROOM.z - 0.02)),
        (v(-ROOM.x + 0.01, -0.002, 0.0), v(0.03, 0.12, 2.0 * ROOM.z - 0.02)),
    ] {
        s.block(foot, size);
    }
}

/// The long bench at the back wall: flasks over burners, racks of tubes, a condenser.
fn bench(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "bench");
    let z = -ROOM.z + 0.42;
    s.bevelled(v(-0.6, BENCH - 0.05, z), v(6.4, 0.05, 0.78), 0.008);
    for i in 0..4 {
        let x = -3.0 + 1.6 * f64::from(i);
        s.add(&chest(v(0.8, BENCH - 0.05 + 0.003, 0.66), 4, 1), stand(x, 0.0, z, 0.0));
    }
    for (i, x) in [-3.2, -1.3, 0.2, 1.9].into_iter().enumerate() {
        let radius = rng.range(0.1, 0.15);
        let tripod = Shape::of(|s| {
            s.torus(v(0.0, 0.22, 0.0), 0.09, 0.008, 24, 6);
            for k in 0..3 {
                let (sin, cos) = sin_cos(TAU * f64::from(k) / 3.0 + 0.3);
                s.rod(v(0.13 * cos, 0.0, 0.13 * sin), v(0.09 * cos, 0.22, 0.09 * sin), 0.006, 5);
            }
            s.lathe(
                &[
                    (0.0, 0.0),
                    (0.05, 0.0),
                    (0.05, 0.02),
                    (0.015, 0.03),
                    (0.015, 0.15),
                    (0.02, 0.16),
                    (0.0, 0.16),
                ],
                14,
            );
        });
        s.add(&tripod, stand(x, BENCH, z, 0.0));
        s.add(&flask(radius, 0.2, 16), at(v(x, BENCH + 0.215, z)));
        // A tube from its neck down into a bottle.
        let neck = v(x, BENCH + 0.2 + 2.08 * radius + 0.2, z);
        let side = if i % 2 == 0 { 0.42 } else { -0.42 };
        let path = [
            neck,
            neck + v(0.1 * side, 0.12, 0.0),
            neck + v(0.7 * side, 0.06, 0.03),
            v(x + side, BENCH + 0.3, z + 0.05),
            v(x + side, BENCH + 0.2, z + 0.05),
        ];
        s.tube(&spline(&path, 6), (0.008, 0.008), 6);
        s.add(&bottle(0.055, 0.24, 16), stand(x + side, BENCH, z + 0.05, 0.0));
    }
    for x in [-2.4, 1.1] {
        let rack = Shape::of(|s| {
            for y in [0.0, 0.12] {
                s.block(v(0.0, y, 0.0), v(0.36, 0.012, 0.07));
            }
            for x in [-0.17, 0.17] {
                s.block(v(x, 0.01, 0.0), v(0.014, 0.112, 0.06));
            }
            for k in 0..8 {
                let tube = [
                    (0.0, 0.012),
                    (0.009, 0.018),
                    (0.012, 0.03),
                    (0.012, 0.19),
                    (0.015, 0.195),
                    (0.0, 0.18),
                ];
                let tube = Shape::of(|s| s.lathe(&tube, 8));
                s.add(&tube, at(v(-0.147 + 0.042 * f64::from(k), 0.0, 0.0)));
            }
        });
        s.add(&rack, stand(x, BENCH, z + 0.2, 0.05));
    }
    // A stand with a spiral condenser.
    let condenser = Shape::of(|s| {
        s.bevelled(V::ZERO, v(0.24, 0.02, 0.18), 0.005);
        s.rod(v(-0.09, 0.01, 0.0), v(-0.09, 0.86, 0.0), 0.008, 8);
        for y in [0.3, 0.7] {
            s.rod(v(-0.1, y, 0.0), v(0.05, y, 0.0), 0.007, 6);
        }
        let coil = Shape::of(|s| s.coil(0.05, (0.24, 0.76), 9, 0.007));
        s.add(&coil, at(v(0.04, 0.0, 0.0)));
        s.add(&flask(0.08, 0.06, 14), stand(0.06, 0.02, 0.0, 0.0));
    });
    s.add(&condenser, stand(-0.55, BENCH, z - 0.05, 0.2));
    for _ in 0..9 {
        let x = rng.range(-3.6, 2.4);
        let size = rng.range(0.022, 0.035);
        let place = stand(x, BENCH, z + rng.range(0.24, 0.33), 0.0);
        s.add(&bottle(size, size * rng.range(3.0, 5.0), 12), place);
    }
}

/// Two boards over the bench with jars and books.
fn shelf(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "shelf");
    for y in [1.75, 2.3] {
        s.bevelled(v(-0.6, y, -ROOM.z + 0.12), v(6.0, 0.03, 0.26), 0.005);
        for x in [-3.2, -1.5, 0.3, 2.0] {
            s.block(v(x, y - 0.14, -ROOM.z + 0.012), v(0.03, 0.142, 0.03));
            s.rod(v(x, y - 0.13, -ROOM.z + 0.02), v(x, y + 0.005, -ROOM.z + 0.2), 0.01, 5);
        }
        let mut x = -3.5;
        while x < 2.2 {
            if rng.unit() < 0.25 {
                let row = book_row(&mut rng, 0.4, 0.3, 0.18);
                s.add(&row, at(v(x, y + 0.0295, -ROOM.z + 0.13)));
                x += 0.46;
            } else {
                let radius = rng.range(0.04, 0.075);
                let model = bottle(radius, rng.range(0.16, 0.34), 8);
                s.add(&model, stand(x + radius, y + 0.03, -ROOM.z + rng.range(0.11, 0.14), 0.0));
                x += 2.0 * radius + rng.range(0.01, 0.09);
            }
        }
    }
}

/// Somebody under a sheet on the slab, and the lamp above.
fn patient(s: &mut Shape, seed: u64) {
    let place = turned(v(0.9, 0.0, 0.1), 0.2);
    let slab = Shape::of(|s| {
        s.bevelled(v(0.0, -0.002, 0.0), v(1.5, 0.06, 0.5), 0.01);
        s.lathe(&[(0.3, 0.055), (0.2, 0.1), (0.14, 0.3), (0.14, 0.6), (0.25, 0.79)], 24);
        s.bevelled(v(0.0, 0.78, 0.0), v(2.3, 0.08, 0.86), 0.015);
        // Bumps of a lying body: head, chest, belly, legs, feet.
        let bumps = [
            (-0.86, 0.0, 0.13, 0.14, 0.19),
            (-0.45, 0.0, 0.24, 0.22, 0.2),
            (-0.12, 0.0, 0.22, 0.2, 0.17),
            (0.28, -0.1, 0.3, 0.1, 0.14),
            (0.28, 0.1, 0.3, 0.1, 0.14),
            (0.68, -0.11, 0.28, 0.08, 0.11),
            (0.68, 0.11, 0.28, 0.08, 0.11),
            (0.93, -0.12, 0.1, 0.08, 0.17),
            (0.93, 0.12, 0.1, 0.08, 0.17),
            (-0.35, 0.29, 0.28, 0.06, 0.1),
            (-0.35, -0.29, 0.28, 0.06, 0.1),
        ];
        s.grid([76, 40], [false, false], |a, b| {
            let (sx, sz) = (mix(-1.08, 1.12, a), mix(-0.72, 0.72, b));
            let down = (sz.abs() - 0.42).max(0.0);
            let side = if sz < 0.0 { -1.0 } else { 1.0 };
            let z = if down > 0.0 { side * (0.445 + 0.1 * down) } else { sz };
            let mut lift: f64 = 0.0;
            for (x, w, rx, rz, h) in bumps {
                let (p, q) = ((sx - x) / rx, (sz - w) / rz);
                let d = p * p + q * q;
                // Cloth over a body: falls off slower than the body itself.
                lift += h / (1.0 + d * d * 0.7) * 0.85;
            }
            let lift =
                lift.min(0.24 + 0.3 * (lift - 0.24).max(0.0)) * (1.0 - (down * 20.0).min(1.0));
            let edge = ((sx + 1.08) * 7.0).min((1.12 - sx) * 7.0).min(1.0);
            let lift = lift * edge;
            let hang = (down * 8.0).min(1.0);
            let crease = 0.006 * noise(seed, 9.0 * sx, 9.0 * sz + 4.0 * sx);
            let fold = 0.018 * hang * (1.0 + sin(21.0 * sx + 3.0 * sin(4.0 * sx)));
            v(sx, 0.872 + lift + crease - 0.97 * down, z + side * fold)
        });
        for x in [-0.3, 0.35] {
            s.rod(v(x, 0.83, -0.44), v(x, 0.83, 0.44), 0.012, 6);
        }
    });
    s.add(&slab, place);
    // The lamp: a shade around the disk light on an arm from the ceiling.
    let lamp = Shape::of(|s| {
        s.lathe(&[(0.42, 2.2), (0.36, 2.32), (0.22, 2.42), (0.06, 2.46), (0.0, 2.47)], 40);
        let arm = spline(
            &[v(0.0, 2.45, 0.0), v(0.02, 2.75, 0.0), v(0.3, 3.0, 0.0), v(0.32, 3.71, 0.0)],
            8,
        );
        s.tube(&arm, (0.025, 0.03), 10);
        s.cylinder(0.1, 3.66, 3.71, 20);
    });
    s.add(&lamp, at(v(0.9, 0.0, 0.1)));
    // A trolley with instruments.
    let trolley = Shape::of(|s| {
        for y in [0.25, 0.78] {
            s.bevelled(v(0.0, y, 0.0), v(0.62, 0.025, 0.42), 0.006);
        }
        for (x, z) in [(-0.29, -0.19), (0.29, -0.19), (-0.29, 0.19), (0.29, 0.19)] {
            s.rod(v(x, 0.06, z), v(x, 0.86, z), 0.012, 8);
            let wheel = Shape::of(|s| s.torus(V::ZERO, 0.025, 0.012, 12, 5));
            s.add(&wheel, tilted(v(x, 0.037, z), 0.0, PI * 0.5, 0.0));
        }
        let mut rng = Rng::new(seed, "instruments");
        for k in 0..9 {
            let x = -0.22 + 0.055 * f64::from(k);
            let tool = turned(v(x, 0.811, 0.0), rng.range(-0.15, 0.15));
            let length = rng.range(0.1, 0.14);
            let model = Shape::of(|s| {
                s.tube(
                    &[v(0.0, 0.0, length), v(0.0, 0.0, -0.02), v(0.0, 0.0, -length)],
                    (0.006, 0.002),
                    6,
                );
            });
            s.add(&model, tool);
        }
        s.add(&bottle(0.04, 0.2, 18), stand(0.2, 0.275, 0.05, 0.0));
        s.add(&flask(0.07, 0.08, 14), stand(-0.15, 0.275, 0.0, 0.0));
    });
    s.add(&trolley, stand(-0.75, 0.0, 0.75, 0.5));
}

fn clutter(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "clutter");
    // A side table with flasks and books against the left wall.
    s.add(&table(1.5, 0.8, 0.65), stand(-4.6, 0.0, -1.9, PI * 0.5));
    for (k, z) in [-2.4, -2.0, -1.6].into_iter().enumerate() {
        let r = 0.09 + 0.02 * k as f64;
        s.add(&flask(r, 0.1, 16), stand(-4.65, 0.8, z, 0.0));
    }
    let row = book_row(&mut rng, 0.5, 0.28, 0.19);
    s.add(&row, turned(v(-4.78, 0.799, -1.25), PI * 0.5));
    // Sphere machine: two balls on columns with a belt's housing.
    for (x, z, h) in [(2.5, 2.6, 1.5), (3.3, 2.9, 1.15)] {
        let ball = Shape::of(|s| {
            s.lathe(
                &[
                    (0.0, 0.0),
                    (0.24, 0.0),
                    (0.24, 0.05),
                    (0.07, 0.09),
                    (0.06, h - 0.2),
                    (0.0, h - 0.2),
                ],
                24,
            );
            s.icosphere(v(0.0, h, 0.0), 0.25, 3);
        });
        s.add(&ball, stand(x, 0.0, z, 0.0));
    }
    // Gas cylinders with valves.
    for (x, z) in [(2.95, -3.6), (3.2, -3.35)] {
        let gas = Shape::of(|s| {
            s.lathe(
                &[
                    (0.0, 0.0),
                    (0.11, 0.0),
                    (0.12, 0.02),
                    (0.12, 1.2),
                    (0.1, 1.3),
                    (0.04, 1.36),
                    (0.035, 1.44),
                    (0.0, 1.44),
                ],
                26,
            );
            s.rod(v(-0.05, 1.46, 0.0), v(0.05, 1.46, 0.0), 0.02, 8);
            s.torus(v(0.0, 1.5, 0.0), 0.035, 0.008, 20, 6);
            s.rod(v(0.0, 1.43, 0.0), v(0.0, 1.51, 0.0), 0.008, 6);
        });
        s.add(&gas, stand(x, 0.0, z, 0.0));
    }
    for (x, z) in [(-1.6, -2.75), (0.6, -2.7)] {
        let stool = Shape::of(|s| {
            s.lathe(
                &[
                    (0.0, 0.6),
                    (0.15, 0.605),
                    (0.16, 0.62),
                    (0.16, 0.64),
                    (0.15, 0.655),
                    (0.0, 0.66),
                ],
                28,
            );
            s.torus(v(0.0, 0.25, 0.0), 0.15, 0.008, 28, 6);
            for k in 0..4 {
                let (sin, cos) = sin_cos(TAU * (f64::from(k) + 0.5) / 4.0);
                s.rod(v(0.19 * cos, 0.0, 0.19 * sin), v(0.11 * cos, 0.62, 0.11 * sin), 0.011, 8);
            }
        });
        s.add(&stool, stand(x, 0.0, z, rng.angle()));
    }
    for (x, z) in [(-3.4, -3.65), (2.6, -3.0), (4.6, -0.95)] {
        s.chain(v(x, ROOM.y, z), rng.range(2.2, 2.6), 0.09);
    }
    // Crates with a book open on top.
    s.bevelled(v(-4.2, -0.002, 0.3), v(0.8, 0.55, 0.8), 0.015);
    s.bevelled(v(-4.25, 0.546, 0.25), v(0.55, 0.4, 0.55), 0.015);
    for side in [-1.0, 1.0] {
        let pages = Shape::of(|s| {
            s.grid([16, 8], [false, false], |a, b| {
                let x = side * mix(0.0, 0.2, a);
                v(x, 0.03 * sin(PI * (0.15 + 0.85 * a)) + 0.004, mix(0.14, -0.14, b))
            });
        });
        s.add(&pages, turned(v(-4.25, 0.946, 0.25), 0.7));
    }
}

/// What the budget leaves: splinters of a dropped flask and screws from the machines.
fn shards(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "shards");
    let nut = Shape::of(|s| {
        s.lathe(&[(0.5, 0.0), (1.0, 0.0), (1.0, 0.7), (0.5, 0.7), (0.5, 0.0)], 6);
    });
    while s.len() + nut.len() <= TRIANGLES {
        let (sin, cos) = sin_cos(rng.angle());
        let spread = rng.unit();
        let r = 2.6 * spread * spread + 0.05;
        let p = v(-0.4 + 1.4 * r * cos, -0.0005, 1.9 + 0.55 * r * sin);
        let size = rng.range(0.006, 0.014);
        s.add(&nut, turned(p, rng.angle()) * Place::from_scale(V::splat(size)));
    }
}

//! A closed bedroom: six walls of a few triangles around cloth, books, leaves and a shaggy rug.

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, aimed_quad, at, blade, book, book_row, bottle, camera, chair,
    chest, cos, light, mix, noise, pillow, plant, scaled, sin, stand, table, teddy, tilted, turned,
    v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "bedroom",
    about: "361k triangles: closed room, bed, curtains, books and a rug of single fibres",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 361_000;
/// The room goes from the origin to here.
const ROOM: V = v(5.4, 2.75, 6.0);
/// The window in the wall at +x: from and to in z and y.
const WINDOW: [(f64, f64); 2] = [(2.3, 0.95), (4.1, 2.25)];
/// Height of the mattress.
const BED: f64 = 0.52;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    walls(&mut shape);
    bed(&mut shape, seed, v(3.3, 0.0, 0.12));
    bedside(&mut shape, seed);
    shelves(&mut shape, seed);
    curtains(&mut shape, seed);
    furniture(&mut shape, seed);
    rug(&mut shape, seed);
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(4.45, 1.72, 5.66), v(1.95, 0.75, 1.6), 60.0),
        lights: vec![
            light(
                "window",
                aimed_quad(v(ROOM.x + 0.14, 1.6, 3.2), v(0.0, 1.1, 3.2), 1.7, 1.2),
                26.0,
                v(0.85, 0.93, 1.0),
            ),
            light(
                "bedside",
                LightShape::Sphere { center: glam::vec3(2.02, 0.966, 0.36), radius: 0.045 },
                900.0,
                v(1.0, 0.8, 0.55),
            ),
            light(
                "ceiling",
                LightShape::Disk {
                    center: glam::vec3(2.7, 2.53, 3.2),
                    normal: -glam::Vec3::Y,
                    radius: 0.2,
                },
                170.0,
                v(1.0, 0.93, 0.82),
            ),
        ],
        ao_radius: 0.6,
        motion: None,
    }
}

fn walls(shape: &mut Shape) {
    shape.room(V::ZERO, ROOM, 0b00_0010);
    // The wall with the window, its recess and the pane behind it.
    let [(z0, y0), (z1, y1)] = WINDOW;
    let wall = Shape::of(|s| {
        s.wall_with_hole((ROOM.z, ROOM.y), (z0 - ROOM.z * 0.5, y0), (z1 - ROOM.z * 0.5, y1));
    });
    shape.add(&wall, turned(v(ROOM.x, 0.0, ROOM.z * 0.5), -PI * 0.5));
    let niche = Shape::of(|s| s.room(v(0.0, y0, z0), v(0.2, y1, z1), 0b00_0001));
    shape.add(&niche, at(v(ROOM.x, 0.0, 0.0)));
    let x = ROOM.x + 0.17;
    shape.block(v(x, y0 + 0.001, 0.5 * (z0 + z1)), v(0.04, y1 - y0 - 0.002, 0.05));
    shape.cuboid(v(x - 0.018, 1.57, z0 + 0.001), v(x + 0.018, 1.61, z1 - 0.001));
    shape.bevelled(v(ROOM.x - 0.03, y0 - 0.04, 3.2), v(0.16, 0.035, 2.0), 0.008);
    // Skirting boards, and a door in the wall at +z.
    for (foot, size) in [
        (v(2.7, 0.0, 0.008), v(5.38, 0.09, 0.02)),
        (v(0.008, 0.0, 3.0), v(0.02, 0.09, 5.98)),
        (v(ROOM.x - 0.008, 0.0, 3.0), v(0.02, 0.09, 5.98)),
    ] {
        shape.block(foot - V::Y * 0.002, size);
    }
    shape.bevelled(v(4.3, -0.002, ROOM.z), v(0.9, 2.05, 0.06), 0.01);
    for y in [0.25, 1.15] {
        shape.bevelled(v(4.3, y, ROOM.z - 0.03), v(0.66, 0.72, 0.03), 0.012);
    }
    // Ceiling lamp: a rose, a cord and a shade open below, around the disk light.
    let lamp = Shape::of(|s| {
        s.cylinder(0.06, 2.72, 2.76, 24);
        s.rod(v(0.0, 2.6, 0.0), v(0.0, 2.73, 0.0), 0.005, 6);
        s.lathe(&[(0.3, 2.45), (0.28, 2.52), (0.2, 2.58), (0.08, 2.61), (0.0, 2.612)], 48);
    });
    shape.add(&lamp, at(v(2.7, 0.0, 3.2)));
}

/// Where a sheet goes that lies on a bed of half width `half` and falls off its edge: the way
/// along x and how far down, for a distance `s` from the middle.
fn over_edge(s: f64, half: f64, flare: f64) -> (f64, f64) {
    let (side, beyond) = (if s < 0.0 { -1.0 } else { 1.0 }, s.abs() - half);
    if beyond <= 0.0 { (s, 0.0) } else { (side * (half + flare * beyond), beyond) }
}

/// A double bed with its head at the wall z = 0.
fn bed(shape: &mut Shape, seed: u64, place: V) {
    let model = Shape::of(|s| {
        s.bevelled(v(0.0, 0.0, -0.06), v(1.96, 1.15, 0.07), 0.02);
        for x in [-0.6, 0.0, 0.6] {
            s.bevelled(v(x, 0.62, -0.02), v(0.52, 0.44, 0.05), 0.02);
        }
        s.bevelled(v(0.0, 0.16, 1.05), v(1.86, 0.14, 2.14), 0.02);
        for (x, z) in [(-0.85, 0.15), (0.85, 0.15), (-0.85, 2.0), (0.85, 2.0)] {
            s.bevelled(v(x, 0.0, z), v(0.08, 0.17, 0.08), 0.01);
        }
        s.bevelled(v(0.0, 0.29, 1.04), v(1.8, BED - 0.29, 2.04), 0.05);
        // The duvet, turned back at its head end.
        s.grid([120, 130], [false, false], |a, b| {
            let (sx, sz) = (mix(-1.27, 1.27, a), mix(0.62, 2.42, b));
            let (mut x, down_x) = over_edge(sx, 0.93, 0.06);
            let (mut z, down_z) = over_edge(sz - 1.0, 1.1, 0.06);
            z += 1.0;
            let down = (down_x * down_x + down_z * down_z).sqrt();
            let hang = (down * 8.0).min(1.0);
            let folds =
                0.022 * hang * (sin(19.0 * sz + 2.0 * sin(3.0 * sx)) * (down_x * 8.0).min(1.0));
            x += folds * if sx < 0.0 { -1.0 } else { 1.0 };
            z += 0.022 * (down_z * 8.0).min(1.0) * sin(17.0 * sx + 1.0);
            let wrinkle = noise(seed, 3.1 * sx + 1.4 * sz, 2.0 * sz)
                + 0.5 * noise(seed ^ 1, 7.0 * sx, 6.0 * sz + 3.0 * sx)
                + 0.25 * noise(seed ^ 2, 15.0 * sx + 5.0 * sz, 13.0 * sz);
            let puff = 0.045 + 0.028 * wrinkle * (1.0 - hang);
            let roll = 0.05 * (1.0 - ((sz - 0.7) * 9.0).abs()).max(0.0);
            v(x, BED + puff + roll - 0.92 * down, z)
        });
        // A folded throw across the foot, riding on the duvet.
        s.grid([80, 40], [false, false], |a, b| {
            let (sx, sz) = (mix(-1.14, 1.14, a), mix(1.42, 1.92, b));
            let (x, down) = over_edge(sx, 0.96, 0.05);
            let edge = (b * (1.0 - b) * 12.0).min(1.0);
            let weave = 0.004 * sin(TAU * 30.0 * b) + 0.015 * noise(seed ^ 3, 4.0 * sx, 5.0 * sz);
            let swing = 0.025 * (down * 6.0).min(1.0) * sin(23.0 * sz);
            v(
                x + swing * if sx < 0.0 { -1.0 } else { 1.0 },
                BED + 0.098 + 0.02 * edge + weave - 0.9 * down,
                sz,
            )
        });
        for (i, (x, z, pitch)) in
            [(-0.45, 0.3, -0.35), (0.45, 0.3, -0.35), (-0.4, 0.47, -0.6), (0.42, 0.46, -0.55)]
                .into_iter()
                .enumerate()
        {
            let small = i >= 2;
            let size = if small { v(0.5, 0.15, 0.38) } else { v(0.74, 0.19, 0.5) };
            let pillow = pillow(seed ^ (40 + i as u64), size, [64, 40]);
            let y = BED + if small { 0.13 } else { 0.055 };
            let angle = 0.12 * (i as f64 - 1.5);
            s.add(&pillow, tilted(v(x, y, z), angle, -pitch, 0.0));
        }
    });
    shape.add(&model, at(place - V::Y * 0.002));
    let bear = teddy(0.85, 24);
    shape.add(&bear, turned(place + v(0.08, BED + 0.035, 0.86), 0.35));
}

fn bedside(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "bedside");
    let stand_model = chest(v(0.46, 0.54, 0.4), 2, 1);
    for (x, height) in [(2.02, 0.55), (4.58, 0.48)] {
        shape.add(&stand_model, stand(x, 0.0, 0.26, 0.0));
        shape.table_lamp(v(x, 0.538, 0.36 - 0.14), height, 40);
    }
    let lying = tilted(V::ZERO, 0.0, 0.0, PI * 0.5);
    for (x, z, count) in [(4.45, 0.4, 3), (2.18, 0.42, 1)] {
        let mut y = 0.538;
        for _ in 0..count {
            let thickness = rng.range(0.018, 0.035);
            let place = turned(v(x, y + 0.5 * thickness, z), rng.range(0.8, 1.3));
            shape.add(&book(thickness, 0.19, 0.13), place * lying * at(v(0.0, -0.095, 0.0)));
            y += thickness + 0.0004;
        }
    }
    shape.add(&bottle(0.035, 0.22, 20), stand(1.86, 0.538, 0.36, 0.0));
    shape.picture(0.9, 0.6, at(v(3.3, 1.75, 0.0)));
    shape.picture(0.35, 0.45, at(v(2.15, 1.78, 0.0)));
    shape.picture(0.35, 0.45, at(v(4.45, 1.78, 0.0)));
}

/// Bookcase and wardrobe on the wall x = 0.
fn shelves(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "shelves");
    let bookcase = Shape::of(|s| {
        let (width, height, depth) = (1.3, 2.05, 0.3);
        s.block(v(0.0, 0.0, 0.004), v(width - 0.05, height - 0.03, 0.006));
        for x in [-1.0, 1.0] {
            s.bevelled(
                v(x * (width * 0.5 - 0.0125), 0.0, depth * 0.5),
                v(0.025, height, depth),
                0.003,
            );
        }
        for i in 0..6 {
            let y = 0.06 + 0.385 * f64::from(i);
            s.bevelled(
                v(0.0, y, depth * 0.5 - 0.003),
                v(width - 0.046, 0.022, depth - 0.014),
                0.003,
            );
            if i == 5 {
                continue;
            }
            let half = i % 2 == 0 && rng.unit() < 0.6;
            let length = if half { 0.75 } else { width - 0.06 };
            let row = book_row(&mut rng, length, 0.33, 0.22);
            s.add(&row, at(v(-width * 0.5 + 0.026, y + 0.0215, 0.15)));
            if half {
                let vase = [
                    (0.0, 0.0),
                    (0.06, 0.0),
                    (0.09, 0.09),
                    (0.04, 0.2),
                    (0.055, 0.26),
                    (0.05, 0.26),
                    (0.0, 0.2),
                ];
                let vase = Shape::of(|s| s.lathe(&vase, 32));
                s.add(&vase, stand(0.4, y + 0.022, 0.15, 0.0));
            }
        }
        let globe = Shape::of(|s| {
            s.cylinder(0.09, 0.0, 0.015, 32);
            s.rod(v(0.0, 0.01, 0.0), v(0.0, 0.05, 0.0), 0.01, 10);
            s.icosphere(v(0.0, 0.17, 0.0), 0.125, 3);
            s.torus(v(0.0, 0.17, 0.0), 0.14, 0.006, 40, 6);
        });
        s.add(&globe, stand(0.3, 2.007, 0.15, 0.0));
    });
    shape.add(&bookcase, stand(0.004, 0.0, 3.05, PI * 0.5));
    let wardrobe = Shape::of(|s| {
        s.block(v(0.0, 0.0, -0.02), v(1.56, 0.08, 0.52));
        s.block(v(0.0, 0.075, 0.0), v(1.6, 2.065, 0.58));
        s.bevelled(v(0.0, 2.13, 0.01), v(1.7, 0.07, 0.66), 0.02);
        for x in [-0.4, 0.4] {
            s.bevelled(v(x, 0.1, 0.29), v(0.77, 2.01, 0.04), 0.008);
            for (y, h) in [(0.2, 0.75), (1.05, 0.95)] {
                s.bevelled(v(x, y, 0.305), v(0.55, h, 0.03), 0.012);
            }
            s.ball(v(x * 0.15, 1.05, 0.335), 0.018, 14, 8);
        }
    });
    shape.add(&wardrobe, stand(0.3, 0.0, 1.2, PI * 0.5));
    let case = Shape::of(|s| s.bevelled(V::ZERO, v(0.7, 0.22, 0.45), 0.03));
    shape.add(&case, stand(0.32, 2.198, 1.3, PI * 0.5 + 0.1));
}

fn curtains(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "curtains");
    let rail = ROOM.x - 0.13;
    shape.rod(v(rail, 2.42, 1.75), v(rail, 2.42, 4.65), 0.014, 14);
    for z in [1.73, 4.67] {
        shape.ball(v(rail, 2.42, z), 0.032, 18, 10);
        shape.rod(v(rail, 2.42, z), v(ROOM.x + 0.01, 2.42, z), 0.009, 8);
    }
    for start in [1.8, 4.02] {
        // Along z: the curtain's x is the room's -z.
        let place = turned(v(rail, 0.0, start + 0.58), PI * 0.5);
        shape.curtain(&mut rng, 0.58, (0.03, 2.405), (9, 0.045), [150, 50], place);
        for k in 0..9 {
            let z = start + 0.58 * (f64::from(k) + 0.5) / 9.0;
            let ring = Shape::of(|s| s.torus(V::ZERO, 0.022, 0.004, 16, 6));
            shape.add(&ring, tilted(v(rail, 2.415, z), 0.0, PI * 0.5, 0.0));
        }
    }
}

fn furniture(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "furniture");
    shape.add(&plant(&mut rng, 1.25, 16, 12, 5), stand(4.85, 0.0, 1.45, 0.0));
    // A desk under the window, with its chair drawn out.
    let z = 3.3;
    shape.add(&table(1.3, 0.74, 0.6), stand(4.95, 0.0, z, PI * 0.5));
    shape.add(&chair(), stand(4.28, 0.0, z + 0.1, PI * 0.5 + 0.25));
    let row = book_row(&mut rng, 0.42, 0.24, 0.17);
    shape.add(&row, turned(v(5.2, 0.739, z + 0.6), PI * 0.5));
    shape.table_lamp(v(5.1, 0.74, z - 0.45), 0.42, 32);
    let mug = [(0.0, 0.0), (0.035, 0.0), (0.04, 0.09), (0.036, 0.09), (0.032, 0.012), (0.0, 0.01)];
    let mug = Shape::of(|s| {
        s.lathe(&mug, 28);
        let handle = Shape::of(|s| s.torus(V::ZERO, 0.022, 0.005, 18, 7));
        s.add(&handle, tilted(v(0.045, 0.047, 0.0), 0.0, PI * 0.5, 0.0));
    });
    shape.add(&mug, stand(4.82, 0.74, z + 0.15, 0.6));
    shape.add(&mug, stand(1.9, 0.538, 0.44, 2.1));
    // A bench at the foot of the bed with a folded blanket, and things left on the floor.
    let z = 2.72;
    shape.add(&table(1.3, 0.42, 0.38), stand(3.3, 0.0, z, 0.0));
    for k in 0..3 {
        let y = 0.418 + 0.035 * f64::from(k);
        let place = scaled(v(3.05, y, z), 0.05 * f64::from(k), v(0.48, 0.04, 0.3));
        let fold = pillow(seed ^ (60 + k as u64), V::ONE, [48, 16]);
        shape.add(&fold, place);
    }
    shape.add(&pillow(seed ^ 70, v(0.4, 0.16, 0.4), [56, 32]), stand(3.68, 0.416, z, 0.3));
    // A slipper: a sole, and an upper that is highest at the instep and closes at the toes.
    let slipper = Shape::of(|s| {
        s.ellipsoid(v(0.0, 0.011, 0.0), v(0.048, 0.012, 0.135), 24, 10);
        s.grid([20, 12], [false, false], |a, b| {
            let z = mix(-0.015, 0.134, b);
            let wide = 0.051 * (1.0 - (z / 0.139) * (z / 0.139)).sqrt();
            let high = mix(0.06, 0.012, b * b);
            v(-wide * cos(PI * a), 0.008 + high * sin(PI * a), z)
        });
    });
    for (x, z, angle) in [(1.92, 1.75, 1.3), (1.9, 1.95, 1.75)] {
        shape.add(&slipper, stand(x, 0.0, z, angle));
    }
    let lying = tilted(V::ZERO, 0.0, 0.0, PI * 0.5);
    for (stack, x, z) in [(7, 0.85, 3.95), (4, 0.6, 4.3)] {
        let mut y = 0.0;
        for _ in 0..stack {
            let thickness = rng.range(0.02, 0.045);
            let size = (rng.range(0.2, 0.28), rng.range(0.15, 0.2));
            let place = turned(v(x, y + 0.5 * thickness - 0.0005, z), rng.range(-0.5, 0.5));
            let book = book(thickness, size.0, size.1);
            shape.add(&book, place * lying * at(v(0.0, -0.5 * size.0, 0.0)));
            y += thickness + 0.0004;
        }
    }
    let ball = Place::from_translation(v(2.0, 0.108, 3.15));
    shape.add(&Shape::of(|s| s.icosphere(V::ZERO, 0.11, 3)), ball);
}

/// A shaggy rug: a thin mat and as many fibres as the budget leaves.
fn rug(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "rug");
    let (center, half) = (v(2.45, 0.0, 3.75), v(1.35, 0.0, 0.95));
    shape.block(center - V::Y * 0.002, v(2.0 * half.x, 0.008, 2.0 * half.z));
    let pieces = 2;
    let fibres = TRIANGLES.saturating_sub(shape.len()) / (2 * pieces as usize - 1);
    for _ in 0..fibres {
        let root = center + v(rng.range(-half.x, half.x), 0.0055, rng.range(-half.z, half.z));
        blade(shape, &mut rng, root, 0.03, 0.0035, pieces);
    }
}

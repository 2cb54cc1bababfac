//! A fairground at dusk: one huge lawn and big canvas around crowds of small things.

mod rides;

use super::kit::{
    PI, Place, Rng, Shape, TAU, V, aimed_quad, at, barrel, blade, camera, curve, figure, light,
    mix, sin, sin_cos, stand, table, teddy, tilted, turned, v,
};
use super::{Generated, GeneratorEntry};
use crate::scene::LightShape;

/// The catalogue's entry.
pub(super) static ENTRY: GeneratorEntry = GeneratorEntry {
    name: "carnival",
    about: "446k triangles: fairground with tents, wheel, carousel, stalls, bulbs and a crowd",
    triangles: TRIANGLES,
    generate,
};

const TRIANGLES: usize = 446_000;

fn generate(seed: u64) -> Generated {
    let mut shape = Shape::new();
    let lawn = 90.0;
    let p = |x: f64, z: f64| v(x * lawn, 0.0, z * lawn);
    shape.quad(p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0), p(-1.0, -1.0));
    shape.add(&rides::ferris_wheel(), stand(9.5, 0.0, -17.0, -0.25));
    shape.add(&rides::carousel(), stand(-5.2, 0.0, -4.0, 0.2));
    let tent = big_top(7.5, 3.2, 8.5);
    for (x, z, size) in
        [(-15.0, -17.0, 1.0), (26.0, -24.0, 1.15), (-31.0, -13.0, 0.85), (-4.0, -34.0, 1.2)]
    {
        shape.add(&tent, stand(x, 0.0, z, 0.3) * Place::from_scale(V::splat(size)));
    }
    stalls(&mut shape, seed);
    lights_on_wires(&mut shape);
    fence(&mut shape);
    small_things(&mut shape, seed);
    crowd(&mut shape, seed);
    lawn_and_litter(&mut shape, seed);
    Generated {
        mesh: shape.into_mesh(),
        camera: camera(v(-3.5, 4.3, 15.5), v(1.2, 2.95, -3.0), 57.0),
        lights: vec![
            light(
                "floodlight",
                aimed_quad(v(-16.0, 17.0, 9.0), v(1.0, 0.0, -3.0), 4.0, 3.0),
                250.0,
                v(1.0, 0.93, 0.8),
            ),
            light(
                "moon-balloon",
                LightShape::Sphere { center: glam::vec3(17.0, 13.0, 2.0), radius: 1.2 },
                140.0,
                v(0.75, 0.85, 1.0),
            ),
            light(
                "lamp",
                LightShape::Point { position: glam::vec3(1.6, 3.6, 3.0) },
                60.0,
                v(1.0, 0.75, 0.45),
            ),
        ],
        ao_radius: 1.5,
        motion: None,
    }
}

/// A round tent with a scalloped eave, striped seams and a flag.
fn big_top(radius: f64, wall: f64, top: f64) -> Shape {
    Shape::of(|s| {
        let seams = 24.0;
        s.grid([96, 10], [true, false], |u, w| {
            let (sin_u, cos_u) = sin_cos(-TAU * u);
            // The canvas sags between its seams and towards the ground.
            let sag = (sin(PI * seams * u)).abs();
            let r = radius * (1.0 - w) * (1.0 - 0.25 * w * (1.0 - w)) + 0.12;
            let y = mix(wall, top, w * (0.72 + 0.28 * w)) - 0.05 * r * sag * (1.0 - w) * (0.3 + w);
            v(r * cos_u, y, r * sin_u)
        });
        s.grid([96, 2], [true, false], |u, w| {
            let (sin_u, cos_u) = sin_cos(-TAU * u);
            let scallop = 0.16 * (sin(PI * seams * u)).abs();
            let r = radius + 0.16 + 0.03 * (1.0 - w);
            v(r * cos_u, wall + 0.03 - (0.3 + scallop) * (1.0 - w), r * sin_u)
        });
        s.grid([120, 3], [false, false], |u, w| {
            // The wall leaves an entrance open.
            let angle = PI * 0.5 + 0.2 + (TAU - 0.4) * u;
            let (sin_u, cos_u) = sin_cos(-angle + PI);
            let r = radius - 0.15 + 0.05 * sin(PI * 60.0 * u) + 0.1 * (1.0 - w);
            v(r * cos_u, mix(0.0, wall - 0.02, w), r * sin_u)
        });
        s.rod(v(0.0, 0.0, 0.0), v(0.0, top + 1.6, 0.0), 0.07, 10);
        s.add(&flag(1.3, 0.6), at(v(0.06, top + 1.0, 0.0)));
        for k in 0..12 {
            let (sin_k, cos_k) = sin_cos(TAU * f64::from(k) / 12.0);
            let out = v(cos_k, 0.0, sin_k);
            let (head, peg) = (out * (radius + 0.12) + V::Y * wall, out * (radius + 2.2));
            s.rod(head, peg - V::Y * 0.05, 0.015, 4);
            s.rod(peg - out * 0.05 - V::Y * 0.1, peg + out * 0.08 + V::Y * 0.25, 0.03, 6);
            s.rod(out * (radius + 0.05), head, 0.04, 8);
        }
    })
}

/// A flag that flies along +x from the origin.
fn flag(length: f64, height: f64) -> Shape {
    Shape::of(|s| {
        s.grid([12, 5], [false, false], |u, w| {
            let taper = mix(1.0, 0.25, u);
            let wave = 0.1 * length * u * sin(7.0 * u + 0.8 * w);
            v(length * u, height * (0.5 + (w - 0.5) * taper), wave)
        });
    })
}

/// A booth with counter, striped awning, shelves and prizes.
fn stall(rng: &mut Rng) -> Shape {
    let bear = teddy(0.7, 9);
    Shape::of(|s| {
        let (width, depth) = (3.2, 2.2);
        s.bevelled(v(0.0, 0.0, 0.5 * depth), v(width, 1.0, 0.25), 0.02);
        s.bevelled(v(0.0, 0.99, 0.5 * depth), v(width + 0.15, 0.06, 0.5), 0.015);
        s.block(v(0.0, 0.0, -0.5 * depth), v(width, 2.7, 0.06));
        for x in [-1.0, 1.0] {
            s.block(v(x * 0.5 * width, 0.0, -0.06), v(0.06, 1.6, depth));
            s.rod(
                v(x * (0.5 * width - 0.03), 0.95, 0.5 * depth),
                v(x * (0.5 * width - 0.03), 2.5, 0.5 * depth),
                0.04,
                8,
            );
        }
        s.grid([48, 6], [false, false], |u, w| {
            let gather = 0.05 * (sin(PI * 12.0 * u)).abs();
            let z = mix(0.5 * depth + 0.55, -0.5 * depth - 0.1, w);
            v(mix(-0.54, 0.54, u) * width, 2.42 + 0.55 * w - gather, z)
        });
        s.grid([48, 2], [false, false], |u, w| {
            let scallop = 0.12 * (sin(PI * 12.0 * u)).abs();
            v(mix(-0.54, 0.54, u) * width, 2.4 - (0.16 + scallop) * (1.0 - w), 0.5 * depth + 0.57)
        });
        for (k, y) in [1.05, 1.6, 2.1].into_iter().enumerate() {
            s.block(v(0.0, y, -0.5 * depth + 0.18), v(width - 0.1, 0.03, 0.32));
            for i in 0..8 {
                let x = -1.37 + 0.39 * f64::from(i) + rng.range(-0.03, 0.03);
                let p = v(x, y + 0.029, -0.5 * depth + 0.19);
                match (i + k as u32 + rng.below(2) as u32) % 4 {
                    0 | 1 => s.add(&bear, turned(p + V::Y * 0.004, rng.range(-0.4, 0.4))),
                    2 => s.icosphere(p + V::Y * 0.138, 0.14, 2),
                    _ => s.add(&barrel(0.1, 0.3, 14), turned(p, 0.0)),
                }
            }
        }
        for i in 0..6 {
            let p = v(-1.25 + 0.5 * f64::from(i), 1.049, 0.5 * depth + rng.range(-0.1, 0.1));
            if rng.unit() < 0.5 {
                s.cylinder_at(p, 0.05, 0.14, 14);
            } else {
                s.ball(p + V::Y * 0.054, 0.055, 14, 8);
            }
        }
        for i in 0..16 {
            let x = mix(-0.52, 0.52, f64::from(i) / 15.0) * width;
            s.icosphere(v(x, 2.36, 0.5 * depth + 0.63), 0.04, 1);
            s.rod(v(x, 2.38, 0.5 * depth + 0.63), v(x, 2.41, 0.5 * depth + 0.55), 0.012, 4);
        }
    })
}

/// Where the stalls stand: x, z and the way they face.
const STALLS: [(f64, f64, f64); 11] = [
    (7.4, 2.6, -0.9),
    (9.7, -2.4, -0.75),
    (-12.5, 1.0, 1.1),
    (-14.0, -4.5, 1.25),
    (-7.0, -14.0, 0.3),
    (-1.5, -15.5, 0.1),
    (20.0, -9.0, -0.8),
    (17.0, -4.5, -1.1),
    (-20.0, -2.0, 1.2),
    (3.0, -22.0, 0.0),
    (-22.0, 5.5, 1.4),
];

fn stalls(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "stalls");
    for (x, z, angle) in STALLS {
        shape.add(&stall(&mut rng), stand(x, 0.0, z, angle));
    }
}

/// Lamp posts with strings of bulbs and bunting between them.
fn lights_on_wires(shape: &mut Shape) {
    let posts = [(-9.5, 8.0), (5.2, 8.2), (13.0, 5.2), (12.0, -8.0), (0.8, -9.5), (-12.8, -9.5)];
    let post = Shape::of(|s| {
        s.lathe(&[(0.2, 0.0), (0.2, 0.1), (0.09, 0.25), (0.06, 5.0), (0.1, 5.05), (0.0, 5.1)], 14);
        s.icosphere(v(0.0, 5.25, 0.0), 0.17, 2);
    });
    for (x, z) in posts {
        shape.add(&post, stand(x, 0.0, z, 0.0));
    }
    let bulb = Shape::of(|s| {
        s.icosphere(V::ZERO, 0.06, 1);
        s.rod(v(0.0, 0.05, 0.0), v(0.0, 0.115, 0.0), 0.022, 6);
    });
    for i in 0..posts.len() {
        for k in [i + 1, i + 2] {
            let ((ax, az), (bx, bz)) = (posts[i], posts[k % posts.len()]);
            let (a, b) = (v(ax, 5.0, az), v(bx, 5.0, bz));
            let sag = if k == i + 1 { 0.9 } else { 1.3 };
            let along = |t: f64| a + (b - a) * t - V::Y * (4.0 * sag * t * (1.0 - t));
            shape.tube(&curve(24, along), (0.012, 0.012), 4);
            let count = ((b - a).length() / 0.55) as u32;
            for n in 1..count {
                let p = along(f64::from(n) / f64::from(count));
                if k == i + 1 {
                    shape.add(&bulb, at(p - V::Y * 0.11));
                } else {
                    let side = (b - a) / (b - a).length() * 0.16;
                    shape.tri(p - side, p - V::Y * 0.42, p + side);
                }
            }
        }
    }
}

fn fence(shape: &mut Shape) {
    let picket = Shape::of(|s| {
        s.bevelled(V::ZERO, v(0.09, 0.95, 0.025), 0.008);
    });
    for k in 0..300 {
        let x = -45.0 + 0.3 * f64::from(k);
        shape.add(&picket, stand(x, 0.0, -42.0, 0.0));
    }
    for y in [0.3, 0.7] {
        shape.block(v(-0.15, y, -42.03), v(90.0, 0.07, 0.04));
    }
}

fn small_things(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "small things");
    // A balloon seller's bunch over a cart.
    let cart = v(1.6, 0.0, 3.0);
    let model = Shape::of(|s| {
        s.bevelled(v(0.0, 0.5, 0.0), v(1.5, 0.55, 0.8), 0.03);
        for (x, z) in [(-0.5, -0.42), (0.5, -0.42), (-0.5, 0.42), (0.5, 0.42)] {
            let wheel = Shape::of(|s| {
                s.torus(V::ZERO, 0.33, 0.035, 32, 8);
                for k in 0..5 {
                    let (sin_k, cos_k) = sin_cos(PI * f64::from(k) / 5.0);
                    let spoke = v(0.32 * cos_k, 0.0, 0.32 * sin_k);
                    s.rod(-spoke, spoke, 0.014, 6);
                }
            });
            s.add(&wheel, tilted(v(x, 0.365, z), 0.0, PI * 0.5, 0.0));
        }
        for x in [-0.65, 0.65] {
            s.rod(v(x, 1.0, 0.0), v(x, 2.2, 0.0), 0.025, 8);
        }
        s.grid([40, 8], [false, false], |u, w| {
            let (sin_w, cos_w) = sin_cos(PI * w);
            v(
                mix(-0.85, 0.85, u),
                2.15 + 0.35 * sin_w - 0.02 * (sin(PI * 10.0 * u)).abs(),
                0.6 * cos_w,
            )
        });
    });
    shape.add(&model, stand(cart.x - 1.5, 0.0, cart.z - 0.6, 0.4));
    for (x, z, count) in [(-1.2, 4.6, 22), (5.0, -1.5, 18), (-9.0, 3.4, 14)] {
        let hand = v(x, 1.15, z);
        for _ in 0..count {
            let d = rng.direction();
            let p = hand + v(0.65 * d.x, 2.1 + 0.55 * d.y, 0.65 * d.z);
            shape.cord(hand, p - V::Y * 0.2, 0.004);
            let balloon = v(0.17, 0.21, 0.17);
            shape.ellipsoid(p, balloon, 14, 8);
        }
        shape.cylinder_at(v(x, -0.002, z), 0.22, 1.2, 20);
    }
    // Benches, bins and barrels.
    let bench = table(1.7, 0.45, 0.4);
    for (x, z, angle) in [(-6.8, 4.0, 0.9), (4.2, 5.4, -0.5), (0.6, -7.4, 0.1), (10.8, 1.2, 1.0)] {
        shape.add(&bench, stand(x, 0.0, z, angle));
    }
    let bin = barrel(0.3, 0.85, 20);
    for (x, z) in [(-5.2, 4.9), (5.6, 4.6), (-10.2, -1.6), (8.0, -5.0), (6.1, 5.1)] {
        shape.add(&bin, stand(x, 0.0, z, rng.angle()));
    }
    // A lamp post over the cart, around the point light.
    shape.rod(v(cart.x, -0.01, cart.z), v(cart.x, 3.4, cart.z), 0.045, 10);
    shape.lathe_at(
        v(cart.x, 3.36, cart.z),
        &[(0.0, 0.0), (0.2, 0.02), (0.22, 0.06), (0.0, 0.08)],
        20,
    );
    for k in 0..3 {
        let (sin_k, cos_k) = sin_cos(TAU * f64::from(k) / 3.0);
        let p = v(cart.x + 0.18 * cos_k, 3.4, cart.z + 0.18 * sin_k);
        shape.rod(p, p + V::Y * 0.5, 0.012, 6);
    }
    shape.lathe_at(
        v(cart.x, 3.86, cart.z),
        &[(0.0, 0.0), (0.24, 0.02), (0.05, 0.2), (0.0, 0.24)],
        20,
    );
}

/// Whether nothing big stands within `margin` of a point on the lawn.
fn is_free(x: f64, z: f64, margin: f64) -> bool {
    let far = |cx: f64, cz: f64, r: f64| {
        let reach = r + margin;
        (x - cx) * (x - cx) + (z - cz) * (z - cz) > reach * reach
    };
    far(-5.2, -4.0, 4.9)
        && far(9.5, -17.0, 6.0)
        && far(-15.0, -17.0, 8.2)
        && far(26.0, -24.0, 9.5)
        && far(-31.0, -13.0, 7.2)
        && far(-4.0, -34.0, 9.8)
        && far(0.1, 2.4, 1.3)
        && STALLS.iter().all(|&(sx, sz, _)| far(sx, sz, 2.1))
        && [
            (1.6, 3.0),
            (-1.2, 4.6),
            (5.0, -1.5),
            (-9.0, 3.4),
            (-6.8, 4.0),
            (4.2, 5.4),
            (0.6, -7.4),
            (10.8, 1.2),
            (-5.2, 4.9),
            (5.6, 4.6),
            (6.1, 5.1),
        ]
        .iter()
        .all(|&(sx, sz)| far(sx, sz, 0.5))
}

fn crowd(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "crowd");
    let people: Vec<Shape> = (0..24)
        .map(|k| {
            let height = if k % 5 == 0 { rng.range(1.1, 1.35) } else { rng.range(1.6, 1.88) };
            figure(&mut rng, height)
        })
        .collect();
    let mut placed: Vec<(f64, f64)> = Vec::new();
    // Bounded, so that an unlucky seed cannot hang it.
    for _ in 0..20_000 {
        if placed.len() == 200 {
            break;
        }
        let (x, z) = (rng.range(-22.0, 20.0), rng.range(-26.0, 7.5));
        let apart = |&(px, pz): &(f64, f64)| (x - px) * (x - px) + (z - pz) * (z - pz) > 0.5;
        if is_free(x, z, 0.35) && placed.iter().all(apart) {
            placed.push((x, z));
            let person = &people[rng.below(people.len())];
            shape.add(person, stand(x, 0.0, z, rng.angle()));
        }
    }
}

/// Paper on the ground, then grass in tufts up to the budget, denser near the camera.
fn lawn_and_litter(shape: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "lawn");
    for _ in 0..900 {
        let (x, z) = (rng.range(-14.0, 13.0), rng.range(-14.0, 11.0));
        let (u, w) = (v(rng.range(0.03, 0.07), 0.002, 0.0), v(0.01, 0.004, rng.range(0.03, 0.07)));
        let p = v(x, 0.006, z);
        shape.quad(p - u - w + V::Y * 0.004, p - u + w, p + u + w, p + u - w);
    }
    const PER_TUFT: usize = 24;
    const PIECES: u32 = 2;
    let blades = TRIANGLES.saturating_sub(shape.len()) / (2 * PIECES as usize - 1);
    let (mut tuft, mut size) = (V::ZERO, 0.0);
    for i in 0..blades {
        if i % PER_TUFT == 0 {
            tuft = loop {
                let (x, away) = (rng.range(-1.0, 1.0), rng.unit());
                let z = 13.8 - 24.0 * away * away;
                let p = v(-3.0 + x * (4.0 + 0.75 * (15.0 - z)), 0.0, z);
                if is_free(p.x, p.z, -0.3) {
                    break p;
                }
            };
            size = rng.range(0.05, 0.12);
        }
        let (sin_a, cos_a) = sin_cos(rng.angle());
        let r = 0.16 * rng.unit();
        let root = tuft + v(r * cos_a, -0.003, r * sin_a);
        blade(shape, &mut rng, root, size, 0.009, PIECES);
    }
}

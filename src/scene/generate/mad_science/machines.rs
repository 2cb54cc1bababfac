//! The laboratory's machines and pipes.

use super::ROOM;
use crate::scene::generate::kit::{
    PI, Rng, Shape, TAU, V, at, curve, mix, sin_cos, spline, stand, tilted, turned, v,
};

/// A coil as high as a man: flat primary, wound secondary, torus and ball.
pub(super) fn tesla_coil(s: &mut Shape, foot: V) {
    let model = Shape::of(|s| {
        s.bevelled(v(0.0, -0.002, 0.0), v(0.9, 0.35, 0.9), 0.02);
        for (x, z) in [(-0.3, -0.3), (0.3, -0.3), (-0.3, 0.3), (0.3, 0.3)] {
            s.cylinder(0.03, 0.345, 0.52, 12);
            s.rod(v(x, 0.34, z), v(x, 0.56, z), 0.03, 10);
        }
        // Flat primary, then the wound secondary under its torus.
        let primary = curve(6 * 24, |t| {
            let (sin, cos) = sin_cos(TAU * 6.0 * t);
            let r = mix(0.2, 0.44, t);
            v(r * cos, 0.57, r * sin)
        });
        s.tube(&primary, (0.012, 0.012), 5);
        s.cylinder(0.125, 0.5, 1.9, 32);
        s.coil(0.13, (0.62, 1.82), 38, 0.011);
        s.lathe(&[(0.125, 1.895), (0.2, 1.93), (0.2, 1.96), (0.05, 2.0), (0.05, 2.1)], 28);
        s.torus(v(0.0, 2.14, 0.0), 0.3, 0.1, 44, 14);
        s.cylinder(0.24, 2.12, 2.16, 32);
        s.rod(v(0.0, 2.15, 0.0), v(0.0, 2.42, 0.0), 0.015, 8);
        s.ball(v(0.0, 2.46, 0.0), 0.06, 20, 12);
    });
    s.add(&model, at(foot));
}

/// A dial that faces +z.
fn gauge() -> Shape {
    let face = Shape::of(|s| {
        s.cylinder(0.1, 0.0, 0.03, 16);
        s.torus(v(0.0, 0.032, 0.0), 0.095, 0.011, 18, 5);
        for k in 0..6 {
            let (sin, cos) = sin_cos(TAU * (f64::from(k) / 7.0 + 0.16));
            s.block(v(0.072 * cos, 0.029, 0.072 * sin), v(0.012, 0.004, 0.004));
        }
        s.tri(v(-0.006, 0.037, 0.0), v(0.05, 0.037, -0.05), v(0.006, 0.037, 0.006));
    });
    face.placed(tilted(V::ZERO, 0.0, PI * 0.5, 0.0))
}

/// A riveted boiler with gauges, and its pipes up to the ceiling.
pub(super) fn boiler(s: &mut Shape, foot: V) {
    let model = Shape::of(|s| {
        s.lathe(
            &[
                (0.75, -0.002),
                (0.75, 0.12),
                (0.68, 0.14),
                (0.7, 0.2),
                (0.7, 1.75),
                (0.64, 1.95),
                (0.45, 2.12),
                (0.2, 2.2),
                (0.2, 2.3),
                (0.14, 2.32),
            ],
            44,
        );
        s.tube(
            &[v(0.0, 2.25, 0.0), v(0.0, 3.0, 0.0), v(0.0, ROOM.y + 0.01, 0.0)],
            (0.14, 0.14),
            22,
        );
        let rivet = Shape::of(|s| s.lathe(&[(0.018, 0.0), (0.013, 0.009), (0.0, 0.013)], 6));
        for y in [0.28, 0.95, 1.65] {
            s.lathe(
                &[(0.7, y - 0.05), (0.712, y - 0.045), (0.712, y + 0.045), (0.7, y + 0.05)],
                44,
            );
            for k in 0..30 {
                let angle = TAU * f64::from(k) / 30.0;
                let (sin, cos) = sin_cos(angle);
                let out = turned(v(0.707 * sin, y, 0.707 * cos), angle)
                    * tilted(V::ZERO, 0.0, PI * 0.5, 0.0);
                s.add(&rivet, out);
            }
        }
        let door = Shape::of(|s| {
            s.bevelled(v(0.0, 0.38, 0.66), v(0.5, 0.42, 0.1), 0.02);
            for k in 0..4 {
                s.block(v(0.0, 0.46 + 0.08 * f64::from(k), 0.708), v(0.36, 0.02, 0.02));
            }
        });
        s.add(&door, turned(V::ZERO, -0.7));
        for (angle, y) in [(-0.45, 1.3), (-0.95, 1.3), (-0.7, 1.52)] {
            s.add(&gauge(), turned(V::ZERO, angle) * at(v(0.0, y, 0.695)));
        }
        let wheel = Shape::of(|s| {
            s.torus(V::ZERO, 0.14, 0.014, 28, 8);
            for k in 0..5 {
                let (sin, cos) = sin_cos(TAU * f64::from(k) / 5.0);
                s.rod(V::ZERO, v(0.14 * cos, 0.0, 0.14 * sin), 0.009, 6);
            }
            s.rod(v(0.0, 0.02, 0.0), v(0.0, -0.2, 0.0), 0.016, 8);
        });
        s.add(&wheel, turned(V::ZERO, -1.35) * tilted(v(0.0, 1.1, 0.86), 0.0, PI * 0.5, 0.0));
    });
    s.add(&model, at(foot));
}

/// The control desk at the right wall: gauges, knobs, levers and lamps.
pub(super) fn console(s: &mut Shape, seed: u64) {
    let mut rng = Rng::new(seed, "console");
    let model = Shape::of(|s| {
        s.block(v(0.0, 0.0, -0.02), v(2.3, 0.1, 0.5));
        s.bevelled(v(0.0, 0.095, 0.0), v(2.4, 0.8, 0.6), 0.015);
        s.bevelled(v(0.0, 0.89, -0.2), v(2.4, 1.15, 0.22), 0.015);
        for row in 0..2 {
            for k in 0..7 {
                let place =
                    at(v(-0.96 + 0.32 * f64::from(k), 1.28 + 0.42 * f64::from(row), -0.092));
                s.add(&gauge(), place * tilted(V::ZERO, 0.0, 0.0, rng.angle()));
            }
        }
        let knob = Shape::of(|s| {
            s.lathe(&[(0.026, 0.0), (0.02, 0.03), (0.0, 0.032)], 12);
        });
        for k in 0..44 {
            let p = v(-1.09 + 0.05 * f64::from(k), 0.893, 0.2 + 0.05 * f64::from(k % 2));
            s.add(&knob, at(p));
        }
        for k in 0..6 {
            let x = -1.0 + 0.4 * f64::from(k);
            let pitch = rng.range(-0.5, 0.6);
            let lever = Shape::of(|s| {
                s.rod(v(0.0, -0.02, 0.0), v(0.0, 0.2, 0.0), 0.009, 7);
                s.ball(v(0.0, 0.21, 0.0), 0.026, 8, 6);
            });
            s.bevelled(v(x, 0.891, 0.06), v(0.07, 0.02, 0.16), 0.004);
            s.add(&lever, tilted(v(x, 0.91, 0.06), 0.0, pitch, 0.0));
        }
        for k in 0..14 {
            s.ball(v(-1.04 + 0.16 * f64::from(k), 1.98, -0.09), 0.022, 8, 5);
        }
    });
    s.add(&model, stand(ROOM.x - 0.35, 0.0, 0.75, -PI * 0.5));
}

/// Pipes along the walls and cables across the floor.
pub(super) fn pipes(s: &mut Shape) {
    let (back, right) = (-ROOM.z + 0.12, ROOM.x - 0.12);
    for (k, y) in [2.95, 3.15, 3.32].into_iter().enumerate() {
        let inset = 0.11 * k as f64;
        let (z, x) = (back + inset, right - inset);
        let path = [
            v(-ROOM.x - 0.01, y, z),
            v(0.0, y, z),
            v(x - 0.25, y, z),
            v(x - 0.06, y, z + 0.06),
            v(x, y, z + 0.25),
            v(x, y, 1.0),
            v(x, y, ROOM.z + 0.01),
        ];
        s.tube(&spline(&path, 5), (0.045, 0.045), 10);
        for i in 0..7 {
            let clip = Shape::of(|s| s.torus(V::ZERO, 0.048, 0.013, 14, 5));
            let p = v(-4.2 + 1.3 * f64::from(i), y, z);
            s.add(&clip, tilted(p, 0.0, 0.0, PI * 0.5));
        }
    }
    let cables: [&[V]; 4] = [
        &[
            v(-2.1, 0.2, -0.7),
            v(-1.6, 0.05, -0.4),
            v(-0.9, 0.016, 0.4),
            v(0.0, 0.016, 0.9),
            v(0.5, 0.016, 0.7),
            v(0.9, 0.05, 0.3),
        ],
        &[
            v(-2.1, 0.25, -1.1),
            v(-1.5, 0.05, -1.3),
            v(0.0, 0.018, -1.5),
            v(1.8, 0.018, -1.2),
            v(2.8, 0.018, -1.6),
            v(3.4, 0.1, -2.0),
        ],
        &[
            v(4.4, 0.3, 0.6),
            v(3.9, 0.03, 0.3),
            v(2.9, 0.017, 0.9),
            v(1.6, 0.017, 1.2),
            v(1.0, 0.017, 0.8),
            v(0.95, 0.06, 0.3),
        ],
        &[
            v(-2.95, 0.2, -0.9),
            v(-3.4, 0.02, -0.5),
            v(-3.2, 0.016, 0.6),
            v(-2.2, 0.016, 1.3),
            v(-1.2, 0.016, 0.7),
            v(-0.2, 0.017, 1.45),
            v(1.7, 0.017, 1.7),
            v(4.45, 0.05, 1.2),
        ],
    ];
    for (k, points) in cables.into_iter().enumerate() {
        let radius = 0.016 + 0.004 * (k % 2) as f64;
        s.tube(&spline(points, 10), (radius, radius), 6);
    }
}

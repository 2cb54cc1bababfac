//! The fairground's big machines.

use crate::scene::generate::kit::{
    PI, Place, Shape, TAU, V, at, mix, sin, sin_cos, tilted, turned, v,
};

/// A wheel of 8 m radius in the x-y plane with gondolas and bulbs, standing on two trestles.
pub(super) fn ferris_wheel() -> Shape {
    const GONDOLAS: u32 = 16;
    let (radius, hub) = (8.0, 9.8);
    let upright = tilted(V::ZERO, 0.0, PI * 0.5, 0.0);
    let point = |k: f64, r: f64, z: f64| {
        let (s, c) = sin_cos(TAU * k / f64::from(GONDOLAS) + 0.11);
        v(r * c, hub + r * s, z)
    };
    let gondola = gondola();
    Shape::of(|s| {
        for z in [-0.9, 0.9] {
            for r in [radius, 0.62 * radius] {
                let rim = Shape::of(|s| s.torus(V::ZERO, r, 0.07, 128, 8));
                s.add(&rim, at(v(0.0, hub, z)) * upright);
            }
            for k in 0..GONDOLAS {
                let k = f64::from(k);
                s.rod(point(k, 0.3, z), point(k, radius, z), 0.045, 8);
                s.rod(point(k, 0.62 * radius, z), point(k + 0.5, radius, z), 0.03, 6);
                s.rod(point(k + 0.5, radius, z), point(k + 1.0, 0.62 * radius, z), 0.03, 6);
            }
            for k in 0..96 {
                let k = f64::from(k) * f64::from(GONDOLAS) / 96.0;
                let out = if z < 0.0 { -0.1 } else { 0.1 };
                s.icosphere(point(k, radius, z + out), 0.065, 1);
            }
            // A trestle: two legs, outside the wheel, and a foot plate under each.
            for x in [-4.2, 4.2] {
                let foot = v(x, 0.0, 2.3 * z);
                s.tube(&[foot, v(0.0, hub, 1.5 * z)], (0.2, 0.16), 12);
                s.bevelled(foot, v(1.1, 0.15, 1.1), 0.03);
            }
            s.rod(v(-2.2, 4.7, 1.92 * z), v(2.2, 4.7, 1.92 * z), 0.09, 8);
        }
        s.rod(v(0.0, hub, -1.6), v(0.0, hub, 1.6), 0.28, 20);
        for k in 0..GONDOLAS {
            let k = f64::from(k);
            s.rod(point(k, radius, -0.95), point(k, radius, 0.95), 0.05, 8);
            s.add(&gondola, at(point(k, radius, 0.0)));
        }
        // The platform to board from.
        s.bevelled(v(0.0, 0.0, 0.0), v(5.0, 0.35, 3.0), 0.03);
    })
}

/// A car that hangs from the origin.
fn gondola() -> Shape {
    Shape::of(|s| {
        let bowl = [
            (0.0, -1.55),
            (0.45, -1.5),
            (0.66, -1.25),
            (0.7, -0.95),
            (0.66, -0.95),
            (0.55, -1.3),
            (0.0, -1.35),
        ];
        s.lathe(&bowl, 24);
        s.lathe(&[(0.8, -0.22), (0.78, -0.2), (0.4, -0.05), (0.0, 0.06)], 24);
        for k in 0..4 {
            let (sin_k, cos_k) = sin_cos(TAU * (f64::from(k) + 0.5) / 4.0);
            let p = v(0.64 * cos_k, -0.97, 0.64 * sin_k);
            s.rod(p, p + V::Y * 0.83, 0.025, 6);
        }
    })
}

/// A horse on its pole, its middle at the origin, facing +x.
fn horse() -> Shape {
    Shape::of(|s| {
        s.ellipsoid(V::ZERO, v(0.46, 0.2, 0.17), 20, 12);
        s.tube(&[v(0.3, 0.05, 0.0), v(0.46, 0.3, 0.0), v(0.56, 0.5, 0.0)], (0.15, 0.08), 12);
        s.tube(&[v(0.5, 0.53, 0.0), v(0.66, 0.45, 0.0), v(0.84, 0.34, 0.0)], (0.1, 0.055), 12);
        for z in [-0.045, 0.045] {
            s.tube(&[v(0.53, 0.58, z), v(0.51, 0.7, z)], (0.03, 0.008), 6);
        }
        for (x, z, reach) in
            [(0.3, 0.1, 0.24), (0.3, -0.1, 0.12), (-0.32, 0.1, -0.2), (-0.32, -0.1, -0.08)]
        {
            let knee = v(x + reach, -0.3, z);
            let hoof = v(x + 0.4 * reach - 0.05, -0.56, z);
            s.tube(&[v(x, -0.06, z), knee, hoof], (0.09, 0.035), 9);
            s.lathe_at(
                hoof - V::Y * 0.06,
                &[(0.0, 0.0), (0.055, 0.0), (0.04, 0.08), (0.0, 0.09)],
                10,
            );
        }
        s.tube(&[v(-0.43, 0.08, 0.0), v(-0.62, 0.05, 0.0), v(-0.7, -0.25, 0.0)], (0.05, 0.02), 8);
        for k in 0..7 {
            let t = f64::from(k) / 6.0;
            let root = v(mix(0.28, 0.5, t), mix(0.2, 0.6, t), 0.0);
            s.tube(
                &[root, root + v(-0.1, 0.02, 0.0), root + v(-0.15, -0.08, 0.02)],
                (0.035, 0.012),
                6,
            );
        }
        s.ellipsoid(v(-0.02, 0.17, 0.0), v(0.19, 0.06, 0.15), 16, 8);
    })
}

/// A merry-go-round of 4.4 m radius with a scalloped roof, mirrors, bulbs and two rows of horses.
pub(super) fn carousel() -> Shape {
    let (radius, eave) = (4.4, 3.5);
    let horse = horse();
    Shape::of(|s| {
        s.lathe(
            &[
                (radius + 0.25, 0.0),
                (radius + 0.25, 0.2),
                (radius, 0.2),
                (radius, 0.42),
                (0.0, 0.42),
            ],
            72,
        );
        // The core: a drum of panels with frames.
        s.lathe(
            &[(1.2, 0.41), (1.2, 0.7), (1.08, 0.75), (1.08, 3.2), (1.25, 3.3), (1.25, 3.6)],
            16,
        );
        for k in 0..16 {
            let angle = TAU * (f64::from(k) + 0.5) / 16.0;
            let (sin_k, cos_k) = sin_cos(angle);
            let panel = Shape::of(|s| s.bevelled(v(0.0, 0.95, 0.0), v(0.3, 2.0, 0.05), 0.015));
            s.add(&panel, turned(v(1.065 * sin_k, 0.0, 1.065 * cos_k), angle));
        }
        let ribs = 20.0;
        s.grid([160, 10], [true, false], |u, w| {
            let (sin_u, cos_u) = sin_cos(-TAU * u);
            let sag = (sin(PI * ribs * u)).abs() * (1.0 - w);
            let r = mix(radius + 0.35, 0.25, w);
            v(r * cos_u, mix(eave, 5.6, w * (0.75 + 0.25 * w)) - 0.12 * sag, r * sin_u)
        });
        s.grid([160, 3], [true, false], |u, w| {
            let (sin_u, cos_u) = sin_cos(-TAU * u);
            let r = radius + 0.38 + 0.02 * (1.0 - w);
            let drop = (0.35 + 0.2 * (sin(PI * ribs * u)).abs()) * (1.0 - w);
            v(r * cos_u, eave + 0.12 - drop, r * sin_u)
        });
        s.lathe_at(
            v(0.0, 5.5, 0.0),
            &[(0.3, 0.0), (0.3, 0.15), (0.1, 0.3), (0.18, 0.55), (0.0, 0.9)],
            24,
        );
        for k in 0..80 {
            let (sin_k, cos_k) = sin_cos(TAU * f64::from(k) / 80.0);
            let r = radius + 0.45;
            s.icosphere(v(r * cos_k, eave + 0.16, r * sin_k), 0.05, 1);
        }
        for k in 0..20 {
            let outer = k % 2 == 0;
            let r = if outer { 3.6 } else { 2.3 };
            let angle = TAU * f64::from(k) / 20.0 + 0.05;
            let (sin_k, cos_k) = sin_cos(angle);
            let y = 1.35 + 0.28 * sin(2.3 * f64::from(k));
            let p = v(r * sin_k, y, r * cos_k);
            let size = if outer { 1.15 } else { 0.95 };
            s.add(&horse, turned(p, angle) * Place::from_scale(V::splat(size)));
            s.rod(v(p.x, 0.41, p.z), v(p.x, eave + 0.3, p.z), 0.028, 10);
        }
        for k in 0..10 {
            let (sin_k, cos_k) = sin_cos(TAU * (f64::from(k) + 0.5) / 10.0);
            let r = radius - 0.12;
            let p = v(r * sin_k, 0.41, r * cos_k);
            s.tube(&[p, p + V::Y * (eave - 0.37)], (0.05, 0.05), 12);
        }
    })
}

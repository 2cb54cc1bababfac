//! Furniture, vessels and figures. Each stands at the origin, its front towards +z.

use super::math::{PI, Place, Rng, TAU, V, at, mix, noise, sin, sin_cos, stand, tilted, turned, v};
use super::shape::Shape;
use super::sweeps::{curve, spline};

/// An upright book, spine to +z: two covers, a spine and the block of pages.
pub(crate) fn book(thickness: f64, height: f64, depth: f64) -> Shape {
    Shape::of(|s| {
        let cover = 0.002;
        for x in [-0.5, 0.5] {
            let foot = v(x * (thickness - cover), 0.0, 0.0);
            s.block(foot, v(cover, height, depth));
        }
        let spine = v(0.0, 0.0, depth * 0.5 + cover);
        s.block(spine, v(thickness + 0.001, height + 0.0006, 0.004));
        let pages = v(thickness - 2.0 * cover, height - 0.008, depth - 0.012);
        s.block(v(0.0, 0.004, -0.002), pages);
    })
}

/// Books side by side along x from 0 to at most `length`, some leaning, with gaps.
pub(crate) fn book_row(rng: &mut Rng, length: f64, tallest: f64, depth: f64) -> Shape {
    Shape::of(|s| {
        let mut x = 0.004;
        loop {
            let thickness = rng.range(0.015, 0.05);
            let height = tallest * rng.range(0.65, 1.0);
            let lean = if rng.unit() < 0.12 { rng.range(0.05, 0.16) } else { 0.0 };
            let width = thickness + height * lean * 1.05 + 0.002;
            if x + width > length {
                break;
            }
            let book = book(thickness, height, depth * rng.range(0.7, 0.95));
            // Leaning to the left about its lower left edge, into its own gap.
            let place = tilted(v(x + width - thickness, -0.001, 0.0), 0.0, 0.0, lean);
            s.add(&book, place * at(v(thickness * 0.5, 0.0, 0.0)));
            x += width + if rng.unit() < 0.06 { rng.range(0.03, 0.12) } else { 0.001 };
        }
    })
}

/// A corked bottle.
pub(crate) fn bottle(radius: f64, height: f64, sides: u32) -> Shape {
    let (r, h) = (radius, height);
    Shape::of(|s| {
        s.lathe(
            &[
                (0.0, 0.0),
                (0.92 * r, 0.0),
                (r, 0.04 * h),
                (r, 0.55 * h),
                (0.9 * r, 0.63 * h),
                (0.55 * r, 0.7 * h),
                (0.33 * r, 0.76 * h),
                (0.3 * r, 0.92 * h),
                (0.42 * r, 0.93 * h),
                (0.42 * r, 0.96 * h),
                (0.3 * r, 0.96 * h),
                (0.26 * r, h),
                (0.0, h),
            ],
            sides,
        );
    })
}

/// A round flask with a long neck, on a ring of cork.
pub(crate) fn flask(radius: f64, neck: f64, sides: u32) -> Shape {
    Shape::of(|s| {
        s.torus(v(0.0, 0.12 * radius, 0.0), 0.55 * radius, 0.14 * radius, sides, 6);
        let center = 1.08 * radius;
        let mut profile: Vec<_> = (0..=10)
            .map(|i| {
                let (sin, cos) = sin_cos(PI * 0.92 * f64::from(i) / 10.0);
                (if i == 0 { 0.0 } else { radius * sin }, center - radius * cos)
            })
            .collect();
        let (r, top) = (0.22 * radius, center + radius + neck);
        profile.extend([(r, top - 0.02), (1.4 * r, top), (1.2 * r, top), (0.8 * r, top - 0.02)]);
        s.lathe(&profile, sides);
    })
}

/// A board on four legs.
pub(crate) fn table(width: f64, height: f64, depth: f64) -> Shape {
    Shape::of(|s| {
        let board = 0.04;
        s.bevelled(v(0.0, height - board, 0.0), v(width, board, depth), 0.006);
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let foot = v(x * (width * 0.5 - 0.07), 0.0, z * (depth * 0.5 - 0.07));
            s.bevelled(foot, v(0.06, height - board + 0.005, 0.06), 0.006);
        }
        for z in [-1.0, 1.0] {
            let rail = v(0.0, height - board - 0.09, z * (depth * 0.5 - 0.07));
            s.block(rail, v(width - 0.18, 0.08, 0.02));
        }
    })
}

/// A wooden chair, 45 cm to the seat, with spindles in its back.
pub(crate) fn chair() -> Shape {
    Shape::of(|s| {
        s.bevelled(v(0.0, 0.43, 0.0), v(0.44, 0.035, 0.44), 0.01);
        for x in [-0.18, 0.18] {
            s.tube(&[v(1.1 * x, 0.0, 0.21), v(x, 0.44, 0.18)], (0.014, 0.02), 8);
            let back = [v(1.1 * x, 0.0, -0.22), v(x, 0.45, -0.18), v(x, 0.95, -0.26)];
            s.tube(&spline(&back, 4), (0.016, 0.016), 8);
            s.rod(v(1.05 * x, 0.2, 0.19), v(1.05 * x, 0.2, -0.2), 0.01, 6);
        }
        s.rod(v(-0.19, 0.25, 0.0), v(0.19, 0.25, 0.0), 0.01, 6);
        s.bevelled(v(0.0, 0.88, -0.255), v(0.44, 0.08, 0.025), 0.008);
        for i in -2..=2 {
            let x = 0.06 * f64::from(i);
            s.rod(v(x, 0.46, -0.19), v(x, 0.9, -0.253), 0.008, 6);
        }
    })
}

/// A soft cushion lying flat, `size` wide, high and deep, with creases.
pub(crate) fn pillow(seed: u64, size: V, [around, rings]: [u32; 2]) -> Shape {
    // A superellipse in plan keeps corners; thickness falls off towards the seam.
    let profile = |t: f64| if t < 0.5 { 2.0 * t } else { 2.0 - 2.0 * t };
    Shape::of(|s| {
        let bottom = s.vertex(v(0.0, 0.0, 0.0));
        let mut ids = Vec::new();
        for j in 1..rings {
            let t = f64::from(j) / f64::from(rings);
            let r = profile(t);
            for i in 0..around {
                let (sin, cos) = sin_cos(TAU * f64::from(i) / f64::from(around));
                let (c2, s2) = (cos * cos, sin * sin);
                let stretch = 1.0 / (c2 * c2 + s2 * s2).sqrt().sqrt();
                let (x, z) = (r * cos * stretch, r * sin * stretch);
                let swell = (1.0 - r * r * r).sqrt();
                let crease = 1.0 + 0.22 * noise(seed, 3.0 * x + 9.0 * t, 3.0 * z);
                let y = if t < 0.5 { 0.4 - 0.4 * swell } else { 0.4 + 0.6 * swell * crease };
                ids.push(s.vertex(v(x * 0.5, y, z * 0.5) * size));
            }
        }
        let top = s.vertex(v(0.0, size.y, 0.0));
        let n = around as usize;
        for i in 0..n {
            let k = (i + 1) % n;
            s.face(bottom, ids[i], ids[k]);
            for j in 0..rings as usize - 2 {
                let (low, high) = (j * n, (j + 1) * n);
                s.face4(ids[low + k], ids[low + i], ids[high + i], ids[high + k]);
            }
            let last = (rings as usize - 2) * n;
            s.face(top, ids[last + k], ids[last + i]);
        }
    })
}

/// A barrel with hoops.
pub(crate) fn barrel(radius: f64, height: f64, sides: u32) -> Shape {
    Shape::of(|s| {
        let bulge = |t: f64| radius * (0.78 + 0.88 * t * (1.0 - t));
        let mut profile = vec![(0.0, 0.0)];
        profile.extend((0..=4).map(|i| {
            let t = f64::from(i) / 4.0;
            (bulge(t), height * t)
        }));
        profile.extend([(0.9 * bulge(1.0), height), (0.88 * bulge(1.0), 0.96 * height)]);
        profile.push((0.0, 0.96 * height));
        s.lathe(&profile, sides);
        for t in [0.2, 0.8] {
            let (low, high) = (t - 0.04, t + 0.04);
            let r = 0.012 * radius + bulge(if t < 0.5 { high } else { low });
            s.lathe(&[(r, low * height), (r, high * height)], sides);
        }
    })
}

/// A box with plinth, drawers of `rows` by `columns` and a knob on each.
pub(crate) fn chest(size: V, rows: u32, columns: u32) -> Shape {
    Shape::of(|s| {
        s.block(V::ZERO, v(size.x - 0.04, 0.06, size.z - 0.04));
        s.block(v(0.0, 0.055, 0.0), v(size.x, size.y - 0.085, size.z));
        s.bevelled(v(0.0, size.y - 0.035, 0.0), v(size.x + 0.03, 0.035, size.z + 0.03), 0.008);
        let cell = v(size.x / f64::from(columns), (size.y - 0.11) / f64::from(rows), 0.0);
        for row in 0..rows {
            for column in 0..columns {
                let x = (f64::from(column) + 0.5) * cell.x - size.x * 0.5;
                let y = 0.07 + f64::from(row) * cell.y;
                let front = v(x, y + 0.008, size.z * 0.5);
                s.bevelled(front, v(cell.x - 0.016, cell.y - 0.016, 0.03), 0.006);
                let knob = v(x, y + cell.y * 0.5, size.z * 0.5 + 0.03);
                s.ball(knob, 0.014, 10, 6);
            }
        }
    })
}

/// A person in coat or trousers, standing or with an arm up, of about 450 triangles.
pub(crate) fn figure(rng: &mut Rng, height: f64) -> Shape {
    let shape = Shape::of(|s| {
        let coat = rng.unit() < 0.4;
        let hem = if coat { 0.45 } else { 0.85 };
        let wide = if coat { 0.2 } else { 0.15 };
        let body = [(0.0, hem), (wide, hem), (0.14, 1.0), (0.17, 1.3), (0.15, 1.42), (0.06, 1.49)];
        let torso = Shape::of(|s| s.lathe(&body, 10));
        s.add(&torso, Place::from_scale(v(1.15, 1.0, 0.72)));
        s.rod(v(0.0, 1.45, 0.0), v(0.0, 1.58, 0.01), 0.05, 6);
        s.ellipsoid(v(0.0, 1.65, 0.015), v(0.085, 0.115, 0.1), 10, 7);
        if rng.unit() < 0.35 {
            s.cylinder(0.16, 1.7, 1.715, 14);
            s.cylinder(0.095, 1.7, 1.83, 14);
        }
        let stride = rng.range(-0.2, 0.2);
        for x in [-1.0, 1.0] {
            let foot = v(0.1 * x, 0.05, stride * x);
            let knee = v(0.1 * x, 0.48, 0.45 * stride * x + 0.03);
            s.tube(&[v(0.085 * x, 0.92, 0.0), knee, foot], (0.085, 0.05), 7);
            s.block(v(0.1 * x, 0.0, stride * x + 0.05), v(0.09, 0.08, 0.24));
            let raised = rng.unit() < 0.25;
            let shoulder = v(0.185 * x, 1.38, 0.0);
            let (elbow, hand) = if raised {
                (v(0.3 * x, 1.45, 0.15), v(0.25 * x, 1.7, 0.25))
            } else {
                (v(0.25 * x, 1.1, -0.3 * stride * x), v(0.24 * x, 0.85, 0.1 - 0.6 * stride * x))
            };
            s.tube(&[shoulder, elbow, hand], (0.055, 0.035), 6);
            s.ball(hand, 0.048, 6, 4);
        }
    });
    shape.placed(Place::from_scale(V::splat(height / 1.77)))
}

/// A sitting teddy bear, 40 cm high at scale 1; `sides` around its belly.
pub(crate) fn teddy(scale: f64, sides: u32) -> Shape {
    let (most, some, few) = (sides, sides * 2 / 3, sides * 5 / 12);
    let shape = Shape::of(|s| {
        s.ellipsoid(v(0.0, 0.125, 0.0), v(0.11, 0.13, 0.1), most, some);
        s.ellipsoid(v(0.0, 0.3, 0.01), v(0.09, 0.085, 0.085), most, some);
        s.ellipsoid(v(0.0, 0.28, 0.09), v(0.04, 0.032, 0.035), some, few);
        s.ball(v(0.0, 0.293, 0.124), 0.012, few, 4);
        for x in [-1.0, 1.0] {
            s.ellipsoid(v(0.07 * x, 0.37, 0.0), v(0.035, 0.035, 0.018), some, few);
            s.ball(v(0.035 * x, 0.325, 0.083), 0.009, few, 4);
            s.tube(&[v(0.09 * x, 0.2, 0.02), v(0.15 * x, 0.12, 0.09)], (0.04, 0.034), few);
            s.ball(v(0.15 * x, 0.12, 0.09), 0.036, few, few);
            s.tube(&[v(0.06 * x, 0.05, 0.04), v(0.11 * x, 0.048, 0.19)], (0.052, 0.045), few);
            s.ellipsoid(v(0.112 * x, 0.058, 0.2), v(0.048, 0.058, 0.034), some, few);
        }
    });
    shape.placed(Place::from_scale(V::splat(scale)))
}

impl Shape {
    /// A table lamp of `height` standing at `foot`: turned base and an open shade, so that the
    /// light inside reaches out above and below. The bulb belongs at 0.78 of the height.
    pub(crate) fn table_lamp(&mut self, foot: V, height: f64, sides: u32) {
        let h = height;
        let lamp = Self::of(|s| {
            let base = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.03), (0.07, 0.07), (0.05, 0.12)];
            let belly = [(0.12, 0.2), (0.14, 0.28), (0.1, 0.38), (0.035, 0.45), (0.02, 0.64)];
            let mut profile: Vec<_> =
                base.into_iter().chain(belly).map(|(r, y)| (r * h, y * h)).collect();
            profile.push((0.0, 0.645 * h));
            s.lathe(&profile, sides);
            // The shade has a thickness, and pleats.
            s.grid([sides * 3, 10], [true, false], |u, w| {
                let (sin_u, cos_u) = sin_cos(-TAU * u);
                let r = h * mix(0.36, 0.2, w) * (1.0 + 0.012 * sin(TAU * 36.0 * u));
                v(r * cos_u, mix(0.56 * h, h, w), r * sin_u)
            });
            for k in 0..3 {
                let (sin, cos) = sin_cos(TAU * f64::from(k) / 3.0);
                let r = 0.29 * h;
                s.rod(v(0.0, 0.63 * h, 0.0), v(r * cos, 0.74 * h, r * sin), 0.004 * h, 5);
            }
        });
        self.add(&lamp, stand(foot.x, foot.y, foot.z, 0.0));
    }

    /// A picture on the wall behind `z = 0` around the origin: a frame and a panel.
    pub(crate) fn picture(&mut self, width: f64, height: f64, place: Place) {
        let frame = Self::of(|s| {
            let (w, h, t) = (width * 0.5, height * 0.5, 0.045);
            for y in [-h, h] {
                s.bevelled(v(0.0, y - 0.5 * t, 0.012), v(width + 2.0 * t, t, 0.03), 0.008);
            }
            for x in [-w, w] {
                s.bevelled(v(x, -h, 0.011), v(t, height, 0.027), 0.008);
            }
            s.quad(v(-w, -h, 0.008), v(w, -h, 0.008), v(w, h, 0.008), v(-w, h, 0.008));
        });
        self.add(&frame, place);
    }

    /// A curtain in folds along x from 0 to `width`, hanging from `top` to `bottom`.
    pub(crate) fn curtain(
        &mut self,
        rng: &mut Rng,
        width: f64,
        (bottom, top): (f64, f64),
        (folds, depth): (u32, f64),
        cells: [u32; 2],
        place: Place,
    ) {
        let (a, b) = (rng.angle(), rng.angle());
        let cloth = Self::of(|s| {
            s.grid(cells, [false, false], |u, w| {
                let phase = TAU * f64::from(folds) * u + 0.5 * sin(2.3 * w + a);
                let z = depth * sin(phase) * (0.75 + 0.25 * sin(5.0 * u + b + w));
                let sway =
                    0.25 * depth * sin(2.0 * phase) + 0.4 * depth * (1.0 - w) * sin(3.0 * u + a);
                v(width * u + sway, mix(bottom, top, w), z * mix(1.25, 0.8, w))
            });
        });
        self.add(&cloth, place);
    }

    /// A coil about the upright axis through the origin.
    pub(crate) fn coil(&mut self, radius: f64, (low, high): (f64, f64), turns: u32, wire: f64) {
        let path = curve(turns * 16, |t| {
            let (s, c) = sin_cos(TAU * f64::from(turns) * t);
            v(radius * c, mix(low, high, t), radius * s)
        });
        self.tube(&path, (wire, wire), 4);
    }

    /// Chain links from `a` straight down to height `low`, each turned by a quarter.
    pub(crate) fn chain(&mut self, a: V, low: f64, link: f64) {
        let ring = Self::of(|s| s.torus(V::ZERO, 0.36 * link, 0.1 * link, 8, 4))
            .placed(tilted(V::ZERO, 0.0, PI * 0.5, 0.0) * Place::from_scale(v(0.75, 1.0, 1.3)));
        let count = ((a.y - low) / (0.72 * link)) as u32;
        for i in 0..count {
            let p = v(a.x, a.y - 0.72 * link * (f64::from(i) + 0.5), a.z);
            self.add(&ring, turned(p, PI * 0.5 * f64::from(i % 2)));
        }
    }
}

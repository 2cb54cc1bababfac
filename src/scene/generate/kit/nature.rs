//! Leaves, blades and pot plants.

use super::math::{Place, Rng, TAU, V, mix, sin_cos, tilted, v};
use super::shape::Shape;
use super::sweeps::curve;

impl Shape {
    /// A blade or fibre rooted at `root` that leans by `lean`: `2 pieces - 1` triangles. `side` is
    /// half its width, level and across the lean.
    pub(crate) fn blade(&mut self, root: V, height: f64, lean: V, side: V, pieces: u32) {
        let mut last: Option<[u32; 2]> = None;
        for i in 0..=pieces {
            let t = f64::from(i) / f64::from(pieces);
            let p = root + lean * (t * t) + V::Y * (height * t * (1.0 - 0.15 * t));
            if i == pieces {
                let tip = self.vertex(p);
                if let Some([a, b]) = last {
                    self.face(a, b, tip);
                }
            } else {
                let half = side * (1.0 - 0.6 * t);
                let row = [self.vertex(p - half), self.vertex(p + half)];
                if let Some([a, b]) = last {
                    self.face4(a, b, row[1], row[0]);
                }
                last = Some(row);
            }
        }
    }
}

/// Plants a blade at random about `root`.
pub(crate) fn blade(
    shape: &mut Shape,
    rng: &mut Rng,
    root: V,
    height: f64,
    width: f64,
    pieces: u32,
) {
    let (s, c) = sin_cos(rng.angle());
    let lean = v(c, 0.0, s) * (height * rng.range(0.1, 0.8));
    shape.blade(root, height * rng.range(0.7, 1.3), lean, v(-s, 0.0, c) * (width * 0.5), pieces);
}

/// A leaf of unit length along z, folded along its middle and drooping: `4 pieces - 2` triangles.
pub(crate) fn leaf(pieces: u32, width: f64, droop: f64) -> Shape {
    Shape::of(|s| {
        let row = |s: &mut Shape, t: f64, side: f64| {
            let half = width * 2.0 * t * (1.0 - t) * side;
            s.vertex(v(half, 0.25 * half.abs() - droop * t * t, t))
        };
        let mut last = [row(s, 0.0, 0.0); 3];
        for i in 1..=pieces {
            let t = f64::from(i) / f64::from(pieces);
            if i == pieces {
                let tip = row(s, 1.0, 0.0);
                s.face(last[0], last[1], tip);
                s.face(last[1], last[2], tip);
            } else {
                let next = [-1.0, 0.0, 1.0].map(|side| row(s, t, side));
                if i == 1 {
                    s.face(last[1], next[1], next[0]);
                    s.face(last[1], next[2], next[1]);
                } else {
                    s.face4(last[0], last[1], next[1], next[0]);
                    s.face4(last[1], last[2], next[2], next[1]);
                }
                last = next;
            }
        }
    })
}

/// A pot plant about `height` high: an earthen pot and arching stems with leaves in pairs.
pub(crate) fn plant(rng: &mut Rng, height: f64, stems: u32, leaves: u32, pieces: u32) -> Shape {
    let leaf = leaf(pieces, 0.55, 0.25);
    let pot = 0.3 * height;
    Shape::of(|s| {
        let r = 0.45 * pot;
        let rim = 1.18 * r;
        s.lathe(
            &[
                (0.0, 0.0),
                (0.7 * r, 0.0),
                (r, 0.82 * pot),
                (rim, 0.82 * pot),
                (rim, pot),
                (0.95 * r, pot),
                (0.9 * r, 0.88 * pot),
                (0.0, 0.9 * pot),
            ],
            20,
        );
        for _ in 0..stems {
            let (sin, cos) = sin_cos(rng.angle());
            let out = v(cos, 0.0, sin);
            let (reach, top) = (height * rng.range(0.08, 0.38), height * rng.range(0.65, 1.0));
            let point = |t: f64| {
                out * (0.3 * r + reach * t * t) + V::Y * mix(0.85 * pot, top, t * (1.4 - 0.4 * t))
            };
            let path = curve(6, point);
            s.tube(&path, (0.012 * height, 0.004 * height), 5);
            for k in 0..leaves {
                let t = 0.25 + 0.75 * f64::from(k + 1) / f64::from(leaves);
                let size = height * rng.range(0.1, 0.2);
                let turn = TAU * 0.381_966 * f64::from(k) + rng.range(-0.4, 0.4);
                let place = tilted(point(t), turn, rng.range(-0.7, 0.2), rng.range(-0.4, 0.4));
                s.add(&leaf, place * Place::from_scale(V::splat(size)));
            }
        }
    })
}

//! Boxes, lathed bodies, spheres and tori.

use super::math::{PI, TAU, V, at, mix, scaled, sin_cos, v};
use super::shape::Shape;
use std::collections::HashMap;

impl Shape {
    /// An outline of a convex body, wound to face away from `inside`.
    fn convex_face(&mut self, corners: &[u32], inside: V) {
        let [a, b, c] = [0, 1, 2].map(|i| self.position(corners[i]));
        let outward = (b - a).cross(c - a).dot(a - inside) > 0.0;
        for i in 1..corners.len() - 1 {
            let (p, q) = (corners[i], corners[i + 1]);
            if outward { self.face(corners[0], p, q) } else { self.face(corners[0], q, p) }
        }
    }

    /// The box between two corners: 12 triangles.
    pub(crate) fn cuboid(&mut self, min: V, max: V) {
        let corner = [0_u32, 1, 2, 3, 4, 5, 6, 7].map(|c| {
            let pick = |axis: usize| if c >> axis & 1 == 1 { max[axis] } else { min[axis] };
            self.vertex(v(pick(0), pick(1), pick(2)))
        });
        for [a, b, c, d] in
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        {
            self.convex_face(&[corner[a], corner[b], corner[c], corner[d]], (min + max) * 0.5);
        }
    }

    /// A box of `size` that stands at `foot`, the middle of its bottom.
    pub(crate) fn block(&mut self, foot: V, size: V) {
        let half = v(size.x * 0.5, 0.0, size.z * 0.5);
        self.cuboid(foot - half, foot + half + v(0.0, size.y, 0.0));
    }

    /// A [`block`](Self::block) with its edges cut off by `bevel`: 44 triangles.
    pub(crate) fn bevelled(&mut self, foot: V, size: V, bevel: f64) {
        let center = foot + v(0.0, size.y * 0.5, 0.0);
        // One vertex for each corner and axis: at full extent on that axis, inset on the others.
        let mut index = [[0; 3]; 8];
        for (c, of_axis) in index.iter_mut().enumerate() {
            for (axis, id) in of_axis.iter_mut().enumerate() {
                let extent = |k: usize| {
                    let half = size[k] * 0.5 - if k == axis { 0.0 } else { bevel };
                    if c >> k & 1 == 1 { half } else { -half }
                };
                *id = self.vertex(center + v(extent(0), extent(1), extent(2)));
            }
        }
        for axis in 0..3 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in 0..2 {
                let corner = |i: usize, j: usize| index[side << axis | i << b | j << c];
                let outline = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                self.convex_face(&outline.map(|ids| ids[axis]), center);
                // The edge between this face and its neighbour on axis b, along axis c.
                for i in 0..2 {
                    let (low, high) = (corner(i, 0), corner(i, 1));
                    self.convex_face(&[low[axis], high[axis], high[b], low[b]], center);
                }
            }
        }
        for ids in index {
            self.convex_face(&ids, center);
        }
    }

    /// A body of revolution about the upright axis from `(radius, height)` pairs, outside to the
    /// right when going up. Zero radius at either end closes it with a fan.
    pub(crate) fn lathe(&mut self, profile: &[(f64, f64)], sides: u32) {
        let rings: Vec<Vec<u32>> = profile
            .iter()
            .map(|&(r, y)| {
                let count = if r == 0.0 { 1 } else { sides };
                (0..count)
                    .map(|i| {
                        let (s, c) = sin_cos(TAU * f64::from(i) / f64::from(sides));
                        self.vertex(v(r * c, y, r * s))
                    })
                    .collect()
            })
            .collect();
        for pair in rings.windows(2) {
            let id = |ring: &[u32], i: usize| ring[i % ring.len()];
            for i in 0..sides as usize {
                let [low, high] = [&pair[0], &pair[1]];
                if high.len() > 1 {
                    self.face(id(low, i), id(high, i), id(high, i + 1));
                }
                if low.len() > 1 {
                    self.face(id(low, i), id(high, i + 1), id(low, i + 1));
                }
            }
        }
    }

    /// An upright closed cylinder.
    pub(crate) fn cylinder(&mut self, radius: f64, low: f64, high: f64, sides: u32) {
        self.lathe(&[(0.0, low), (radius, low), (radius, high), (0.0, high)], sides);
    }

    /// A [`lathe`](Self::lathe) that stands at `foot`.
    pub(crate) fn lathe_at(&mut self, foot: V, profile: &[(f64, f64)], sides: u32) {
        let body = Self::of(|s| s.lathe(profile, sides));
        self.add(&body, at(foot));
    }

    /// A [`cylinder`](Self::cylinder) that stands at `foot`.
    pub(crate) fn cylinder_at(&mut self, foot: V, radius: f64, height: f64, sides: u32) {
        self.lathe_at(foot, &[(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], sides);
    }

    /// A sphere of rings and sides: `2 sides (rings - 1)` triangles.
    pub(crate) fn ball(&mut self, center: V, radius: f64, sides: u32, rings: u32) {
        self.ellipsoid(center, V::splat(radius), sides, rings);
    }

    /// As [`ball`](Self::ball), with a radius for each axis.
    pub(crate) fn ellipsoid(&mut self, center: V, radii: V, sides: u32, rings: u32) {
        let profile: Vec<_> = (0..=rings)
            .map(|i| {
                let (s, c) = sin_cos(PI * f64::from(i) / f64::from(rings));
                (if i == 0 || i == rings { 0.0 } else { s }, -c)
            })
            .collect();
        let unit = Self::of(|s| s.lathe(&profile, sides));
        self.add(&unit, scaled(center, 0.0, radii));
    }

    /// A sphere of nearly equal triangles: `20 * 4^level`.
    pub(crate) fn icosphere(&mut self, center: V, radius: f64, level: u32) {
        let g = (1.0 + 5_f64.sqrt()) * 0.5;
        let mut points = Vec::new();
        for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
            points.extend([v(a, b, 0.0), v(0.0, a, b), v(b, 0.0, a)]);
        }
        for p in &mut points {
            *p /= p.length();
        }
        // A face is three points at the least distance from each other, found once per sphere.
        let near = |a: V, b: V| (a - b).length_squared() < 1.2;
        let mut faces = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [points[a], points[b], points[c]];
                    if near(p, q) && near(q, r) && near(r, p) {
                        let outward = (q - p).cross(r - p).dot(p) > 0.0;
                        faces.push(if outward { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        for _ in 0..level {
            let mut middle = HashMap::new();
            let mut halfway = |a: usize, b: usize| {
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let m: V = points[a] + points[b];
                    points.push(m / m.length());
                    points.len() - 1
                })
            };
            let mut finer = Vec::with_capacity(faces.len() * 4);
            for [a, b, c] in faces {
                let (ab, bc, ca) = (halfway(a, b), halfway(b, c), halfway(c, a));
                finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            faces = finer;
        }
        let ids: Vec<u32> = points.iter().map(|&p| self.vertex(center + p * radius)).collect();
        for face in faces {
            let [a, b, c] = face.map(|i| ids[i]);
            self.face(a, b, c);
        }
    }

    /// A ring about the upright axis: `2 around across` triangles.
    pub(crate) fn torus(&mut self, center: V, radius: f64, tube: f64, around: u32, across: u32) {
        self.grid([across, around], [true, true], |u, w| {
            let ((su, cu), (sw, cw)) = (sin_cos(TAU * u), sin_cos(TAU * w));
            let r = radius + tube * cu;
            center + v(r * cw, tube * su, r * sw)
        });
    }

    /// A wall in the plane `z = 0`, `size.0` wide about x = 0 and `size.1` high, as eight
    /// triangles around an opening from `low` to `high`.
    pub(crate) fn wall_with_hole(&mut self, size: (f64, f64), low: (f64, f64), high: (f64, f64)) {
        let half = size.0 * 0.5;
        let p = |x: f64, y: f64| v(x, y, 0.0);
        self.quad(p(-half, 0.0), p(low.0, 0.0), p(low.0, size.1), p(-half, size.1));
        self.quad(p(high.0, 0.0), p(half, 0.0), p(half, size.1), p(high.0, size.1));
        self.quad(p(low.0, 0.0), p(high.0, 0.0), p(high.0, low.1), p(low.0, low.1));
        self.quad(p(low.0, high.1), p(high.0, high.1), p(high.0, size.1), p(low.0, size.1));
    }

    /// The inside of a closed room of two triangles a side, without the sides in `open` (a bit
    /// each for -x, +x, -z, +z, floor, ceiling).
    pub(crate) fn room(&mut self, min: V, max: V, open: u32) {
        let p = |i: u32| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { max[axis] } else { min[axis] };
            v(pick(0), pick(1), pick(2))
        };
        let sides =
            [[0, 2, 6, 4], [1, 5, 7, 3], [0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6]];
        for (i, corners) in sides.into_iter().enumerate() {
            if open >> i & 1 == 0 {
                let [a, b, c, d] = corners.map(p);
                self.quad(a, b, c, d);
            }
        }
    }

    /// A body of revolution from height `low` to `high` in `n` rings; `f` maps 0..1 to radius.
    pub(crate) fn turned_body(
        &mut self,
        low: f64,
        high: f64,
        [n, sides]: [u32; 2],
        f: impl Fn(f64) -> f64,
    ) {
        let profile: Vec<_> = (0..=n)
            .map(|i| {
                let t = f64::from(i) / f64::from(n);
                (f(t), mix(low, high, t))
            })
            .collect();
        self.lathe(&profile, sides);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed volume: right only if closed and wound outwards.
    fn volume(shape: Shape) -> f64 {
        let mesh = shape.into_mesh();
        (0..mesh.len())
            .map(|i| {
                let [a, b, c] = mesh.triangle(i).0.map(|p| p.as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn solids_are_closed_and_face_outwards() {
        let near = |shape: Shape, count: usize, wanted: f64, tolerance: f64| {
            assert_eq!(shape.len(), count);
            let got = volume(shape);
            assert!((got - wanted).abs() <= tolerance * wanted, "{got} for {wanted}");
        };
        near(Shape::of(|s| s.cuboid(V::ONE, v(2.0, 3.0, 4.0))), 12, 6.0, 1e-6);
        near(Shape::of(|s| s.bevelled(V::ZERO, v(1.0, 2.0, 3.0), 0.01)), 44, 6.0, 1e-2);
        near(Shape::of(|s| s.cylinder(1.0, 0.0, 2.0, 64)), 256, TAU, 1e-2);
        near(Shape::of(|s| s.ball(V::ONE, 1.0, 48, 24)), 48 * 46, 4.0 * PI / 3.0, 1e-2);
        near(Shape::of(|s| s.icosphere(V::ONE, 1.0, 3)), 1280, 4.0 * PI / 3.0, 1e-2);
        near(Shape::of(|s| s.torus(V::ONE, 2.0, 0.5, 64, 32)), 4096, PI * PI, 1e-2);
    }

    #[test]
    fn rooms_face_inwards() {
        let room = Shape::of(|s| s.room(V::ZERO, v(1.0, 2.0, 3.0), 0));
        assert_eq!(room.len(), 12);
        assert!((volume(room) + 6.0).abs() < 1e-6);
    }
}

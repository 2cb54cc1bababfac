//! Things swept along a path: tubes, rods, arches.

use super::math::{PI, TAU, V, aim, mix, sin_cos, v};
use super::shape::Shape;

/// `n + 1` points of a curve over 0..1.
pub(crate) fn curve(n: u32, f: impl Fn(f64) -> V) -> Vec<V> {
    (0..=n).map(|i| f(f64::from(i) / f64::from(n))).collect()
}

/// A smooth curve (Catmull and Rom's) through `points`, `steps` pieces between two of them.
pub(crate) fn spline(points: &[V], steps: u32) -> Vec<V> {
    let last = points.len() - 1;
    let mut path = vec![points[0]];
    for i in 0..last {
        let [p0, p1, p2, p3] =
            [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| points[k]);
        for k in 1..=steps {
            let t = f64::from(k) / f64::from(steps);
            let a = (p2 - p0) * t;
            let b = (p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3) * (t * t);
            let c = (p1 * 3.0 - p0 - p2 * 3.0 + p3) * (t * t * t);
            path.push(p1 + (a + b + c) * 0.5);
        }
    }
    path
}

impl Shape {
    /// A tube along `path` whose radius goes from `radii.0` to `radii.1`, closed at both ends:
    /// `2 sides` triangles a piece and `sides` an end.
    pub(crate) fn tube(&mut self, path: &[V], radii: (f64, f64), sides: u32) {
        let last = path.len() - 1;
        let mut normal = V::ZERO;
        let mut previous: Vec<u32> = Vec::new();
        for (i, &p) in path.iter().enumerate() {
            let along = path[(i + 1).min(last)] - path[i.saturating_sub(1)];
            let along = along / along.length();
            if i == 0 {
                let helper = if along.y * along.y < 0.5 { V::Y } else { V::X };
                normal = helper.cross(along);
            }
            // The last frame, brought back square to the path: no needless twist.
            normal -= along * along.dot(normal);
            normal /= normal.length();
            let across = along.cross(normal);
            let radius = mix(radii.0, radii.1, i as f64 / last as f64);
            let ring: Vec<u32> = (0..sides)
                .map(|k| {
                    let (s, c) = sin_cos(TAU * f64::from(k) / f64::from(sides));
                    self.vertex(p + (normal * c + across * s) * radius)
                })
                .collect();
            for k in 0..ring.len() {
                let next = (k + 1) % ring.len();
                if i > 0 {
                    self.face4(previous[k], previous[next], ring[next], ring[k]);
                }
            }
            if i == 0 || i == last {
                let middle = self.vertex(p);
                for k in 0..ring.len() {
                    let next = (k + 1) % ring.len();
                    let (a, b) = if i == 0 { (next, k) } else { (k, next) };
                    self.face(middle, ring[a], ring[b]);
                }
            }
            previous = ring;
        }
    }

    /// A straight closed rod.
    pub(crate) fn rod(&mut self, a: V, b: V, radius: f64, sides: u32) {
        self.tube(&[a, b], (radius, radius), sides);
    }

    /// A thin three-sided rod with open ends: 6 triangles.
    pub(crate) fn cord(&mut self, a: V, b: V, radius: f64) {
        let place = aim(a, b - a);
        let mut cord = Self::new();
        cord.lathe(&[(radius, 0.0), (radius, (b - a).length())], 3);
        self.add(&cord, place);
    }

    /// A wall over a round arch: `width` by `height` in x and y from the springing line (y = 0),
    /// `depth` in z about 0, with a half-circle of `radius` cut out of the bottom. Only the soffit
    /// is finely cut; the ends at `±width / 2` stay open, neighbours join there.
    pub(crate) fn arch(&mut self, width: f64, height: f64, depth: f64, radius: f64, cells: u32) {
        let (half, z) = (width * 0.5, depth * 0.5);
        let edge: Vec<(f64, f64)> = (0..=cells)
            .map(|i| {
                let (s, c) = sin_cos(PI * f64::from(i) / f64::from(cells));
                (-radius * c, radius * s)
            })
            .collect();
        for side in [-1.0, 1.0] {
            let p = |x: f64, y: f64| v(x * side, y, z * side);
            for x in [-1.0, 1.0] {
                let (a, b) = (radius * x, half * x);
                let (a, b) = if a < b { (a, b) } else { (b, a) };
                self.quad(p(a, 0.0), p(b, 0.0), p(b, height), p(a, height));
            }
            let ids: Vec<[u32; 2]> = edge
                .iter()
                .map(|&(x, y)| [self.vertex(p(x, y)), self.vertex(p(x, height))])
                .collect();
            for w in ids.windows(2) {
                self.face4(w[0][0], w[1][0], w[1][1], w[0][1]);
            }
        }
        self.grid([cells, 1], [false, false], |u, w| {
            let (s, c) = sin_cos(PI * u);
            v(-radius * c, radius * s, mix(z, -z, w))
        });
        for x in [-1.0, 1.0] {
            let (a, b) = (v(radius * x, 0.0, z * x), v(half * x, 0.0, z * x));
            self.quad(a, v(a.x, 0.0, -a.z), v(b.x, 0.0, -b.z), b);
        }
        self.quad(
            v(-half, height, z),
            v(half, height, z),
            v(half, height, -z),
            v(-half, height, -z),
        );
    }

    /// A moulding that follows the arch of `radius`: a tube with its ends on the springing line.
    pub(crate) fn arch_moulding(
        &mut self,
        radius: f64,
        tube: f64,
        z: f64,
        [cells, sides]: [u32; 2],
    ) {
        let path = curve(cells, |t| {
            let (s, c) = sin_cos(PI * t);
            v(-radius * c, radius * s, z)
        });
        self.tube(&path, (tube, tube), sides);
    }
}

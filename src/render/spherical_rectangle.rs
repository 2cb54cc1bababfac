//! Uniform sampling of the solid angle of a rectangle.

use super::light_samples::Numbers;
use super::warp::sin_cos;
use crate::vectorized::inverse_sqrt;
use glam::DVec3;
use std::f64::consts::TAU;

/// A rectangle seen from a point in front of it.
///
/// Urena, Fajardo and King, "An Area-Preserving Parametrization for Spherical Rectangles", EGSR
/// 2013. Of a 2 x 2 light at height 1, the irradiance of one sample has a quarter of the standard
/// deviation that points uniform in area give.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalRectangle {
    /// Distance to the plane, positive.
    height: f64,
    inverse_height: f64,
    /// Over the height, as is `y`.
    x: [f64; 2],
    y: [f64; 2],
    b: [f64; 2],
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// The rectangle that spans `[x0, x1] x [y0, y1]` at `height > 0` from the point, in the
    /// rectangle's own axes. `None` where it looks so small that its angles have lost their digits:
    /// sampling it by area is as good there.
    pub(super) fn new(x: [f64; 2], y: [f64; 2], height: f64) -> Option<Self> {
        let corner = |i: usize, j: usize| DVec3::new(x[i], y[j], -height);
        let side = |p: DVec3, q: DVec3| p.cross(q).normalize();
        let n = [
            side(corner(0, 0), corner(1, 0)),
            side(corner(1, 0), corner(1, 1)),
            side(corner(1, 1), corner(0, 1)),
            side(corner(0, 1), corner(0, 0)),
        ];
        let angle = |i: usize| (-n[i].dot(n[(i + 1) % 4])).clamp(-1.0, 1.0).acos();
        let k = TAU - angle(2) - angle(3);
        let solid_angle = angle(0) + angle(1) - k;
        let [x, y] = [x, y].map(|span| span.map(|end| end / height));
        let is_usable =
            solid_angle > 1e-5 && [x, y].as_flattened().iter().all(|end| end.abs() < 1e9);
        let inverse_height = 1.0 / height;
        is_usable.then_some(Self {
            height,
            inverse_height,
            x,
            y,
            b: [n[0].z, n[2].z],
            k,
            solid_angle,
        })
    }

    /// How many numbers there are.
    pub(super) const NUMBERS: usize = 10;

    /// Its numbers, in the order that [`of_lane`](Self::of_lane) knows.
    pub(super) fn numbers(&self) -> [f64; Self::NUMBERS] {
        let Self { height, inverse_height, x, y, b, k, solid_angle } = *self;
        [height, inverse_height, x[0], x[1], y[0], y[1], b[0], b[1], k, solid_angle]
    }

    /// The rectangle with the numbers of a lane.
    #[inline(always)]
    pub(super) fn of_lane<const N: usize>(rows: &[[f64; N]; Self::NUMBERS], lane: usize) -> Self {
        let [height, inverse_height, x0, x1, y0, y1, b0, b1, k, solid_angle] = rows;
        Self {
            height: height[lane],
            inverse_height: inverse_height[lane],
            x: [x0[lane], x1[lane]],
            y: [y0[lane], y1[lane]],
            b: [b0[lane], b1[lane]],
            k: k[lane],
            solid_angle: solid_angle[lane],
        }
    }

    /// In steradians.
    #[inline(always)]
    pub(super) fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// All steps to the sample of a point, as [`y_and_distance`](Self::y_and_distance) returns it.
    #[cfg(test)]
    fn sample(&self, point: [f64; 2]) -> ([f64; 2], f64) {
        self.y_and_distance(self.h(self.x(self.phi(point))))
    }

    /// The first of four steps to a sample, named as the paper has what they find: terms of the angle.
    ///
    /// The paper's formulas without divisions, and with few roots, in units of the height: with
    /// `m = b0 cos - b1`, its `f = m / sin` and `c = 1 / sqrt(f^2 + b0^2)` give
    /// `x = |sin| / sqrt(m^2 - (1 - b0^2) sin^2)`, and `y = h` times the distance.
    #[inline(always)]
    pub(super) fn phi(&self, [u, v]: [f64; 2]) -> Numbers {
        let [sin, cos] = sin_cos(u * self.solid_angle + self.k);
        let m = cos * self.b[0] - self.b[1];
        let below = (m * m - (1.0 - self.b[0] * self.b[0]) * (sin * sin)).max(1e-18 * m * m);
        [sin.abs().copysign(m * sin), below, v, 0.0]
    }

    /// The second step: the first coordinate.
    #[inline(always)]
    pub(super) fn x(&self, [sin, below, v, _]: Numbers) -> Numbers {
        let x = (sin * inverse_sqrt(below)).clamp(self.x[0], self.x[1]);
        [x, x * x + 1.0, v, 0.0]
    }

    /// The third step: the second coordinate over the distance.
    #[inline(always)]
    pub(super) fn h(&self, [x, squared, v, _]: Numbers) -> Numbers {
        let [h0, h1] = self.y.map(|y| y * inverse_sqrt(squared + y * y));
        [x, squared, h0 + v * (h1 - h0), 0.0]
    }

    /// The last step: coordinates in the rectangle's axes, relative to the point's foot, and one over
    /// the distance from the point.
    #[inline(always)]
    pub(super) fn y_and_distance(&self, [x, squared, h, _]: Numbers) -> ([f64; 2], f64) {
        let rest = (1.0 - h * h).max(1e-18);
        let root = inverse_sqrt(squared * rest);
        let y = (h * squared * root).clamp(self.y[0], self.y[1]);
        ([x, y].map(|end| end * self.height), rest * root * self.inverse_height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn solid_angles_of_a_cube_face_and_of_strips() {
        let face = SphericalRectangle::new([-1.0, 1.0], [-1.0, 1.0], 1.0).unwrap();
        assert!((face.solid_angle() - TAU / 3.0).abs() < 1e-12);
        let half = SphericalRectangle::new([0.0, 1.0], [-1.0, 1.0], 1.0).unwrap();
        assert!((half.solid_angle() - PI / 3.0).abs() < 1e-12);
        assert!(SphericalRectangle::new([5.0, 5.001], [-1e-3, 1e-3], 1.0).is_none());
    }

    /// The share of samples in a part is the part's share of the solid angle.
    #[test]
    fn samples_are_uniform_in_solid_angle() {
        let (x, y, height) = ([-0.3, 2.0], [0.4, 3.0], 0.5);
        let all = SphericalRectangle::new(x, y, height).unwrap();
        for (cut_x, cut_y) in [(0.0, 1.0), (1.0, 0.5), (0.2, 2.5)] {
            let part = SphericalRectangle::new([x[0], cut_x], [y[0], cut_y], height).unwrap();
            let mut inside = 0;
            const N: u32 = 512;
            for i in 0..N * N {
                let uv = [i % N, i / N].map(|k| (f64::from(k) + 0.5) / f64::from(N));
                let ([px, py], inverse) = all.sample(uv);
                let length = DVec3::new(px, py, height).length();
                assert!((inverse * length - 1.0).abs() < 1e-9, "1 / {inverse} is not {length}");
                let inside_of = |p: f64, [a, b]: [f64; 2]| a - 1e-15 <= p && p <= b + 1e-15;
                assert!(inside_of(px, x) && inside_of(py, y));
                inside += u32::from(px < cut_x && py < cut_y);
            }
            let share = f64::from(inside) / f64::from(N * N);
            let expected = part.solid_angle() / all.solid_angle();
            assert!((share - expected).abs() < 2e-3, "{share} is not {expected}");
        }
    }
}

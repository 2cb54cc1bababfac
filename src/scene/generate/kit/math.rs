//! Vectors, placements, trigonometry and random numbers that are the same on every platform.

use glam::{DAffine3, DMat3, DVec3};

pub(crate) use std::f64::consts::{PI, TAU};

/// A point or direction while modelling.
pub(crate) type V = DVec3;
/// Where an instance goes.
pub(crate) type Place = DAffine3;

/// Short for [`V::new`].
pub(crate) const fn v(x: f64, y: f64, z: f64) -> V {
    V::new(x, y, z)
}

/// Sine and cosine of `x` radians, to about 1e-15 for arguments of ordinary size.
///
/// The standard library's may differ between platforms in the last bit; these cannot.
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // Half pi in two parts: multiples of the first are exact in f64.
    const HALF_PI_HIGH: f64 = 1.570_796_326_734_125_6;
    const HALF_PI_LOW: f64 = 6.077_100_506_506_192e-11;
    let quarter = (x * std::f64::consts::FRAC_2_PI).round();
    let r = (x - quarter * HALF_PI_HIGH) - quarter * HALF_PI_LOW;
    let s = r * r;
    let series = |first: f64, n: f64| {
        // Taylor by Horner's rule: 1 - s/(n(n+1)) (1 - s/((n+2)(n+3)) (...)).
        let mut sum = 1.0;
        for k in (0..8).rev() {
            let m = n + 2.0 * f64::from(k);
            sum = 1.0 - sum * s / (m * (m + 1.0));
        }
        first * sum
    };
    let (sin, cos) = (series(r, 2.0), series(1.0, 1.0));
    match (quarter as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Sine of `x` radians.
pub(crate) fn sin(x: f64) -> f64 {
    sin_cos(x).0
}

/// Cosine of `x` radians.
pub(crate) fn cos(x: f64) -> f64 {
    sin_cos(x).1
}

/// From `a` at 0 to `b` at 1.
pub(crate) fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// Moved by `offset`.
pub(crate) fn at(offset: V) -> Place {
    Place::from_translation(offset)
}

fn yaw(angle: f64) -> DMat3 {
    let (s, c) = sin_cos(angle);
    DMat3::from_cols(v(c, 0.0, -s), V::Y, v(s, 0.0, c))
}

/// Turned by `angle` about the upright axis, then moved.
pub(crate) fn turned(offset: V, angle: f64) -> Place {
    Place::from_mat3_translation(yaw(angle), offset)
}

/// As [`turned`], but two millimetres deep, so that a flat bottom does not coincide with what it
/// stands on.
pub(crate) fn stand(x: f64, ground: f64, z: f64, angle: f64) -> Place {
    turned(v(x, ground - 0.002, z), angle)
}

/// Scaled along the axes, turned about the upright axis, then moved.
pub(crate) fn scaled(offset: V, angle: f64, scale: V) -> Place {
    Place::from_mat3_translation(yaw(angle) * DMat3::from_diagonal(scale), offset)
}

/// Tilted about x by `pitch` and about z by `roll`, turned by `angle`, then moved.
pub(crate) fn tilted(offset: V, angle: f64, pitch: f64, roll: f64) -> Place {
    let (s, c) = sin_cos(pitch);
    let about_x = DMat3::from_cols(V::X, v(0.0, c, s), v(0.0, -s, c));
    let (s, c) = sin_cos(roll);
    let about_z = DMat3::from_cols(v(c, s, 0.0), v(-s, c, 0.0), V::Z);
    Place::from_mat3_translation(yaw(angle) * about_x * about_z, offset)
}

/// Turned so that y points along `direction`, then moved.
pub(crate) fn aim(offset: V, direction: V) -> Place {
    let y = direction / direction.length();
    let helper = if y.x * y.x < 0.5 { V::X } else { V::Z };
    let z = helper.cross(y);
    let z = z / z.length();
    Place::from_mat3_translation(DMat3::from_cols(y.cross(z), y, z), offset)
}

/// SplitMix64 (Steele, Lea and Flood 2014): small, and good enough to scatter things.
pub(crate) struct Rng(u64);

impl Rng {
    /// A stream of its own for each seed and object.
    pub(crate) fn new(seed: u64, object: &str) -> Self {
        let mut rng = Self(seed);
        for byte in object.bytes() {
            rng.0 = (rng.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
        Self(rng.bits())
    }

    /// The next 64 bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform from `a` to `b`.
    pub(crate) fn range(&mut self, a: f64, b: f64) -> f64 {
        mix(a, b, self.unit())
    }

    /// Uniform whole number below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }

    /// Uniform angle.
    pub(crate) fn angle(&mut self) -> f64 {
        self.range(0.0, TAU)
    }

    /// Uniform direction.
    pub(crate) fn direction(&mut self) -> V {
        let y = self.range(-1.0, 1.0);
        let (s, c) = sin_cos(self.angle());
        let r = (1.0 - y * y).sqrt();
        v(r * c, y, r * s)
    }
}

/// Smooth noise in `[-1, 1]` with features of unit size.
pub(crate) fn noise(seed: u64, x: f64, y: f64) -> f64 {
    let (fx, fy) = (x.floor(), y.floor());
    let corner = |i: i64, j: i64| {
        let key = (fx as i64 + i).wrapping_mul(0x1f1f_1f1f) ^ (fy as i64 + j).wrapping_mul(0x5bd1);
        2.0 * Rng(seed ^ (key as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)).unit() - 1.0
    };
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (ease(x - fx), ease(y - fy));
    mix(mix(corner(0, 0), corner(1, 0), tx), mix(corner(0, 1), corner(1, 1), tx), ty)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_accurate() {
        for i in -4000..4000 {
            let x = f64::from(i) * 0.013;
            let (s, c) = sin_cos(x);
            assert!((s - x.sin()).abs() < 1e-12 && (c - x.cos()).abs() < 1e-12, "at {x}");
        }
    }

    #[test]
    fn rng_is_splitmix64() {
        // The reference implementation's first outputs for seed 1234567.
        let mut rng = Rng(1_234_567);
        assert_eq!(rng.bits(), 6_457_827_717_110_365_317);
        assert_eq!(rng.bits(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn placements_are_rigid() {
        for place in [turned(V::ONE, 0.7), tilted(V::ONE, 0.3, 1.1, -0.4), aim(V::ONE, V::ONE)] {
            let d = place.matrix3.determinant();
            assert!((d - 1.0).abs() < 1e-12, "determinant {d}");
        }
        let up = aim(V::ZERO, v(1.0, 2.0, -2.0)).transform_vector3(V::Y);
        assert!((up - v(1.0, 2.0, -2.0) / 3.0).length() < 1e-12);
    }
}

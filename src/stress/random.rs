//! Seeded numbers for rays and meshes: a ray depends on the seed, its case and its index alone.

use crate::geometry::Vec3;

/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A stream of its own for each seed, name and number.
    pub fn new(seed: u64, name: &str, number: u64) -> Self {
        let mut random = Self(seed);
        for byte in name.bytes() {
            random.0 = (random.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
        random.0 = random.bits() ^ number;
        Self(random.bits())
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform below `n`, which is small.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.bits() >> 32) as usize * n) >> 32
    }

    /// One of these.
    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in `[-1, 1)` on each axis; now and then on a coarse grid, where differences are exact.
    pub fn point(&mut self) -> Vec3 {
        let mut axis = || self.unit() * 2.0 - 1.0;
        let point = Vec3::new(axis(), axis(), axis());
        if self.below(4) == 0 { (point * 4.0).round() / 4.0 } else { point }
    }
}

//! Where samples come from: one low-discrepancy point set per pixel and dimension set.

/// What a pair of sample coordinates is for. Each user draws from points of its own, so that what
/// one of them does never shows in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Position of the camera ray in its pixel.
    Camera,
    /// Direction of a finite ambient-occlusion ray.
    AmbientOcclusion,
    /// Direction of an unbounded ambient-occlusion ray.
    AmbientOcclusionUnbounded,
    /// Point on the light of this index in the scene.
    Light(usize),
}

impl Dimension {
    fn id(self) -> u64 {
        match self {
            Self::Camera => 0,
            Self::AmbientOcclusion => 1,
            Self::AmbientOcclusionUnbounded => 2,
            Self::Light(light) => 16 + light as u64,
        }
    }
}

/// The samples of one pixel: a function of seed, pixel, dimension set and sample index and of
/// nothing else, so images do not depend on the order of the work.
///
/// Two-dimensional Sobol points, Owen-scrambled by hashing for each pixel and dimension set
/// (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Any number of samples may be
/// taken; powers of two are stratified best.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    key: u64,
}

impl PixelSampler {
    /// The sampler of pixel `(x, y)`, counted from the upper left corner.
    pub fn new(seed: u64, x: u32, y: u32) -> Self {
        Self { key: mix(mix(seed) ^ (u64::from(y) << 32 | u64::from(x))) }
    }

    /// Point `index` of a dimension set, both coordinates in `[0, 1)`.
    #[inline]
    pub fn sample_2d(&self, dimension: Dimension, index: u32) -> [f64; 2] {
        // The crate's sequence is 2^16 points long: longer runs are sets of that length.
        let (set, index) = (u64::from(index >> 16), index & 0xffff);
        let scramble = mix(self.key ^ mix(dimension.id() << 32 | set)) as u32;
        let [u, v, ..] = sobol_burley::sample_4d(index, 0, scramble);
        [f64::from(u), f64::from(v)]
    }
}

/// A bijection of 64-bit words in which every input bit moves every output bit: the finaliser of
/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
pub(crate) fn mix(word: u64) -> u64 {
    let z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of area 1/n holds exactly one of the first n points.
    #[test]
    fn points_are_stratified_in_every_pixel() {
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1919, 1079)] {
            let sampler = PixelSampler::new(7, x, y);
            for dimension in [Dimension::Camera, Dimension::Light(0), Dimension::Light(3)] {
                for log_columns in 0..=4 {
                    let (columns, rows) = (1usize << log_columns, 1usize << (4 - log_columns));
                    let mut seen = [0; 16];
                    for index in 0..16 {
                        let [u, v] = sampler.sample_2d(dimension, index);
                        let column = (u * columns as f64) as usize;
                        seen[column * rows + (v * rows as f64) as usize] += 1;
                    }
                    assert_eq!(seen, [1; 16], "pixel {x} {y}, {dimension:?}, {columns} columns");
                }
            }
        }
    }

    #[test]
    fn keys_are_told_apart() {
        let first = |seed, x, y, d| PixelSampler::new(seed, x, y).sample_2d(d, 0);
        let ao = Dimension::AmbientOcclusion;
        let base = first(1, 2, 3, ao);
        assert_eq!(base, first(1, 2, 3, ao));
        for other in [first(2, 2, 3, ao), first(1, 3, 2, ao), first(1, 2, 3, Dimension::Camera)] {
            assert_ne!(base, other);
        }
    }

    #[test]
    fn sets_longer_than_the_sequence_go_on() {
        let sampler = PixelSampler::new(0, 0, 0);
        let d = Dimension::Camera;
        assert_ne!(sampler.sample_2d(d, 5), sampler.sample_2d(d, (1 << 16) + 5));
        let mean = (0..1u32 << 17).map(|i| sampler.sample_2d(d, i)[0]).sum::<f64>() / 131_072.0;
        assert!((mean - 0.5).abs() < 1e-4, "{mean}");
    }
}

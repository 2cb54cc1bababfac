//! The hand-over types between renderer and backends: rays, hits, batches, occlusion bits.

use glam::Vec3;

/// The points `origin + t * direction` with `t` in the closed interval `[t_min, t_max]`.
///
/// `direction` need not have unit length; `t` is measured in multiples of it. A ray with a
/// non-finite origin or direction, a zero direction, or an empty or NaN interval hits nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, in scene units.
    pub origin: Vec3,
    /// Start of the interval.
    pub t_min: f32,
    /// Direction, of any length.
    pub direction: Vec3,
    /// End of the interval; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// The ray from `origin` along `direction` over `[0, t_max]`.
    pub fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, t_min: 0.0, direction, t_max }
    }

    /// The point at parameter `t`, rounded.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// The closest intersection of a ray. Ties in `t` go to the lower triangle index, so that the hit
/// does not depend on the backend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in multiples of the direction's length.
    pub t: f32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
}

/// Shadow rays that are answered together: one virtual call a batch, never one a ray.
#[derive(Clone, Copy, Debug)]
pub struct RayBatch<'a> {
    /// The rays, in the order of their bits in the answer.
    pub rays: &'a [Ray],
}

/// Number of 64-bit words that hold one bit for each of `rays` rays.
pub const fn words_for(rays: usize) -> usize {
    rays.div_ceil(64)
}

/// Sets the answer of ray `index` in a zeroed bit set.
#[inline]
pub fn set_bit(words: &mut [u64], index: usize, value: bool) {
    words[index / 64] |= u64::from(value) << (index % 64);
}

/// The answer of ray `index`.
#[inline]
pub fn bit(words: &[u64], index: usize) -> bool {
    words[index / 64] >> (index % 64) & 1 != 0
}

/// What a counting run saw along one ray. Counting runs are never timed runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VisitCounts {
    /// Tree nodes entered: inner nodes and leaves whose box the ray meets.
    pub nodes: u32,
    /// Ray-triangle tests.
    pub triangles: u32,
    /// Those of them that `f32` left in doubt and `f64` settled; in exact mode.
    pub double_tests: u32,
    /// Those that `f64` left in doubt too, so that integers settled them; in exact mode.
    pub exact_tests: u32,
}

impl std::ops::AddAssign for VisitCounts {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.triangles += other.triangles;
        self.double_tests += other.double_tests;
        self.exact_tests += other.exact_tests;
    }
}

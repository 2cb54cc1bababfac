//! One ray of a stream against the boxes of a node's children.

use super::rays::{Rays, Row};
use super::simd::Simd;
use crate::tree::Node8;

/// A ray's numbers, one in all lanes each.
#[derive(Clone, Copy)]
pub(super) struct OneRay<S: Simd> {
    reciprocal: [S::Floats; 3],
    near: [S::Floats; 3],
    far: [S::Floats; 3],
    t_min: S::Floats,
    t_max: S::Floats,
    /// For each axis the side of the entry plane.
    entry_side: [usize; 3],
}

impl<S: Simd> OneRay<S> {
    #[inline(always)]
    pub(super) fn new(s: S, rays: &Rays<'_>, index: usize, octant: u8) -> Self {
        let octant = usize::from(octant);
        Self {
            reciprocal: splat_3(s, &rays.reciprocal, index),
            near: splat_3(s, &rays.near, index),
            far: splat_3(s, &rays.far, index),
            t_min: s.splat(rays.t_min.0[index]),
            t_max: s.splat(rays.t_max.0[index]),
            entry_side: [octant & 1, octant >> 1 & 1, octant >> 2 & 1],
        }
    }

    /// The children that the ray meets, one bit each.
    #[inline(always)]
    pub(super) fn meets(&self, s: S, node: &Node8) -> u32 {
        self.enters(s, node).0
    }

    /// As [`meets`](Self::meets), and where the ray enters all boxes.
    #[inline(always)]
    pub(super) fn enters(&self, s: S, node: &Node8) -> (u32, S::Floats) {
        let (mut entry, mut exit) = (self.t_min, self.t_max);
        for axis in 0..3 {
            let side = self.entry_side[axis] & 1;
            let planes = &node.planes[axis];
            let (near, far) = (s.load(&planes[side]), s.load(&planes[1 - side]));
            let (r, n, f) = (self.reciprocal[axis], self.near[axis], self.far[axis]);
            entry = s.max(s.mul_sub(near, r, n), entry);
            exit = s.min(s.mul_sub(far, r, f), exit);
        }
        (s.bits(s.less_equal(entry, exit)) as u32 & node.occupied(), entry)
    }

    /// Ends the ray at `t`.
    #[inline(always)]
    pub(super) fn shorten(&mut self, s: S, t: f32) {
        self.t_max = s.min(s.splat(t), self.t_max);
    }
}

/// One ray's numbers of three rows, in all lanes.
#[inline(always)]
fn splat_3<S: Simd>(s: S, rows: &[Row; 3], index: usize) -> [S::Floats; 3] {
    [s.splat(rows[0].0[index]), s.splat(rows[1].0[index]), s.splat(rows[2].0[index])]
}

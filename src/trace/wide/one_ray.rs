//! One ray of a stream against the boxes of a node's children.

use super::numbers::Slabs;
use super::rays::{Rays, Row};
use super::simd::Simd;
use crate::tree::Node8;

/// A ray's numbers, one in all lanes each.
#[derive(Clone, Copy)]
pub(super) struct OneRay<S: Simd> {
    slabs: Slabs<S>,
    /// For each axis the side of the entry plane.
    entry_side: [usize; 3],
}

impl<S: Simd> OneRay<S> {
    /// Ray `index` of a stream.
    #[inline(always)]
    pub(super) fn new(s: S, rays: &Rays<'_>, index: usize, octant: u8) -> Self {
        let slabs = Slabs {
            reciprocal: splat_3(s, &rays.reciprocal, index),
            near: splat_3(s, &rays.near, index),
            far: splat_3(s, &rays.far, index),
            t_min: s.splat(rays.t_min.0[index]),
            t_max: s.splat(rays.t_max.0[index]),
            begin: s.splat(rays.begin.0[index]),
        };
        Self::of(slabs, octant)
    }

    #[inline(always)]
    pub(super) fn of(slabs: Slabs<S>, octant: u8) -> Self {
        let octant = usize::from(octant);
        Self { slabs, entry_side: [octant & 1, octant >> 1 & 1, octant >> 2 & 1] }
    }

    /// Where the ray crosses the entry planes of an axis, and the exit planes.
    #[inline(always)]
    fn crosses(&self, s: S, node: &Node8, axis: usize) -> [S::Floats; 2] {
        let side = self.entry_side[axis] & 1;
        let planes = &node.planes[axis];
        let (near, far) = (s.load(&planes[side]), s.load(&planes[1 - side]));
        let reciprocal = self.slabs.reciprocal[axis];
        [
            s.mul_sub(near, reciprocal, self.slabs.near[axis]),
            s.mul_sub(far, reciprocal, self.slabs.far[axis]),
        ]
    }

    /// The children that the ray meets, one bit each. All that a single ray does next waits for this.
    #[inline(always)]
    pub(super) fn meets(&self, s: S, node: &Node8) -> u32 {
        let [x, y, z] =
            [self.crosses(s, node, 0), self.crosses(s, node, 1), self.crosses(s, node, 2)];
        let entry = s.quick_max(s.quick_max(x[0], y[0]), s.quick_max(z[0], self.slabs.begin));
        let exit = s.quick_min(s.quick_min(x[1], y[1]), s.quick_min(z[1], self.slabs.t_max));
        s.quick_less_equal(entry, exit) & node.occupied()
    }

    /// The children that the ray meets, one bit each, and where it enters all boxes.
    #[inline(always)]
    pub(super) fn enters(&self, s: S, node: &Node8) -> (u32, S::Floats) {
        let (mut entry, mut exit) = (self.slabs.t_min, self.slabs.t_max);
        for axis in 0..3 {
            let [enters, leaves] = self.crosses(s, node, axis);
            entry = s.max(enters, entry);
            exit = s.min(leaves, exit);
        }
        (s.bits(s.less_equal(entry, exit)) as u32 & node.occupied(), entry)
    }

    /// Ends the ray at `t`.
    #[inline(always)]
    pub(super) fn shorten(&mut self, s: S, t: f32) {
        self.slabs.t_max = s.min(s.splat(t), self.slabs.t_max);
    }
}

/// One ray's numbers of three rows, in all lanes.
#[inline(always)]
fn splat_3<S: Simd>(s: S, rows: &[Row; 3], index: usize) -> [S::Floats; 3] {
    [s.splat(rows[0].0[index]), s.splat(rows[1].0[index]), s.splat(rows[2].0[index])]
}

//! The rays of a packet side by side, for loops that the compiler turns into vector instructions.
//!
//! The arithmetic is that of [`PreparedRay`], operation by operation, so each lane gives the bits
//! that its ray would.

use super::PACKET_SIZE;
use crate::geometry::{Aabb, Triangle};
use crate::intersect::{Mode, PreparedRay};

/// Rays that are computed together.
pub(super) const LANES: usize = 8;

type Wide = [f32; LANES];

/// The bits of one group's rays.
#[inline(always)]
pub(super) fn of_group(mask: u64, group: usize) -> u64 {
    mask >> (group * LANES) & ((1 << LANES) - 1)
}

/// The parts of [`PreparedRay`] of one group's rays; lanes without a ray hold zeros.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Group {
    near_origin: [Wide; 3],
    far_origin: [Wide; 3],
    reciprocal: [Wide; 3],
    box_t_min: Wide,
    box_t_max: Wide,
    /// In the order of the ray's sheared axes.
    origin: [Wide; 3],
    shear: [Wide; 2],
    /// Edge functions beyond this times the corners' distance count; 0 where signs alone do.
    edge_slack: Wide,
}

const EMPTY: Group = Group {
    near_origin: [[0.0; LANES]; 3],
    far_origin: [[0.0; LANES]; 3],
    reciprocal: [[0.0; LANES]; 3],
    box_t_min: [0.0; LANES],
    box_t_max: [0.0; LANES],
    origin: [[0.0; LANES]; 3],
    shear: [[0.0; LANES]; 2],
    edge_slack: [0.0; LANES],
};

/// The rays of a packet in groups.
pub(super) struct Lanes {
    groups: [Group; PACKET_SIZE / LANES],
    /// For each axis whether all rays descend, if they all agree on all axes.
    descending: Option<[bool; 3]>,
    /// The axes of the shear, if all rays have the same.
    shear_axes: Option<[usize; 3]>,
}

impl Lanes {
    pub(super) fn new(rays: &[Option<PreparedRay>; PACKET_SIZE], mode: Mode) -> Self {
        let mut groups = [EMPTY; PACKET_SIZE / LANES];
        for (index, ray) in rays.iter().enumerate() {
            let Some(ray) = ray else { continue };
            let (group, lane) = (&mut groups[index / LANES], index % LANES);
            let (slabs, shear) = (ray.slabs(), ray.shear());
            for axis in 0..3 {
                group.near_origin[axis][lane] = slabs.near_origin[axis];
                group.far_origin[axis][lane] = slabs.far_origin[axis];
                group.reciprocal[axis][lane] = slabs.reciprocal[axis];
                group.origin[axis][lane] = shear.origin[shear.axes[axis]];
            }
            for (shears, factor) in group.shear.iter_mut().zip(shear.factors) {
                shears[lane] = factor;
            }
            if mode == Mode::Exact {
                group.edge_slack[lane] = ray.edge_slack();
            }
            group.box_t_min[lane] = slabs.t_min;
            group.box_t_max[lane] = slabs.t_max;
        }
        let valid = || rays.iter().flatten();
        Self {
            groups,
            descending: agreed(valid().map(|ray| ray.slabs().descending)),
            shear_axes: agreed(valid().map(|ray| ray.shear().axes)),
        }
    }

    /// Those rays of a group that meet `bounds`, as [`PreparedRay::enter`] says, from the lowest
    /// bit on.
    #[inline]
    pub(super) fn meet(&self, group: usize, bounds: &Aabb) -> u64 {
        let group = &self.groups[group];
        match self.descending {
            Some(descending) => group.meet(bounds, |axis, _| descending[axis]),
            None => group.meet(bounds, |_, reciprocal| reciprocal < 0.0),
        }
    }

    /// Those rays of a group that may hit `triangle`: no sign in `f32` speaks against it, in exact mode
    /// none that is certain, if all rays are sheared along one axis; else all.
    #[inline]
    pub(super) fn may_hit(&self, mode: Mode, group: usize, triangle: &Triangle) -> u64 {
        match self.shear_axes {
            Some(axes) => self.groups[group].accepts(mode, axes, triangle),
            None => (1 << LANES) - 1,
        }
    }
}

/// The value that all have.
fn agreed<T: PartialEq>(mut values: impl Iterator<Item = T>) -> Option<T> {
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

/// One instruction; what overflows is in doubt either way.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// One bit for each lane.
#[inline(always)]
fn packed(lanes: [u32; LANES]) -> u64 {
    let mut mask = 0;
    for (lane, set) in lanes.iter().enumerate() {
        mask |= set << lane;
    }
    u64::from(mask)
}

impl Group {
    #[inline(always)]
    fn meet(&self, bounds: &Aabb, descends: impl Fn(usize, f32) -> bool) -> u64 {
        let (mut entry, mut exit) = (self.box_t_min, self.box_t_max);
        for axis in 0..3 {
            let (lower, upper) = (bounds.min[axis], bounds.max[axis]);
            for lane in 0..LANES {
                let reciprocal = self.reciprocal[axis][lane];
                let (near, far) =
                    if descends(axis, reciprocal) { (upper, lower) } else { (lower, upper) };
                let enters = (near - self.near_origin[axis][lane]) * reciprocal;
                let leaves = (far - self.far_origin[axis][lane]) * reciprocal;
                // Comparisons that are one instruction each; nothing here is NaN.
                entry[lane] = if enters > entry[lane] { enters } else { entry[lane] };
                exit[lane] = if leaves < exit[lane] { leaves } else { exit[lane] };
            }
        }
        packed(std::array::from_fn(|lane| u32::from(entry[lane] <= exit[lane])))
    }

    /// The vertex in sheared coordinates.
    #[inline(always)]
    fn project(&self, axes: [usize; 3], vertex: glam::Vec3) -> [Wide; 2] {
        let [mut x, mut y] = [[0.0; LANES]; 2];
        let vertex = axes.map(|axis| vertex[axis]);
        for lane in 0..LANES {
            let z = vertex[2] - self.origin[2][lane];
            x[lane] = (vertex[0] - self.origin[0][lane]) - self.shear[0][lane] * z;
            y[lane] = (vertex[1] - self.origin[1][lane]) - self.shear[1][lane] * z;
        }
        [x, y]
    }

    #[inline(always)]
    fn accepts(&self, mode: Mode, axes: [usize; 3], triangle: &Triangle) -> u64 {
        let [a, b, c] = triangle.0;
        let [a, b, c] = [self.project(axes, a), self.project(axes, b), self.project(axes, c)];
        let mut inside = [0; LANES];
        for lane in 0..LANES {
            let u = c[0][lane] * b[1][lane] - c[1][lane] * b[0][lane];
            let v = a[0][lane] * c[1][lane] - a[1][lane] * c[0][lane];
            let w = b[0][lane] * a[1][lane] - b[1][lane] * a[0][lane];
            let slack = match mode {
                Mode::Fast => 0.0,
                Mode::Exact => {
                    let far = |p: &[Wide; 2]| p[0][lane].abs() + p[1][lane].abs();
                    let farthest = larger(larger(far(&a), far(&b)), far(&c));
                    self.edge_slack[lane] * farthest + f32::MIN_POSITIVE
                }
            };
            let below = (u < -slack) | (v < -slack) | (w < -slack);
            let above = (u > slack) | (v > slack) | (w > slack);
            inside[lane] = u32::from(!(below & above));
        }
        packed(inside)
    }
}

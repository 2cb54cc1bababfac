//! Up to 128 rays side by side, with what the conservative tests compute with.

use super::around::Around;
use super::leaf::{END_SLACK, SLOPE_SLACK, UNDERFLOW};
use super::numbers::{Given, LARGEST_REACH, OF_EXTENT, OF_UNDERFLOW, Target, prepare};
use super::octants::Picked;
use super::simd::{LANES, Simd, Wide};
use super::stack::Stack;
use crate::geometry::{Aabb, TriangleMesh};
use crate::intersect::{Mode, PreparedRay, Stage};
use crate::ray::Ray;
use crate::trace::packet::PacketCounter;
use std::cell::OnceCell;

/// Rays of a stream.
pub(super) const STREAM: usize = Bits::BITS as usize;

/// One bit for each ray of a stream.
pub(super) type Bits = u128;

/// One number for each ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Row(pub(super) [f32; STREAM]);

impl Row {
    pub(super) const ZERO: Self = Self([0.0; STREAM]);

    /// Those of eight rays.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> &[f32; LANES] {
        &self.0.as_chunks::<LANES>().0[group]
    }

    #[inline(always)]
    pub(super) fn group_mut(&mut self, group: usize) -> &mut [f32; LANES] {
        &mut self.0.as_chunks_mut::<LANES>().0[group]
    }
}

/// What a stream's rays are tested with.
pub(super) struct Numbers {
    pub(super) reciprocal: [Row; 3],
    /// Subtracted from the products of entry planes and reciprocals.
    pub(super) near: [Row; 3],
    /// Subtracted from those of exit planes.
    pub(super) far: [Row; 3],
    /// Interval of the box test.
    pub(super) t_min: Row,
    pub(super) t_max: Row,
    /// What any-hit rays' exits are held against in place of `t_min`: not negative.
    pub(super) begin: Row,
    pub(super) origin: [Row; 3],
    /// NaN for rays that the scalar test alone is to decide on.
    pub(super) direction: [Row; 3],
    /// The interval, cut to where the scene may be.
    pub(super) start: Row,
    pub(super) end: Row,
    /// Bounds of [`leaf`](super::leaf).
    pub(super) slope_slack: Row,
    pub(super) edge_slack: Row,
    pub(super) start_slack: Row,
    pub(super) end_slack: Row,
    pub(super) height_slack: Row,
    /// For each group the signs of the directions, one bit for each axis.
    pub(super) octants: [u8; STREAM / LANES],
}

impl Numbers {
    pub(super) const ZERO: Self = Self {
        reciprocal: [Row::ZERO; 3],
        near: [Row::ZERO; 3],
        far: [Row::ZERO; 3],
        t_min: Row::ZERO,
        t_max: Row::ZERO,
        begin: Row::ZERO,
        origin: [Row::ZERO; 3],
        direction: [Row::ZERO; 3],
        start: Row::ZERO,
        end: Row::ZERO,
        slope_slack: Row::ZERO,
        edge_slack: Row::ZERO,
        start_slack: Row::ZERO,
        end_slack: Row::ZERO,
        height_slack: Row::ZERO,
        octants: [0; STREAM / LANES],
    };
}

/// The rays of a stream.
pub(super) struct Rays<'a> {
    numbers: &'a mut Numbers,
    target: Target<'a>,
    picked: Picked<'a>,
    /// One bit for each ray that may hit something.
    pub(super) valid: Bits,
    /// Whether none is odd.
    pub(super) are_plain: bool,
    around: OnceCell<Around>,
}

impl std::ops::Deref for Rays<'_> {
    type Target = Numbers;

    #[inline(always)]
    fn deref(&self) -> &Numbers {
        self.numbers
    }
}

impl<'a> Rays<'a> {
    /// Those picked.
    #[inline(always)]
    pub(super) fn new<S: Simd, W: Wide>(
        s: S,
        w: W,
        numbers: &'a mut Numbers,
        target: Target<'a>,
        picked: Picked<'a>,
    ) -> Self {
        let Picked { batch: given, places, there, ahead, .. } = picked;
        for (group, places) in places.as_chunks::<LANES>().0.iter().enumerate() {
            let mut rays = [&given[usize::from(places[0])]; LANES];
            for (lane, place) in places.iter().enumerate().skip(1) {
                rays[lane] = &given[usize::from(*place)];
            }
            numbers.take(s, group, rays);
        }
        let mut plain: Bits = 0;
        for group in 0..places.len() / W::GROUP {
            // Batches of a set lie one after the other. A few lines at a time, as only so many are under way.
            if given.len() >= STREAM {
                for pair in 0..W::GROUP / 2 {
                    s.prefetch_ahead(ahead.wrapping_add(group * W::GROUP + 2 * pair));
                }
            }
            plain |= Bits::from(numbers.prepare(w, group, target)) << (group * W::GROUP);
            numbers.octants[group] = s.octant(&given[usize::from(places[group * W::GROUP])]);
        }
        let mut valid = there & plain;
        let mut odd = there & !plain;
        while odd != 0 {
            let index = odd.trailing_zeros() as usize;
            let ray = &given[usize::from(places[index])];
            valid |= Bits::from(numbers.fill_odd(index, ray, target.bounds)) << index;
            odd &= odd - 1;
        }
        let are_plain = there & !plain == 0;
        Self { numbers, target, picked, valid, are_plain, around: OnceCell::new() }
    }

    /// The ray with this number in the stream, prepared for the scalar tests.
    #[inline(always)]
    pub(super) fn prepared(&self, index: usize) -> Option<PreparedRay> {
        PreparedRay::new(self.given(index), self.target.bounds)
    }

    /// The ray with this number in the stream.
    pub(super) fn given(&self, index: usize) -> &Ray {
        &self.picked.batch[usize::from(self.picked.places[index])]
    }

    /// What holds them all, found when it is asked for first.
    #[inline(always)]
    pub(super) fn around<W: Wide>(&self, w: W) -> &Around {
        // `get_or_init` is not compiled for the instructions at hand.
        if self.around.get().is_none() {
            let _ = self.around.set(Around::new(w, self));
        }
        self.around.get().expect("set above")
    }

    /// Those of `alive` rays that a triangle stops that was in doubt.
    #[inline(always)]
    pub(super) fn settle<S: Simd, C: PacketCounter>(
        &self,
        s: S,
        alive: Bits,
        stack: &mut Stack,
        counter: &mut C,
    ) -> Bits {
        stack.settle(s, self.target, |index| self.given(index), alive, counter)
    }

    /// Box around all that they are tested against.
    pub(super) fn bounds(&self) -> &Aabb {
        self.target.bounds
    }

    /// The mesh that they are tested against.
    pub(super) fn mesh(&self) -> &TriangleMesh {
        self.target.mesh
    }

    /// From now on misses what lies beyond `t`, in units of [`PreparedRay::triangle`]; a hit at `t`
    /// itself is still found.
    #[inline(always)]
    pub(super) fn shorten(&mut self, index: usize, t: f32) {
        let numbers = &mut *self.numbers;
        let box_end = &mut numbers.t_max.0[index];
        *box_end = box_end.min(t);
        // What the plane test finds beyond the next number is rounded to that number or a later one.
        let end = t.next_up().min(numbers.end.0[index]);
        numbers.end.0[index] = end;
        let unit = numbers.slope_slack.0[index] * (END_SLACK / SLOPE_SLACK);
        numbers.end_slack.0[index] = end.abs() * unit + UNDERFLOW;
    }
}

/// Whether a ray hits a triangle that the vector tests leave in doubt, and what settled it.
#[inline(never)]
pub(super) fn confirm(ray: &Ray, triangle: u32, target: Target<'_>) -> (bool, Stage) {
    let triangle = target.mesh.triangle(triangle as usize);
    match target.mode {
        Mode::Exact => crate::intersect::hits_exactly(ray, &triangle),
        Mode::Fast => {
            let prepared = PreparedRay::new(ray, target.bounds);
            (prepared.is_some_and(|ray| ray.triangle(&triangle).is_some()), Stage::Single)
        }
    }
}

impl Numbers {
    /// The rays' own numbers, in the rows of their names.
    #[inline(always)]
    fn take<S: Simd>(&mut self, s: S, group: usize, rays: [&Ray; LANES]) {
        let [ox, oy, oz, t_min, dx, dy, dz, t_max] = s.rays(rays);
        for (row, numbers) in self.origin.iter_mut().zip([ox, oy, oz]) {
            s.store(row.group_mut(group), numbers);
        }
        for (row, numbers) in self.direction.iter_mut().zip([dx, dy, dz]) {
            s.store(row.group_mut(group), numbers);
        }
        s.store(self.start.group_mut(group), t_min);
        s.store(self.end.group_mut(group), t_max);
    }

    /// Computes the others. Returns which rays are not odd: valid, and of common size.
    #[inline(always)]
    fn prepare<W: Wide>(&mut self, w: W, group: usize, target: Target<'_>) -> u64 {
        let given = Given {
            origin: load_3(w, &self.origin, group),
            direction: load_3(w, &self.direction, group),
            t_min: w.load(&self.start, group),
            t_max: w.load(&self.end, group),
        };
        let (slabs, limits, plain) = prepare(w, &given, target);
        for axis in 0..3 {
            w.store(&mut self.reciprocal[axis], group, slabs.reciprocal[axis]);
            w.store(&mut self.near[axis], group, slabs.near[axis]);
            w.store(&mut self.far[axis], group, slabs.far[axis]);
        }
        w.store(&mut self.t_min, group, slabs.t_min);
        w.store(&mut self.t_max, group, slabs.t_max);
        w.store(&mut self.begin, group, slabs.begin);
        w.store(&mut self.start, group, limits.start);
        w.store(&mut self.end, group, limits.end);
        w.store(&mut self.slope_slack, group, limits.slope_slack);
        w.store(&mut self.edge_slack, group, limits.edge_slack);
        w.store(&mut self.start_slack, group, limits.start_slack);
        w.store(&mut self.end_slack, group, limits.end_slack);
        w.store(&mut self.height_slack, group, limits.height_slack);
        plain
    }

    /// A ray that is scaled or might overflow, from what it is prepared as. `false` if it hits nothing
    /// by definition.
    #[cold]
    #[inline(never)]
    fn fill_odd(&mut self, index: usize, ray: &Ray, bounds: &Aabb) -> bool {
        let Some(prepared) = PreparedRay::new(ray, bounds) else { return false };
        let slabs = prepared.slabs();
        let corners = [bounds.min, bounds.max];
        let later = f64::from(-slabs.t_min).max(0.0);
        for axis in 0..3 {
            let (reciprocal, origin) = (slabs.reciprocal[axis], ray.origin[axis]);
            let extent = corners.map(|c| (c[axis] - origin).abs()).into_iter().fold(0.0, f32::max);
            // The padding that the planes have already is in `slabs`.
            let pad = (f64::from(extent) + f64::from(origin.abs())) * f64::from(OF_EXTENT)
                + f64::from(OF_UNDERFLOW);
            let forwards = if slabs.descending[axis] { -pad } else { pad };
            let moved = |origin: f32, by: f64| (f64::from(origin) + by) * f64::from(reciprocal);
            let near = moved(slabs.near_origin[axis], forwards) as f32;
            let far = (moved(slabs.far_origin[axis], -forwards) - later) as f32;
            let bounded = (extent + origin.abs()) * reciprocal.abs() < LARGEST_REACH;
            self.reciprocal[axis].0[index] = if bounded { reciprocal } else { 0.0 };
            self.near[axis].0[index] = if bounded { near } else { f32::INFINITY };
            self.far[axis].0[index] = if bounded { far } else { f32::NEG_INFINITY };
        }
        self.t_min.0[index] = slabs.t_min;
        self.t_max.0[index] = (f64::from(slabs.t_max) + later) as f32;
        self.begin.0[index] = if slabs.t_min > 0.0 { slabs.t_min } else { 0.0 };
        self.direction.iter_mut().for_each(|row| row.0[index] = f32::NAN);
        true
    }
}

/// The numbers of a group in three rows.
#[inline(always)]
pub(super) fn load_3<W: Wide>(w: W, rows: &[Row; 3], group: usize) -> [W::Floats; 3] {
    [w.load(&rows[0], group), w.load(&rows[1], group), w.load(&rows[2], group)]
}

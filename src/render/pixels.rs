//! From the points that a tile's pixels see to the shadow rays of one class.

use super::ambient_occlusion;
use super::few_samples::{Member, Toward};
use super::sampled_light::SampledLight;
use super::skip::Skip;
use super::soft_shadow::LightView;
use super::stats::SkippedRays;
use super::walk::{BATCH_RAYS, Known, RayBuffer, Samples, Sink, Visible, Walk};
use crate::ray::Ray;
use crate::trace::shaft::{Entry, View};

/// Pixels with more samples fill vectors on their own.
const MOST_FEW: u32 = 4;

/// Why rays of which that is known, to a light or not, need not be traced.
pub(super) fn reason(view: View, to_light: bool) -> Option<Skip> {
    match view {
        View::Open if to_light => Some(Skip::LitShafts),
        View::Open => Some(Skip::OpenHemispheres),
        View::Blocked => Some(Skip::BlockedShafts),
        View::Partly => None,
    }
}

/// What turns pixels into samples of one class.
pub(super) struct Pixels<'a, 'w> {
    pub(super) walk: &'a Walk<'w>,
    pub(super) tile: usize,
    pub(super) class: usize,
    /// Which block of each pixel's points.
    pub(super) camera_sample: u32,
    /// If its rays go to one.
    pub(super) light: Option<&'a SampledLight>,
    pub(super) buffer: &'a mut RayBuffer,
    pub(super) samples: &'a mut Samples,
    pub(super) sink: &'a mut dyn Sink,
    pub(super) skipped: &'a mut SkippedRays,
}

impl Pixels<'_, '_> {
    /// Has rays start there from now on.
    pub(super) fn start_at(&mut self, entry: &Entry) {
        if entry.parts().is_some() || self.buffer.entry.parts().is_some() {
            self.buffer.flush(self.class, self.sink);
            self.buffer.entry.clone_from(entry);
        }
    }

    /// Adds the samples of pixels of which nothing is known.
    pub(super) fn add_all(&mut self, surfaces: &[Visible]) {
        for visible in surfaces {
            let Some((count, light)) = self.samples_of(visible) else { continue };
            let surface = &visible.surface;
            let toward = match &light {
                None => Some(Toward::Hemisphere(surface.normal)),
                Some(light) => light.as_rectangle().map(Toward::Rectangle),
            };
            let Some(toward) = toward.filter(|_| count <= MOST_FEW) else {
                self.add_samples(visible, View::Partly, count, light);
                continue;
            };
            if !self.samples.few.has_room(count) {
                self.add_few();
            }
            let pixel = (visible.slot, visible.sampler);
            self.samples.few.add(pixel, surface.origin, &toward, count);
        }
        self.add_few();
    }

    /// Adds the samples of pixels that have few each.
    fn add_few(&mut self) {
        let Samples { directions, of_light, few, .. } = &mut *self.samples;
        if self.buffer.rays.len() + few.len() > BATCH_RAYS {
            self.buffer.flush(self.class, self.sink);
        }
        let RayBuffer { rays, weights, slots, .. } = &mut *self.buffer;
        let (dimension, radius) = self.walk.dimension(self.class);
        if self.light.is_none() {
            few.directions(dimension, self.camera_sample, directions);
            for Member { slot, ray_origin, samples, .. } in few.members() {
                let ray = |direction| Ray::new(*ray_origin, direction, radius);
                rays.extend(directions.some(samples.clone()).map(ray));
                slots.extend(std::iter::repeat_n(*slot, samples.len()));
            }
        } else {
            few.of_light(dimension, self.camera_sample, of_light);
            let weightless = !self.walk.skip.has(Skip::Weightless);
            for Member { slot, ray_origin, samples, .. } in few.members() {
                let before = rays.len();
                let ray = |direction| Ray::new(*ray_origin, direction, radius);
                of_light.add_rays(samples.clone(), weightless, ray, rays, weights);
                let added = rays.len() - before;
                self.skipped[Skip::Weightless as usize] += (samples.len() - added) as u64;
                slots.extend(std::iter::repeat_n(*slot, added));
            }
        }
        few.clear();
    }

    /// Adds the samples of one pixel, of which that is known.
    pub(super) fn add(&mut self, visible: &Visible, view: View) {
        if let Some((count, light)) = self.samples_of(visible) {
            self.add_samples(visible, view, count, light);
        }
    }

    /// How many samples a pixel has, and the light as it sees it, if they are of one; `None` if all of
    /// them are left out.
    fn samples_of(&mut self, visible: &Visible) -> Option<(u32, Option<LightView>)> {
        let count = self.walk.plan.samples(self.tile, self.class, usize::from(visible.slot));
        let light = self.light.map(|light| light.seen_from(&visible.surface));
        if light.is_some_and(|light| light.is_dark()) && self.walk.skip.has(Skip::DarkLights) {
            self.skipped[Skip::DarkLights as usize] += u64::from(count);
            return None;
        }
        Some((count, light))
    }

    /// Adds so many samples of one pixel, of which that is known.
    fn add_samples(
        &mut self,
        visible: &Visible,
        view: View,
        count: u32,
        view_of_light: Option<LightView>,
    ) {
        let skip = |skip| self.walk.skip.has(skip);
        let by = reason(view, self.light.is_some()).filter(|by| skip(*by));
        if let (Some(by), None) = (by, view_of_light) {
            self.skipped[by as usize] += u64::from(count);
            let is_lit = view == View::Open;
            let known = Known { slot: visible.slot, count, weights: &[], is_lit };
            self.sink.known(self.class, &known);
            return;
        }
        let (dimension, radius) = self.walk.dimension(self.class);
        let mut start = 0;
        while start < count {
            let end = count.min(start + BATCH_RAYS as u32);
            if self.buffer.rays.len() + (end - start) as usize > BATCH_RAYS {
                self.buffer.flush(self.class, self.sink);
            }
            let Samples { points, directions, of_light, .. } = &mut *self.samples;
            visible.sampler.fill(dimension, [self.camera_sample, count], start..end, points);
            start = end;
            let before = self.buffer.rays.len();
            let Some(light) = &view_of_light else {
                let rays = &mut self.buffer.rays;
                ambient_occlusion::rays(&visible.surface, points, radius, directions, rays);
                self.buffer.slots.extend(std::iter::repeat_n(visible.slot, points.len()));
                continue;
            };
            light.sample_all(points, of_light);
            let weights = &of_light.weights()[..points.len()];
            if let Some(by) = by {
                let weightless = if skip(Skip::Weightless) {
                    weights.iter().filter(|&&weight| weight == 0.0).count() as u64
                } else {
                    0
                };
                self.skipped[Skip::Weightless as usize] += weightless;
                self.skipped[by as usize] += points.len() as u64 - weightless;
                let (count, is_lit) = (points.len() as u32, view == View::Open);
                let known = Known { slot: visible.slot, count, weights, is_lit };
                self.sink.known(self.class, &known);
                continue;
            }
            let (weightless, buffer) = (!skip(Skip::Weightless), &mut *self.buffer);
            of_light.add_rays(
                0..points.len(),
                weightless,
                |direction| light.ray(direction),
                &mut buffer.rays,
                &mut buffer.weights,
            );
            let added = self.buffer.rays.len() - before;
            self.skipped[Skip::Weightless as usize] += (points.len() - added) as u64;
            self.buffer.slots.extend(std::iter::repeat_n(visible.slot, added));
        }
    }
}

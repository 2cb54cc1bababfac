//! Samples of pixels that have few each: those of many pixels are computed together, as vectors hold
//! more numbers than one pixel has.

use super::ambient_occlusion::{Directions, HemisphereLanes};
use super::light_samples::LightSamples;
use super::rectangle_light::{RectangleLanes, RectangleView};
use super::sampler::{Dimension, MOST_TOGETHER, PixelSampler, Points};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Pixels of one class that wait until there are enough.
#[derive(Default)]
pub(super) struct FewSamples {
    members: Vec<Member>,
    used: usize,
    hemispheres: HemisphereLanes,
    rectangles: RectangleLanes,
    points: Points,
}

/// A pixel.
pub(super) struct Member {
    pub(super) slot: u8,
    sampler: PixelSampler,
    pub(super) ray_origin: Vec3,
    /// Which of the samples are its own.
    pub(super) samples: Range<usize>,
}

/// Where a pixel's samples go: the same for all that wait together.
pub(super) enum Toward<'a> {
    /// All ways from a surface with this normal.
    Hemisphere(DVec3),
    Rectangle(&'a RectangleView),
}

impl FewSamples {
    /// Whether so many more samples find a place.
    pub(super) fn has_room(&self, count: u32) -> bool {
        self.used + count as usize <= MOST_TOGETHER
    }

    /// Adds a pixel with so many samples.
    pub(super) fn add(
        &mut self,
        (slot, sampler): (u8, PixelSampler),
        ray_origin: Vec3,
        toward: &Toward<'_>,
        count: u32,
    ) {
        let samples = self.used..self.used + count as usize;
        match toward {
            Toward::Hemisphere(normal) => self.hemispheres.set(samples.clone(), *normal),
            Toward::Rectangle(view) => self.rectangles.set(samples.clone(), view),
        }
        self.used = samples.end;
        self.members.push(Member { slot, sampler, ray_origin, samples });
    }

    /// The pixels that wait.
    pub(super) fn members(&self) -> &[Member] {
        &self.members
    }

    /// How many samples they have.
    pub(super) fn len(&self) -> usize {
        self.used
    }

    /// The directions of all samples, which go into hemispheres: those of one block of each pixel's
    /// points.
    pub(super) fn directions(&mut self, of: Dimension, block: u32, directions: &mut Directions) {
        self.find_points(of, block);
        self.hemispheres.sample(&self.points, directions);
    }

    /// All samples, which go to a light.
    pub(super) fn of_light(&mut self, of: Dimension, block: u32, samples: &mut LightSamples) {
        self.find_points(of, block);
        self.rectangles.sample(&self.points, samples);
    }

    fn find_points(&mut self, of: Dimension, block: u32) {
        let members = self.members.iter().map(|m| (&m.sampler, m.samples.len() as u32));
        PixelSampler::fill_blocks(members, of, block, &mut self.points);
    }

    /// Forgets all pixels.
    pub(super) fn clear(&mut self) {
        self.members.clear();
        self.used = 0;
    }
}

//! Light samples of pixels that have few each: those of many pixels are computed together, as vectors
//! hold more numbers than one pixel has.

use super::light_samples::LightSamples;
use super::rectangle_light::{RectangleLanes, RectangleView};
use super::sampler::{Dimension, PixelSampler, Points};
use glam::Vec3;
use std::ops::Range;

/// Pixels that wait until there are enough.
#[derive(Default)]
pub(super) struct FewSamples {
    pub(super) members: Vec<Member>,
    lanes: RectangleLanes,
    used: usize,
}

/// A pixel.
pub(super) struct Member {
    pub(super) slot: u8,
    sampler: PixelSampler,
    pub(super) ray_origin: Vec3,
    /// Which of the samples are its own.
    pub(super) samples: Range<usize>,
}

impl FewSamples {
    /// Whether so many more samples find a place.
    pub(super) fn has_room(&self, count: usize) -> bool {
        self.used + count <= RectangleLanes::ROOM
    }

    /// Adds a pixel with so many samples of a light.
    pub(super) fn add(
        &mut self,
        (slot, sampler): (u8, PixelSampler),
        ray_origin: Vec3,
        view: &RectangleView,
        count: usize,
    ) {
        let samples = self.used..self.used + count;
        self.lanes.set(samples.clone(), view);
        self.used = samples.end;
        self.members.push(Member { slot, sampler, ray_origin, samples });
    }

    /// Finds the samples of all pixels: those of one block of their points.
    pub(super) fn sample(
        &self,
        dimension: Dimension,
        block: u32,
        points: &mut Points,
        samples: &mut LightSamples,
    ) {
        let members = self.members.iter().map(|m| (&m.sampler, m.samples.len() as u32));
        PixelSampler::fill_blocks(members, dimension, block, points);
        self.lanes.sample(points, samples);
    }

    /// Forgets all pixels.
    pub(super) fn clear(&mut self) {
        self.members.clear();
        self.used = 0;
    }
}

//! The way of a ray up to its batch: camera, primary hit, surface point, shadow rays. Streaming and
//! recording take the same way, so they trace the same rays.

use super::ambient_occlusion;
use super::film::PrimarySums;
use super::plan::Plan;
use super::sampling::{Dimension, PixelSampler};
use super::settings::RayClass;
use super::soft_shadow::{LightSample, LightView};
use super::surface::SurfacePoint;
use super::surface_lanes::points_seen;
use super::tile::TILE_PIXELS;
use crate::backend::Accelerator;
use crate::ray::{Hit, Ray};
use crate::scene::Scene;
use std::time::{Duration, Instant};

/// Most rays of a batch: 128 KiB of rays, so that a batch stays in a core's own cache.
pub(super) const BATCH_RAYS: usize = 4096;

/// Shadow rays of one class and tile: sample 0 of all pixels, then sample 1 of all pixels, and so
/// on.
#[derive(Clone, Debug, Default)]
pub(super) struct RayBuffer {
    pub(super) rays: Vec<Ray>,
    /// For each ray its pixel's slot in the tile.
    pub(super) slots: Vec<u8>,
    /// For each ray its weight; empty where all weights are 1.
    pub(super) weights: Vec<f32>,
}

impl RayBuffer {
    fn clear(&mut self) {
        self.rays.clear();
        self.slots.clear();
        self.weights.clear();
    }
}

/// What a walk over tiles needs.
pub(super) struct Walk<'a> {
    pub(super) scene: &'a Scene,
    pub(super) accelerator: &'a dyn Accelerator,
    pub(super) plan: &'a Plan,
    /// Leave out rays of weight 0, and lights that a point cannot see as a whole.
    pub(super) skip: bool,
}

/// Memory that one thread uses again for all its tiles.
#[derive(Default)]
pub(super) struct Scratch {
    buffers: Vec<RayBuffer>,
    gaze: Gaze,
    surfaces: Vec<Visible>,
    views: Vec<LightView>,
}

/// Camera rays of a tile's pixels, what each hits, and the points of those that hit something.
#[derive(Default)]
struct Gaze {
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    points: Vec<SurfacePoint>,
}

struct Visible {
    slot: u8,
    sampler: PixelSampler,
    surface: SurfacePoint,
}

/// What is known of a tile besides its shadow rays.
pub(super) struct TileWalk {
    pub(super) primary: PrimarySums,
    /// For each class the rays that were left out.
    pub(super) skipped: Vec<u64>,
    pub(super) primary_time: Duration,
}

impl Walk<'_> {
    /// Walks a tile, handing each batch of shadow rays to `flush` with its class's index.
    pub(super) fn tile(
        &self,
        tile: usize,
        scratch: &mut Scratch,
        flush: &mut dyn FnMut(usize, &RayBuffer),
    ) -> TileWalk {
        scratch.buffers.resize_with(self.plan.classes.len(), RayBuffer::default);
        let mut walk = TileWalk {
            primary: PrimarySums::default(),
            skipped: vec![0; self.plan.classes.len()],
            primary_time: Duration::ZERO,
        };
        for camera_sample in 0..self.plan.settings.camera_samples {
            let start = Instant::now();
            self.look(tile, camera_sample, &mut scratch.gaze, &mut scratch.surfaces);
            walk.primary_time += start.elapsed();
            for visible in &scratch.surfaces {
                walk.primary.add(visible.slot, &visible.surface);
            }
            for class in 0..self.plan.classes.len() {
                walk.skipped[class] += self.sample_class(class, camera_sample, scratch, flush);
            }
        }
        for (class, buffer) in scratch.buffers.iter_mut().enumerate() {
            if !buffer.rays.is_empty() {
                flush(class, buffer);
                buffer.clear();
            }
        }
        walk
    }

    /// Finds what one camera sample of each of the tile's pixels sees.
    fn look(&self, tile: usize, camera_sample: u32, gaze: &mut Gaze, surfaces: &mut Vec<Visible>) {
        let settings = &self.plan.settings;
        let tile = self.plan.grid.tile(tile);
        let view = self.scene.camera.view(settings.size);
        gaze.rays.clear();
        gaze.rays.extend(tile.pixels().map(|(_, [x, y])| {
            let [dx, dy] = if settings.camera_samples == 1 {
                [0.5, 0.5]
            } else {
                let sampler = PixelSampler::new(settings.seed, x, y);
                sampler.sample_2d(Dimension::Camera, camera_sample)
            };
            view.ray((f64::from(x) + dx) as f32, (f64::from(y) + dy) as f32)
        }));
        gaze.hits.resize(gaze.rays.len(), None);
        self.accelerator.closest_hits(&gaze.rays, &mut gaze.hits);
        surfaces.clear();
        points_seen(&self.scene.mesh, &gaze.rays, &gaze.hits, &mut gaze.points);
        let seen = tile.pixels().zip(&gaze.hits).filter(|(_, hit)| hit.is_some());
        for (((slot, [x, y]), _), &surface) in seen.zip(&gaze.points) {
            let sampler = PixelSampler::new(settings.seed, x, y);
            surfaces.push(Visible { slot: slot as u8, sampler, surface });
        }
    }

    /// Adds the rays of one class for what one camera sample sees; returns how many it left out.
    fn sample_class(
        &self,
        class: usize,
        camera_sample: u32,
        scratch: &mut Scratch,
        flush: &mut dyn FnMut(usize, &RayBuffer),
    ) -> u64 {
        let plan = &self.plan.classes[class];
        let Scratch { buffers, surfaces, views, .. } = scratch;
        let buffer = &mut buffers[class];
        let mut skipped = 0;
        if let RayClass::Shadow { light } = plan.class {
            views.clear();
            let light = &self.scene.lights[light];
            views.extend(surfaces.iter().map(|visible| LightView::new(light, &visible.surface)));
        }
        for sample in 0..plan.samples {
            if buffer.rays.len() + TILE_PIXELS > BATCH_RAYS {
                flush(class, buffer);
                buffer.clear();
            }
            let index = camera_sample * plan.samples + sample;
            for (place, visible) in surfaces.iter().enumerate() {
                let ambient = |dimension, radius| {
                    let point = visible.sampler.sample_2d(dimension, index);
                    ambient_occlusion::ray(&visible.surface, point, radius)
                };
                let ray = match plan.class {
                    RayClass::AmbientOcclusion => {
                        ambient(Dimension::AmbientOcclusion, self.plan.settings.ao_radius)
                    }
                    RayClass::AmbientOcclusionUnbounded => {
                        ambient(Dimension::AmbientOcclusionUnbounded, f32::INFINITY)
                    }
                    RayClass::Shadow { light } => {
                        let view = &views[place];
                        if self.skip && view.is_dark() {
                            skipped += 1;
                            continue;
                        }
                        let point = visible.sampler.sample_2d(Dimension::Light(light), index);
                        let LightSample { ray, weight } = view.sample(point);
                        if self.skip && weight == 0.0 {
                            skipped += 1;
                            continue;
                        }
                        buffer.weights.push(weight);
                        ray
                    }
                };
                buffer.rays.push(ray);
                buffer.slots.push(visible.slot);
            }
        }
        skipped
    }
}

//! The way of a ray up to its batch: camera, primary hit, surface point, shadow rays. Streaming and
//! recording take the same way, so they trace the same rays.

use super::ambient_occlusion::{self, Directions};
use super::film::PrimarySums;
use super::plan::Plan;
use super::sampler::{Dimension, PixelSampler, Points};
use super::settings::RayClass;
use super::skip::{Skip, Skips};
use super::soft_shadow::{LightSamples, LightView};
use super::surface::SurfacePoint;
use crate::backend::Accelerator;
use crate::ray::Ray;
use crate::scene::Scene;
use std::time::{Duration, Instant};

/// Most rays of a batch: 128 KiB of rays, so that a batch stays in a core's own cache.
pub(super) const BATCH_RAYS: usize = 4096;

/// Shadow rays of one class and tile, pixel by pixel.
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
    pub(super) skip: Skips,
}

/// Memory that one thread uses again for all its tiles.
#[derive(Default)]
pub(super) struct Scratch {
    buffers: Vec<RayBuffer>,
    surfaces: Vec<Visible>,
    samples: Samples,
}

/// The samples of one pixel and class.
#[derive(Default)]
struct Samples {
    points: Points,
    directions: Directions,
    of_light: LightSamples,
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
            self.look(tile, camera_sample, &mut scratch.surfaces);
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
    fn look(&self, tile: usize, camera_sample: u32, surfaces: &mut Vec<Visible>) {
        let settings = &self.plan.settings;
        surfaces.clear();
        let mut points = Points::default();
        for (slot, [x, y]) in self.plan.grid.tile(tile).pixels() {
            let sampler = PixelSampler::new(settings.sampler, settings.seed, x, y);
            let [dx, dy] = if settings.camera_samples == 1 {
                [0.5, 0.5]
            } else {
                let (all, one) = (settings.camera_samples, camera_sample..camera_sample + 1);
                sampler.fill(Dimension::Camera, [0, all], one, &mut points);
                points.get(0).map(f64::from)
            };
            let (px, py) = ((f64::from(x) + dx) as f32, (f64::from(y) + dy) as f32);
            let ray = self.scene.camera.ray(px, py, settings.size);
            if let Some(hit) = self.accelerator.closest_hit(&ray) {
                let triangle = self.scene.mesh.triangle(hit.triangle as usize);
                let surface = SurfacePoint::new(&triangle, &ray);
                surfaces.push(Visible { slot: slot as u8, sampler, surface });
            }
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
        let Scratch { buffers, surfaces, samples } = scratch;
        let buffer = &mut buffers[class];
        let mut skipped = 0;
        for visible in surfaces {
            let surface = &visible.surface;
            let view = match plan.class {
                RayClass::Shadow { light } => {
                    let light = &self.scene.lights[light];
                    Some(LightView::new(light, surface, self.plan.settings.light_sampling))
                }
                _ => None,
            };
            if view.is_some_and(|view| view.is_dark() && self.skip.has(Skip::DarkLights)) {
                skipped += u64::from(plan.samples);
                continue;
            }
            let mut start = 0;
            while start < plan.samples {
                let end = plan.samples.min(start + BATCH_RAYS as u32);
                if buffer.rays.len() + (end - start) as usize > BATCH_RAYS {
                    flush(class, buffer);
                    buffer.clear();
                }
                let block = [camera_sample, plan.samples];
                let fill = visible.sampler;
                let fill = |dimension, points: &mut Points| {
                    fill.fill(dimension, block, start..end, points);
                };
                let before = buffer.rays.len();
                match (plan.class, view) {
                    (RayClass::Shadow { light }, Some(view)) => {
                        fill(Dimension::Light(light), &mut samples.points);
                        skipped += self.add_light(&view, samples, buffer);
                    }
                    (RayClass::AmbientOcclusionUnbounded, _) => {
                        fill(Dimension::AmbientOcclusionUnbounded, &mut samples.points);
                        add_ambient(surface, f32::INFINITY, samples, buffer);
                    }
                    _ => {
                        fill(Dimension::AmbientOcclusion, &mut samples.points);
                        add_ambient(surface, self.plan.settings.ao_radius, samples, buffer);
                    }
                }
                let added = buffer.rays.len() - before;
                buffer.slots.extend(std::iter::repeat_n(visible.slot, added));
                start = end;
            }
        }
        skipped
    }

    /// Adds rays to a light; returns how many it left out.
    fn add_light(&self, view: &LightView, samples: &mut Samples, buffer: &mut RayBuffer) -> u64 {
        let Samples { points, of_light, .. } = samples;
        view.sample_all(points, of_light);
        let skip = self.skip.has(Skip::Weightless);
        let mut skipped = 0;
        for (index, &weight) in of_light.weights()[..points.len()].iter().enumerate() {
            if skip && weight == 0.0 {
                skipped += 1;
                continue;
            }
            buffer.rays.push(view.ray(of_light.direction(index)));
            buffer.weights.push(weight);
        }
        skipped
    }
}

/// Adds ambient-occlusion rays.
fn add_ambient(surface: &SurfacePoint, radius: f32, samples: &mut Samples, buffer: &mut RayBuffer) {
    let Samples { points, directions, .. } = samples;
    ambient_occlusion::rays(surface, points, radius, directions, &mut buffer.rays);
}

//! The way of a ray up to its batch: camera, primary hit, surface point, shadow rays. Streaming and
//! recording take the same way, so they trace the same rays.

use super::ambient_occlusion::Directions;
use super::few_samples::FewSamples;
use super::film::PrimarySums;
use super::light_samples::LightSamples;
use super::pixels::{Pixels, reason};
use super::plan::{ClassPlan, Plan};
use super::sampled_light::SampledLight;
use super::sampler::{Dimension, PixelSampler, Points};
use super::settings::RayClass;
use super::shafts::{Aim, Group, groups};
use super::skip::{Skip, Skips};
use super::stats::SkippedRays;
use super::surface::SurfacePoint;
use super::surface_lanes::points_seen;
use crate::backend::{Accelerator, Hints};
use crate::ray::{Hit, Ray};
use crate::scene::Scene;
use crate::trace::shaft::{Budget, Entry, Gate, Shaft, View};
use glam::Vec3;
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
    /// Where in the backend's tree all that is in their way is.
    pub(super) entry: Entry,
}

/// Samples of one pixel that are all lit, or none of them.
pub(super) struct Known<'a> {
    pub(super) slot: u8,
    pub(super) count: u32,
    /// Empty where all weights are 1.
    pub(super) weights: &'a [f32],
    pub(super) is_lit: bool,
}

/// Takes what a walk finds, each pixel's in the order of its samples.
pub(super) trait Sink {
    /// Rays of a class that are to be traced.
    fn trace(&mut self, class: usize, rays: &RayBuffer);
    /// Samples of a class that need not be.
    fn known(&mut self, class: usize, known: &Known<'_>);
}

impl RayBuffer {
    /// What is known of these rays, which are of a class.
    pub(super) fn hints(&self, class: usize, skip: Skips) -> Hints<'_> {
        let stratum = skip.has(Skip::LastOccluders).then_some(class);
        Hints { entry: &self.entry, stratum }
    }

    /// Hands over what has gathered.
    pub(super) fn flush(&mut self, class: usize, sink: &mut dyn Sink) {
        if self.rays.is_empty() {
            return;
        }
        sink.trace(class, self);
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
    /// Of each class, if its rays go to one.
    lights: Vec<Option<SampledLight>>,
}

/// Memory that is used again for one tile after the other.
#[derive(Default)]
pub(super) struct Scratch {
    buffers: Vec<RayBuffer>,
    gaze: Gaze,
    surfaces: Vec<Visible>,
    groups: Vec<Group>,
    origins: Vec<Vec3>,
    samples: Samples,
}

/// The samples of one pixel and class.
#[derive(Default)]
pub(super) struct Samples {
    pub(super) points: Points,
    pub(super) directions: Directions,
    pub(super) of_light: LightSamples,
    pub(super) few: FewSamples,
}

/// Camera rays of a tile's pixels, what each hits, and the points of those that hit something.
#[derive(Default)]
struct Gaze {
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    points: Vec<SurfacePoint>,
}

/// What a pixel sees.
pub(super) struct Visible {
    pub(super) slot: u8,
    pub(super) sampler: PixelSampler,
    pub(super) surface: SurfacePoint,
}

/// What is known of a tile besides its shadow rays.
pub(super) struct TileWalk {
    pub(super) primary: PrimarySums,
    /// For each class the rays that were left out, by reason.
    pub(super) skipped: Vec<SkippedRays>,
    pub(super) primary_time: Duration,
}

impl<'a> Walk<'a> {
    /// Of a plan's picture, with all that `skip` names left out.
    pub(super) fn new(
        scene: &'a Scene,
        accelerator: &'a dyn Accelerator,
        plan: &'a Plan,
        skip: Skips,
    ) -> Self {
        let of_class = |class: &ClassPlan| match class.class {
            RayClass::Shadow { light } => {
                Some(SampledLight::new(&scene.lights[light], plan.settings.light_sampling))
            }
            _ => None,
        };
        let lights = plan.classes.iter().map(of_class).collect();
        Self { scene, accelerator, plan, skip, lights }
    }

    /// Walks a tile.
    pub(super) fn tile(&self, tile: usize, scratch: &mut Scratch, sink: &mut dyn Sink) -> TileWalk {
        scratch.buffers.resize_with(self.plan.classes.len(), RayBuffer::default);
        let mut walk = TileWalk {
            primary: PrimarySums::default(),
            skipped: vec![SkippedRays::default(); self.plan.classes.len()],
            primary_time: Duration::ZERO,
        };
        for camera_sample in 0..self.plan.settings.camera_samples {
            let start = Instant::now();
            self.look(tile, camera_sample, &mut scratch.gaze, &mut scratch.surfaces);
            walk.primary_time += start.elapsed();
            let seen = scratch.surfaces.iter().map(|visible| (visible.slot, &visible.surface));
            walk.primary.add(self.plan, seen);
            let bounds = self.accelerator.looks_within();
            let looks = bounds.is_some() && (0..walk.skipped.len()).any(|class| self.looks(class));
            if looks {
                scratch.groups = groups(scratch.surfaces.iter().map(|visible| &visible.surface));
            }
            for (class, skipped) in walk.skipped.iter_mut().enumerate() {
                self.sample_class([tile, class], camera_sample, scratch, sink, skipped);
            }
            // What is known is added at once, so what comes before it must not wait.
            if looks {
                scratch.flush_all(sink);
            }
        }
        scratch.flush_all(sink);
        walk
    }

    /// Finds what one camera sample of each of the tile's pixels sees.
    fn look(&self, tile: usize, camera_sample: u32, gaze: &mut Gaze, surfaces: &mut Vec<Visible>) {
        let settings = &self.plan.settings;
        let tile = self.plan.grid.tile(tile);
        let view = self.scene.camera.view(settings.size);
        let mut points = Points::default();
        let sampler = |[x, y]: [u32; 2]| PixelSampler::new(settings.sampler, settings.seed, x, y);
        gaze.rays.clear();
        gaze.rays.extend(tile.pixels().map(|(_, [x, y])| {
            let [dx, dy] = if settings.camera_samples == 1 {
                [0.5, 0.5]
            } else {
                let (all, one) = (settings.camera_samples, camera_sample..camera_sample + 1);
                sampler([x, y]).fill(Dimension::Camera, [0, all], one, &mut points);
                points.get(0).map(f64::from)
            };
            view.ray((f64::from(x) + dx) as f32, (f64::from(y) + dy) as f32)
        }));
        gaze.hits.resize(gaze.rays.len(), None);
        self.accelerator.closest_hits(&gaze.rays, &mut gaze.hits);
        surfaces.clear();
        points_seen(&self.scene.mesh, &gaze.rays, &gaze.hits, &mut gaze.points);
        let seen = tile.pixels().zip(&gaze.hits).filter(|(_, hit)| hit.is_some());
        for (((slot, pixel), _), &surface) in seen.zip(&gaze.points) {
            surfaces.push(Visible { slot: slot as u8, sampler: sampler(pixel), surface });
        }
    }

    /// What points the samples of a class are made from, and how far its rays go; 1 where they end at a
    /// point of a light.
    pub(super) fn dimension(&self, class: usize) -> (Dimension, f32) {
        let Plan { settings, classes, .. } = self.plan;
        match classes[class].class {
            RayClass::AmbientOcclusion => (Dimension::AmbientOcclusion, settings.ao_radius),
            RayClass::AmbientOcclusionUnbounded => {
                (Dimension::AmbientOcclusionUnbounded, f32::INFINITY)
            }
            RayClass::Shadow { light } => (Dimension::Light(light), 1.0),
        }
    }

    /// Whether shafts are made for a class: where there are enough rays to pay for them.
    fn looks(&self, class: usize) -> bool {
        self.plan.classes[class].samples >= LEAST_LOOKED_FOR
            && Skip::SHAFTS.into_iter().any(|skip| self.skip.has(skip))
    }

    /// Adds the rays of one class for what one camera sample sees.
    fn sample_class(
        &self,
        [tile, class]: [usize; 2],
        camera_sample: u32,
        scratch: &mut Scratch,
        sink: &mut dyn Sink,
        skipped: &mut SkippedRays,
    ) {
        let of_class = &self.plan.classes[class];
        let light = match of_class.class {
            RayClass::Shadow { light } => Some(&self.scene.lights[light]),
            _ => None,
        };
        let mut pixels = Pixels {
            walk: self,
            tile,
            class,
            camera_sample,
            light: self.lights[class].as_ref(),
            buffer: &mut scratch.buffers[class],
            samples: &mut scratch.samples,
            sink,
            skipped,
        };
        let Some(bounds) = self.accelerator.looks_within().filter(|_| self.looks(class)) else {
            pixels.add_all(&scratch.surfaces);
            return;
        };
        let radius = match of_class.class {
            RayClass::AmbientOcclusion => self.plan.settings.ao_radius,
            _ => f32::INFINITY,
        };
        let (mut entry, mut of_pixel) = (Entry::WHOLE, Entry::WHOLE);
        let look = |shaft: &Option<Shaft<'_>>, from: &Entry, budget, entry: &mut Entry| {
            let shaft = shaft.as_ref();
            shaft.map_or(View::Partly, |s| self.accelerator.look(s, from, budget, entry))
        };
        for group in &scratch.groups {
            let members = group.members.iter().map(|&index| &scratch.surfaces[index]);
            scratch.origins.clear();
            scratch.origins.extend(members.clone().map(|visible| visible.surface.origin));
            let origins = &scratch.origins[..];
            let aim = match light {
                Some(light) => Aim::at_light(light, origins, &bounds),
                None => Some(Aim::into_hemisphere(radius)),
            };
            entry.clear();
            let shaft = aim.as_ref().and_then(|aim| aim.shaft(origins, group.normal, &bounds));
            let of_group = look(&shaft, &Entry::WHOLE, GROUP_BUDGET, &mut entry);
            // Rays that are traced although all is known of them must not start where another group's do.
            let is_traced = reason(of_group, light.is_some()).is_none_or(|by| !self.skip.has(by));
            if self.skip.has(Skip::EntryPoints) && is_traced {
                pixels.start_at(if of_group == View::Open { &Entry::WHOLE } else { &entry });
            }
            let mut gate = Gate::default();
            // From the root on, a pixel's few looks would tell nothing that the group's have not told.
            let by_pixel = of_class.samples >= LEAST_LOOKED_FOR_ALONE
                && of_group == View::Partly
                && origins.len() > 1
                && entry.parts().is_some();
            for (visible, origin) in members.zip(origins) {
                let mut view = of_group;
                if let Some(aim) = aim.as_ref().filter(|_| by_pixel && gate.is_open()) {
                    let normal = Some(visible.surface.normal);
                    let shaft = aim.shaft(std::slice::from_ref(origin), normal, &bounds);
                    view = look(&shaft, &entry, PIXEL_BUDGET, &mut of_pixel);
                    gate.note(view != View::Partly);
                }
                pixels.add(visible, view);
            }
        }
        pixels.start_at(&Entry::WHOLE);
    }
}

impl Scratch {
    fn flush_all(&mut self, sink: &mut dyn Sink) {
        for (class, buffer) in self.buffers.iter_mut().enumerate() {
            buffer.flush(class, sink);
        }
    }
}

/// Fewer samples are traced sooner than looked after: those of a group's pixels, and of one.
const LEAST_LOOKED_FOR: u32 = 8;
const LEAST_LOOKED_FOR_ALONE: u32 = 64;
/// What is looked at for a group of pixels, and for one.
const GROUP_BUDGET: Budget = Budget { nodes: 24, triangles: 32 };
const PIXEL_BUDGET: Budget = Budget { nodes: 0, triangles: 8 };

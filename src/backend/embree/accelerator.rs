//! The [`Accelerator`] over Embree.

use super::ffi::{
    Arguments, Device, Packet, Part, Quality, RTCRay, RTCRay4, RTCRay8, RTCRay16, Scene, Settings,
    Valid, occlude,
};
use crate::backend::{Accelerator, BackendSpec, BuildContext, BuildStats};
use crate::ray::{Hit, Ray, RayBatch};
use crate::{Error, Result};
use std::sync::Arc;
use std::time::Instant;

/// A scene that Embree built, and how to ask it.
///
/// Embree's answers are given as they are, with nothing in the timed path to correct them: it takes
/// negative `t` as 0, leaves open which of two triangles at the same `t` is the closest hit, and
/// makes no promise for rays that are not finite.
#[derive(Debug)]
pub(super) struct Embree {
    pub(super) scene: Scene,
    width: Width,
    coherent: bool,
    stats: BuildStats,
}

#[derive(Clone, Copy, Debug)]
enum Width {
    Single,
    Packet4,
    Packet8,
    Packet16,
}

/// Builds what the spec says over the scene's mesh, with the context's number of threads.
pub(super) fn build(
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn Accelerator>> {
    build_within(i64::MAX, spec, context)
}

/// As [`build`], with at most `memory_limit` bytes: the one way to make Embree fail on purpose.
fn build_within(
    memory_limit: i64,
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn Accelerator>> {
    let quality = quality_of(spec);
    let triangles = 0..context.scene.mesh.len();
    let parts = [Part { triangles, quality, moves: false }];
    let settings = Settings { quality, robust: spec.value("mode") == "robust", dynamic: false };
    let embree = Embree::build(memory_limit, spec, context, &parts, settings, &STILL_KEYS)?;
    Ok(Box::new(embree))
}

/// What the backend's notes say of a scene that stands still.
const STILL_KEYS: [&str; 4] = ["quality", "mode", "width", "flags"];

/// The quality that the spec asks for.
pub(super) fn quality_of(spec: &BackendSpec) -> Quality {
    match spec.value("quality") {
        "low" => Quality::LOW,
        "medium" => Quality::MEDIUM,
        _ => Quality::HIGH,
    }
}

impl Embree {
    /// Builds the parts of the context's mesh, with at most `memory_limit` bytes; its notes show
    /// `keys`.
    pub(super) fn build(
        memory_limit: i64,
        spec: &BackendSpec,
        context: &BuildContext<'_>,
        parts: &[Part],
        settings: Settings,
        keys: &[&str],
    ) -> Result<Self> {
        let failed = |message| Error::Backend { backend: spec.to_string(), message };
        let width = match spec.value("width") {
            "4" => Width::Packet4,
            "8" => Width::Packet8,
            "16" => Width::Packet16,
            _ => Width::Single,
        };
        // Starting threads is no part of building a tree: the device is made outside the clock.
        let device = Device::new(context.threads, memory_limit).map_err(failed)?;
        let mesh = Arc::clone(&context.scene.mesh);
        let start = Instant::now();
        let scene = Scene::build(device, mesh, parts, settings).map_err(failed)?;
        let stats = BuildStats {
            build_ms: start.elapsed().as_secs_f64() * 1e3,
            memory_bytes: scene.memory_bytes(),
            notes: notes(scene.device(), spec, keys, context.threads),
            ..BuildStats::default()
        };
        Ok(Self { scene, width, coherent: spec.value("flags") == "coherent", stats })
    }
}

fn notes(device: &Device, spec: &BackendSpec, keys: &[&str], threads: usize) -> Vec<String> {
    let widths = device.native_widths();
    let listed = widths.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    let flags: Vec<_> = keys.iter().map(|k| format!("{k}={}", spec.value(k))).collect();
    vec![
        format!("Embree {}", device.version()),
        format!("{} kernels (native packet widths {listed})", instruction_set(&widths)),
        flags.join(" "),
        format!("{threads} build threads, {} tasking", device.tasking()),
    ]
}

/// The instruction set of Embree's kernels. It cannot be asked for; the native packet widths and
/// the CPU tell.
fn instruction_set(native_widths: &[u32]) -> &'static str {
    if cfg!(target_arch = "aarch64") {
        return "NEON";
    }
    #[cfg(target_arch = "x86_64")]
    let avx2 = is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    let avx2 = false;
    match native_widths.last() {
        Some(16) => "AVX-512",
        Some(8) if avx2 => "AVX2",
        Some(8) => "AVX",
        _ => "SSE",
    }
}

/// The end of the ray for Embree. Its answer «occluded» is a `tfar` of -infinity, so a ray that ends
/// there, or nowhere (NaN), ends at -1 instead, which misses likewise.
#[inline]
pub(super) fn tfar(ray: &Ray) -> f32 {
    ray.t_max.max(-1.0)
}

impl Embree {
    fn occluded_singles(&self, rays: &[Ray], occluded: &mut [u64]) {
        let mut arguments = Arguments::new(self.coherent);
        for (word, rays) in occluded.iter_mut().zip(rays.chunks(64)) {
            let mut bits = 0;
            for (index, ray) in rays.iter().enumerate() {
                let mut query = convert(ray);
                occlude(&self.scene, &mut query, &mut arguments);
                bits |= u64::from(query.tfar == f32::NEG_INFINITY) << index;
            }
            *word = bits;
        }
    }

    fn occluded_packets<const N: usize, P: Packet<N>>(&self, rays: &[Ray], occluded: &mut [u64]) {
        let mut arguments = Arguments::new(self.coherent);
        // Embree changes `tfar` only; what `set` does not write stays.
        let mut packet = P::default();
        for (word, rays) in occluded.iter_mut().zip(rays.chunks(64)) {
            let (full, rest) = rays.as_chunks::<N>();
            for (group, rays) in full.iter().enumerate() {
                for (lane, ray) in rays.iter().enumerate() {
                    packet.set(lane, ray);
                }
                packet.occlude(&self.scene, &Valid([-1; N]), &mut arguments);
                *word |= occluded_lanes(packet.tfar()) << (group * N);
            }
            if !rest.is_empty() {
                let mut valid = Valid([0; N]);
                for (lane, ray) in rest.iter().enumerate() {
                    packet.set(lane, ray);
                    valid.0[lane] = -1;
                }
                packet.occlude(&self.scene, &valid, &mut arguments);
                *word |= occluded_lanes(&packet.tfar()[..rest.len()]) << (full.len() * N);
            }
        }
    }
}

/// One bit for each lane with something in the way.
#[inline]
fn occluded_lanes(tfar: &[f32]) -> u64 {
    let lanes = tfar.iter().enumerate();
    lanes.fold(0, |bits, (lane, &t)| bits | u64::from(t == f32::NEG_INFINITY) << lane)
}

#[inline]
fn convert(ray: &Ray) -> RTCRay {
    RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        tnear: ray.t_min,
        dir_x: ray.direction.x,
        dir_y: ray.direction.y,
        dir_z: ray.direction.z,
        time: 0.0,
        tfar: tfar(ray),
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

impl Accelerator for Embree {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.scene.intersect(convert(ray)).map(|(t, triangle)| Hit { t, triangle })
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        match self.width {
            Width::Single => self.occluded_singles(batch.rays, occluded),
            Width::Packet4 => self.occluded_packets::<4, RTCRay4>(batch.rays, occluded),
            Width::Packet8 => self.occluded_packets::<8, RTCRay8>(batch.rays, occluded),
            Width::Packet16 => self.occluded_packets::<16, RTCRay16>(batch.rays, occluded),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::SharedTrees;
    use crate::scene::{Camera, Defaults, Scene};
    use crate::test_random::Random;
    use glam::Vec3;

    #[test]
    fn a_failing_build_is_a_backend_error_that_names_the_spec() {
        let scene = Scene {
            name: "test".into(),
            mesh: Random::new(1).mesh(1000).into(),
            camera: Camera { eye: Vec3::Z, look_at: Vec3::ZERO, up: Vec3::Y, fov_degrees: 60.0 },
            lights: Vec::new(),
            defaults: Defaults { ao_radius: 1.0, size: [8, 8] },
            motion: None,
            warnings: Vec::new(),
        };
        let trees = SharedTrees::of(&scene);
        let context =
            BuildContext { scene: &scene, trees: &trees, threads: 2, seed: 0, training: None };
        for quality in ["low", "medium", "high"] {
            let spec: BackendSpec = format!("embree:quality={quality}").parse().unwrap();
            let text = match build_within(0, &spec, &context) {
                Err(error @ Error::Backend { .. }) => error.to_string(),
                other => panic!("built, or failed otherwise: {:?}", other.err()),
            };
            assert!(text.starts_with(&format!("backend {spec}: Embree: ")), "{text}");
            assert!(!text.contains('\n') && text.contains("out of memory"), "{text}");
            assert!(build(&spec, &context).is_ok());
        }
    }
}

//! Safe ownership of Embree's objects: the only file that calls Embree.
//!
//! Calls go through embree4-sys, whose layouts [`abi`](super::abi) has checked, or through `abi`
//! where embree4-sys does not fit Embree 4.4. Errors are collected by a callback and looked at after
//! the build; queries report none.
//!
//! Embree advises to set the CPU's flush-to-zero and denormals-are-zero modes. We leave them alone:
//! they belong to the whole thread, and native backends on the same thread answer by exact rules.

#![allow(unsafe_code)]

use super::abi;
use super::error::error_text;
use crate::geometry::{TriangleMesh, Vec3};
use embree4_sys as sys;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ops::Range;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

pub(super) use sys::{RTCBuildQuality as Quality, RTCRay, RTCRay4, RTCRay8, RTCRay16};

/// What Embree's callbacks write, at an address that stays.
#[derive(Debug)]
struct Monitor {
    /// Bytes that Embree holds now.
    bytes: AtomicI64,
    /// Bytes that it may hold.
    limit: AtomicI64,
    /// The first error; what follows is often its consequence.
    error: Mutex<Option<String>>,
}

unsafe extern "C" fn on_error(monitor: *mut c_void, code: c_int, text: *const c_char) {
    // SAFETY: `Device::new` registers a monitor that outlives the device.
    let monitor = unsafe { &*monitor.cast::<Monitor>() };
    let text = match text.is_null() {
        true => String::new(),
        // SAFETY: Embree passes a string that ends with a zero and lives during the call.
        false => unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned(),
    };
    let mut error = monitor.error.lock().unwrap_or_else(PoisonError::into_inner);
    error.get_or_insert_with(|| error_text(code, &text));
}

unsafe extern "C" fn on_memory(monitor: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: as in `on_error`.
    let monitor = unsafe { &*monitor.cast::<Monitor>() };
    let bytes = bytes as i64;
    let held = monitor.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
    bytes <= 0 || held <= monitor.limit.load(Ordering::Relaxed)
}

/// An Embree device: settings, threads and error state.
#[derive(Debug)]
pub(super) struct Device {
    handle: sys::RTCDevice,
    monitor: Box<Monitor>,
}

// SAFETY: Embree's devices may be used and released from any thread; `Monitor` is Sync.
unsafe impl Send for Device {}
// SAFETY: `&Device` only reads properties, which Embree allows concurrently, and `Monitor`.
unsafe impl Sync for Device {}

impl Device {
    /// A device that builds with `threads` threads and holds at most `memory_limit` bytes.
    pub(super) fn new(threads: usize, memory_limit: i64) -> Result<Self, String> {
        let config = CString::new(format!("threads={threads},set_affinity=0"))
            .expect("the text has no zero byte");
        // SAFETY: `config` is a string that ends with a zero and outlives the call.
        let handle = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if handle.is_null() {
            // SAFETY: without a device, the call reports why none could be made on this thread.
            let code = unsafe { abi::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(error_text(code, "no device"));
        }
        let monitor = Monitor {
            bytes: AtomicI64::new(0),
            limit: AtomicI64::new(memory_limit),
            error: Mutex::new(None),
        };
        let device = Self { handle, monitor: Box::new(monitor) };
        let user = std::ptr::from_ref(&*device.monitor).cast_mut().cast::<c_void>();
        // SAFETY: the handle is live; the callbacks have the types that Embree calls; the monitor is
        // boxed and, as a field of the device, freed only after `drop` has released the handle.
        unsafe {
            abi::rtcSetDeviceErrorFunction(handle.cast(), Some(on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(handle, Some(on_memory), user);
        }
        match device.property(sys::RTCDeviceProperty::VERSION_MAJOR) {
            4 => Ok(device),
            major => Err(format!("the Embree library is version {major}, not 4")),
        }
    }

    fn property(&self, property: sys::RTCDeviceProperty) -> isize {
        // SAFETY: the handle is live.
        unsafe { sys::rtcGetDeviceProperty(self.handle, property) }
    }

    /// `major.minor.patch` of the library that runs.
    pub(super) fn version(&self) -> String {
        use sys::RTCDeviceProperty as P;
        [P::VERSION_MAJOR, P::VERSION_MINOR, P::VERSION_PATCH]
            .map(|part| self.property(part).to_string())
            .join(".")
    }

    /// The packet widths that its kernels handle natively on this CPU.
    pub(super) fn native_widths(&self) -> Vec<u32> {
        use sys::RTCDeviceProperty as P;
        [
            (4, P::NATIVE_RAY4_SUPPORTED),
            (8, P::NATIVE_RAY8_SUPPORTED),
            (16, P::NATIVE_RAY16_SUPPORTED),
        ]
        .into_iter()
        .filter_map(|(width, property)| (self.property(property) != 0).then_some(width))
        .collect()
    }

    /// Name of the library that runs its build threads.
    pub(super) fn tasking(&self) -> &'static str {
        match self.property(sys::RTCDeviceProperty::TASKING_SYSTEM) {
            0 => "internal",
            1 => "TBB",
            2 => "PPL",
            _ => "unknown",
        }
    }

    /// The first error since the last look.
    fn take_error(&self) -> Result<(), String> {
        match self.monitor.error.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and is not used again.
        unsafe { sys::rtcReleaseDevice(self.handle) }
    }
}

/// A geometry handle, released on drop.
#[derive(Debug)]
struct Geometry(sys::RTCGeometry);

impl Geometry {
    /// Shares the mesh's vertices with it. The scene that it is attached to must keep the mesh for as
    /// long as it is not committed with those of another.
    fn set_vertices(&self, mesh: &TriangleMesh) {
        // SAFETY: the geometry is live. The buffer belongs to a mesh behind an `Arc` that the scene
        // keeps, so it neither moves nor changes meanwhile. It holds as many items as stated, with
        // a stride that is a multiple of 4, and one more vertex follows the last, so the 16 bytes
        // that Embree reads at each are the mesh's.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                self.0,
                sys::RTCBufferType::VERTEX,
                0,
                sys::RTCFormat::FLOAT3,
                mesh.padded_vertices().as_ptr().cast::<c_void>(),
                0,
                size_of::<Vec3>(),
                mesh.vertices().len(),
            );
        }
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: the handle is ours; a scene that it is attached to holds its own reference.
        unsafe { sys::rtcReleaseGeometry(self.0) }
    }
}

/// How a scene is built.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    /// `LOW` makes a tree for each geometry, by the geometry's quality, and one above them; others
    /// make one tree of all, and geometries' qualities mean nothing.
    pub(super) quality: Quality,
    pub(super) robust: bool,
    /// Whether trees are kept from one commit to the next, so that only what changed is built.
    pub(super) dynamic: bool,
}

/// Triangles that are one geometry.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Indices of its triangles.
    pub(super) triangles: Range<usize>,
    pub(super) quality: Quality,
    /// Whether [`Scene::update`] takes it along.
    pub(super) moves: bool,
}

/// A committed scene of one mesh: answers rays from any number of threads.
#[derive(Debug)]
pub(super) struct Scene {
    handle: sys::RTCScene,
    /// Those that move.
    moving: Vec<Geometry>,
    /// The first triangle of each geometry, by `geomID`.
    first_triangles: Vec<u32>,
    // Dropped after `drop` has released the scene, which reads all that follows.
    device: Device,
    /// Its indices are those of every geometry, its vertices those of geometries that do not move.
    first: Arc<TriangleMesh>,
    /// Those whose vertices moving geometries may read: the last one, unless an update failed.
    meshes: Vec<Arc<TriangleMesh>>,
    /// Whether a commit failed, after which Embree can only release the scene.
    failed: bool,
}

// SAFETY: a committed scene may be queried and released from any thread; what changes it needs it
// exclusively.
unsafe impl Send for Scene {}
// SAFETY: Embree allows concurrent queries of a committed scene.
unsafe impl Sync for Scene {}

impl Scene {
    /// Builds Embree's tree over the parts of the mesh, whose buffers it shares.
    pub(super) fn build(
        device: Device,
        mesh: Arc<TriangleMesh>,
        parts: &[Part],
        settings: Settings,
    ) -> Result<Self, String> {
        let mut flags = sys::RTCSceneFlags::NONE;
        for (wanted, flag) in [
            (settings.robust, sys::RTCSceneFlags::ROBUST),
            (settings.dynamic, sys::RTCSceneFlags::DYNAMIC),
        ] {
            flags = if wanted { flags | flag } else { flags };
        }
        // SAFETY: the device is live.
        let handle = unsafe { sys::rtcNewScene(device.handle) };
        if handle.is_null() {
            device.take_error()?;
            return Err("Embree made no scene".to_string());
        }
        let meshes = vec![Arc::clone(&mesh)];
        let mut scene = Self {
            handle,
            moving: Vec::new(),
            first_triangles: Vec::new(),
            device,
            first: mesh,
            meshes,
            failed: false,
        };
        // SAFETY: the scene is live.
        unsafe {
            sys::rtcSetSceneFlags(handle, flags);
            sys::rtcSetSceneBuildQuality(handle, settings.quality);
        }
        for part in parts.iter().filter(|part| !part.triangles.is_empty()) {
            scene.attach(part)?;
        }
        scene.commit()?;
        Ok(scene)
    }

    fn attach(&mut self, part: &Part) -> Result<(), String> {
        // SAFETY: the device is live.
        let geometry =
            unsafe { sys::rtcNewGeometry(self.device.handle, sys::RTCGeometryType::TRIANGLE) };
        if geometry.is_null() {
            self.device.take_error()?;
            return Err("Embree made no geometry".to_string());
        }
        let geometry = Geometry(geometry);
        geometry.set_vertices(&self.first);
        let triangles = &self.first.triangles()[part.triangles.clone()];
        // SAFETY: geometry and scene are live, and the identifier is new. The buffer belongs to the
        // first mesh, which is behind an `Arc` that the scene keeps, so it neither moves nor changes
        // before the scene is released. It holds as many items as stated, with a stride that is a
        // multiple of 4. Every index is less than the number of vertices: `TriangleMesh::new` sees
        // to it, and `update` to meshes having as many.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                geometry.0,
                sys::RTCBufferType::INDEX,
                0,
                sys::RTCFormat::UINT3,
                triangles.as_ptr().cast::<c_void>(),
                0,
                size_of::<[u32; 3]>(),
                triangles.len(),
            );
            sys::rtcSetGeometryBuildQuality(geometry.0, part.quality);
            sys::rtcCommitGeometry(geometry.0);
            let id = self.first_triangles.len() as u32;
            sys::rtcAttachGeometryByID(self.handle, geometry.0, id);
        }
        self.first_triangles.push(part.triangles.start as u32);
        if part.moves {
            self.moving.push(geometry);
        }
        Ok(())
    }

    fn commit(&mut self) -> Result<(), String> {
        // SAFETY: the scene is live and complete, and nobody else has it.
        unsafe { sys::rtcCommitScene(self.handle) };
        let result = self.device.take_error();
        self.failed = result.is_err();
        result
    }

    /// Follows the moving parts to where their vertices are in `mesh`, and builds or refits them as
    /// their qualities say. After an error of Embree's, answers mean nothing and no update succeeds.
    pub(super) fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<(), String> {
        if self.failed {
            return Err("an earlier update failed".to_string());
        }
        let (old, new) = (self.first.triangles(), mesh.triangles());
        let same_triangles = std::ptr::eq(old, new) || old == new;
        if !same_triangles || mesh.vertices().len() != self.first.vertices().len() {
            return Err("a frame's mesh has other triangles than the first one's".to_string());
        }
        self.meshes.push(Arc::clone(&mesh));
        for geometry in &self.moving {
            geometry.set_vertices(&mesh);
            // SAFETY: the geometry is live, and its index buffer fits the new vertices.
            unsafe {
                sys::rtcUpdateGeometryBuffer(geometry.0, sys::RTCBufferType::VERTEX, 0);
                sys::rtcCommitGeometry(geometry.0);
            }
        }
        self.commit()?;
        self.meshes.drain(..self.meshes.len() - 1);
        Ok(())
    }

    /// The device that it was built on.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    /// Bytes that Embree holds for device and scene, without the shared buffers.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.device.monitor.bytes.load(Ordering::Relaxed).max(0) as u64
    }

    /// Shortens the ray to its closest hit and returns the triangle's index.
    pub(super) fn intersect(&self, ray: RTCRay) -> Option<(f32, u32)> {
        // Not embree4-sys's RTCRayHit: Embree 4.4 writes past its end.
        let none = abi::SATO_INVALID_ID;
        let mut query = abi::RTCRayHit {
            // SAFETY: the two are the same plain data, as `abi` has checked.
            ray: unsafe { std::mem::transmute::<RTCRay, abi::RTCRay>(ray) },
            hit: abi::RTCHit {
                Ng_x: 0.0,
                Ng_y: 0.0,
                Ng_z: 0.0,
                u: 0.0,
                v: 0.0,
                primID: none,
                geomID: none,
                instID: [none],
                instPrimID: [none],
            },
        };
        // SAFETY: the scene is committed; the query is aligned and initialised; no arguments means
        // Embree's defaults.
        unsafe {
            abi::rtcIntersect1(self.handle.cast(), &raw mut query, std::ptr::null_mut());
        }
        let first = *self.first_triangles.get(query.hit.geomID as usize)?;
        Some((query.ray.tfar, first + query.hit.primID))
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and is not used again.
        unsafe { sys::rtcReleaseScene(self.handle) }
    }
}

/// The arguments of occlusion queries.
pub(super) struct Arguments(sys::RTCOccludedArguments);

impl Arguments {
    /// What Embree's inline `rtcInitOccludedArguments` sets, and whether rays are coherent.
    pub(super) fn new(coherent: bool) -> Self {
        Self(sys::RTCOccludedArguments {
            flags: match coherent {
                true => sys::RTCRayQueryFlags::COHERENT,
                false => sys::RTCRayQueryFlags::INCOHERENT,
            },
            feature_mask: sys::RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
            context: std::ptr::null_mut(),
            filter: None,
            occluded: None,
        })
    }
}

/// Which rays of a packet to trace (-1) and which not (0), aligned for every width.
#[repr(C, align(64))]
pub(super) struct Valid<const N: usize>(pub(super) [i32; N]);

/// A packet of `N` rays.
pub(super) trait Packet<const N: usize>: Default {
    /// Sets ray `lane`.
    fn set(&mut self, lane: usize, ray: &crate::ray::Ray);

    /// Sets `tfar` of every valid ray with something in the way to -infinity.
    fn occlude(&mut self, scene: &Scene, valid: &Valid<N>, arguments: &mut Arguments);

    /// The ends of the rays.
    fn tfar(&self) -> &[f32; N];
}

macro_rules! packet {
    ($type:ident, $width:literal, $call:ident) => {
        impl Packet<$width> for $type {
            #[inline]
            fn set(&mut self, lane: usize, ray: &crate::ray::Ray) {
                self.org_x[lane] = ray.origin.x;
                self.org_y[lane] = ray.origin.y;
                self.org_z[lane] = ray.origin.z;
                self.tnear[lane] = ray.t_min;
                self.dir_x[lane] = ray.direction.x;
                self.dir_y[lane] = ray.direction.y;
                self.dir_z[lane] = ray.direction.z;
                self.tfar[lane] = super::accelerator::tfar(ray);
            }

            #[inline]
            fn occlude(&mut self, scene: &Scene, valid: &Valid<$width>, arguments: &mut Arguments) {
                // SAFETY: the scene is committed; packet and mask have the alignment and number of
                // lanes that this width needs; the arguments are complete, and nobody else has them.
                unsafe {
                    sys::$call(valid.0.as_ptr(), scene.handle, self, &raw mut arguments.0);
                }
            }

            #[inline]
            fn tfar(&self) -> &[f32; $width] {
                &self.tfar
            }
        }
    };
}

packet!(RTCRay4, 4, rtcOccluded4);
packet!(RTCRay8, 8, rtcOccluded8);
packet!(RTCRay16, 16, rtcOccluded16);

/// Sets the ray's `tfar` to -infinity if something is in the way.
#[inline]
pub(super) fn occlude(scene: &Scene, ray: &mut RTCRay, arguments: &mut Arguments) {
    // SAFETY: the scene is committed; the ray is aligned and initialised; the arguments are
    // complete, and nobody else has them.
    unsafe { sys::rtcOccluded1(scene.handle, ray, &raw mut arguments.0) }
}

#[cfg(test)]
mod tests;

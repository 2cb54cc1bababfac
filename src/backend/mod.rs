//! What answers rays: the [`Accelerator`] trait, the specs that name one, and the catalogue.

mod brute;
mod bvh2;
mod bvh8;
pub mod catalogue;
mod embree;
mod following;
mod kd;
mod lazy;
mod mode;
mod moving;
mod shared_trees;
mod spec;

pub use moving::{BuildMoving, MovingAccelerator, TreeQuality, UpdateStats, build_moving};
pub use shared_trees::{Built, SharedTrees};
pub use spec::{BackendSpec, Choice, Key};

use crate::Result;
use crate::geometry::Aabb;
use crate::parts::Visited;
use crate::ray::{Hit, Ray, RayBatch, VisitCounts};
use crate::ray_set::RaySet;
use crate::scene::Scene;
use crate::trace::shaft::{Budget, Entry, Shaft, View};

/// A structure built from a scene's triangles that answers rays.
///
/// A hit is a point of a closed, non-degenerate triangle at a `t` of the ray's closed interval;
/// [`Ray`] says which rays hit nothing.
pub trait Accelerator: Send + Sync {
    /// What building it took.
    fn build_stats(&self) -> &BuildStats;

    /// The closest hit, or `None`.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// For each of `rays` its [`closest_hit`](Self::closest_hit), into the element of `hits` in its
    /// place; both have the same length. Best for rays that go the same way, such as those of a tile.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest_hit(ray);
        }
    }

    /// For each ray of the batch, whether anything is in the way. `occluded` holds
    /// [`words_for`](crate::ray::words_for) zeroed words.
    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]);

    /// As [`occluded`](Self::occluded), and adds what each ray visited to its element of `counts`.
    /// Returns `false`, having done nothing, if this backend cannot count. Never timed.
    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        let _ = (batch, occluded, counts);
        false
    }

    /// What rays have come by so far, if trees are built for that only.
    fn visited(&self) -> Option<Visited> {
        None
    }

    /// Box around all triangles, if [`look`](Self::look) can tell anything.
    fn looks_within(&self) -> Option<Aabb> {
        None
    }

    /// What stands in the way of all rays of a shaft, as far as it can be said for all at once and
    /// without looking at more than `budget` allows: true of each ray in exact arithmetic. Sets `entry`,
    /// where `from` holds all that these rays can meet, to what of it may be in their way.
    fn look(&self, shaft: &Shaft<'_>, from: &Entry, budget: Budget, entry: &mut Entry) -> View {
        let _ = (shaft, from, budget);
        entry.clear();
        View::Partly
    }

    /// As [`occluded`](Self::occluded) for rays of which something is known. Returns how many of them
    /// were stopped by occluders that had stopped others of their stratum, before anything else was
    /// looked at: 0 where none are remembered.
    fn occluded_with(&self, hints: &Hints<'_>, batch: &RayBatch<'_>, occluded: &mut [u64]) -> u64 {
        let _ = hints;
        self.occluded(batch, occluded);
        0
    }
}

/// What is known of the rays of a batch. Answers are the same without it.
#[derive(Clone, Copy, Debug)]
pub struct Hints<'a> {
    /// All that is in their way is in here.
    pub entry: &'a Entry,
    /// Rays that are like them have this number too, so that what stopped those is tried first; `None`
    /// tries nothing.
    pub stratum: Option<usize>,
}

impl Hints<'_> {
    /// Nothing is known: rays are all taken to be alike.
    pub const NONE: Self = Self { entry: &Entry::WHOLE, stratum: Some(0) };
}

/// What building an accelerator took.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct BuildStats {
    /// Wall-clock time to build the structure, in milliseconds, without `order_ms`. Backends that
    /// share a tree each say what its one build took.
    pub build_ms: f64,
    /// Wall-clock time to set the traversal order, in milliseconds; 0 where there is none.
    pub order_ms: f64,
    /// Memory of the structure, in bytes, without the mesh that all backends share; with the tree,
    /// even if others use it too.
    pub memory_bytes: u64,
    /// Inner nodes, where known.
    pub inner_nodes: Option<u64>,
    /// Leaves, where known.
    pub leaves: Option<u64>,
    /// Expected cost of a random line by the surface-area heuristic, where known.
    pub sah_cost: Option<f64>,
    /// Facts to print beside the timings: library version, instruction set, flags.
    pub notes: Vec<String>,
}

/// What a backend is built with, besides its spec.
#[derive(Clone, Copy, Debug)]
pub struct BuildContext<'a> {
    /// The scene. Backends use its mesh only.
    pub scene: &'a Scene,
    /// The scene's trees, for those that share them.
    pub trees: &'a SharedTrees,
    /// Threads that build; at least 1. Natively, the current rayon pool has as many.
    pub threads: usize,
    /// Seed of anything random in the structure (`order=random`).
    pub seed: u64,
    /// Recorded rays for what learns from them (`order=trained`), representative of those to come.
    pub training: Option<&'a RaySet>,
}

/// Builds the backend that `spec` names.
///
/// # Errors
/// [`Error::Backend`](crate::Error::Backend) if the backend is not in this build or fails.
pub fn build(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Box<dyn Accelerator>> {
    (spec.entry().build)(spec, context)
}

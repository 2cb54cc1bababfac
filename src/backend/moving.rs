//! Structures that follow a moving scene.

use super::{Accelerator, BackendSpec, BuildContext, SharedTrees, build};
use crate::Result;
use crate::geometry::TriangleMesh;
use crate::ray_set::RaySet;
use crate::scene::Scene;
use std::sync::Arc;

/// An accelerator whose triangles move from frame to frame.
pub trait MovingAccelerator: Send {
    /// Follows the vertices to where they are in `mesh`, whose triangles are those of the first
    /// frame's.
    ///
    /// # Errors
    /// [`Error::Backend`](crate::Error::Backend) if the backend fails.
    fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<UpdateStats>;

    /// Tells what tracing the rays of a frame took after the last update, in milliseconds: for those
    /// that weigh a slower tree against building a new one.
    fn traced(&mut self, trace_ms: f64) {
        let _ = trace_ms;
    }

    /// What answers rays for the last frame given.
    fn accelerator(&self) -> &dyn Accelerator;

    /// What is known of the tree besides times: never timed.
    fn quality(&self) -> TreeQuality {
        TreeQuality::default()
    }
}

/// What following the triangles to a frame took. Times are wall-clock, in milliseconds.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct UpdateStats {
    /// Boxes and triangles brought up to date, without what the others say; all of the update where
    /// parts cannot be told.
    pub refit_ms: f64,
    /// Parts of the tree put elsewhere, if that was timed apart from `refit_ms`; 0 for native trees,
    /// which do both in one pass.
    pub rotation_ms: f64,
    /// Building anew, in whole or in part.
    pub build_ms: f64,
    /// Bringing the traversal order up to date.
    pub order_ms: f64,
    /// Whether the whole tree was built anew.
    pub rebuilt: bool,
    /// Nodes at which subtrees below changed places.
    pub rotations: u64,
    /// Nodes whose order was looked at; some may have been looked at more than once, and count so.
    pub order_nodes: u64,
}

impl UpdateStats {
    /// All of it.
    pub fn total_ms(&self) -> f64 {
        self.refit_ms + self.rotation_ms + self.build_ms + self.order_ms
    }
}

/// How good the tree of a frame is.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct TreeQuality {
    /// Expected cost of a random line by the surface-area heuristic, where known.
    pub sah_cost: Option<f64>,
    /// That of a tree that is built anew, by the same builder.
    pub fresh_sah_cost: Option<f64>,
    /// Share of the nodes whose children would be in another order if it were set anew.
    pub stale_order: Option<f64>,
    /// Bytes that the structure holds now.
    pub memory_bytes: u64,
}

/// Builds the backend that `spec` names, ready to follow the context's scene from its first frame on.
///
/// # Errors
/// As [`build`].
pub fn build_moving(
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn MovingAccelerator>> {
    match spec.entry().build_moving {
        Some(build) => build(spec, context),
        None => Ok(Box::new(Rebuilt::new(spec, context)?)),
    }
}

/// How a backend is built that follows a moving scene.
pub type BuildMoving = fn(&BackendSpec, &BuildContext<'_>) -> Result<Box<dyn MovingAccelerator>>;

/// Any backend, built anew for each frame.
pub(super) struct Rebuilt {
    spec: BackendSpec,
    scene: Scene,
    threads: usize,
    seed: u64,
    training: Option<RaySet>,
    current: Box<dyn Accelerator>,
}

impl Rebuilt {
    pub(super) fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        Ok(Self {
            spec: spec.clone(),
            scene: context.scene.clone(),
            threads: context.threads,
            seed: context.seed,
            training: context.training.cloned(),
            current: build(spec, context)?,
        })
    }
}

impl MovingAccelerator for Rebuilt {
    fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<UpdateStats> {
        self.scene.mesh = mesh;
        let trees = SharedTrees::of(&self.scene);
        let training = self.training.as_ref();
        let Self { scene, threads, seed, .. } = self;
        let context =
            BuildContext { scene, trees: &trees, threads: *threads, seed: *seed, training };
        self.current = build(&self.spec, &context)?;
        let stats = self.current.build_stats();
        let (build_ms, order_ms) = (stats.build_ms, stats.order_ms);
        Ok(UpdateStats { build_ms, order_ms, rebuilt: true, ..UpdateStats::default() })
    }

    fn accelerator(&self) -> &dyn Accelerator {
        &*self.current
    }

    fn quality(&self) -> TreeQuality {
        let stats = self.current.build_stats();
        TreeQuality {
            sah_cost: stats.sah_cost,
            fresh_sah_cost: stats.sah_cost,
            stale_order: Some(0.0),
            memory_bytes: stats.memory_bytes,
        }
    }
}

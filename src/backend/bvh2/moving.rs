//! The binary tree of a moving scene.

use super::Bvh2Backend;
use crate::backend::following::{Following, Follows, timed, upkeep_of};
use crate::backend::{
    Accelerator, BackendSpec, BuildContext, Built, MovingAccelerator, TreeQuality, UpdateStats,
};
use crate::build::{self, BuilderEntry, Leaves};
use crate::dynamics::{BinaryFollower, PlanUpkeep};
use crate::geometry::TriangleMesh;
use crate::order::{self, OrderContext};
use crate::ray_set::RaySet;
use crate::{Error, Result};
use std::sync::Arc;

/// What does not change.
struct Settings {
    spec: BackendSpec,
    builder: &'static BuilderEntry,
    seed: u64,
    training: Option<RaySet>,
}

impl Settings {
    fn context<'a>(&'a self, mesh: &'a TriangleMesh) -> OrderContext<'a> {
        OrderContext { mesh, seed: self.seed, training: self.training.as_ref() }
    }
}

/// The tree with all that lets it follow.
struct MovingBvh2 {
    settings: Settings,
    mesh: Arc<TriangleMesh>,
    /// Its tree is not shared.
    backend: Bvh2Backend,
    follower: BinaryFollower,
    upkeep: PlanUpkeep,
}

pub(super) fn build(
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn MovingAccelerator>> {
    let failed = |message| Error::Backend { backend: spec.to_string(), message };
    let settings = Settings {
        spec: spec.clone(),
        builder: build::find(spec.value("builder")).expect("specs are checked"),
        seed: context.seed,
        training: context.training.cloned(),
    };
    let order = order::find(spec.value("order")).expect("specs are checked");
    if order.needs_training && context.training.is_none() {
        return Err(failed(format!("order={} needs recorded rays to learn from", order.name)));
    }
    let mut upkeep = PlanUpkeep::new(order, upkeep_of(spec)).map_err(failed)?;
    let shared = context.trees.bvh2(settings.builder, Leaves::Fit).map_err(failed)?;
    let built = Built { tree: shared.tree.clone(), build_ms: shared.build_ms };
    let mesh = Arc::clone(&context.scene.mesh);
    let (backend, follower) = ordered(&settings, &mut upkeep, built, &mesh);
    let triangles = mesh.len();
    let tree = MovingBvh2 { settings, mesh, backend, follower, upkeep };
    Ok(Box::new(Following::new(spec, tree, triangles)))
}

/// A tree that was just built, in its order.
fn ordered(
    settings: &Settings,
    upkeep: &mut PlanUpkeep,
    built: Built<crate::tree::Bvh2>,
    mesh: &TriangleMesh,
) -> (Bvh2Backend, BinaryFollower) {
    let (follower, follower_ms) =
        timed(|| BinaryFollower::of(&built.tree, upkeep.needs_ancestors()));
    let (plan, order_ms) = timed(|| upkeep.plan(&built.tree, &follower, &settings.context(mesh)));
    let built = Arc::new(Built { build_ms: built.build_ms + follower_ms, tree: built.tree });
    (Bvh2Backend::of(&settings.spec, built, plan, order_ms, mesh.len()), follower)
}

impl Follows for MovingBvh2 {
    fn rebuild(&mut self, mesh: Arc<TriangleMesh>) -> UpdateStats {
        let (tree, build_ms) = timed(|| (self.settings.builder.build)(&mesh, Leaves::Fit));
        let built = Built { tree, build_ms };
        (self.backend, self.follower) = ordered(&self.settings, &mut self.upkeep, built, &mesh);
        self.mesh = mesh;
        let stats = &self.backend.stats;
        UpdateStats {
            build_ms: stats.build_ms,
            order_ms: stats.order_ms,
            rebuilt: true,
            order_nodes: self.backend.built.tree.nodes.len() as u64,
            ..UpdateStats::default()
        }
    }

    fn follow(&mut self, mesh: Arc<TriangleMesh>, rotates: bool) -> UpdateStats {
        let Self { settings, backend, follower, upkeep, .. } = self;
        let tree = &mut Arc::get_mut(&mut backend.built).expect("is not shared").tree;
        let asks = upkeep.asks_of_exchanged();
        let (updated, refit_ms) = timed(|| follower.update(tree, &mesh, rotates, asks));
        let context = settings.context(&mesh);
        let (order_nodes, order_ms) =
            timed(|| upkeep.update(tree, follower, &mut backend.plan, &context));
        self.mesh = mesh;
        let rotations = updated.rotations;
        UpdateStats { refit_ms, order_ms, rotations, order_nodes, ..UpdateStats::default() }
    }

    fn accelerator(&self) -> &dyn Accelerator {
        &self.backend
    }

    fn quality(&self) -> TreeQuality {
        let Self { settings, mesh, backend, follower, upkeep } = self;
        let (tree, plan) = (&backend.built.tree, &backend.plan);
        let fresh = (settings.builder.build)(mesh, Leaves::Fit);
        TreeQuality {
            sah_cost: Some(tree.sah_cost()),
            fresh_sah_cost: Some(fresh.sah_cost()),
            stale_order: Some(upkeep.stale_share(tree, plan, &settings.context(mesh))),
            memory_bytes: tree.memory_bytes()
                + plan.memory_bytes()
                + follower.memory_bytes()
                + upkeep.memory_bytes(),
        }
    }
}

//! The eight-wide tree of a moving scene.

use super::{Bvh8Backend, error, wide_tree};
use crate::Result;
use crate::backend::following::{Following, Follows, timed, upkeep_of};
use crate::backend::shared_trees::{Built, check_size};
use crate::backend::{
    Accelerator, BackendSpec, BuildContext, MovingAccelerator, TreeQuality, UpdateStats,
};
use crate::build::{self, BuilderEntry, BuiltInParts, Leaves, WideCosts};
use crate::dynamics::{Ranking, WideFollower};
use crate::geometry::TriangleMesh;
use crate::order::{self, OrderContext, OrderEntry};
use crate::ray_set::RaySet;
use std::sync::Arc;

/// What does not change.
struct Settings {
    spec: BackendSpec,
    builder: &'static BuilderEntry,
    order: &'static OrderEntry,
    seed: u64,
    training: Option<RaySet>,
}

/// The tree with all that lets it follow.
struct MovingBvh8 {
    settings: Settings,
    backend: Bvh8Backend,
    follower: WideFollower,
    ranking: Ranking,
}

pub(super) fn build(
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn MovingAccelerator>> {
    let settings = Settings {
        spec: spec.clone(),
        builder: build::find(spec.value("builder")).expect("specs are checked"),
        order: order::find(spec.value("order")).expect("specs are checked"),
        seed: context.seed,
        training: context.training.cloned(),
    };
    let ranking = Ranking { box_score: settings.order.box_score, upkeep: upkeep_of(spec) };
    let mesh = Arc::clone(&context.scene.mesh);
    check_size(&mesh).map_err(|message| error(spec, message))?;
    let triangles = mesh.len();
    let (backend, follower) = built(&settings, mesh);
    let tree = MovingBvh8 { settings, backend, follower, ranking };
    Ok(Box::new(Following::new(spec, tree, triangles)))
}

/// Builds the tree of a frame, with what follows it.
fn built(settings: &Settings, mesh: Arc<TriangleMesh>) -> (Bvh8Backend, WideFollower) {
    let Settings { spec, builder, order, seed, training } = settings;
    let keeps_scores = order.box_score.is_none();
    let context = OrderContext { mesh: &mesh, seed: *seed, training: training.as_ref() };
    let binary = || {
        let (tree, build_ms) = timed(|| (builder.build)(&mesh, Leaves::Wide));
        Ok(Arc::new(Built { tree, build_ms }))
    };
    let (BuiltInParts { tree, scores, order_ms }, tree_ms) =
        wide_tree(builder, order, &context, keeps_scores, binary).expect("a binary tree is built");
    let (follower, follower_ms) = timed(|| WideFollower::of(&tree, scores, WideCosts::default()));
    (Bvh8Backend::of(spec, tree, mesh, [tree_ms + follower_ms, order_ms]), follower)
}

impl Follows for MovingBvh8 {
    fn rebuild(&mut self, mesh: Arc<TriangleMesh>) -> UpdateStats {
        (self.backend, self.follower) = built(&self.settings, mesh);
        let stats = &self.backend.stats;
        UpdateStats {
            build_ms: stats.build_ms,
            order_ms: stats.order_ms,
            rebuilt: true,
            order_nodes: self.backend.tree.nodes.len() as u64,
            ..UpdateStats::default()
        }
    }

    fn follow(&mut self, mesh: Arc<TriangleMesh>, rotates: bool) -> UpdateStats {
        let Self { backend, follower, ranking, .. } = self;
        let (updated, refit_ms) = timed(|| follower.update(&mut backend.tree, &mesh, rotates));
        let (order_nodes, order_ms) = timed(|| ranking.update(&mut backend.tree, follower));
        backend.mesh = mesh;
        let rotations = updated.rotations;
        UpdateStats { refit_ms, order_ms, rotations, order_nodes, ..UpdateStats::default() }
    }

    fn accelerator(&self) -> &dyn Accelerator {
        &self.backend
    }

    fn quality(&self) -> TreeQuality {
        let Self { settings, backend, follower, ranking } = self;
        let binary = (settings.builder.build)(&backend.mesh, Leaves::Wide);
        let costs = WideCosts::default();
        let fresh = build::collapse(&binary, costs, |_, _| 0.0);
        TreeQuality {
            sah_cost: Some(costs.sah_cost(&backend.tree)),
            fresh_sah_cost: Some(costs.sah_cost(&fresh)),
            stale_order: ranking.stale_share(&backend.tree),
            memory_bytes: backend.tree.memory_bytes() + follower.memory_bytes(),
        }
    }
}

//! The eight-wide tree of a moving scene.

use super::Bvh8Backend;
use crate::backend::following::{Following, Follows, timed, upkeep_of};
use crate::backend::{
    Accelerator, BackendSpec, BuildContext, MovingAccelerator, TreeQuality, UpdateStats,
};
use crate::build::{self, BuilderEntry, Leaves, WideCosts, collapse_and_keep};
use crate::dynamics::{Ranking, WideFollower};
use crate::geometry::TriangleMesh;
use crate::order::{self, OrderContext, OrderEntry};
use crate::ray_set::RaySet;
use crate::tree::Bvh2;
use crate::{Error, Result};
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
    let shared = context
        .trees
        .bvh2(settings.builder, Leaves::Wide)
        .map_err(|message| Error::Backend { backend: spec.to_string(), message })?;
    let ranking = Ranking { box_score: settings.order.box_score, upkeep: upkeep_of(spec) };
    let mesh = Arc::clone(&context.scene.mesh);
    let triangles = mesh.len();
    let (backend, follower) = collapsed(&settings, &shared.tree, shared.build_ms, mesh);
    let tree = MovingBvh8 { settings, backend, follower, ranking };
    Ok(Box::new(Following::new(spec, tree, triangles)))
}

/// What a binary tree becomes that took `build_ms`.
fn collapsed(
    settings: &Settings,
    binary: &Bvh2,
    build_ms: f64,
    mesh: Arc<TriangleMesh>,
) -> (Bvh8Backend, WideFollower) {
    let Settings { spec, order, seed, training, .. } = settings;
    let context = OrderContext { mesh: &mesh, seed: *seed, training: training.as_ref() };
    let scores = order.scores.expect("specs are checked");
    let (scores, order_ms) = timed(|| scores(binary, &context));
    let costs = WideCosts::default();
    let ((tree, follower), wide_ms) = timed(|| {
        let score = |node: usize, side: usize| scores[node][side];
        let keeps_scores = order.box_score.is_none();
        let (tree, kept) = collapse_and_keep(binary, costs, score, keeps_scores);
        let follower = WideFollower::of(&tree, kept, costs);
        (tree, follower)
    });
    (Bvh8Backend::of(spec, tree, mesh, [build_ms + wide_ms, order_ms]), follower)
}

impl Follows for MovingBvh8 {
    fn rebuild(&mut self, mesh: Arc<TriangleMesh>) -> UpdateStats {
        let (binary, build_ms) = timed(|| (self.settings.builder.build)(&mesh, Leaves::Wide));
        (self.backend, self.follower) = collapsed(&self.settings, &binary, build_ms, mesh);
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

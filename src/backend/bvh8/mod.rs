//! The eight-wide tree: collapsed from a binary one, any order that is a score, traced by streams.

mod moving;

use super::catalogue::BackendEntry;
use super::following::timed;
use super::shared_trees::{Built, check_size};
use super::{
    Accelerator, BackendSpec, BuildContext, BuildStats, Choice, Hints, Key, following, mode,
};
use crate::build::{self, BuilderEntry, BuiltInParts, Leaves, PartOrder, WideCosts};
use crate::geometry::{Aabb, TriangleMesh};
use crate::intersect::Mode;
use crate::order::{self, OrderContext, OrderEntry};
use crate::ray::{Hit, Ray, RayBatch, VisitCounts};
use crate::trace::shaft::{self, Budget, Entry, Shaft, View, WithMesh};
use crate::trace::wide::{self, Instructions, Query, Scratch, Structure, Way};
use crate::tree::{Bvh2, Bvh8};
use crate::{Error, Result};
use std::cell::RefCell;
use std::sync::Arc;

pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "bvh8",
    about: "native eight-wide bounding volume hierarchy, by vector instructions",
    keys: &[
        Key {
            name: "builder",
            about: "how the binary tree is built that it is collapsed from",
            choices: || {
                build::BUILDERS.iter().map(|b| Choice { name: b.name, about: b.about }).collect()
            },
            default: "top-reinsertion",
        },
        Key {
            name: "order",
            about: "which children a shadow ray visits first",
            choices: || {
                let scored = order::ORDERS.iter().filter(|o| o.scores.is_some());
                scored.map(|o| Choice { name: o.name, about: o.about }).collect()
            },
            default: "p-over-c",
        },
        Key {
            name: "trace",
            about: "how rays are taken through the tree",
            choices: ways,
            default: "auto",
        },
        mode::KEY,
    ],
    moving_keys: following::KEYS,
    unavailable: None,
    check: None,
    build: |spec, context| Ok(Box::new(Bvh8Backend::new(spec, context)?)),
    build_moving: Some(moving::build),
};

/// Values of `trace=`.
pub(super) fn ways() -> Vec<Choice> {
    vec![
        Choice { name: "auto", about: "by what is known of the batch" },
        Choice { name: "single", about: "one ray at a time" },
        Choice { name: "stream", about: "128 rays of a batch together, sorted by direction" },
    ]
}

/// What the spec says of it.
pub(super) fn way_of(spec: &BackendSpec) -> Way {
    match spec.value("trace") {
        "single" => Way::Single,
        "stream" => Way::Stream,
        _ => Way::Automatic,
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

fn error(spec: &BackendSpec, message: String) -> Error {
    Error::Backend { backend: spec.to_string(), message }
}

/// A tree, and what building it took without the order, in milliseconds: part by part if builder and
/// order can, else from the binary tree that `binary` gives.
fn wide_tree(
    builder: &BuilderEntry,
    order: &OrderEntry,
    context: &OrderContext<'_>,
    keeps_scores: bool,
    binary: impl FnOnce() -> Result<Arc<Built<Bvh2>>>,
) -> Result<(BuiltInParts, f64)> {
    if let Some((in_parts, score)) = builder.in_parts.zip(order.score_part) {
        let order = PartOrder { score, keeps_scores };
        let (built, all_ms) = timed(|| in_parts(context.mesh, order));
        let build_ms = all_ms - built.order_ms;
        return Ok((built, build_ms));
    }
    let binary = binary()?;
    let scores = order.scores.expect("specs are checked");
    let (scores, order_ms) = timed(|| scores(&binary.tree, context));
    let score = |node: usize, side: usize| scores[node][side];
    let ((tree, scores), wide_ms) =
        timed(|| build::collapse_and_keep(&binary.tree, WideCosts::default(), score, keeps_scores));
    Ok((BuiltInParts { tree, scores, order_ms }, binary.build_ms + wide_ms))
}

struct Bvh8Backend {
    tree: Bvh8,
    mesh: Arc<TriangleMesh>,
    mode: Mode,
    instructions: Instructions,
    way: Way,
    stats: BuildStats,
}

impl Bvh8Backend {
    fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let builder = build::find(spec.value("builder")).expect("specs are checked");
        let order = order::find(spec.value("order")).expect("specs are checked");
        let mesh = context.scene.mesh.clone();
        check_size(&mesh).map_err(|message| error(spec, message))?;
        let order_context =
            OrderContext { mesh: &mesh, seed: context.seed, training: context.training };
        let binary = || {
            let shared = context.trees.bvh2(builder, Leaves::Wide);
            shared.map_err(|message| error(spec, message))
        };
        let (BuiltInParts { tree, order_ms, .. }, build_ms) =
            wide_tree(builder, order, &order_context, false, binary)?;
        Ok(Self::of(spec, tree, mesh, [build_ms, order_ms]))
    }

    /// Of a tree over `mesh`, and what building and ordering it took.
    fn of(
        spec: &BackendSpec,
        tree: Bvh8,
        mesh: Arc<TriangleMesh>,
        [build_ms, order_ms]: [f64; 2],
    ) -> Self {
        let instructions = Instructions::detect();
        let stats = BuildStats {
            build_ms,
            order_ms,
            memory_bytes: tree.memory_bytes(),
            inner_nodes: Some(tree.nodes.len() as u64),
            leaves: Some(tree.leaf_count() as u64),
            sah_cost: Some(WideCosts::default().sah_cost(&tree)),
            notes: vec![instructions.name().into()],
        };
        let way = way_of(spec);
        Self { tree, mesh, mode: mode::of(spec), instructions, way, stats }
    }

    fn query<'a>(&'a self, hints: &Hints<'a>) -> Query<'a> {
        Query {
            structure: Structure::Tree(&self.tree),
            mesh: &self.mesh,
            way: self.way,
            mode: self.mode,
            entry: hints.entry,
            stratum: hints.stratum,
        }
    }
}

impl Accelerator for Bvh8Backend {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        wide::closest_hit(self.instructions, Structure::Tree(&self.tree), &self.mesh, ray)
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        SCRATCH.with_borrow_mut(|scratch| {
            let tree = Structure::Tree(&self.tree);
            wide::closest_hits(self.instructions, tree, &self.mesh, rays, hits, scratch);
        });
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        self.occluded_with(&Hints::NONE, batch, occluded);
    }

    fn looks_within(&self) -> Option<Aabb> {
        Some(self.tree.bounds)
    }

    fn look(&self, shaft: &Shaft<'_>, from: &Entry, budget: Budget, entry: &mut Entry) -> View {
        let tree = WithMesh { tree: &self.tree, mesh: &self.mesh };
        shaft::look(&tree, shaft, from, budget, entry)
    }

    fn occluded_with(&self, hints: &Hints<'_>, batch: &RayBatch<'_>, occluded: &mut [u64]) -> u64 {
        SCRATCH.with_borrow_mut(|scratch| {
            wide::any_hit(self.instructions, &self.query(hints), batch.rays, occluded, scratch)
        })
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        SCRATCH.with_borrow_mut(|scratch| {
            let query = self.query(&Hints::NONE);
            wide::any_hit_counted(self.instructions, &query, batch.rays, occluded, scratch, counts);
        });
        true
    }
}

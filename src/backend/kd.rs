//! The kd-tree: any order that means something for one, one ray at a time.

use super::catalogue::BackendEntry;
use super::{Accelerator, BackendSpec, BuildContext, BuildStats, Built, Choice, Key, mode};
use crate::build::kd_sah::Splits;
use crate::geometry::Aabb;
use crate::intersect::{Exact, Fast, Mode};
use crate::order::OrderContext;
use crate::ray::{Hit, Ray, RayBatch, VisitCounts, set_bit};
use crate::trace::shaft::{self, Budget, Cells, Entry, Shaft, View};
use crate::trace::{Counter, NoCount, kd};
use crate::tree::{KdTree, Plan};
use crate::{Error, Result, order};
use std::sync::Arc;
use std::time::Instant;

pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "kd",
    about: "native kd-tree by surface-area heuristic",
    keys: &[
        Key {
            name: "order",
            about: "which child a shadow ray visits first",
            choices: || {
                let orders = order::ORDERS.iter().filter(|o| o.plan_kd.is_some());
                orders.map(|o| Choice { name: o.name, about: o.about }).collect()
            },
            default: "node-sato",
        },
        Key {
            name: "splits",
            about: "in which cells a triangle is listed",
            choices: || {
                vec![
                    Choice {
                        name: "perfect",
                        about: "those that the triangle itself reaches into",
                    },
                    Choice { name: "boxes", about: "those that the triangle's box reaches into" },
                ]
            },
            default: "perfect",
        },
        Key {
            name: "trace",
            about: "how rays are taken through the tree",
            choices: || vec![Choice { name: "single", about: "one ray at a time" }],
            default: "single",
        },
        mode::KEY,
    ],
    moving_keys: &[],
    unavailable: None,
    check: None,
    build: |spec, context| Ok(Box::new(KdBackend::new(spec, context)?)),
    build_moving: None,
};

struct KdBackend {
    built: Arc<Built<KdTree>>,
    plan: Plan,
    mode: Mode,
    stats: BuildStats,
}

impl KdBackend {
    fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let mesh = &context.scene.mesh;
        let plan_kd = order::find(spec.value("order")).and_then(|o| o.plan_kd);
        let plan_kd = plan_kd.expect("specs are checked");
        let splits = match spec.value("splits") {
            "boxes" => Splits::Boxes,
            _ => Splits::Perfect,
        };
        let built = context
            .trees
            .kd(splits)
            .map_err(|message| Error::Backend { backend: spec.to_string(), message })?;
        let tree = &built.tree;
        let start = Instant::now();
        let plan =
            plan_kd(tree, &OrderContext { mesh, seed: context.seed, training: context.training });
        let order_ms = start.elapsed().as_secs_f64() * 1e3;
        let per_triangle = tree.references.len() as f64 / tree.triangles.len().max(1) as f64;
        let stats = BuildStats {
            build_ms: built.build_ms,
            order_ms,
            memory_bytes: tree.memory_bytes() + plan.memory_bytes(),
            inner_nodes: Some(tree.inner_count() as u64),
            leaves: Some((tree.leaf_count() + tree.empty_leaf_count()) as u64),
            sah_cost: Some(tree.sah_cost()),
            notes: vec![
                format!("{per_triangle:.2} references per triangle"),
                format!("{} empty leaves", tree.empty_leaf_count()),
            ],
        };
        Ok(Self { built, plan, mode: mode::of(spec), stats })
    }

    fn any_hit<C: Counter>(&self, ray: &Ray, counter: &mut C) -> bool {
        let (tree, plan) = (&self.built.tree, &self.plan);
        match self.mode {
            Mode::Fast => kd::any_hit(tree, plan, Fast, ray, counter),
            Mode::Exact => kd::any_hit(tree, plan, Exact, ray, counter),
        }
    }
}

impl Accelerator for KdBackend {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        kd::closest_hit(&self.built.tree, ray)
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        for (index, ray) in batch.rays.iter().enumerate() {
            set_bit(occluded, index, self.any_hit(ray, &mut NoCount));
        }
    }

    fn looks_within(&self) -> Option<Aabb> {
        Some(self.built.tree.bounds)
    }

    fn look(&self, shaft: &Shaft<'_>, _: &Entry, budget: Budget, entry: &mut Entry) -> View {
        let view = shaft::look(&Cells(&self.built.tree), shaft, &Entry::WHOLE, budget, entry);
        // Rays know where they are by the planes that they have passed: they start at the root.
        entry.clear();
        view
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        for (index, (ray, counts)) in batch.rays.iter().zip(counts).enumerate() {
            set_bit(occluded, index, self.any_hit(ray, counts));
        }
        true
    }
}

//! The binary tree: any builder, any order, ray by ray or in packets.

mod moving;

use super::catalogue::BackendEntry;
use super::{
    Accelerator, BackendSpec, BuildContext, BuildStats, Built, Choice, Hints, Key, following, mode,
};
use crate::geometry::Aabb;
use crate::intersect::{Exact, Fast, Mode};
use crate::order::OrderContext;
use crate::ray::{Hit, Ray, RayBatch, VisitCounts, set_bit};
use crate::trace::packet::{self, PacketCounter};
use crate::trace::shaft::{self, Budget, Entry, Shaft, View};
use crate::trace::{Counter, NoCount, single};
use crate::tree::ChildRef;
use crate::tree::{Bvh2, Plan};
use crate::{Error, Result, build, order};
use std::sync::Arc;
use std::time::Instant;

pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "bvh2",
    about: "native binary bounding volume hierarchy",
    keys: &[
        Key {
            name: "builder",
            about: "how the tree is built",
            choices: || {
                build::BUILDERS.iter().map(|b| Choice { name: b.name, about: b.about }).collect()
            },
            default: "binned",
        },
        Key {
            name: "order",
            about: "which child a shadow ray visits first",
            choices: || {
                order::ORDERS.iter().map(|o| Choice { name: o.name, about: o.about }).collect()
            },
            default: "node-sato",
        },
        Key {
            name: "trace",
            about: "how rays are taken through the tree",
            choices: || {
                vec![
                    Choice { name: "single", about: "one ray at a time" },
                    Choice { name: "packet", about: "64 consecutive rays of a batch at a time" },
                ]
            },
            default: "single",
        },
        mode::KEY,
    ],
    moving_keys: following::KEYS,
    unavailable: None,
    check: None,
    build: |spec, context| Ok(Box::new(Bvh2Backend::new(spec, context)?)),
    build_moving: Some(moving::build),
};

struct Bvh2Backend {
    built: Arc<Built<Bvh2>>,
    plan: Plan,
    mode: Mode,
    in_packets: bool,
    stats: BuildStats,
}

impl Bvh2Backend {
    fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let failed = |message| Error::Backend { backend: spec.to_string(), message };
        let builder = build::find(spec.value("builder")).expect("specs are checked");
        let order = order::find(spec.value("order")).expect("specs are checked");
        if order.needs_training && context.training.is_none() {
            return Err(failed(format!("order={} needs recorded rays to learn from", order.name)));
        }
        let built = context.trees.bvh2(builder, build::Leaves::Fit).map_err(failed)?;
        let start = Instant::now();
        let plan = (order.plan_bvh2)(
            &built.tree,
            &OrderContext {
                mesh: &context.scene.mesh,
                seed: context.seed,
                training: context.training,
            },
        );
        let order_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(Self::of(spec, built, plan, order_ms, context.scene.mesh.len()))
    }

    /// Of a tree over so many triangles, and a plan that took `order_ms`.
    fn of(
        spec: &BackendSpec,
        built: Arc<Built<Bvh2>>,
        plan: Plan,
        order_ms: f64,
        triangles: usize,
    ) -> Self {
        let tree = &built.tree;
        let references = tree.triangles.len() as f64 / triangles.max(1) as f64;
        let notes = (references > 1.0).then(|| format!("{references:.2} references per triangle"));
        let stats = BuildStats {
            build_ms: built.build_ms,
            order_ms,
            memory_bytes: tree.memory_bytes() + plan.memory_bytes(),
            inner_nodes: Some(tree.nodes.len() as u64),
            leaves: Some(tree.leaf_count() as u64),
            sah_cost: Some(tree.sah_cost()),
            notes: notes.into_iter().collect(),
        };
        let in_packets = spec.value("trace") == "packet";
        Self { built, plan, mode: mode::of(spec), in_packets, stats }
    }

    fn any_hit<C: Counter>(&self, from: Option<ChildRef>, ray: &Ray, counter: &mut C) -> bool {
        let (tree, plan) = (&self.built.tree, &self.plan);
        match self.mode {
            Mode::Fast => single::any_hit(tree, from, plan, Fast, ray, counter),
            Mode::Exact => single::any_hit(tree, from, plan, Exact, ray, counter),
        }
    }

    fn packet<C: PacketCounter>(&self, rays: &[Ray], counter: C) -> u64 {
        let (tree, plan) = (&self.built.tree, &self.plan);
        match self.mode {
            Mode::Fast => packet::any_hit(tree, plan, Fast, rays, counter),
            Mode::Exact => packet::any_hit(tree, plan, Exact, rays, counter),
        }
    }
}

impl Accelerator for Bvh2Backend {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        single::closest_hit(&self.built.tree, ray)
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        if self.in_packets {
            for (rays, word) in batch.rays.chunks(packet::PACKET_SIZE).zip(occluded) {
                *word = self.packet(rays, NoCount);
            }
            return;
        }
        for (index, ray) in batch.rays.iter().enumerate() {
            set_bit(occluded, index, self.any_hit(self.built.tree.root, ray, &mut NoCount));
        }
    }

    fn looks_within(&self) -> Option<Aabb> {
        Some(self.built.tree.bounds)
    }

    fn look(&self, shaft: &Shaft<'_>, from: &Entry, budget: Budget, entry: &mut Entry) -> View {
        let view = shaft::look(&self.built.tree, shaft, from, budget, entry);
        if self.in_packets {
            // They start at the root.
            entry.clear();
        }
        view
    }

    fn occluded_with(&self, hints: &Hints<'_>, batch: &RayBatch<'_>, occluded: &mut [u64]) -> u64 {
        let Some(parts) = hints.entry.parts().filter(|_| !self.in_packets) else {
            self.occluded(batch, occluded);
            return 0;
        };
        for (index, ray) in batch.rays.iter().enumerate() {
            let mut children = parts.children[..parts.len].iter();
            let hit = children.any(|child| self.any_hit(Some(*child), ray, &mut NoCount));
            set_bit(occluded, index, hit);
        }
        0
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        if self.in_packets {
            let packets = batch.rays.chunks(packet::PACKET_SIZE);
            let counts = counts.chunks_mut(packet::PACKET_SIZE);
            for ((rays, word), counts) in packets.zip(occluded).zip(counts) {
                *word = self.packet(rays, counts);
            }
            return true;
        }
        for (index, (ray, counts)) in batch.rays.iter().zip(counts).enumerate() {
            set_bit(occluded, index, self.any_hit(self.built.tree.root, ray, counts));
        }
        true
    }
}

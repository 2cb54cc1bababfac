//! The eight-wide tree: collapsed from a binary one, any order that is a score, traced by streams.

use super::catalogue::BackendEntry;
use super::{Accelerator, BackendSpec, BuildContext, BuildStats, Choice, Key};
use crate::order::{self, OrderContext};
use crate::ray::{Hit, Ray, RayBatch, VisitCounts};
use crate::trace::wide::{self, Instructions, Scratch, Way};
use crate::tree::{Bvh8, ChildRef};
use crate::{Error, Result, build};
use std::cell::RefCell;
use std::time::Instant;

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
            default: "binned",
        },
        Key {
            name: "order",
            about: "which children a shadow ray visits first",
            choices: || {
                let scored = order::ORDERS.iter().filter(|o| order::find_scored(o.name).is_some());
                scored.map(|o| Choice { name: o.name, about: o.about }).collect()
            },
            default: "p-over-c",
        },
        Key {
            name: "trace",
            about: "how rays are taken through the tree",
            choices: || {
                vec![
                    Choice { name: "auto", about: "by what is known of the batch" },
                    Choice { name: "single", about: "one ray at a time" },
                    Choice {
                        name: "stream",
                        about: "64 rays of a batch together, sorted by direction",
                    },
                ]
            },
            default: "auto",
        },
    ],
    unavailable: None,
    check: None,
    build: |spec, context| Ok(Box::new(Bvh8Backend::new(spec, context)?)),
};

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

struct Bvh8Backend {
    tree: Bvh8,
    instructions: Instructions,
    way: Way,
    stats: BuildStats,
}

impl Bvh8Backend {
    fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let mesh = &context.scene.mesh;
        if mesh.len() > ChildRef::MAX_TRIANGLES {
            return Err(Error::Backend {
                backend: spec.to_string(),
                message: format!(
                    "{} triangles are more than the {} that a tree can hold",
                    mesh.len(),
                    ChildRef::MAX_TRIANGLES
                ),
            });
        }
        let builder = build::find(spec.value("builder")).expect("specs are checked");
        let order = order::find_scored(spec.value("order")).expect("specs are checked");
        let start = Instant::now();
        let binary = build::split_leaves(&(builder.build)(mesh));
        let built = Instant::now();
        let order_context = OrderContext { mesh, seed: context.seed, training: context.training };
        let scores = (order.score)(&binary, &order_context);
        let ordered = Instant::now();
        let tree =
            build::collapse(&binary, build::WideCosts::default(), &|node, side| scores[node][side]);
        let order_ms = (ordered - built).as_secs_f64() * 1e3;
        let instructions = Instructions::detect();
        let stats = BuildStats {
            build_ms: start.elapsed().as_secs_f64() * 1e3 - order_ms,
            order_ms,
            memory_bytes: tree.memory_bytes(),
            inner_nodes: Some(tree.nodes.len() as u64),
            leaves: Some(tree.leaf_count() as u64),
            sah_cost: None,
            notes: vec![instructions.name().into()],
        };
        let way = match spec.value("trace") {
            "single" => Way::Single,
            "stream" => Way::Stream,
            _ => Way::Automatic,
        };
        Ok(Self { tree, instructions, way, stats })
    }
}

impl Accelerator for Bvh8Backend {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        wide::closest_hit(self.instructions, &self.tree, ray)
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        SCRATCH.with_borrow_mut(|scratch| {
            let (tree, rays) = (&self.tree, batch.rays);
            wide::any_hit(self.instructions, self.way, tree, rays, occluded, scratch);
        });
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        SCRATCH.with_borrow_mut(|scratch| {
            let (tree, rays) = (&self.tree, batch.rays);
            wide::any_hit_counted(
                self.instructions,
                self.way,
                tree,
                rays,
                occluded,
                scratch,
                counts,
            );
        });
        true
    }
}

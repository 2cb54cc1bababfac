//! Trees in the leaves of a tree, each built when a ray first comes by.

use super::catalogue::BackendEntry;
use super::{
    Accelerator, BackendSpec, BuildContext, BuildStats, Choice, Hints, Key, MovingAccelerator,
    TreeQuality, UpdateStats, mode,
};
use crate::geometry::TriangleMesh;
use crate::intersect::Mode;
use crate::order::{self, OrderContext, OrderEntry};
use crate::parts::{Parts, Visited};
use crate::ray::{Hit, Ray, RayBatch, VisitCounts};
use crate::trace::shaft::Entry;
use crate::trace::wide::{self, Instructions, Query, Scratch, Structure, Way};
use crate::tree::{Bvh8, ChildRef, ScoreAtSplit};
use crate::{Error, Result, build};
use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "lazy",
    about: "native eight-wide trees under a small one, each built when a ray first comes by",
    keys: &[
        Key {
            name: "order",
            about: "which children a shadow ray visits first; of parts, the larger one",
            choices: || choices(|order| order.at_split.is_some()),
            default: "node-sato",
        },
        Key {
            name: "trace",
            about: "how rays are taken through the trees",
            choices: super::bvh8::ways,
            default: "auto",
        },
        mode::KEY,
    ],
    moving_keys: &[Key {
        name: "still",
        about: "order of the one tree of all that stands still",
        choices: || choices(|order| order.scores.is_some()),
        default: "p-over-c",
    }],
    unavailable: None,
    check: None,
    build: |spec, context| Ok(Box::new(Lazy::new(spec, context)?)),
    build_moving: Some(|spec, context| Ok(Box::new(Lazy::moving(spec, context)?))),
};

fn choices(fits: impl Fn(&OrderEntry) -> bool) -> Vec<Choice> {
    let orders = order::ORDERS.iter().filter(|o| fits(o));
    orders.map(|o| Choice { name: o.name, about: o.about }).collect()
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

struct Lazy {
    parts: Parts,
    mode: Mode,
    instructions: Instructions,
    way: Way,
    stats: BuildStats,
}

impl Lazy {
    fn new(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let mesh = Arc::clone(&context.scene.mesh);
        Self::over(spec, &mesh, || Parts::new(Arc::clone(&mesh), score_of(spec)))
    }

    fn moving(spec: &BackendSpec, context: &BuildContext<'_>) -> Result<Self> {
        let still = order::find(spec.value("still")).expect("specs are checked");
        if still.needs_training && context.training.is_none() {
            let message = format!("still={} needs recorded rays to learn from", still.name);
            return Err(Error::Backend { backend: spec.to_string(), message });
        }
        let (mesh, motion) = (Arc::clone(&context.scene.mesh), context.scene.motion.as_deref());
        let still = |mesh: &TriangleMesh, ids: &[u32]| Some(still_tree(mesh, ids, still, context));
        Self::over(spec, &mesh, || Parts::moving(Arc::clone(&mesh), motion, still, score_of(spec)))
    }

    fn over(spec: &BackendSpec, mesh: &TriangleMesh, make: impl FnOnce() -> Parts) -> Result<Self> {
        if mesh.len() > ChildRef::MAX_TRIANGLES {
            let most = ChildRef::MAX_TRIANGLES;
            let message = format!("{} triangles are more than {most}", mesh.len());
            return Err(Error::Backend { backend: spec.to_string(), message });
        }
        let start = Instant::now();
        let parts = make();
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let instructions = Instructions::detect();
        let visited = parts.visited();
        let stats = BuildStats {
            build_ms,
            memory_bytes: visited.memory_bytes,
            notes: vec![instructions.name().into(), format!("{} parts to build", visited.parts)],
            ..BuildStats::default()
        };
        let way = super::bvh8::way_of(spec);
        Ok(Self { parts, mode: mode::of(spec), instructions, way, stats })
    }

    fn query(&self, stratum: Option<usize>) -> Query<'_> {
        Query {
            structure: Structure::TwoLevel(&self.parts),
            mesh: self.parts.mesh(),
            way: self.way,
            mode: self.mode,
            entry: &Entry::WHOLE,
            stratum,
        }
    }
}

fn score_of(spec: &BackendSpec) -> ScoreAtSplit {
    order::find(spec.value("order")).and_then(|o| o.at_split).expect("specs are checked")
}

/// One tree of the triangles `ids`, which its slots name.
fn still_tree(
    mesh: &TriangleMesh,
    ids: &[u32],
    order: &OrderEntry,
    context: &BuildContext<'_>,
) -> Bvh8 {
    let corners = ids.iter().map(|&id| mesh.triangles()[id as usize]).collect();
    let own = TriangleMesh::new(mesh.vertices().to_vec(), corners);
    let binned = build::find("binned").expect("is in the catalogue");
    let binary = (binned.build)(&own, build::Leaves::Wide);
    let training = context.training;
    let order_context = OrderContext { mesh: &own, seed: context.seed, training };
    let scores = order.scores.expect("an order with scores")(&binary, &order_context);
    let costs = build::WideCosts::default();
    let mut tree = build::collapse(&binary, costs, |node, side| scores[node][side]);
    for id in &mut tree.triangle_ids {
        *id = ids[*id as usize];
    }
    tree
}

impl Accelerator for Lazy {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let structure = Structure::TwoLevel(&self.parts);
        wide::closest_hit(self.instructions, structure, self.parts.mesh(), ray)
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        SCRATCH.with_borrow_mut(|scratch| {
            let structure = Structure::TwoLevel(&self.parts);
            let mesh = self.parts.mesh();
            wide::closest_hits(self.instructions, structure, mesh, rays, hits, scratch);
        });
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        self.occluded_with(&Hints::NONE, batch, occluded);
    }

    fn occluded_with(&self, hints: &Hints<'_>, batch: &RayBatch<'_>, occluded: &mut [u64]) -> u64 {
        let query = self.query(hints.stratum);
        SCRATCH.with_borrow_mut(|scratch| {
            wide::any_hit(self.instructions, &query, batch.rays, occluded, scratch)
        })
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        SCRATCH.with_borrow_mut(|scratch| {
            let query = self.query(Hints::NONE.stratum);
            wide::any_hit_counted(self.instructions, &query, batch.rays, occluded, scratch, counts);
        });
        true
    }

    fn visited(&self) -> Option<Visited> {
        Some(self.parts.visited())
    }
}

impl MovingAccelerator for Lazy {
    fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<UpdateStats> {
        let start = Instant::now();
        let cut_anew = self.parts.follow(mesh);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let (refit_ms, build_ms) = if cut_anew { (0.0, ms) } else { (ms, 0.0) };
        Ok(UpdateStats { refit_ms, build_ms, rebuilt: cut_anew, ..UpdateStats::default() })
    }

    fn accelerator(&self) -> &dyn Accelerator {
        self
    }

    fn quality(&self) -> TreeQuality {
        let memory_bytes = self.parts.visited().memory_bytes;
        TreeQuality { memory_bytes, ..TreeQuality::default() }
    }
}

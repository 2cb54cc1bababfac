//! What native trees that follow moving scenes have in common: the keys, and when to do what.

use super::{Accelerator, BackendSpec, Choice, Key, MovingAccelerator, TreeQuality, UpdateStats};
use crate::dynamics::{SkiRental, Strategy, Upkeep};
use crate::geometry::TriangleMesh;
use crate::{Error, Result};
use std::sync::Arc;

/// Keys of trees that follow moving scenes.
pub(super) static KEYS: &[Key] = &[
    Key {
        name: "update",
        about: "how the tree follows a moving scene",
        choices: || {
            let all = Strategy::ALL.iter();
            all.map(|s| Choice { name: s.name(), about: s.about() }).collect()
        },
        default: "auto",
    },
    Key {
        name: "upkeep",
        about: "where the traversal order is brought up to date as the tree changes",
        choices: || {
            let all = Upkeep::ALL.iter();
            all.map(|u| Choice { name: u.name(), about: u.about() }).collect()
        },
        default: "selective",
    },
];

/// What `upkeep=` says.
pub(super) fn upkeep_of(spec: &BackendSpec) -> Upkeep {
    let value = spec.value("upkeep");
    Upkeep::ALL.into_iter().find(|u| u.name() == value).expect("specs are checked")
}

/// A tree that can follow its triangles.
pub(super) trait Follows: Send {
    /// Builds it anew for `mesh`.
    fn rebuild(&mut self, mesh: Arc<TriangleMesh>) -> UpdateStats;

    /// Brings it up to date with `mesh`, with rotations or without.
    fn follow(&mut self, mesh: Arc<TriangleMesh>, rotates: bool) -> UpdateStats;

    /// What answers rays.
    fn accelerator(&self) -> &dyn Accelerator;

    /// What is known of the tree.
    fn quality(&self) -> TreeQuality;
}

/// A tree that follows its triangles as `update=` says.
pub(super) struct Following<F> {
    spec: BackendSpec,
    strategy: Strategy,
    rule: SkiRental,
    triangles: usize,
    tree: F,
}

impl<F: Follows> Following<F> {
    /// With a tree that was just built over so many triangles.
    pub(super) fn new(spec: &BackendSpec, tree: F, triangles: usize) -> Self {
        let value = spec.value("update");
        let strategy = Strategy::ALL.into_iter().find(|s| s.name() == value);
        let stats = tree.accelerator().build_stats();
        Self {
            spec: spec.clone(),
            strategy: strategy.expect("specs are checked"),
            rule: SkiRental::new(stats.build_ms + stats.order_ms),
            triangles,
            tree,
        }
    }
}

impl<F: Follows> MovingAccelerator for Following<F> {
    fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<UpdateStats> {
        if mesh.len() != self.triangles {
            let message = format!("{} triangles where there were {}", mesh.len(), self.triangles);
            return Err(Error::Backend { backend: self.spec.to_string(), message });
        }
        let builds = match self.strategy {
            Strategy::Rebuild => true,
            Strategy::Auto => self.rule.is_due(),
            Strategy::Refit | Strategy::Rotate => false,
        };
        if builds {
            let stats = self.tree.rebuild(mesh);
            self.rule = SkiRental::new(stats.total_ms());
            return Ok(stats);
        }
        Ok(self.tree.follow(mesh, self.strategy != Strategy::Refit))
    }

    fn traced(&mut self, trace_ms: f64) {
        self.rule.traced(trace_ms);
    }

    fn accelerator(&self) -> &dyn Accelerator {
        self.tree.accelerator()
    }

    fn quality(&self) -> TreeQuality {
        self.tree.quality()
    }
}

/// Runs `work` and returns what it took, in milliseconds, too.
pub(super) fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = std::time::Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64() * 1e3)
}

//! Trees that several backends of one scene use: an order is a plan beside a tree, so backends that
//! differ in order or kernel alone share it.

use crate::build::kd_sah::{self, Splits};
use crate::build::{self, BuilderEntry, Leaves};
use crate::geometry::TriangleMesh;
use crate::scene::Scene;
use crate::tree::{Bvh2, ChildRef, KdTree};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// A tree and what building it took.
#[derive(Debug)]
pub struct Built<T> {
    /// The tree.
    pub tree: T,
    /// Wall-clock time of the one build, in milliseconds.
    pub build_ms: f64,
}

/// The trees of one scene: each is built when it is first asked for, and only then.
#[derive(Debug)]
pub struct SharedTrees {
    mesh: Arc<TriangleMesh>,
    bvh2: List<(&'static str, Leaves), Bvh2>,
    kd: List<Splits, KdTree>,
}

/// Refuses meshes that are larger than the layout of trees can hold.
pub(super) fn check_size(mesh: &TriangleMesh) -> Result<(), String> {
    let (count, most) = (mesh.len(), ChildRef::MAX_TRIANGLES);
    if count <= most {
        return Ok(());
    }
    Err(format!("{count} triangles are more than the {most} that a tree can hold"))
}

/// The trees built so far, by what tells them apart.
type List<K, T> = Mutex<Vec<(K, Arc<Built<T>>)>>;

impl SharedTrees {
    /// No tree yet.
    pub fn of(scene: &Scene) -> Self {
        Self { mesh: Arc::clone(&scene.mesh), bvh2: Mutex::default(), kd: Mutex::default() }
    }

    /// The binary tree of `builder`, built on the current rayon pool if need be.
    ///
    /// # Errors
    /// If the mesh is larger than the layout can hold.
    pub fn bvh2(
        &self,
        builder: &'static BuilderEntry,
        leaves: Leaves,
    ) -> Result<Arc<Built<Bvh2>>, String> {
        check_size(&self.mesh)?;
        shared(&self.bvh2, (builder.name, leaves), || Ok((builder.build)(&self.mesh, leaves)))
    }

    /// A binary tree whose boxes hold whole triangles, likewise: for the arbiter.
    ///
    /// # Errors
    /// As [`bvh2`](Self::bvh2).
    pub fn uncut(&self) -> Result<Arc<Built<Bvh2>>, String> {
        self.bvh2(build::find("binned").expect("is in the catalogue"), Leaves::Fit)
    }

    /// The kd-tree with these splits, likewise.
    ///
    /// # Errors
    /// If the mesh or the tree is larger than the layout can hold.
    pub fn kd(&self, splits: Splits) -> Result<Arc<Built<KdTree>>, String> {
        shared(&self.kd, splits, || kd_sah::build(&self.mesh, splits))
    }
}

/// What the list has under `key`; built and added if there is none.
fn shared<K: Copy + PartialEq, T>(
    list: &List<K, T>,
    key: K,
    build: impl FnOnce() -> Result<T, String>,
) -> Result<Arc<Built<T>>, String> {
    let find = || {
        let list = list.lock().unwrap_or_else(PoisonError::into_inner);
        list.iter().find(|entry| entry.0 == key).map(|entry| Arc::clone(&entry.1))
    };
    if let Some(built) = find() {
        return Ok(built);
    }
    // Not under the lock: a thread that waits for its pool may take up other work, even some that
    // asks for a tree. At worst one is built twice.
    let start = Instant::now();
    let tree = build()?;
    let built = Arc::new(Built { tree, build_ms: start.elapsed().as_secs_f64() * 1e3 });
    list.lock().unwrap_or_else(PoisonError::into_inner).push((key, Arc::clone(&built)));
    Ok(built)
}

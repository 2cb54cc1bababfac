//! A scene with what is made for it when something asks: trees that backends share, rays to learn
//! from, the backends themselves.

use crate::Result;
use crate::backend::{
    Accelerator, BackendSpec, BuildContext, MovingAccelerator, SharedTrees, build, build_moving,
};
use crate::order;
use crate::ray_set::RaySet;
use crate::render::training_rays;
use crate::scene::Scene;
use std::cell::OnceCell;

/// Where the backends of one scene are built, on the current rayon pool.
#[derive(Debug)]
pub struct Lab<'a> {
    scene: &'a Scene,
    seed: u64,
    trees: SharedTrees,
    training: OnceCell<RaySet>,
}

impl<'a> Lab<'a> {
    /// Nothing is built yet. The seed is that of random orders and of the rays to learn from.
    pub fn new(scene: &'a Scene, seed: u64) -> Self {
        Self { scene, seed, trees: SharedTrees::of(scene), training: OnceCell::new() }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The trees built so far, and those to come.
    pub fn trees(&self) -> &SharedTrees {
        &self.trees
    }

    /// Rays for orders that learn, recorded once.
    ///
    /// # Errors
    /// As [`record`](crate::render::record).
    pub fn training(&self) -> Result<&RaySet> {
        if self.training.get().is_none() {
            let tracer = self.built(&"bvh2".parse()?, None)?;
            let rays = training_rays(self.scene, &*tracer, self.seed)?;
            self.training.get_or_init(|| rays);
        }
        Ok(self.training.get().expect("recorded above"))
    }

    /// Builds a backend; one whose order learns from rays is given some.
    ///
    /// # Errors
    /// As [`build`].
    pub fn build(&self, spec: &BackendSpec) -> Result<Box<dyn Accelerator>> {
        self.built(spec, self.training_for(spec)?)
    }

    /// Builds what follows the scene when it moves; with trees of its own.
    ///
    /// # Errors
    /// As [`build`].
    pub fn build_moving(&self, spec: &BackendSpec) -> Result<Box<dyn MovingAccelerator>> {
        let training = self.training_for(spec)?;
        let trees = SharedTrees::of(self.scene);
        let threads = rayon::current_num_threads();
        let Self { scene, seed, .. } = *self;
        build_moving(spec, &BuildContext { scene, trees: &trees, threads, seed, training })
    }

    fn training_for(&self, spec: &BackendSpec) -> Result<Option<&RaySet>> {
        // The orders of what moves and of what stands still.
        let orders = ["order", "still"].map(|key| spec.find_value(key).and_then(order::find));
        let learns = orders.into_iter().flatten().any(|order| order.needs_training);
        if learns { self.training().map(Some) } else { Ok(None) }
    }

    fn built(&self, spec: &BackendSpec, training: Option<&RaySet>) -> Result<Box<dyn Accelerator>> {
        let threads = rayon::current_num_threads();
        let Self { scene, ref trees, seed, .. } = *self;
        build(spec, &BuildContext { scene, trees, threads, seed, training })
    }
}

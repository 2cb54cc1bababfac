//! Embree following a moving scene.
//!
//! What Embree 4 does, by its manual and its source: qualities of geometries count in scenes of low
//! quality only, which have a tree for each geometry and one above them. There, `LOW` builds in Morton
//! order, `MEDIUM` and `HIGH` by binned SAH (spatial splits are left out), and `REFIT` by binned SAH
//! the first time and refits from then on. To change a geometry's quality is to throw its tree away,
//! so that a tree that is to be refitted has that quality from the start. Scenes that are not dynamic
//! throw away all trees when they are committed, and have none to refit.
//!
//! The shared vertices are those of another mesh in each frame. A refit reads them through the
//! geometry's buffer, and a buffer that is set anew counts as modified, so nothing is copied.

use super::accelerator::{Embree, quality_of};
use super::ffi::{Part, Quality, Settings};
use crate::backend::{
    Accelerator, BackendSpec, BuildContext, MovingAccelerator, TreeQuality, UpdateStats,
};
use crate::geometry::TriangleMesh;
use crate::scene::Scene;
use crate::{Error, Result};
use std::sync::Arc;
use std::time::Instant;

struct MovingEmbree {
    embree: Embree,
    spec: BackendSpec,
    refits: bool,
    /// Whether some of the tree is kept from frame to frame.
    keeps_parts: bool,
}

/// Builds what the spec says, ready to follow the context's scene.
pub(super) fn build_moving(
    spec: &BackendSpec,
    context: &BuildContext<'_>,
) -> Result<Box<dyn MovingAccelerator>> {
    let refits = spec.value("update") == "refit";
    let one = spec.value("geometries") == "one";
    let parts = parts_of(context.scene, one, refits, quality_of(spec));
    let settings = Settings {
        // One tree of everything, or one for each geometry.
        quality: if one && !refits { quality_of(spec) } else { Quality::LOW },
        robust: spec.value("mode") == "robust",
        dynamic: spec.value("scene") == "dynamic",
    };
    let keys: Vec<_> = spec.entry().all_keys().map(|key| key.name).collect();
    Ok(Box::new(MovingEmbree {
        embree: Embree::build(i64::MAX, spec, context, &parts, settings, &keys)?,
        spec: spec.clone(),
        refits,
        keeps_parts: settings.dynamic && parts.iter().any(|part| !part.moves),
    }))
}

fn parts_of(scene: &Scene, one: bool, refits: bool, quality: Quality) -> Vec<Part> {
    let objects = scene.motion.as_ref().map(|motion| &motion.objects).filter(|_| !one);
    let mut parts: Vec<_> = match objects {
        Some(objects) => objects
            .iter()
            .map(|object| Part {
                triangles: object.triangles.clone(),
                quality,
                moves: object.moves,
            })
            .collect(),
        None => vec![Part { triangles: 0..scene.mesh.len(), quality, moves: true }],
    };
    for part in parts.iter_mut().filter(|part| part.moves && refits) {
        part.quality = Quality::REFIT;
    }
    parts
}

impl MovingAccelerator for MovingEmbree {
    fn update(&mut self, mesh: Arc<TriangleMesh>) -> Result<UpdateStats> {
        let start = Instant::now();
        self.embree
            .scene
            .update(mesh)
            .map_err(|message| Error::Backend { backend: self.spec.to_string(), message })?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(match self.refits {
            true => UpdateStats { refit_ms: ms, ..UpdateStats::default() },
            false => {
                UpdateStats { build_ms: ms, rebuilt: !self.keeps_parts, ..UpdateStats::default() }
            }
        })
    }

    fn accelerator(&self) -> &dyn Accelerator {
        &self.embree
    }

    fn quality(&self) -> TreeQuality {
        TreeQuality { memory_bytes: self.embree.scene.memory_bytes(), ..TreeQuality::default() }
    }
}

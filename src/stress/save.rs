//! Wrong rays kept for replay, with the scene that they belong to.

use super::Stage;
use crate::Result;
use crate::backend::BackendSpec;
use crate::ray::Ray;
use crate::ray_set::{RayFile, RaySet};
use crate::scene::{Scene, export};
use std::path::Path;

/// Rays kept of each backend in a stage.
const MOST: usize = 8;

/// The first wrong rays of each backend in one stage.
#[derive(Debug, Default)]
pub(super) struct Saved {
    rays: Vec<(String, Vec<Ray>)>,
}

impl Saved {
    /// Keeps rays that `spec` is wrong on, up to a few in all.
    pub(super) fn keep(&mut self, spec: &BackendSpec, wrong: impl Iterator<Item = Ray>) {
        let name = spec.full();
        let known = self.rays.iter().position(|(spec, _)| *spec == name);
        let mut wrong = wrong.peekable();
        if known.is_none() && wrong.peek().is_none() {
            return;
        }
        let index = known.unwrap_or_else(|| {
            self.rays.push((name, Vec::new()));
            self.rays.len() - 1
        });
        let kept = &mut self.rays[index].1;
        kept.extend(wrong.take(MOST - kept.len().min(MOST)));
    }

    /// Writes the scene and the rays, if there are any; returns the files' names.
    pub(super) fn write(
        &self,
        folder: &Path,
        case: &str,
        stage: &Stage,
        scene: &Scene,
    ) -> Result<Vec<String>> {
        if self.rays.is_empty() {
            return Ok(Vec::new());
        }
        let label = &stage.label;
        let stem = if label.is_empty() { case.to_string() } else { format!("{case}.{label}") };
        let (mesh, rays) = (format!("{stem}.obj"), format!("{stem}.rays"));
        export(scene, folder.join(&mesh))?;
        let class = |(spec, rays): &(String, Vec<Ray>)| {
            let mut set = RaySet::default();
            set.push_batch(rays);
            (spec.clone(), set)
        };
        let file = RayFile {
            frame: None,
            scene: folder.join(&mesh).to_string_lossy().into_owned(),
            about: format!("first wrong rays of: {}", crate::report::command_line().join(" ")),
            classes: self.rays.iter().map(class).collect(),
        };
        file.write(&folder.join(&rays))?;
        Ok(vec![mesh, rays])
    }
}

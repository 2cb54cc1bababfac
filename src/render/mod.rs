//! The renderer: camera, primary hit, surface point, batches of shadow rays, film. It sees backends
//! through [`Accelerator`](crate::backend::Accelerator) only.
//!
//! [`render`] makes an image tile by tile; [`record`] keeps the rays so that backends can be
//! compared on the same ones, and makes the same image from their answers.

mod adaptive;
pub mod ambient_occlusion;
mod few_samples;
mod film;
mod layers;
mod light_lift;
pub mod light_samples;
mod light_sampling;
mod pixels;
mod plan;
mod recording;
mod rectangle_light;
mod reused;
mod sampled_light;
pub mod sampler;
mod settings;
mod shafts;
mod skip;
pub mod soft_shadow;
mod spherical_rectangle;
mod stats;
mod streaming;
mod surface;
mod surface_lanes;
mod tile;
mod training;
mod unseen;
mod walk;
pub mod warp;

pub use adaptive::Adaptive;
pub(crate) use film::luminance;
pub use film::{Channel, Film, Layer};
pub use light_sampling::LightSampling;
pub use recording::{RecordedPass, Recording, record};
pub use sampler::{SAMPLERS, SamplerEntry};
pub use settings::{Pass, RayClass, RenderSettings};
pub use skip::{Skip, Skips};
pub use stats::{AdaptiveStats, ClassStats, RenderStats, Skipped};
pub use streaming::{RenderOptions, Rendering, render};
pub use surface::SurfacePoint;
pub use tile::{TILE_PIXELS, TILE_SIZE, Tile, TileGrid, TileOrder};
pub use training::training_rays;
pub use unseen::seen_part;

use std::sync::atomic::{AtomicUsize, Ordering};

/// Told how many tiles are done, and of how many.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// Counts tiles for a [`Progress`].
struct TileCount<'a> {
    done: AtomicUsize,
    total: usize,
    progress: Option<Progress<'a>>,
}

impl<'a> TileCount<'a> {
    fn new(total: usize, progress: Option<Progress<'a>>) -> Self {
        Self { done: AtomicUsize::new(0), total, progress }
    }

    fn add_one(&self) {
        if let Some(progress) = self.progress {
            progress(self.done.fetch_add(1, Ordering::Relaxed) + 1, self.total);
        }
    }
}

//! Image files: OpenEXR with all layers, PNG for the eye.

mod colour_map;
mod exr;
mod png;
mod tone_map;

pub use self::exr::write_exr;
pub use colour_map::viridis;
pub use png::{RgbImage, differences, gray, heat_map, write_png};
pub use tone_map::{ToneCurve, to_srgb, tone_map, tone_map_by};

//! What of a pass is held against the reference, and how it is shown.

use crate::image_file::ToneCurve;
use crate::render::{Film, Pass, luminance};
use glam::Vec3;

/// An image: channels, row by row.
pub(super) type Planes = Vec<Vec<f32>>;

/// The layer of a pass, and its channels.
///
/// Ambient occlusion is measured as it is, a share of 1. Of shadows it is the irradiance, whose
/// expectation is the true one; `shadow` is a ratio of two estimates.
pub(super) fn raw_planes(film: &Film, pass: Pass) -> Planes {
    let (layer, channels): (_, &[&str]) = match pass {
        Pass::Shadow => ("irradiance", &["R", "G", "B"]),
        _ => (pass.name(), &["Y"]),
    };
    let plane = |name: &&str| film.channel(layer, name).unwrap_or_default().to_vec();
    channels.iter().map(plane).collect()
}

/// The unit of a pass's values.
pub(super) fn unit(pass: Pass) -> &'static str {
    match pass {
        Pass::Shadow => "irradiance over its mean in the reference",
        _ => "share of rays that nothing stops",
    }
}

/// How images of one scene and pass are looked at: as the reference asks for.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) size: [u32; 2],
    /// Pixels that see a surface: errors are means over these.
    pub(super) pixels: Vec<usize>,
    /// What values are multiplied with. Irradiance is divided by its mean in the reference, as lights
    /// may have any strength.
    pub(super) scale: f32,
    /// Of irradiance; shares are shown as they are.
    tone: Option<ToneCurve>,
}

impl View {
    /// Of the reference's values, not yet scaled.
    pub(super) fn of(size: [u32; 2], pass: Pass, raw: &Planes, pixels: Vec<usize>) -> Self {
        let mut view = Self { size, pixels, scale: 1.0, tone: None };
        if pass == Pass::Shadow {
            let values = raw.iter().flat_map(|plane| view.pixels.iter().map(|&p| plane[p]));
            let count = (raw.len() * view.pixels.len()).max(1);
            let mean = values.map(f64::from).sum::<f64>() / count as f64;
            if mean > 0.0 {
                view.scale = (1.0 / mean) as f32;
            }
            let scaled = view.scaled(raw);
            let light = view.pixels.iter().map(|&p| luminance(colour(&scaled, p)));
            view.tone = Some(ToneCurve::of(light.collect()));
        }
        view
    }

    /// Values in the unit of the errors.
    pub(super) fn scaled(&self, raw: &Planes) -> Planes {
        let scale = |plane: &Vec<f32>| plane.iter().map(|v| v * self.scale).collect();
        raw.iter().map(scale).collect()
    }

    /// What a screen shows of scaled values, as linear RGB.
    pub(super) fn shown(&self, planes: &Planes) -> Vec<Vec3> {
        let pixels = 0..planes.first().map_or(0, Vec::len);
        let shown = |p| self.tone.map_or(colour(planes, p), |tone| tone.shown(colour(planes, p)));
        pixels.map(shown).collect()
    }
}

/// One channel is grey.
fn colour(planes: &Planes, pixel: usize) -> Vec3 {
    let last = planes.len() - 1;
    Vec3::from([0, 1, 2].map(|axis: usize| planes[axis.min(last)][pixel]))
}

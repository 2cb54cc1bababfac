//! From radiance to the screen.

use super::png::RgbImage;
use crate::render::{Film, luminance};
use glam::Vec3;

/// What shows where there is no surface, as linear grey.
const BACKGROUND: f32 = 0.06;
/// Middle grey: where the average of the logarithms goes.
const KEY: f64 = 0.18;

/// From radiance to what a screen shows: exposed by the average logarithm of the luminance of what it
/// was made for, compressed so that all but its brightest hundredth keeps detail.
///
/// Reinhard et al., "Photographic Tone Reproduction for Digital Images", SIGGRAPH 2002 (the global
/// operator with a white point).
#[derive(Clone, Copy, Debug)]
pub struct ToneCurve {
    exposure: f64,
    white_squared: f64,
}

impl ToneCurve {
    /// For a picture whose surfaces have these luminances.
    pub fn of(mut luminances: Vec<f64>) -> Self {
        let count = luminances.len().max(1) as f64;
        let mean = luminances.iter().sum::<f64>() / count;
        // Black does not count as infinitely dark.
        let floor = 1e-2 * mean + f64::MIN_POSITIVE;
        let log_mean = luminances.iter().map(|l| (l + floor).ln()).sum::<f64>() / count;
        let exposure = if mean > 0.0 { KEY / log_mean.exp() } else { 1.0 };
        let rank = luminances.len().saturating_sub(1) * 99 / 100;
        let white = match luminances.is_empty() {
            true => 1.0,
            false => *luminances.select_nth_unstable_by(rank, f64::total_cmp).1 * exposure,
        };
        Self { exposure, white_squared: white.max(f64::from(f32::MIN_POSITIVE)).powi(2) }
    }

    /// For the film's picture.
    pub fn of_film(film: &Film) -> Self {
        let [red, green, blue, alpha] = picture(film);
        let seen = (0..alpha.len()).filter(|&i| alpha[i] > 0.0);
        Self::of(seen.map(|i| luminance(Vec3::new(red[i], green[i], blue[i]) / alpha[i])).collect())
    }

    /// The linear RGB shown for a radiance; what is brighter than white leaves `[0, 1]`.
    pub fn shown(&self, radiance: Vec3) -> Vec3 {
        let colour = radiance * self.exposure as f32;
        let light = luminance(colour);
        colour * ((1.0 + light / self.white_squared) / (1.0 + light)) as f32
    }
}

/// The film's picture for the eye as 8-bit sRGB, by its own [`ToneCurve`], over dark grey where it is
/// transparent.
pub fn tone_map(film: &Film) -> RgbImage {
    tone_map_by(film, &ToneCurve::of_film(film))
}

/// As [`tone_map`], by any curve: the same one for pictures that are to be seen together.
pub fn tone_map_by(film: &Film, curve: &ToneCurve) -> RgbImage {
    let [red, green, blue, alpha] = picture(film);
    let pixels = (0..alpha.len()).map(|i| {
        let shown = curve.shown(Vec3::new(red[i], green[i], blue[i]))
            + Vec3::splat((1.0 - alpha[i]) * BACKGROUND);
        shown.to_array().map(to_srgb)
    });
    RgbImage { size: film.size(), pixels: pixels.collect() }
}

fn picture(film: &Film) -> [&[f32]; 4] {
    ["R", "G", "B", "A"].map(|name| film.channel("", name).unwrap_or_default())
}

/// The 8-bit sRGB code of a linear value in `[0, 1]` (forced into it).
pub fn to_srgb(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let code =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (code * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_codes() {
        let codes = [0.0, 0.002, 0.215_861, 1.0, 7.0, -1.0, f32::NAN].map(to_srgb);
        assert_eq!(codes, [0, 7, 128, 255, 255, 0, 0]);
    }
}

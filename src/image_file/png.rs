//! PNG files for the eye: grey layers, heat maps, differences.

use super::colour_map::viridis;
use super::tone_map::to_srgb;
use crate::Result;
use crate::output::write_atomically;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::io;
use std::path::Path;

/// An 8-bit sRGB image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Row by row from the upper left pixel.
    pub pixels: Vec<[u8; 3]>,
}

/// Writes a PNG file.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) naming the file.
pub fn write_png(path: &Path, image: &RgbImage) -> Result<()> {
    let [width, height] = image.size;
    let bytes = image.pixels.as_flattened();
    write_atomically(path, |out| {
        PngEncoder::new(out)
            .write_image(bytes, width, height, ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    })
}

/// A layer of values from 0, black, to 1, white.
pub fn gray(size: [u32; 2], values: &[f32]) -> RgbImage {
    RgbImage { size, pixels: values.iter().map(|&value| [to_srgb(value); 3]).collect() }
}

/// A layer as colours from 0, dark violet, to `most`, yellow.
pub fn heat_map(size: [u32; 2], values: &[f32], most: f32) -> RgbImage {
    RgbImage { size, pixels: values.iter().map(|&value| viridis(value / most)).collect() }
}

/// Marks the pixels whose element of `marks` is not 0 on a dimmed grey layer: a saturated disk on
/// each, large enough to be seen when the image is shown whole, in orange, or in white where it
/// stands for ten or more.
pub fn differences(size: [u32; 2], background: &[f32], marks: &[u32]) -> RgbImage {
    let dimmed: Vec<f32> = background.iter().map(|value| 0.3 * value).collect();
    let mut image = gray(size, &dimmed);
    let [width, height] = size.map(i64::from);
    let radius = (width.max(height) / 320).max(1);
    for (pixel, &count) in marks.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (x, y) = (pixel as i64 % width, pixel as i64 / width);
        let colour = if count >= 10 { [255, 255, 255] } else { [255, 90, 0] };
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let (px, py) = (x + dx, y + dy);
                let inside = (0..width).contains(&px) && (0..height).contains(&py);
                if inside && dx * dx + dy * dy <= radius * radius {
                    let target = &mut image.pixels[(py * width + px) as usize];
                    // Where disks meet, the larger difference shows.
                    *target = colour.max(if target[0] == 255 { *target } else { colour });
                }
            }
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_the_size_and_the_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        let written = heat_map([3, 2], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 5.0);
        write_png(&path, &written).unwrap();
        let read = image::open(&path).unwrap().to_rgb8();
        assert_eq!(read.dimensions(), (3, 2));
        assert_eq!(read.as_raw(), written.pixels.as_flattened());
    }

    #[test]
    fn a_single_differing_ray_shows() {
        let size = [1280, 720];
        let mut marks = vec![0; 1280 * 720];
        marks[0] = 1;
        marks[360 * 1280 + 640] = 12;
        let image = differences(size, &vec![1.0; 1280 * 720], &marks);
        let count = |colour: [u8; 3]| image.pixels.iter().filter(|p| **p == colour).count();
        assert_eq!((count([255, 90, 0]), count([255, 255, 255])), (17, 49));
        assert_eq!(image.pixels[5000], [149; 3]);
    }
}

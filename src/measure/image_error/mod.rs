//! How far an image is from a reference: squared errors and FLIP.

mod flip;

pub use flip::{DEFAULT_PIXELS_PER_DEGREE, Flip};

/// What [`relative_squared_error`] adds to the square of the reference, so that black pixels do not
/// count without end.
const RELATIVE_FLOOR: f64 = 1e-2;

/// Mean of the squared differences over the pixels of `pixels` and over all channels; 0 if there is
/// none. Each element of `image` and `reference` is one channel, row by row.
///
/// # Panics
/// If there is a pixel that a channel does not have.
pub fn squared_error(image: &[Vec<f32>], reference: &[Vec<f32>], pixels: &[usize]) -> f64 {
    mean(image, reference, pixels, |x, r| (x - r) * (x - r))
}

/// As [`squared_error`], each difference over the square of the reference (Rousselle, Knaus and
/// Zwicker 2011): `mean((x - r)^2 / (r^2 + 0.01))`. Values are meant to be about 1.
pub fn relative_squared_error(image: &[Vec<f32>], reference: &[Vec<f32>], pixels: &[usize]) -> f64 {
    mean(image, reference, pixels, |x, r| (x - r) * (x - r) / (r * r + RELATIVE_FLOOR))
}

fn mean(
    image: &[Vec<f32>],
    reference: &[Vec<f32>],
    pixels: &[usize],
    error: impl Fn(f64, f64) -> f64,
) -> f64 {
    let mut sum = 0.0;
    for (image, reference) in image.iter().zip(reference) {
        let of_channel = |&p: &usize| error(f64::from(image[p]), f64::from(reference[p]));
        sum += pixels.iter().map(of_channel).sum::<f64>();
    }
    sum / (pixels.len() * image.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_by_hand() {
        let reference = [vec![0.0, 1.0, 5.0], vec![2.0, 0.5, 5.0]];
        let image = [vec![0.1, 1.0, 9.0], vec![1.0, 1.0, 9.0]];
        let pixels = [0, 1];
        let squared = squared_error(&image, &reference, &pixels);
        assert!((squared - (0.01 + 0.0 + 1.0 + 0.25) / 4.0).abs() < 1e-7, "{squared}");
        let relative = relative_squared_error(&image, &reference, &pixels);
        let expected = (0.01 / 0.01 + 1.0 / 4.01 + 0.25 / 0.26) / 4.0;
        assert!((relative - expected).abs() < 1e-6, "{relative}");
        assert_eq!(squared_error(&image, &reference, &[]), 0.0);
    }
}

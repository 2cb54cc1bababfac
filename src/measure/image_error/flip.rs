//! FLIP: the difference that a viewer sees who flips between two images (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020), for images of low dynamic range. Sections are those of the paper.
//!
//! All filters are separable: the two-dimensional Gaussians as they are, the one for blue and yellow
//! as a sum of two, and derivatives of Gaussians since their sign depends on one coordinate only.

use glam::Vec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels in a degree of the field of view, for a display 0.7 m wide with 3840 pixels seen from
/// 0.7 m: the paper's choice.
pub const DEFAULT_PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Exponents of colour and feature differences (sections 4.1.3 and 4.2).
const COLOUR_EXPONENT: f32 = 0.7;
const FEATURE_EXPONENT: f32 = 0.5;
/// Differences up to this part of the largest fill `[0, KNEE]` of the result (section 4.1.3).
const KNEE_AT: f32 = 0.4;
const KNEE: f32 = 0.95;
/// Width of the detectors of edges and points, in degrees (section 4.2).
const FEATURE_WIDTH: f64 = 0.082;
/// Contrast sensitivity in frequency space as sums of Gaussians, `a sqrt(pi/b) exp(-pi^2 x^2 / b)`
/// with x in degrees (section 4.1.1; the second terms of the first two vanish): pairs `(a, b)`.
const ACHROMATIC: &[[f64; 2]] = &[[1.0, 0.0047]];
const RED_GREEN: &[[f64; 2]] = &[[1.0, 0.0053]];
const BLUE_YELLOW: &[[f64; 2]] = &[[34.1, 0.04], [13.5, 0.025]];
/// The largest `b`, from which the reach of all filters follows.
const WIDEST: f64 = 0.04;

/// A reference that images are compared with.
#[derive(Clone, Debug)]
pub struct Flip {
    size: [usize; 2],
    pixels_per_degree: f64,
    reference: Seen,
}

/// What a viewer makes of an image.
#[derive(Clone, Debug)]
struct Seen {
    /// Hunt-adjusted L\*a\*b\* after filtering.
    colours: Vec<Vec3>,
    /// Strength of edges and of points.
    edges: Vec<f32>,
    points: Vec<f32>,
}

impl Flip {
    /// For comparing with `reference`: linear RGB with the primaries of sRGB, forced into `[0, 1]`,
    /// row by row. `pixels_per_degree` is that of the display, positive.
    ///
    /// # Panics
    /// If there is not one value for each pixel.
    pub fn new(size: [u32; 2], reference: &[Vec3], pixels_per_degree: f64) -> Self {
        let size = size.map(|n| n as usize);
        let reference = Seen::new(size, reference, pixels_per_degree);
        Self { size, pixels_per_degree, reference }
    }

    /// The difference at each pixel, from 0, not seen, to 1.
    ///
    /// # Panics
    /// If `image` has not the size of the reference.
    pub fn differences(&self, image: &[Vec3]) -> Vec<f32> {
        let image = Seen::new(self.size, image, self.pixels_per_degree);
        let reference = &self.reference;
        // Section 4.1.3: no two colours differ more than green and blue.
        let most = distance(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(COLOUR_EXPONENT);
        let knee_at = KNEE_AT * most;
        let at = |pixel: usize| {
            let difference = distance(reference.colours[pixel], image.colours[pixel]);
            let difference = difference.powf(COLOUR_EXPONENT);
            let colour = if difference < knee_at {
                KNEE / knee_at * difference
            } else {
                KNEE + (1.0 - KNEE) * (difference - knee_at) / (most - knee_at)
            };
            let edges = (reference.edges[pixel] - image.edges[pixel]).abs();
            let points = (reference.points[pixel] - image.points[pixel]).abs();
            let feature = edges.max(points) * std::f32::consts::FRAC_1_SQRT_2;
            // Rounding must not leave [0, 1].
            colour.min(1.0).powf(1.0 - feature.powf(FEATURE_EXPONENT).min(1.0))
        };
        (0..image.colours.len()).into_par_iter().map(at).collect()
    }
}

impl Seen {
    fn new(size: [usize; 2], image: &[Vec3], pixels_per_degree: f64) -> Self {
        assert_eq!(image.len(), size[0] * size[1], "one colour for each pixel");
        let opponent: Vec<Vec3> = image.par_iter().map(|&rgb| opponent(clamped(rgb))).collect();
        let plane = |axis: usize| opponent.iter().map(|c| c[axis]).collect::<Vec<f32>>();
        let [achromatic, red_green, blue_yellow] = [0, 1, 2].map(plane);

        // Colours: filtered, back in the box of what the display can show, in a space of even
        // steps, dimmer ones less colourful.
        let filter = |plane: &[f32], terms| sensitivity(size, plane, terms, pixels_per_degree);
        let filtered = [
            filter(&achromatic, ACHROMATIC),
            filter(&red_green, RED_GREEN),
            filter(&blue_yellow, BLUE_YELLOW),
        ];
        let colour = |pixel: usize| {
            let [y, cx, cz] = [0, 1, 2].map(|axis: usize| filtered[axis][pixel]);
            hunt_lab(clamped(from_opponent(Vec3::new(y, cx, cz))))
        };
        let colours = (0..image.len()).into_par_iter().map(colour).collect();

        // Features: of the unfiltered lightness.
        let lightness: Vec<f32> = achromatic.iter().map(|y| (y + 16.0) / 116.0).collect();
        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let reach = (3.0 * deviation).ceil() as i32;
        let gauss = |x: f64| (-0.5 * x * x / (deviation * deviation)).exp();
        let smooth = normalised(kernel(reach, gauss));
        let slope = normalised(kernel(reach, |x| -x * gauss(x)));
        let bend =
            normalised(kernel(reach, |x| (x * x / (deviation * deviation) - 1.0) * gauss(x)));
        let strength = |kernel: &[f32]| {
            let right = separable(size, &lightness, [kernel, &smooth]);
            let down = separable(size, &lightness, [&smooth, kernel]);
            right.iter().zip(down).map(|(r, d)| r.hypot(d)).collect()
        };
        Self { colours, edges: strength(&slope), points: strength(&bend) }
    }
}

/// Section 4.1.1: a channel filtered by contrast sensitivity.
fn sensitivity(size: [usize; 2], plane: &[f32], terms: &[[f64; 2]], per_degree: f64) -> Vec<f32> {
    let reach = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * per_degree).ceil() as i32;
    let gauss = |b: f64| {
        let kernel = kernel(reach, |x| (-(PI * x / per_degree).powi(2) / b).exp());
        let sum = kernel.iter().sum::<f64>();
        (kernel, sum * sum)
    };
    let kernels: Vec<_> = terms.iter().map(|&[a, b]| (a * (PI / b).sqrt(), gauss(b))).collect();
    let whole: f64 = kernels.iter().map(|(weight, (_, sum))| weight * sum).sum();
    let mut filtered = vec![0.0; plane.len()];
    for (weight, (kernel, sum)) in kernels {
        let part = (weight * sum / whole) as f32;
        let kernel = normalised(kernel);
        for (to, from) in filtered.iter_mut().zip(separable(size, plane, [&kernel, &kernel])) {
            *to += part * from;
        }
    }
    filtered
}

fn kernel(reach: i32, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (-reach..=reach).map(|x| weight(f64::from(x))).collect()
}

/// Positive weights sum to 1, negative ones to -1.
fn normalised(kernel: Vec<f64>) -> Vec<f32> {
    let positive: f64 = kernel.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|w| **w < 0.0).sum::<f64>();
    kernel.iter().map(|&w| (w / if w < 0.0 { negative } else { positive }) as f32).collect()
}

/// A plane filtered along rows by the first kernel, along columns by the second. Beyond its edges it
/// goes on as at the edge.
fn separable([width, height]: [usize; 2], plane: &[f32], kernels: [&[f32]; 2]) -> Vec<f32> {
    let [reach_x, reach_y] = kernels.map(|kernel| kernel.len() / 2);
    let mut along_rows = vec![0.0; plane.len()];
    along_rows.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(width)).for_each(
        |(to, from)| {
            let mut padded = vec![from[0]; reach_x];
            padded.extend_from_slice(from);
            padded.resize(width + 2 * reach_x, from[width - 1]);
            for (offset, &weight) in kernels[0].iter().enumerate() {
                add_scaled(to, &padded[offset..], weight);
            }
        },
    );
    let mut filtered = vec![0.0; plane.len()];
    filtered.par_chunks_exact_mut(width).enumerate().for_each(|(y, to)| {
        for (offset, &weight) in kernels[1].iter().enumerate() {
            let row = (y + offset).saturating_sub(reach_y).min(height - 1);
            add_scaled(to, &along_rows[row * width..], weight);
        }
    });
    filtered
}

fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// In `[0, 1]`; NaN is 0.
fn clamped(rgb: Vec3) -> Vec3 {
    rgb.max(Vec3::ZERO).min(Vec3::ONE)
}

/// Linear sRGB to XYZ, the white D65 at 1: rows of the standard's matrix over their sums.
const TO_XYZ: [Vec3; 3] = [
    Vec3::new(0.412_386_56, 0.357_591_49, 0.180_450_49),
    Vec3::new(0.212_636_83, 0.715_183, 0.072_180_2),
    Vec3::new(0.019_330_62, 0.119_197_16, 0.950_372_6),
];
const TO_RGB: [Vec3; 3] = [
    Vec3::new(3.241_003_3, -1.537_398_9, -0.498_615_86),
    Vec3::new(-0.969_224_33, 1.875_930_1, 0.041_554_224),
    Vec3::new(0.055_639_423, -0.204_011_2, 1.057_148_9),
];

fn white() -> Vec3 {
    Vec3::from(TO_XYZ.map(|row| row.element_sum()))
}

fn transformed(matrix: [Vec3; 3], colour: Vec3) -> Vec3 {
    Vec3::from(matrix.map(|row| row.dot(colour)))
}

/// Linear sRGB to YCxCz.
fn opponent(rgb: Vec3) -> Vec3 {
    let [x, y, z] = (transformed(TO_XYZ, rgb) / white()).to_array();
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// YCxCz to linear sRGB.
fn from_opponent(colour: Vec3) -> Vec3 {
    let y = (colour.x + 16.0) / 116.0;
    let xyz = Vec3::new(y + colour.y / 500.0, y, y - colour.z / 200.0);
    transformed(TO_RGB, xyz * white())
}

/// Linear sRGB to L\*a\*b\*, a and b scaled by lightness (the Hunt effect, section 4.1.2).
fn hunt_lab(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |t: f32| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = (transformed(TO_XYZ, rgb) / white()).to_array().map(root);
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    Vec3::new(lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z))
}

/// HyAB: lightness by its difference, colour by its distance (Abasi, Tehran and Fairchild 2020).
fn distance(a: Vec3, b: Vec3) -> f32 {
    let delta = a - b;
    delta.x.abs() + delta.y.hypot(delta.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [40, 30];

    /// An 8-bit sRGB image, each code a function of the pixel, modulo 256.
    fn image(codes: impl Fn(i32, i32) -> [i32; 3]) -> Vec<Vec3> {
        let linear = |code: i32| {
            let s = code.rem_euclid(256) as f32 / 255.0;
            if s > 0.040_45 { ((s + 0.055) / 1.055).powf(2.4) } else { s / 12.92 }
        };
        let [width, height] = SIZE.map(|n| n as i32);
        let pixel = |i: i32| Vec3::from(codes(i % width, i / width).map(linear));
        (0..width * height).map(pixel).collect()
    }

    fn gray(code: impl Fn(i32, i32) -> i32) -> Vec<Vec3> {
        image(|x, y| [code(x, y); 3])
    }

    fn mean(values: &[f32]) -> f64 {
        values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
    }

    /// Means, and the values at pixels (20, 15) and (39, 29), that the authors' own program gives:
    /// `flip_evaluator` 1.7 for Python, which computes in 32 bits.
    #[test]
    fn values_are_those_of_the_authors_program() {
        let patch = |x, y| (10..20).contains(&x) && (8..16).contains(&y);
        let step = |at| gray(move |x, _| if x >= at { 200 } else { 50 });
        let noise = |a: i32, b: i32, c: i32| {
            image(move |x, y| [37 * x + 11 * y + a, 5 * x * y + b, x * x + 7 * y + c])
        };
        let lighter = |x, y| if patch(x, y) { 10 } else { 0 };
        let ramp = gray(|x, _| 6 * x);
        let dot = |x, y| if (x, y) == (20, 15) { 255 } else { 128 };
        type Case = (&'static str, Vec<Vec3>, Vec<Vec3>, f64, [f64; 3]);
        let cases: [Case; 10] = [
            (
                "noise",
                noise(0, 13, 0),
                noise(20, 3, 90),
                67.020_643,
                [0.405_723, 0.225_169, 0.486_158],
            ),
            ("noise", noise(0, 13, 0), noise(20, 3, 90), 30.0, [0.615_143, 0.635_648, 0.647_282]),
            (
                "patch",
                ramp.clone(),
                gray(|x, y| 6 * x + lighter(x, y)),
                67.020_643,
                [0.015_113, 0.068_030, 0.0],
            ),
            (
                "colours",
                ramp.clone(),
                image(|x, y| [6 * x + lighter(x, y), 6 * x, 3 * x]),
                67.020_643,
                [0.460_583, 0.476_768, 0.910_359],
            ),
            (
                "colours",
                ramp,
                image(|x, y| [6 * x + lighter(x, y), 6 * x, 3 * x]),
                30.0,
                [0.449_532, 0.466_973, 0.930_858],
            ),
            (
                "black, white",
                gray(|_, _| 0),
                gray(|_, _| 255),
                67.020_643,
                [0.967_397, 0.967_388, 0.967_388],
            ),
            (
                "green, blue",
                image(|_, _| [0, 255, 0]),
                image(|_, _| [0, 0, 255]),
                67.020_643,
                [1.0, 1.0, 1.0],
            ),
            ("step", step(20), step(21), 67.020_643, [0.055_851, 0.441_886, 0.0]),
            ("step", step(20), step(21), 30.0, [0.042_485, 0.824_861, 0.0]),
            ("dot", gray(|_, _| 128), gray(dot), 30.0, [0.002_094, 0.820_975, 0.0]),
        ];
        for (name, reference, test, per_degree, expected) in cases {
            let found = Flip::new(SIZE, &reference, per_degree).differences(&test);
            let values = [mean(&found), f64::from(found[15 * 40 + 20]), f64::from(found[1199])];
            for (value, expected) in values.into_iter().zip(expected) {
                assert!((value - expected).abs() < 5e-5, "{name}, {per_degree}: {values:?}");
            }
        }
    }

    #[test]
    fn equal_images_do_not_differ_and_order_does_not_matter() {
        let a = image(|x, y| [x * y, 3 * x + y, 200 - y]);
        let b = image(|x, y| [x * y + 9, 3 * x - y, 190 - y]);
        let per_degree = DEFAULT_PIXELS_PER_DEGREE;
        assert!((per_degree - 67.020_643).abs() < 1e-5);
        let (from_a, from_b) = (Flip::new(SIZE, &a, per_degree), Flip::new(SIZE, &b, per_degree));
        assert!(from_a.differences(&a).iter().all(|v| *v == 0.0));
        let (ab, ba) = (from_a.differences(&b), from_b.differences(&a));
        assert!(ab.iter().zip(&ba).all(|(x, y)| (x - y).abs() < 1e-6));
        assert!(ab.iter().all(|v| (0.0..=1.0).contains(v)) && mean(&ab) > 0.01);
    }

    /// Out of range is as the nearest that a display shows; tiny images have neighbours, too.
    #[test]
    fn any_values_and_sizes_will_do() {
        let odd = [Vec3::splat(f32::NAN), Vec3::splat(-3.0), Vec3::splat(f32::INFINITY)];
        let even = [Vec3::ZERO, Vec3::ZERO, Vec3::ONE];
        for size in [[3, 1], [1, 3]] {
            let differences = Flip::new(size, &even, 67.0).differences(&odd);
            assert!(differences.iter().all(|v| *v == 0.0), "{differences:?}");
        }
    }
}

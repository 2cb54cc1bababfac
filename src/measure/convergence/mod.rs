//! Error against samples and time, from repeated seeds: slopes, ratios at equal time and at equal
//! error, and how sure one can be of them.

mod bootstrap;
mod curve;

pub use bootstrap::{Bootstrap, Interval, Replicates};
pub use curve::{Curve, CurvePoint, Reading};

use super::Summary;

/// What was measured of one renderer: at each number of samples, one image a seed.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// Rising numbers of samples.
    pub points: Vec<RunPoint>,
}

/// The images of one number of samples.
#[derive(Clone, Debug)]
pub struct RunPoint {
    /// Samples in a pixel.
    pub samples: u32,
    /// Mean squared error of each seed's image.
    pub squared_error: Vec<f64>,
    /// What each took, in milliseconds; positive.
    pub ms: Vec<f64>,
}

impl Runs {
    /// The curve of some of the seeds, any of them any number of times: mean squared errors, median
    /// times.
    pub fn curve(&self, seeds: &[usize]) -> Curve {
        let point = |point: &RunPoint| {
            let ms: Vec<f64> = seeds.iter().map(|&s| point.ms[s]).collect();
            let sum: f64 = seeds.iter().map(|&s| point.squared_error[s]).sum();
            CurvePoint {
                samples: point.samples,
                squared_error: sum / seeds.len() as f64,
                ms: Summary::of(&ms).median,
            }
        };
        Curve { points: self.points.iter().map(point).collect() }
    }

    /// The curve of all seeds.
    pub fn whole(&self) -> Curve {
        let seeds = self.points.first().map_or(0, |p| p.ms.len());
        self.curve(&(0..seeds).collect::<Vec<_>>())
    }
}

/// Mean over `pixels` and channels of the variance among images of different seeds, each a list of
/// channels: the unbiased estimate, which knows no reference. `None` of fewer than two images.
#[derive(Clone, Debug, Default)]
pub struct Variance {
    images: usize,
    /// Mean, and the sum of squared distances from it, of each value.
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Variance {
    /// Adds an image (Welford 1962).
    ///
    /// # Panics
    /// If it has not the size of those before.
    pub fn add(&mut self, image: &[Vec<f32>], pixels: &[usize]) {
        let values = image.iter().flat_map(|channel| pixels.iter().map(|&p| f64::from(channel[p])));
        if self.images == 0 {
            self.mean = vec![0.0; pixels.len() * image.len()];
            self.squares = self.mean.clone();
        }
        assert_eq!(self.mean.len(), pixels.len() * image.len(), "images of one size");
        self.images += 1;
        let weight = 1.0 / self.images as f64;
        for ((value, mean), squares) in values.zip(&mut self.mean).zip(&mut self.squares) {
            let delta = value - *mean;
            *mean += weight * delta;
            *squares += delta * (value - *mean);
        }
    }

    /// The mean of each value: of one channel after the other, in each of its pixels in the order
    /// given.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The mean variance of one image.
    pub fn of_one(&self) -> Option<f64> {
        let values = self.squares.len().max(1);
        let sum: f64 = self.squares.iter().sum();
        (self.images > 1).then(|| sum / values as f64 / (self.images - 1) as f64)
    }

    /// The mean variance of the mean of all images.
    pub fn of_mean(&self) -> Option<f64> {
        self.of_one().map(|variance| variance / self.images as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_is_that_of_each_value() {
        let mut variance = Variance::default();
        assert_eq!(variance.of_one(), None);
        for value in [1.0f32, 2.0, 6.0] {
            variance.add(&[vec![value, 7.0, 99.0], vec![-value, 1.0, value]], &[0, 1]);
        }
        // 7 in 3 images about a mean of 3, in two of four values.
        assert_eq!(variance.of_one(), Some(0.5 * 7.0));
        assert_eq!(variance.of_mean(), Some(0.5 * 7.0 / 3.0));
    }

    #[test]
    fn curves_are_of_the_seeds_asked_for() {
        let point = |samples, errors: [f64; 3], ms: [f64; 3]| RunPoint {
            samples,
            squared_error: errors.into(),
            ms: ms.into(),
        };
        let runs = Runs { points: vec![point(1, [1.0, 2.0, 6.0], [5.0, 1.0, 2.0])] };
        let expected = |squared_error, ms| CurvePoint { samples: 1, squared_error, ms };
        assert_eq!(runs.whole().points, [expected(3.0, 2.0)]);
        assert_eq!(runs.curve(&[2, 2, 2, 0]).points, [expected(4.75, 2.0)]);
    }
}

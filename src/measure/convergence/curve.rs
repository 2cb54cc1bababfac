//! One renderer's error over samples and over time, read between its points.

/// A renderer's errors at rising numbers of samples. Between points it is straight where both axes
/// are logarithmic; it is never read beyond its ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// By rising number of samples.
    pub points: Vec<CurvePoint>,
}

/// One number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Samples in a pixel.
    pub samples: u32,
    /// Mean squared error.
    pub squared_error: f64,
    /// Time, in milliseconds.
    pub ms: f64,
}

/// What a curve says, or where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// The value there.
    Value(f64),
    /// The curve ends before: the value is this or less.
    AtMost(f64),
    /// The curve ends before: the value is this or more.
    AtLeast(f64),
}

impl Curve {
    /// How long it takes until the squared error is down to `squared_error`, in milliseconds; by the
    /// first such place. `None` of a curve without points.
    pub fn ms_at_error(&self, squared_error: f64) -> Option<Reading> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        if first.squared_error < squared_error {
            return Some(Reading::AtMost(first.ms));
        }
        let reaches = |p: &CurvePoint| p.squared_error <= squared_error;
        let Some(end) = self.points.iter().position(reaches) else {
            return Some(Reading::AtLeast(last.ms));
        };
        let to = self.points[end];
        let from = self.points[end.saturating_sub(1)];
        let ms = between([from.squared_error, to.squared_error], [from.ms, to.ms], squared_error);
        Some(Reading::Value(ms))
    }

    /// The squared error after `ms` milliseconds. `None` if no image is done by then.
    pub fn error_at_ms(&self, ms: f64) -> Option<Reading> {
        let last = self.points.last()?;
        // By the last place where the time goes past it: more samples never take less in truth.
        let from = self.points.iter().rposition(|p| p.ms <= ms)?;
        let from = self.points[from];
        let Some(to) = self.points.iter().find(|p| p.samples > from.samples) else {
            return Some(if ms > last.ms {
                Reading::AtMost(last.squared_error)
            } else {
                Reading::Value(last.squared_error)
            });
        };
        let error = between([from.ms, to.ms], [from.squared_error, to.squared_error], ms);
        Some(Reading::Value(error))
    }

    /// Samples for which an image should take `ms` milliseconds, rounded down: by straight lines
    /// between points, the last of which goes on to 16 times the samples, as nothing but a choice
    /// follows from it. `None` if no image is done by then.
    pub fn samples_for_ms(&self, ms: f64) -> Option<u32> {
        let from = self.points.iter().rposition(|p| p.ms <= ms)?;
        let Some(segment) = self.points.windows(2).nth(from.min(self.points.len().max(2) - 2))
        else {
            return Some(self.points[from].samples);
        };
        let [a, b] = [segment[0], segment[1]];
        let more = (ms - a.ms) / (b.ms - a.ms) * f64::from(b.samples - a.samples);
        let most = 16.0 * f64::from(b.samples);
        Some((f64::from(a.samples) + more.max(0.0)).min(most) as u32)
    }

    /// Slope of the logarithm of the root mean squared error over that of the samples: -1/2 of
    /// independent samples. By least squares over all points with an error; `None` of fewer than
    /// two.
    pub fn slope(&self) -> Option<f64> {
        let logs: Vec<[f64; 2]> = self
            .points
            .iter()
            .filter(|p| p.squared_error > 0.0)
            .map(|p| [f64::from(p.samples).ln(), 0.5 * p.squared_error.ln()])
            .collect();
        if logs.len() < 2 {
            return None;
        }
        let mean = |axis: usize| logs.iter().map(|l| l[axis]).sum::<f64>() / logs.len() as f64;
        let (x, y) = (mean(0), mean(1));
        let covariance: f64 = logs.iter().map(|l| (l[0] - x) * (l[1] - y)).sum();
        let variance: f64 = logs.iter().map(|l| (l[0] - x).powi(2)).sum();
        Some(covariance / variance)
    }
}

/// Where `x` lies from one of `xs` to the other, the same way between `ys`, all as logarithms. What
/// vanishes has none: then nothing is gained before the second.
fn between(xs: [f64; 2], ys: [f64; 2], x: f64) -> f64 {
    let [[x0, x1], [y0, y1]] = [xs, ys].map(|v| v.map(f64::ln));
    let part = (x.ln() - x0) / (x1 - x0);
    if xs[1] <= 0.0 || part.is_nan() || part >= 1.0 {
        ys[1]
    } else if ys[1] <= 0.0 || part <= 0.0 {
        ys[0]
    } else {
        (y0 + part * (y1 - y0)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(u32, f64, f64)]) -> Curve {
        let point = |&(samples, squared_error, ms): &_| CurvePoint { samples, squared_error, ms };
        Curve { points: points.iter().map(point).collect() }
    }

    fn value(reading: Option<Reading>) -> f64 {
        match reading {
            Some(Reading::Value(value)) => value,
            other => panic!("{other:?}"),
        }
    }

    /// A power law is read exactly between its points, and its slope is found.
    #[test]
    fn power_laws_are_straight() {
        let law = |n: f64| (n as u32, 8.0 * n.powf(-1.5), 3.0 * n.powf(1.25));
        let curve = curve(&[1.0, 2.0, 4.0, 8.0, 16.0].map(law));
        for n in [1.0, 1.5, 5.0, 16.0f64] {
            let (_, error, ms) = law(n);
            assert!((value(curve.ms_at_error(error)) / ms - 1.0).abs() < 1e-9, "{n}");
            assert!((value(curve.error_at_ms(ms)) / error - 1.0).abs() < 1e-9, "{n}");
        }
        assert!((curve.slope().unwrap() + 0.75).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_read_beyond_the_ends() {
        let curve = curve(&[(1, 4.0, 10.0), (2, 1.0, 30.0)]);
        assert_eq!(curve.ms_at_error(5.0), Some(Reading::AtMost(10.0)));
        assert_eq!(curve.ms_at_error(0.5), Some(Reading::AtLeast(30.0)));
        assert_eq!(curve.ms_at_error(4.0), Some(Reading::Value(10.0)));
        assert_eq!(curve.error_at_ms(9.0), None);
        assert_eq!(curve.error_at_ms(30.0), Some(Reading::Value(1.0)));
        assert_eq!(curve.error_at_ms(40.0), Some(Reading::AtMost(1.0)));
        let samples = [5.0, 10.0, 29.0, 30.0, 50.0, 1e9].map(|ms| curve.samples_for_ms(ms));
        assert_eq!(samples, [None, Some(1), Some(1), Some(2), Some(3), Some(32)]);
        assert_eq!(Curve::default().ms_at_error(1.0), None);
    }

    /// Noise may turn a curve round; errors may vanish.
    #[test]
    fn crooked_curves_have_an_answer() {
        let crooked = curve(&[(1, 4.0, 10.0), (2, 5.0, 9.0), (4, 1.0, 20.0), (8, 0.0, 40.0)]);
        assert!((9.0..20.0).contains(&value(crooked.ms_at_error(2.0))));
        assert_eq!(value(crooked.ms_at_error(0.5)), 40.0);
        assert_eq!(value(crooked.ms_at_error(0.0)), 40.0);
        assert!((1.0..5.0).contains(&value(crooked.error_at_ms(10.0))));
        let perfect = curve(&[(1, 0.0, 1.0), (2, 0.0, 2.0)]);
        assert_eq!(perfect.slope(), None);
        assert_eq!(perfect.ms_at_error(1e-9), Some(Reading::AtMost(1.0)));
        assert_eq!(value(perfect.error_at_ms(1.5)), 0.0);
    }
}

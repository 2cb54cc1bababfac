//! How much better one renderer is than another: at the same samples, in the same time, to the same
//! error.

use super::trial::Measured;
use crate::measure::convergence::{Bootstrap, Curve, Interval, Reading, Replicates};
use crate::measure::{Summary, geometric_mean};
use serde::Serialize;

/// Whether a ratio is as measured, or the curves do not reach as far as the question.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bound {
    /// As measured.
    #[default]
    Measured,
    /// At its fewest samples the renderer is already better: the ratio is at least this.
    AtLeast,
    /// At its most samples it is not yet as good: the ratio is at most this.
    AtMost,
}

impl Bound {
    /// Before a number.
    pub(super) fn sign(self) -> &'static str {
        match self {
            Self::Measured => "",
            Self::AtLeast => ">=",
            Self::AtMost => "<=",
        }
    }
}

/// One ratio, above 1 where the renderer is better than the one it is held against.
#[derive(Clone, Debug)]
pub(super) struct Ratio {
    pub(super) replicates: Replicates,
    pub(super) bound: Bound,
}

impl Ratio {
    pub(super) fn interval(&self) -> Option<Interval> {
        self.replicates.interval()
    }
}

/// Ratios of a renderer to an earlier one, the other.
#[derive(Clone, Debug)]
pub(super) struct Ratios {
    /// Samples of the images whose times are compared.
    pub(super) samples: u32,
    /// Time of whole images with these samples, seed by seed.
    pub(super) same_samples: Ratio,
    /// The same of the time in shadow rays.
    pub(super) same_samples_tracing: f64,
    /// Squared errors in the same time.
    pub(super) equal_time: Ratio,
    /// Times to the same error.
    pub(super) equal_error: Ratio,
}

/// A renderer held against an earlier one.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// Index of the earlier one.
    pub(super) other: usize,
    /// Index of the renderer.
    pub(super) own: usize,
    /// In the time, and to the error, of the other's images of each number of samples.
    pub(super) by_samples: Vec<Ratios>,
    /// At most samples; in the longest time that both were given, to the smallest error that both
    /// come down to.
    pub(super) at_end: Ratios,
}

/// How a ratio is read from the other's curve and the renderer's own.
type Read<'a> = &'a dyn Fn(&Curve, &Curve) -> Option<(f64, Bound)>;

impl Pair {
    /// From all that was measured.
    pub(super) fn new([other, own]: [usize; 2], all: &[Measured], bootstrap: &Bootstrap) -> Self {
        let [there, here] = [other, own].map(|which| &all[which]);
        let [other_runs, own_runs] = [there, here].map(Measured::runs);
        let ratio = |read: Read<'_>| {
            let value = |seeds: &[usize]| {
                read(&other_runs.curve(seeds), &own_runs.curve(seeds)).map(|(value, _)| value)
            };
            let whole = read(&other_runs.whole(), &own_runs.whole());
            Ratio {
                replicates: bootstrap.values(value),
                bound: whole.map_or(Bound::default(), |(_, bound)| bound),
            }
        };
        let at = |index: usize, equal_time: Read<'_>, equal_error: Read<'_>| {
            let points = [there, here].map(|measured| &measured.points[index]);
            let [their_ms, our_ms] = points.map(|p| p.each(|i| i.stats.total_ms));
            let [their_tracing, our_tracing] = points.map(|p| p.each(|i| i.stats.shadow_ms));
            let all: Vec<usize> = (0..their_ms.len()).collect();
            let quotient = |seeds: &[usize]| Some(median_quotient(&their_ms, &our_ms, seeds));
            Ratios {
                samples: points[0].samples,
                same_samples: Ratio {
                    replicates: bootstrap.values(quotient),
                    bound: Bound::Measured,
                },
                same_samples_tracing: median_quotient(&their_tracing, &our_tracing, &all),
                equal_time: ratio(equal_time),
                equal_error: ratio(equal_error),
            }
        };
        let by_samples = |index: usize| {
            at(index, &|other, own| errors_at(other, own, other.points[index].ms), &|other, own| {
                times_to(other, own, other.points[index].squared_error)
            })
        };
        let count = there.points.len();
        let at_end = at(
            count - 1,
            &|other, own| {
                let ends = [other, own].map(|curve| curve.points[count - 1].ms);
                errors_at(other, own, ends[0].min(ends[1]))
            },
            &|other, own| {
                let ends = [other, own].map(|curve| curve.points[count - 1].squared_error);
                times_to(other, own, ends[0].max(ends[1]))
            },
        );
        Self { other, own, by_samples: (0..count).map(by_samples).collect(), at_end }
    }
}

/// Medians of the quotients, seed by seed.
fn median_quotient(a: &[f64], b: &[f64], seeds: &[usize]) -> f64 {
    let quotients: Vec<f64> = seeds.iter().map(|&s| a[s] / b[s]).collect();
    Summary::of(&quotients).median
}

/// The other's squared error over the own after `ms` milliseconds. None where either vanishes, and if
/// one has no image by then.
fn errors_at(other: &Curve, own: &Curve, ms: f64) -> Option<(f64, Bound)> {
    quotient(other.error_at_ms(ms)?, own.error_at_ms(ms)?)
}

/// The other's time over the own to an error. None to none.
fn times_to(other: &Curve, own: &Curve, squared_error: f64) -> Option<(f64, Bound)> {
    if squared_error <= 0.0 {
        return None;
    }
    quotient(other.ms_at_error(squared_error)?, own.ms_at_error(squared_error)?)
}

/// One reading over another, if that says anything.
fn quotient(above: Reading, below: Reading) -> Option<(f64, Bound)> {
    let (a, b, bound) = match (above, below) {
        (Reading::Value(a), Reading::Value(b)) => (a, b, Bound::Measured),
        (Reading::Value(a) | Reading::AtLeast(a), Reading::AtMost(b))
        | (Reading::AtLeast(a), Reading::Value(b)) => (a, b, Bound::AtLeast),
        (Reading::Value(a) | Reading::AtMost(a), Reading::AtLeast(b))
        | (Reading::AtMost(a), Reading::Value(b)) => (a, b, Bound::AtMost),
        (Reading::AtMost(_), Reading::AtMost(_)) | (Reading::AtLeast(_), Reading::AtLeast(_)) => {
            return None;
        }
    };
    (a > 0.0 && b > 0.0).then(|| (a / b, bound))
}

/// Ratios over several scenes and passes.
#[derive(Clone, Debug, Serialize)]
pub struct MeanRatio {
    /// Geometric mean, draw by draw.
    #[serde(flatten)]
    pub ratio: Interval,
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
    /// How many scenes and passes have such a ratio.
    pub count: usize,
    /// For how many of them it is a lower or an upper bound.
    pub bounds: usize,
    /// What that makes of the mean.
    pub bound: Bound,
}

impl MeanRatio {
    /// `None` if none has a value.
    pub(super) fn of(all: &[&Ratio]) -> Option<Self> {
        let replicates: Vec<&Replicates> = all.iter().map(|r| &r.replicates).collect();
        let ratio = Replicates::geometric_mean(&replicates)?.interval()?;
        let with_value: Vec<(f64, Bound)> =
            all.iter().filter_map(|r| Some((r.interval()?.value, r.bound))).collect();
        let values = || with_value.iter().map(|v| v.0);
        let has = |bound| with_value.iter().any(|v| v.1 == bound);
        Some(Self {
            ratio,
            least: values().fold(f64::INFINITY, f64::min),
            most: values().fold(0.0, f64::max),
            count: with_value.len(),
            bounds: with_value.iter().filter(|v| v.1 != Bound::Measured).count(),
            // Bounds of both kinds make a mean that is neither.
            bound: match (has(Bound::AtLeast), has(Bound::AtMost)) {
                (true, false) => Bound::AtLeast,
                (false, true) => Bound::AtMost,
                _ => Bound::Measured,
            },
        })
    }
}

/// A renderer against an earlier one, over all scenes and passes.
#[derive(Clone, Debug, Serialize)]
pub struct MeanReport {
    /// The renderer.
    pub renderer: String,
    /// The earlier one.
    pub against: String,
    /// Time of whole images with the same samples, the most.
    pub same_samples: Option<MeanRatio>,
    /// The same of the time in shadow rays alone.
    pub same_samples_tracing: Option<f64>,
    /// Squared errors in the longest time that both were given.
    pub equal_time: Option<MeanRatio>,
    /// Times to the smallest error that both come down to.
    pub equal_error: Option<MeanRatio>,
}

impl MeanReport {
    /// Of one pair's ratios in all scenes and passes.
    pub(super) fn new(renderer: &str, against: &str, all: &[&Ratios]) -> Self {
        let mean = |part: fn(&Ratios) -> &Ratio| {
            MeanRatio::of(&all.iter().map(|r| part(r)).collect::<Vec<_>>())
        };
        Self {
            renderer: renderer.into(),
            against: against.into(),
            same_samples: mean(|r| &r.same_samples),
            same_samples_tracing: geometric_mean(all.iter().map(|r| r.same_samples_tracing)),
            equal_time: mean(|r| &r.equal_time),
            equal_error: mean(|r| &r.equal_error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::convergence::CurvePoint;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let point = |(index, &(squared_error, ms)): (usize, &(f64, f64))| CurvePoint {
            samples: 1 << index,
            squared_error,
            ms,
        };
        Curve { points: points.iter().enumerate().map(point).collect() }
    }

    /// Twice as fast with half the squared error at each number of samples: known ratios.
    #[test]
    fn ratios_are_those_of_the_curves() {
        let other = curve(&[(8.0, 2.0), (4.0, 4.0), (2.0, 8.0)]);
        let own = curve(&[(4.0, 1.0), (2.0, 2.0), (1.0, 4.0)]);
        let is = |found: Option<(f64, Bound)>, value: f64, bound: Bound| {
            let (ratio, found) = found.unwrap();
            assert!((ratio - value).abs() < 1e-12 && found == bound, "{ratio} {found:?}");
        };
        is(errors_at(&other, &own, 4.0), 4.0, Bound::Measured);
        is(errors_at(&other, &own, 8.0), 2.0, Bound::AtLeast);
        is(times_to(&other, &own, 2.0), 4.0, Bound::Measured);
        is(times_to(&other, &own, 8.0), 2.0, Bound::AtLeast);
        is(times_to(&own, &other, 1.0), 0.5, Bound::AtMost);
        assert!(errors_at(&other, &own, 1.5).is_none());
        assert!(times_to(&other, &own, 0.0).is_none() && times_to(&other, &own, 0.5).is_none());
    }
}

//! Confidence intervals from repeated seeds.

use serde::Serialize;

/// An estimate with the interval that holds the truth with a confidence of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// From all seeds.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Draws of as many seeds as there are, with replacement, that all statistics share: what is
/// measured with one seed stays together (Efron, "Bootstrap Methods: Another Look at the Jackknife",
/// Annals of Statistics 7(1), 1979; intervals by percentiles).
#[derive(Clone, Debug)]
pub struct Bootstrap {
    seeds: usize,
    draws: Vec<Vec<usize>>,
}

impl Bootstrap {
    /// Number of draws: the ends of an interval have 25 of them beyond.
    const DRAWS: usize = 1000;

    /// Draws among `seeds` seeds, at least one; `stream` numbers independent draws.
    pub fn new(seeds: usize, stream: u64) -> Self {
        let mut state = stream.wrapping_mul(0x9e6c_63d0_876a_9a47);
        let mut word = || {
            // SplitMix64.
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let mut draw = || (0..seeds).map(|_| (word() % seeds as u64) as usize).collect();
        Self { seeds, draws: (0..Self::DRAWS).map(|_| draw()).collect() }
    }

    /// A statistic of all seeds and of each draw; NaN where it has no value.
    pub fn values(&self, statistic: impl Fn(&[usize]) -> Option<f64>) -> Replicates {
        let all: Vec<usize> = (0..self.seeds).collect();
        let value = |seeds: &[usize]| statistic(seeds).unwrap_or(f64::NAN);
        Replicates { value: value(&all), draws: self.draws.iter().map(|d| value(d)).collect() }
    }
}

/// A statistic of all seeds, and of each draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Replicates {
    value: f64,
    draws: Vec<f64>,
}

impl Replicates {
    /// The interval; `None` if the statistic has no value. One seed makes an interval without
    /// width, which says nothing.
    pub fn interval(&self) -> Option<Interval> {
        if !self.value.is_finite() {
            return None;
        }
        let mut sorted: Vec<f64> = self.draws.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |part: f64| {
            let rank = (part * sorted.len() as f64) as usize;
            sorted.get(rank.min(sorted.len().saturating_sub(1))).copied().unwrap_or(self.value)
        };
        // The estimate itself belongs to what is believed.
        let [low, high] = [at(0.025).min(self.value), at(0.975).max(self.value)];
        Some(Interval { value: self.value, low, high })
    }

    /// The geometric mean of several statistics, draw by draw, of those with a positive value;
    /// `None` if there is none.
    pub fn geometric_mean(all: &[&Self]) -> Option<Self> {
        let with_value: Vec<&&Self> =
            all.iter().filter(|r| r.value.is_finite() && r.value > 0.0).collect();
        if with_value.is_empty() {
            return None;
        }
        let mean = |of: &dyn Fn(&Self) -> f64| {
            let sum: f64 = with_value.iter().map(|r| of(r).ln()).sum();
            (sum / with_value.len() as f64).exp()
        };
        let draws = (0..Bootstrap::DRAWS).map(|draw| mean(&|r: &Self| r.draws[draw])).collect();
        Some(Self { value: mean(&|r: &Self| r.value), draws })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::convergence::{RunPoint, Runs};
    use crate::test_random::Random;

    /// Intervals for the ratio of two noisy means hold the true ratio about as often as they say.
    #[test]
    fn intervals_hold_a_known_ratio() {
        let mut random = Random::new(0xb007);
        let (seeds, trials) = (16, 400);
        let mut held = 0;
        for trial in 0..trials {
            // Uniform about 3 and 2, so the ratio of the means is 1.5.
            let mut noisy = |mean: f64| -> Vec<f64> {
                (0..seeds).map(|_| mean * (0.5 + f64::from(random.unit()))).collect()
            };
            let (a, b) = (noisy(3.0), noisy(2.0));
            let mean = |v: &[f64], s: &[usize]| s.iter().map(|&i| v[i]).sum::<f64>();
            let values =
                Bootstrap::new(seeds, trial).values(|draw| Some(mean(&a, draw) / mean(&b, draw)));
            let interval = values.interval().unwrap();
            assert!(interval.low <= interval.value && interval.value <= interval.high);
            held += u32::from(interval.low <= 1.5 && 1.5 <= interval.high);
        }
        // Of 16 seeds, percentiles are a little narrow: 92 to 93 % is known of them.
        let share = f64::from(held) / trials as f64;
        assert!((0.88..0.98).contains(&share), "{share}");
    }

    /// The error of means of independent samples falls as their root; the fit says so, within its
    /// interval.
    #[test]
    fn slope_of_independent_samples() {
        let mut random = Random::new(0x510e);
        let (seeds, pixels) = (8, 300);
        let mut image = |samples: u32| {
            let mut one = || {
                let sum: f64 = (0..samples).map(|_| f64::from(random.unit()) - 0.5).sum();
                (sum / f64::from(samples)).powi(2)
            };
            (0..pixels).map(|_| one()).sum::<f64>() / f64::from(pixels)
        };
        let mut point = |samples| RunPoint {
            samples,
            squared_error: (0..seeds).map(|_| image(samples)).collect(),
            ms: vec![1.0; seeds],
        };
        let runs = Runs { points: [1, 2, 4, 8, 16, 32].map(&mut point).into() };
        let slope = Bootstrap::new(seeds, 1).values(|s| runs.curve(s).slope()).interval().unwrap();
        assert!((slope.value + 0.5).abs() < 0.03, "{slope:?}");
        assert!(
            slope.low < -0.49 && slope.high > -0.51 && slope.high - slope.low < 0.1,
            "{slope:?}"
        );
    }

    #[test]
    fn geometric_means_leave_out_what_has_no_value() {
        let bootstrap = Bootstrap::new(4, 3);
        let [two, eight] = [2.0, 8.0].map(|v| bootstrap.values(|_| Some(v)));
        let none = bootstrap.values(|_| None);
        assert_eq!(none.interval(), None);
        let mean = Replicates::geometric_mean(&[&two, &none, &eight]).unwrap();
        let interval = mean.interval().unwrap();
        for value in [interval.value, interval.low, interval.high] {
            assert!((value - 4.0).abs() < 1e-12, "{interval:?}");
        }
        assert_eq!(Replicates::geometric_mean(&[&none]), None);
    }
}

//! Rounds, medians and ratios.

use serde::Serialize;

/// Median with extremes, of one figure over rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Middle value; the mean of the middle two for an even number of rounds.
    pub median: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Summary {
    /// Of at least one value.
    ///
    /// # Panics
    /// If there is none.
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let median = if sorted.len().is_multiple_of(2) {
            0.5 * (sorted[middle - 1] + sorted[middle])
        } else {
            sorted[middle]
        };
        Self { median, min: sorted[0], max: sorted[sorted.len() - 1] }
    }
}

/// Times all contenders once in each round, after a warm-up round that does not count. Who comes after
/// whom changes from round to round, as everyone finds the caches as the one before left them. The
/// result has a row of `rounds` times for each contender, in milliseconds.
pub fn interleaved(
    contenders: usize,
    rounds: usize,
    mut run_ms: impl FnMut(usize) -> f64,
) -> Vec<Vec<f64>> {
    let mut times = vec![Vec::with_capacity(rounds); contenders];
    for round in 0..=rounds {
        for contender in turns(contenders, round) {
            let ms = run_ms(contender);
            if round > 0 {
                times[contender].push(ms);
            }
        }
    }
    times
}

/// The order of a round: all contenders, in steps that have no divisor in common with their number.
fn turns(contenders: usize, round: usize) -> impl Iterator<Item = usize> {
    let divides_both =
        |step: usize, by: usize| step.is_multiple_of(by) && contenders.is_multiple_of(by);
    let reaches_all = |step: &usize| (2..=*step).all(|by| !divides_both(*step, by));
    let steps: Vec<usize> = (1..contenders.max(2)).filter(reaches_all).collect();
    let step = steps[round % steps.len()];
    (0..contenders).map(move |place| (round + place * step) % contenders)
}

/// How many times faster `other` is than `first`, round by round: the machine's drift cancels.
pub fn ratios(first: &[f64], other: &[f64]) -> Summary {
    let ratios: Vec<f64> = first.iter().zip(other).map(|(a, b)| a / b).collect();
    Summary::of(&ratios)
}

/// The geometric mean of the positive values among these; `None` if there is none.
pub fn geometric_mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values
        .into_iter()
        .filter(|v| *v > 0.0 && v.is_finite())
        .fold((0.0, 0u32), |(sum, count), v| (sum + v.ln(), count + 1));
    (count > 0).then(|| (sum / f64::from(count)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometric_means() {
        assert!((geometric_mean([1.0, 4.0, f64::NAN, 0.0]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(geometric_mean([f64::NAN]), None);
    }

    #[test]
    fn medians() {
        let summary = Summary::of(&[3.0, 1.0, 2.0]);
        assert_eq!((summary.median, summary.min, summary.max), (2.0, 1.0, 3.0));
        assert!((Summary::of(&[1.0, 2.0, 4.0, 9.0]).median - 3.0).abs() < 1e-12);
    }

    #[test]
    fn rounds_are_interleaved_and_the_first_does_not_count() {
        let mut calls = Vec::new();
        let times = interleaved(2, 3, |contender| {
            calls.push(contender);
            calls.len() as f64
        });
        assert_eq!(calls, [0, 1, 1, 0, 0, 1, 1, 0]);
        assert_eq!(times, [[4.0, 5.0, 8.0], [3.0, 6.0, 7.0]]);
        assert!((ratios(&times[0], &times[1]).median - 8.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn everyone_has_a_turn_in_each_round_and_others_before() {
        for contenders in 0..20 {
            let mut before = vec![std::collections::HashSet::new(); contenders];
            for round in 0..12 {
                let order: Vec<usize> = turns(contenders, round).collect();
                order.windows(2).for_each(|pair| {
                    before[pair[1]].insert(pair[0]);
                });
                let mut sorted = order.clone();
                sorted.sort_unstable();
                assert!(sorted.into_iter().eq(0..contenders), "{order:?}");
            }
            let least = [0, 0, 1, 2, 2].get(contenders).copied().unwrap_or(2);
            assert!(before.iter().all(|others| others.len() >= least), "{contenders}: {before:?}");
        }
    }
}

//! Who is right where backends differ, and whether they are where they agree.

use super::judge::{WrongAnswers, verdicts};
use super::{Outcome, Performance};
use crate::arbiter::Arbiter;
use crate::ray_set::RaySet;

/// What the arbiter says of the answers to one class of rays.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Rays that backends disagree on: all were judged.
    pub disputed: Vec<usize>,
    /// Rays that all backends agree on and that were judged.
    pub sampled: usize,
    /// Those of them that all are wrong on.
    pub shared_errors: Vec<usize>,
    /// Wrong answers of each contender to disputed rays.
    pub wrong: Vec<WrongAnswers>,
    /// Wrong answers to sampled rays, the same for each.
    pub wrong_in_sample: WrongAnswers,
}

/// Judges every ray in dispute, and `sample` of the others or so, chosen by `seed`.
pub fn judge(
    arbiter: &Arbiter<'_>,
    set: &RaySet,
    outcome: &Outcome,
    sample: usize,
    seed: u64,
) -> Judgement {
    let mut disputed: Vec<usize> =
        outcome.agreement.iter().flat_map(|a| a.differing.iter().copied()).collect();
    disputed.sort_unstable();
    disputed.dedup();
    let mut agreed = chosen(set.len(), sample, seed);
    agreed.retain(|ray| disputed.binary_search(ray).is_err());

    let truth = verdicts(arbiter, set, &disputed);
    let wrong = outcome.performances.iter().map(|performance| {
        let mut wrong = WrongAnswers::default();
        for (ray, answer) in answers_to(performance, set, &disputed) {
            let verdict = &truth[&ray];
            if verdict.occluded != answer {
                wrong.count(verdict.occluded);
                wrong.explain(verdict);
            }
        }
        wrong
    });
    let wrong = wrong.collect();
    let mut wrong_in_sample = WrongAnswers::default();
    let mut shared_errors = Vec::new();
    if let Some(performance) = outcome.performances.first() {
        let truth = verdicts(arbiter, set, &agreed);
        for (ray, answer) in answers_to(performance, set, &agreed) {
            let verdict = &truth[&ray];
            if verdict.occluded != answer {
                shared_errors.push(ray);
                wrong_in_sample.count(verdict.occluded);
                wrong_in_sample.explain(verdict);
            }
        }
    }
    Judgement { disputed, sampled: agreed.len(), shared_errors, wrong, wrong_in_sample }
}

/// The answers of a contender to some rays, rising.
fn answers_to<'a>(
    performance: &'a Performance,
    set: &'a RaySet,
    rays: &'a [usize],
) -> impl Iterator<Item = (usize, bool)> + 'a {
    let mut wanted = rays.iter().copied().peekable();
    let all = set.each_answer(&performance.answers).enumerate();
    all.filter(move |(ray, _)| wanted.next_if_eq(ray).is_some())
}

/// About `count` of `rays`, rising: one from each of as many equal parts, at random.
fn chosen(rays: usize, count: usize, seed: u64) -> Vec<usize> {
    if count >= rays {
        return (0..rays).collect();
    }
    let mut state = seed;
    let mut word = || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let start = |part: usize| (part as u128 * rays as u128 / count as u128) as usize;
    (0..count)
        .map(|part| start(part) + (word() % (start(part + 1) - start(part)) as u64) as usize)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::agreement;
    use crate::ray::set_bit;
    use crate::test_random::Random;

    #[test]
    fn samples_are_rising_and_within() {
        for (rays, count) in [(0, 5), (5, 5), (7, 3), (1_000_000, 2000)] {
            let sample = chosen(rays, count, 3);
            assert_eq!(sample.len(), count.min(rays));
            assert!(sample.is_sorted_by(|a, b| a < b) && sample.iter().all(|r| *r < rays));
        }
        assert_ne!(chosen(1000, 10, 1), chosen(1000, 10, 2));
    }

    /// Answers that are made wrong on purpose are found, and given to who gave them.
    #[test]
    fn wrong_answers_are_found_and_attributed() {
        let mut random = Random::new(0xd15);
        let mesh = random.mesh(300);
        let tree = (crate::build::find("binned").unwrap().build)(&mesh, crate::build::Leaves::Fit);
        let arbiter = Arbiter::new(&tree);
        let mut set = RaySet::default();
        let rays: Vec<_> = (0..1000).map(|_| random.ray()).collect();
        rays.chunks(100).for_each(|rays| set.push_batch(rays));
        let right = super::super::true_answers(&arbiter, &set);
        let each: Vec<bool> = set.each_answer(&right).collect();
        let flipped = |flip: &dyn Fn(usize) -> bool| {
            let mut answers = set.no_answers();
            let mut index = 0;
            for (batch, words) in set.batches_with(&mut answers) {
                for i in 0..batch.rays.len() {
                    set_bit(words, i, each[index] != flip(index));
                    index += 1;
                }
            }
            answers
        };
        let shared = |ray: usize| ray.is_multiple_of(50);
        let all = vec![flipped(&shared), flipped(&|ray| shared(ray) || ray % 7 == 1)];
        let performance = |answers: &Vec<u64>| Performance {
            answers: answers.clone(),
            trace_ms: super::super::Summary::of(&[1.0]),
            ratio_to_first: super::super::Summary::of(&[1.0]),
            occluded: 0,
            visits: None,
            counts: None,
        };
        let outcome = Outcome {
            performances: all.iter().map(performance).collect(),
            agreement: agreement(&set, &all),
        };
        let judgement = judge(&arbiter, &set, &outcome, 1000, 0);
        let disputed: Vec<_> = (0..1000).filter(|r| r % 7 == 1 && r % 50 != 0).collect();
        assert_eq!(judgement.disputed, disputed);
        assert_eq!(judgement.wrong[0], WrongAnswers::default());
        let missed = disputed.iter().filter(|&&r| each[r]).count() as u64;
        let wrong = &judgement.wrong[1];
        assert_eq!((wrong.missed_hits, wrong.total()), (missed, disputed.len() as u64));
        let by_reason: u64 = wrong.reasons.iter().map(|r| r.false_hits + r.missed_hits).sum();
        assert_eq!(by_reason, wrong.total());
        assert_eq!(judgement.shared_errors, (0..1000).step_by(50).collect::<Vec<_>>());
        assert_eq!(judgement.sampled, 1000 - disputed.len());
    }
}

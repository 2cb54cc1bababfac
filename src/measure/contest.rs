//! Several backends on the same rays: times, counts and agreement of one class.

use super::{Agreement, Summary, agreement, count, interleaved, ratios, trace};
use crate::backend::Accelerator;
use crate::ray::VisitCounts;
use crate::ray_set::{RaySet, occluded_count};

/// What one contender did with a class of rays.
#[derive(Clone, Debug)]
pub struct Performance {
    /// Its answers.
    pub answers: Vec<u64>,
    /// Time to answer all rays, in milliseconds.
    pub trace_ms: Summary,
    /// How many times faster than the first contender, round by round.
    pub ratio_to_first: Summary,
    /// Rays that it calls occluded.
    pub occluded: usize,
    /// What its rays visit on average, if it was asked to count and can.
    pub visits: Option<Visits>,
    /// What each of its rays visits, likewise.
    pub counts: Option<Vec<VisitCounts>>,
}

/// Means over rays of one class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visits {
    /// Nodes per ray.
    pub nodes_per_ray: f64,
    /// Nodes per occluded ray; `None` if there is none.
    pub nodes_per_occluded_ray: Option<f64>,
    /// Nodes per unoccluded ray; `None` if there is none.
    pub nodes_per_unoccluded_ray: Option<f64>,
    /// Triangle tests per ray.
    pub triangles_per_ray: f64,
    /// Of a million rays, tests that `f32` left in doubt and `f64` settled; 0 but in exact mode.
    pub double_tests_per_million: f64,
    /// Of a million rays, tests that integers settled, likewise.
    pub exact_tests_per_million: f64,
}

/// The outcome for one class of rays.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One for each contender.
    pub performances: Vec<Performance>,
    /// One for each pair of contenders.
    pub agreement: Vec<Agreement>,
}

/// Gives the rays of `set` to all contenders: `rounds` timed rounds in turn after a warm-up, then a
/// counting run where `count_visits` asks for it. Runs on the current rayon pool; `progress` is
/// told after each step, of which there are [`steps`].
pub fn contest(
    contenders: &[&dyn Accelerator],
    set: &RaySet,
    rounds: usize,
    count_visits: bool,
    progress: &dyn Fn(),
) -> Outcome {
    let mut answers = vec![set.no_answers(); contenders.len()];
    let times = interleaved(contenders.len(), rounds, |i| {
        let ms = trace(contenders[i], set, &mut answers[i]);
        progress();
        ms
    });
    let agreement = agreement(set, &answers);
    let performances = answers
        .into_iter()
        .zip(contenders)
        .zip(&times)
        .map(|((answers, contender), ms)| {
            let counts = if count_visits { count(*contender, set) } else { None };
            progress();
            Performance {
                trace_ms: Summary::of(ms),
                ratio_to_first: ratios(&times[0], ms),
                occluded: occluded_count(&answers),
                visits: counts.as_ref().map(|counts| visits(set, &answers, counts)),
                counts,
                answers,
            }
        })
        .collect();
    Outcome { performances, agreement }
}

/// Steps that [`contest`] reports.
pub fn steps(contenders: usize, rounds: usize) -> usize {
    contenders * (rounds + 2)
}

fn visits(set: &RaySet, answers: &[u64], counts: &[VisitCounts]) -> Visits {
    let (mut nodes, mut rays) = ([0u64; 2], [0u64; 2]);
    let (mut triangles, mut double_tests, mut exact_tests) = (0u64, 0u64, 0u64);
    for (occluded, count) in set.each_answer(answers).zip(counts) {
        nodes[usize::from(occluded)] += u64::from(count.nodes);
        rays[usize::from(occluded)] += 1;
        triangles += u64::from(count.triangles);
        double_tests += u64::from(count.double_tests);
        exact_tests += u64::from(count.exact_tests);
    }
    let all = counts.len().max(1) as f64;
    let mean = |kind: usize| (rays[kind] > 0).then(|| nodes[kind] as f64 / rays[kind] as f64);
    Visits {
        nodes_per_ray: (nodes[0] + nodes[1]) as f64 / all,
        nodes_per_occluded_ray: mean(1),
        nodes_per_unoccluded_ray: mean(0),
        triangles_per_ray: triangles as f64 / all,
        double_tests_per_million: double_tests as f64 * 1e6 / all,
        exact_tests_per_million: exact_tests as f64 * 1e6 / all,
    }
}

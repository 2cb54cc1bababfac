//! Fair measuring: the same rays for all, interleaved rounds, medians, agreement ray by ray.

mod agreement;
mod contest;
pub mod convergence;
mod dispute;
pub mod image_error;
mod judge;
mod timing;

pub use agreement::{Agreement, agreement};
pub use contest::{Outcome, Performance, Visits, contest, steps};
pub use dispute::{Judgement, judge};
pub use judge::{WrongAnswers, WrongForReason, true_answers, verdicts};
pub use timing::{Summary, geometric_mean, interleaved, ratios};

use crate::backend::Accelerator;
use crate::ray::VisitCounts;
use crate::ray_set::RaySet;
use rayon::prelude::*;
use std::time::Instant;

/// Answers all rays on the current rayon pool. Only the calls of `occluded` lie within the returned
/// time, in milliseconds.
pub fn trace(accelerator: &dyn Accelerator, set: &RaySet, answers: &mut [u64]) -> f64 {
    answers.fill(0);
    let mut batches = set.batches_with(answers);
    let start = Instant::now();
    batches.par_iter_mut().for_each(|(batch, words)| accelerator.occluded(batch, words));
    start.elapsed().as_secs_f64() * 1e3
}

/// What each ray visits, in the order of the set; `None` if the backend cannot count.
pub fn count(accelerator: &dyn Accelerator, set: &RaySet) -> Option<Vec<VisitCounts>> {
    let mut answers = set.no_answers();
    let counted: Option<Vec<Vec<VisitCounts>>> = set
        .batches_with(&mut answers)
        .par_iter_mut()
        .map(|(batch, words)| {
            let mut counts = vec![VisitCounts::default(); batch.rays.len()];
            accelerator.occluded_counted(batch, words, &mut counts).then_some(counts)
        })
        .collect();
    counted.map(|batches| batches.concat())
}

//! Answers before the arbiter: how many are wrong, which way, and why.

use crate::arbiter::{Arbiter, Reason, Verdict};
use crate::ray::set_bit;
use crate::ray_set::RaySet;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::HashMap;

/// The wrong answers of one backend.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WrongAnswers {
    /// Rays called occluded that nothing stops.
    pub false_hits: u64,
    /// Rays called open that something stops.
    pub missed_hits: u64,
    /// The same by what makes the rays hard; those that were looked into.
    pub reasons: Vec<WrongForReason>,
}

/// Wrong answers that one reason explains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WrongForReason {
    /// What makes these rays hard.
    pub reason: Reason,
    /// Rays called occluded that nothing stops.
    pub false_hits: u64,
    /// Rays called open that something stops.
    pub missed_hits: u64,
    /// Largest margin by which an answer is wrong, see [`Verdict::margin`]: the least excusable.
    /// Infinite (null in JSON) if no triangle is near.
    pub worst_margin: f64,
}

impl WrongAnswers {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.false_hits + self.missed_hits
    }

    /// Among a million of `answers`.
    pub fn per_million(&self, answers: u64) -> f64 {
        if answers == 0 { 0.0 } else { self.total() as f64 * 1e6 / answers as f64 }
    }

    /// Counts a wrong answer to a ray whose true answer is `occluded`.
    pub fn count(&mut self, occluded: bool) {
        if occluded {
            self.missed_hits += 1;
        } else {
            self.false_hits += 1;
        }
    }

    /// Notes why one that was counted is wrong.
    pub fn explain(&mut self, verdict: &Verdict) {
        let (missed, falsely) = (u64::from(verdict.occluded), u64::from(!verdict.occluded));
        self.add(&WrongForReason {
            reason: verdict.reason,
            false_hits: falsely,
            missed_hits: missed,
            worst_margin: verdict.margin,
        });
    }

    /// Adds those of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.false_hits += other.false_hits;
        self.missed_hits += other.missed_hits;
        other.reasons.iter().for_each(|reason| self.add(reason));
    }

    fn add(&mut self, new: &WrongForReason) {
        match self.reasons.iter_mut().find(|r| r.reason == new.reason) {
            Some(known) => {
                known.false_hits += new.false_hits;
                known.missed_hits += new.missed_hits;
                known.worst_margin = known.worst_margin.max(new.worst_margin);
            }
            None => {
                self.reasons.push(*new);
                self.reasons.sort_by_key(|r| r.reason);
            }
        }
    }
}

/// The true answers, on the current rayon pool.
pub fn true_answers(arbiter: &Arbiter<'_>, set: &RaySet) -> Vec<u64> {
    let mut answers = set.no_answers();
    set.batches_with(&mut answers).par_iter_mut().for_each(|(batch, words)| {
        for (index, ray) in batch.rays.iter().enumerate() {
            set_bit(words, index, arbiter.occluded(ray));
        }
    });
    answers
}

/// Verdicts on these rays of the set, on the current rayon pool.
pub fn verdicts(arbiter: &Arbiter<'_>, set: &RaySet, rays: &[usize]) -> HashMap<usize, Verdict> {
    rays.par_iter().map(|&ray| (ray, arbiter.explain(&set.rays()[ray]))).collect()
}

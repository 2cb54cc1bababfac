//! Which rays two backends answer differently.

use crate::ray_set::RaySet;

/// How two backends agree on a set of rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// The pair, as indices into the list of backends.
    pub pair: [usize; 2],
    /// Rays that both have answered.
    pub rays: usize,
    /// Those that only one of them calls occluded, as indices into the set.
    pub differing: Vec<usize>,
}

impl Agreement {
    /// Differing rays among a million.
    pub fn per_million(&self) -> f64 {
        if self.rays == 0 { 0.0 } else { self.differing.len() as f64 * 1e6 / self.rays as f64 }
    }
}

/// Compares every pair of answers to one set of rays.
pub fn agreement(set: &RaySet, answers: &[Vec<u64>]) -> Vec<Agreement> {
    let pairs = (0..answers.len()).flat_map(|a| (a + 1..answers.len()).map(move |b| [a, b]));
    pairs
        .map(|pair| Agreement {
            pair,
            rays: set.len(),
            differing: set.differing(&answers[pair[0]], &answers[pair[1]]),
        })
        .collect()
}

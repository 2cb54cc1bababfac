//! Recorded shadow rays: made once, given to every contender, kept in files for replay.

mod file;

pub use file::RayFile;

use crate::ray::{Ray, RayBatch, bit, words_for};
use std::ops::Range;

/// Rays of one class, in batches that are answered together (a tile of the image each).
///
/// Each batch has 64-bit words of its own in the answers, so that threads share none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RaySet {
    rays: Vec<Ray>,
    batches: Vec<Batch>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Batch {
    first_ray: usize,
    rays: usize,
    first_word: usize,
}

impl Batch {
    fn words(&self) -> Range<usize> {
        self.first_word..self.first_word + words_for(self.rays)
    }
}

impl RaySet {
    /// Adds a batch; an empty one is left out.
    pub fn push_batch(&mut self, rays: &[Ray]) {
        if !rays.is_empty() {
            let (first_ray, first_word) = (self.rays.len(), self.word_count());
            self.batches.push(Batch { first_ray, rays: rays.len(), first_word });
            self.rays.extend_from_slice(rays);
        }
    }

    /// All rays, batch after batch.
    pub fn rays(&self) -> &[Ray] {
        &self.rays
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// The batches.
    pub fn batches(&self) -> impl ExactSizeIterator<Item = RayBatch<'_>> {
        self.batches.iter().map(|b| RayBatch { rays: &self.rays[b.first_ray..][..b.rays] })
    }

    /// Words of the answers to all rays.
    pub fn word_count(&self) -> usize {
        self.batches.last().map_or(0, |b| b.words().end)
    }

    /// Zeroed answers.
    pub fn no_answers(&self) -> Vec<u64> {
        vec![0; self.word_count()]
    }

    /// Each batch with the words of its answers.
    ///
    /// # Panics
    /// If `answers` has other than [`word_count`](Self::word_count) words.
    pub fn batches_with<'a>(
        &'a self,
        mut answers: &'a mut [u64],
    ) -> Vec<(RayBatch<'a>, &'a mut [u64])> {
        assert_eq!(answers.len(), self.word_count(), "answers of another ray set");
        self.batches()
            .map(|batch| {
                let (own, rest) =
                    std::mem::take(&mut answers).split_at_mut(words_for(batch.rays.len()));
                answers = rest;
                (batch, own)
            })
            .collect()
    }

    /// The answers to all rays one by one, in the order of [`rays`](Self::rays).
    pub fn each_answer<'a>(&'a self, answers: &'a [u64]) -> impl Iterator<Item = bool> + 'a {
        self.batches.iter().flat_map(move |b| (0..b.rays).map(move |i| bit(&answers[b.words()], i)))
    }

    /// The rays that are not occluded and those that are, each in the batches that they came in.
    pub fn split_by(&self, answers: &[u64]) -> [Self; 2] {
        let mut sides = [Self::default(), Self::default()];
        for batch in &self.batches {
            let words = &answers[batch.words()];
            let rays = &self.rays[batch.first_ray..][..batch.rays];
            for (side, set) in sides.iter_mut().enumerate() {
                let of_side = |&i: &usize| usize::from(bit(words, i)) == side;
                let chosen: Vec<Ray> = (0..rays.len()).filter(of_side).map(|i| rays[i]).collect();
                set.push_batch(&chosen);
            }
        }
        sides
    }

    /// Indices of the rays that two sets of answers disagree on, rising.
    pub fn differing(&self, a: &[u64], b: &[u64]) -> Vec<usize> {
        let mut rays = Vec::new();
        for batch in &self.batches {
            for (word, (a, b)) in a[batch.words()].iter().zip(&b[batch.words()]).enumerate() {
                let mut differing = a ^ b;
                while differing != 0 {
                    let place = differing.trailing_zeros() as usize;
                    rays.push(batch.first_ray + 64 * word + place);
                    differing &= differing - 1;
                }
            }
        }
        rays
    }
}

/// Number of occluded rays among answers.
pub fn occluded_count(answers: &[u64]) -> usize {
    answers.iter().map(|word| word.count_ones() as usize).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::set_bit;
    use crate::test_random::Random;

    #[test]
    fn answers_find_their_rays_across_batches() {
        let mut random = Random::new(21);
        let mut set = RaySet::default();
        for count in [1, 0, 64, 65, 300, 63] {
            let rays: Vec<_> = (0..count).map(|_| random.ray()).collect();
            set.push_batch(&rays);
        }
        assert_eq!((set.len(), set.batches().len()), (493, 5));
        let blocked = |ray: &Ray| ray.origin.x > 0.0;
        let mut answers = set.no_answers();
        for (batch, words) in set.batches_with(&mut answers) {
            for (i, ray) in batch.rays.iter().enumerate() {
                set_bit(words, i, blocked(ray));
            }
        }
        let expected: Vec<_> = set.rays().iter().map(blocked).collect();
        assert_eq!(set.each_answer(&answers).collect::<Vec<_>>(), expected);
        assert_eq!(occluded_count(&answers), expected.iter().filter(|b| **b).count());
        let differing = set.differing(&answers, &set.no_answers());
        let blocked: Vec<_> = (0..set.len()).filter(|&i| expected[i]).collect();
        assert_eq!(differing, blocked);
        let [open, occluded] = set.split_by(&answers);
        for (wanted, part) in [(false, open), (true, occluded)] {
            let chosen = set.rays().iter().zip(&expected).filter(|(_, e)| **e == wanted);
            assert!(chosen.map(|(ray, _)| ray).eq(part.rays()));
        }
    }
}

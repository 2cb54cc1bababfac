//! One bit for each node of a tree.

use rayon::prelude::*;

/// A bit for each node, by its index. 64 of them lie in a word, so that what is said of a million
/// nodes stays in cache.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeBits {
    words: Vec<u64>,
    nodes: usize,
}

impl NodeBits {
    /// No bit set.
    pub fn none(nodes: usize) -> Self {
        Self { words: vec![0; nodes.div_ceil(64)], nodes }
    }

    /// What `bit` says of each index, on the current rayon pool.
    pub fn from_fn(nodes: usize, bit: impl Fn(usize) -> bool + Sync) -> Self {
        // Below some ten thousand nodes threads cost more than they bring.
        const WORDS_AT_ONCE: usize = 256;
        let mut bits = Self::none(nodes);
        let words = bits.words.par_iter_mut().with_min_len(WORDS_AT_ONCE).enumerate();
        words.for_each(|(index, word)| {
            let first = index * 64;
            let count = (nodes - first).min(64);
            for place in 0..count {
                *word |= u64::from(bit(first + place)) << place;
            }
        });
        bits
    }

    /// What `bit` says of each index, asked from the last one to the first.
    #[inline]
    pub fn from_last(nodes: usize, mut bit: impl FnMut(usize) -> bool) -> Self {
        let mut bits = Self::none(nodes);
        for (index, word) in bits.words.iter_mut().enumerate().rev() {
            let first = index * 64;
            let mut all = 0;
            for place in (0..(nodes - first).min(64)).rev() {
                all = all << 1 | u64::from(bit(first + place));
            }
            *word = all;
        }
        bits
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.nodes == 0
    }

    /// The bit of the node at `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 != 0
    }

    /// Sets the bit of the node at `index` to `value`.
    #[inline(always)]
    pub fn set(&mut self, index: usize, value: bool) {
        let word = &mut self.words[index / 64];
        *word = *word & !(1 << (index % 64)) | u64::from(value) << (index % 64);
    }

    /// Sets the bits that `other` has set, its first being the bit at `start` here.
    ///
    /// # Panics
    /// If it has more nodes than there are from `start` on.
    pub fn include(&mut self, start: usize, other: &Self) {
        assert!(start + other.nodes <= self.nodes, "bits of another tree");
        let (first, shift) = (start / 64, start % 64);
        for (place, &word) in (first..).zip(&other.words) {
            self.words[place] |= word << shift;
            // Two shifts, as one by 64 does not exist; what is left over is part of the next word.
            let rest = word >> (63 - shift) >> 1;
            if rest != 0 {
                self.words[place + 1] |= rest;
            }
        }
    }

    /// Number of nodes whose bits differ.
    ///
    /// # Panics
    /// If the number of nodes differs.
    pub fn differing(&self, other: &Self) -> usize {
        assert_eq!(self.nodes, other.nodes, "bits of another tree");
        let pairs = self.words.iter().zip(&other.words);
        pairs.map(|(a, b)| (a ^ b).count_ones() as usize).sum()
    }

    /// Number of bits set.
    pub fn count_ones(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Bytes of the words.
    pub fn memory_bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_kept_one_by_one() {
        let third = |i: usize| i.is_multiple_of(3);
        for nodes in [0, 1, 63, 64, 65, 100_000] {
            let all = NodeBits::from_fn(nodes, third);
            let mut one_by_one = NodeBits::none(nodes);
            (0..nodes).for_each(|i| one_by_one.set(i, true));
            (0..nodes).for_each(|i| one_by_one.set(i, third(i)));
            assert_eq!((all.len(), &all), (nodes, &one_by_one));
            let mut next = nodes;
            let from_last = NodeBits::from_last(nodes, |i| {
                next -= 1;
                i == next && third(i)
            });
            assert_eq!(all, from_last);
            assert!((0..nodes).all(|i| all.get(i) == third(i)));
            assert_eq!(all.count_ones(), nodes.div_ceil(3));
            assert_eq!(all.differing(&NodeBits::none(nodes)), nodes.div_ceil(3));
        }
    }

    #[test]
    fn bits_are_included_anywhere() {
        for (start, count) in [(0, 64), (1, 63), (1, 64), (63, 130), (64, 1), (70, 200), (200, 0)] {
            let part = NodeBits::from_fn(count, |i| i % 5 != 1);
            let mut all = NodeBits::from_fn(400, |i| i % 7 == 0);
            let expected = NodeBits::from_fn(400, |i| {
                i % 7 == 0 || (start..start + count).contains(&i) && part.get(i - start)
            });
            all.include(start, &part);
            assert_eq!(all, expected, "{start} {count}");
        }
    }
}

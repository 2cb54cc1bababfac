//! Large arrays that threads fill part by part, on large pages where there are any, and without writing
//! zeros first: that would touch all of the memory once more, on one thread.
#![allow(unsafe_code, reason = "memory that holds nothing yet")]

use crate::huge_pages;
use rayon::prelude::*;
use std::mem::MaybeUninit;

/// A part of an array, filled from its first slot on.
pub(crate) struct Part<'a, T> {
    slots: &'a mut [MaybeUninit<T>],
    /// As many of the first slots hold something.
    len: usize,
}

impl<T: Copy> Part<'_, T> {
    /// Fills the next slot.
    #[inline(always)]
    pub(crate) fn push(&mut self, value: T) {
        self.slots[self.len].write(value);
        self.len += 1;
    }

    /// What is in it so far.
    pub(crate) fn filled(&mut self) -> &mut [T] {
        // SAFETY: `push` has written the first `len` slots, one after the other.
        unsafe { self.slots[..self.len].assume_init_mut() }
    }
}

/// An array of parts of these lengths, one after the other, each filled by `fill`, which is given its
/// number; and what `fill` returns. On the current rayon pool.
///
/// # Panics
/// If `fill` does not fill a part.
pub(crate) fn in_parts<T: Copy + Send, R: Send>(
    lengths: &[usize],
    fill: impl Fn(usize, &mut Part<'_, T>) -> R + Sync,
) -> (Vec<T>, Vec<R>) {
    let count = lengths.iter().sum();
    let mut array = Vec::with_capacity(count);
    let mut rest = &mut array.spare_capacity_mut()[..count];
    huge_pages::ask_for(rest);
    let mut parts = Vec::with_capacity(lengths.len());
    for &length in lengths {
        let slots;
        (slots, rest) = rest.split_at_mut(length);
        parts.push(Part { slots, len: 0 });
    }
    let fill = |(number, mut part): (usize, Part<'_, T>)| {
        let made = fill(number, &mut part);
        assert_eq!(part.len, part.slots.len(), "part {number} is not full");
        made
    };
    let made = parts.into_par_iter().enumerate().map(fill).collect();
    // SAFETY: the capacity is no less, and the parts, which are all full, are the first `count` slots.
    unsafe { array.set_len(count) };
    (array, made)
}

#[cfg(test)]
mod tests {
    use super::in_parts;

    #[test]
    fn parts_lie_one_after_the_other() {
        for lengths in [vec![], vec![0], vec![3, 0, 1, 100_000, 7]] {
            let (array, made) = in_parts(&lengths, |number, part| {
                for index in 0..lengths[number] {
                    part.push((number, index));
                }
                if let Some(last) = part.filled().last_mut() {
                    last.1 += 1;
                }
                part.filled().len()
            });
            assert_eq!(made, lengths);
            let expected = lengths.iter().enumerate().flat_map(|(number, &length)| {
                (0..length).map(move |index| (number, index + usize::from(index + 1 == length)))
            });
            assert!(array.into_iter().eq(expected));
        }
    }

    #[test]
    #[should_panic(expected = "part 1 is not full")]
    fn a_part_that_is_not_filled_is_not_given_out() {
        in_parts(&[1, 2], |_, part| part.push(0));
    }
}

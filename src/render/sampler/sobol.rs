//! Sobol points, scrambled as by Owen for each pixel and dimension.

use super::{Request, SamplerEntry, mix};
use crate::vectorized::vectorized;
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};
use std::sync::OnceLock;

/// Two-dimensional Sobol points, Owen-scrambled by hashing (Burley, "Practical Hash-based Owen
/// Scrambling", JCGT 9(4), 2020). Any number of samples may be taken; powers of two are spread best.
pub(super) static ENTRY: SamplerEntry = SamplerEntry {
    name: "sobol",
    about: "Owen-scrambled Sobol points; powers of two are spread best",
    fill,
};

/// Points of a sequence of the crate: longer ones are made of several.
const LONGEST: u32 = 1 << 16;

/// The first [`LONGEST`] points before scrambling, bits reversed: first coordinates, then second.
fn table() -> &'static [Vec<u32>; 2] {
    static TABLE: OnceLock<[Vec<u32>; 2]> = OnceLock::new();
    TABLE.get_or_init(|| {
        [0, 1].map(|dimension| {
            let mut points = vec![0; LONGEST as usize];
            // Each point is that of its index without the lowest bit, and that of the bit.
            for index in 1..LONGEST {
                let bit = index & index.wrapping_neg();
                let of_bit = if bit == index {
                    sobol_rev(bit.reverse_bits(), dimension)
                } else {
                    points[bit as usize]
                };
                points[index as usize] = points[(index ^ bit) as usize] ^ of_bit;
            }
            points
        })
    })
}

/// As `sobol_burley::sample_4d(index, 0, seed)`, its first two coordinates, for many points at once.
fn fill(request: &Request, u: &mut [f32], v: &mut [f32]) {
    let table = table();
    let (mut done, len) = (0, u.len());
    while done < len {
        let start = request.first() + done as u32;
        let end = len.min(done + (LONGEST - start % LONGEST) as usize);
        let seed = mix(request.key ^ u64::from(start / LONGEST)) as u32;
        let (u, v) = (&mut u[done..end], &mut v[done..end]);
        vectorized(
            #[inline(always)]
            || part(table, start % LONGEST, seed, u, v),
        );
        done = end;
    }
}

/// Points of one sequence.
#[inline(always)]
fn part(table: &[Vec<u32>; 2], start: u32, seed: u32, u: &mut [f32], v: &mut [f32]) {
    let shuffle = hash(seed ^ 0x79c6_8e4a);
    let of_dimension = |dimension: usize, word: u32, values: &mut [f32]| {
        let points = &table[dimension][..LONGEST as usize];
        let scramble = hash(seed.wrapping_mul(0x9c8f_2d3b) ^ word);
        for (offset, value) in (0u32..).zip(values) {
            let index = (start + offset).reverse_bits();
            let index = (owen_scramble_rev(index, shuffle).reverse_bits() % LONGEST) as usize;
            let point = owen_scramble_rev(points[index], scramble);
            *value = u32_to_f32_norm(point.reverse_bits());
        }
    };
    of_dimension(0, 0x912f_69ba, u);
    of_dimension(1, 0x174f_18ab, v);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_those_of_the_crate() {
        for (key, first, count) in [(1, 0, 64), (77, 1000, 17), (5, LONGEST - 8, 16)] {
            let (mut u, mut v) = (vec![0.0; count], vec![0.0; count]);
            fill(&Request { key, block: 0, count: first, start: first }, &mut u, &mut v);
            for index in 0..count {
                let place = first + index as u32;
                let seed = mix(key ^ u64::from(place / LONGEST)) as u32;
                let expected = sobol_burley::sample_4d(place % LONGEST, 0, seed);
                assert_eq!([u[index], v[index]], expected[..2], "point {place} of {key}");
            }
        }
    }
}

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

/// The second coordinates of the first [`LONGEST`] points before scrambling, bits reversed. The first
/// coordinates need no table: that of a point is its index.
fn table() -> &'static [u32] {
    static TABLE: OnceLock<Vec<u32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut points = vec![0; LONGEST as usize];
        // Each point is that of its index without the lowest bit, and that of the bit.
        for index in 1..LONGEST {
            let bit = index & index.wrapping_neg();
            points[index as usize] = if bit == index {
                sobol_rev(bit.reverse_bits(), 1)
            } else {
                points[(index ^ bit) as usize] ^ points[bit as usize]
            };
        }
        points
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
fn part(table: &[u32], start: u32, seed: u32, u: &mut [f32], v: &mut [f32]) {
    let shuffle = hash(seed ^ 0x79c6_8e4a);
    let [of_u, of_v] =
        [0x912f_69ba, 0x174f_18ab].map(|word| hash(seed.wrapping_mul(0x9c8f_2d3b) ^ word));
    let table = &table[..LONGEST as usize];
    let len = u.len();
    let v = &mut v[..len];
    let scrambled =
        |point, scramble| u32_to_f32_norm(owen_scramble_rev(point, scramble).reverse_bits());
    for place in 0..len {
        let index = owen_scramble_rev((start + place as u32).reverse_bits(), shuffle);
        let index = index.reverse_bits() % LONGEST;
        u[place] = scrambled(index, of_u);
        v[place] = scrambled(table[index as usize], of_v);
    }
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

//! Rays by octant: groups hold rays of one, which enter boxes by the same planes.

use super::rays::{NOBODY, STREAM};
use super::simd::{LANES, Simd, Wide};
use crate::ray::Ray;

/// For each byte the numbers of the bits that are set, and zeros.
static NUMBERS_OF_BITS: [[u8; LANES]; 256] = {
    let mut all = [[0; LANES]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut len) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][len] = bit as u8;
                len += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
};

/// Lists the places of rays octant by octant, each from the start of a group on.
#[inline(always)]
pub(super) fn places_by_octant<S: Simd, W: Wide>(
    s: S,
    rays: &[Ray],
    places: &mut Vec<u16>,
    lists: &mut [Vec<u16>; 8],
) {
    let most = rays.len();
    let mut lens = [0; 8];
    for list in lists.iter_mut() {
        list.resize(list.len().max(most + LANES), 0);
    }
    let mut octants = [0; STREAM];
    for (chunk, rays) in rays.chunks(STREAM).enumerate() {
        for (octant, ray) in octants.iter_mut().zip(rays) {
            *octant = s.octant(ray);
        }
        let there = u64::MAX >> (STREAM - rays.len());
        let [x, y, z, ..] = s.transpose(&octants);
        for octant in 0..8 {
            let picked =
                |word: u64, axis: usize| if octant >> axis & 1 == 1 { word } else { !word };
            let of_octant = picked(x, 0) & picked(y, 1) & picked(z, 2) & there;
            if of_octant == 0 {
                continue;
            }
            let (list, len) = (&mut lists[octant], &mut lens[octant]);
            // Eight bits at a time and without branches, as no processor foresees them.
            for (byte, bits) in of_octant.to_le_bytes().into_iter().enumerate() {
                let first = (chunk * STREAM + byte * LANES) as u16;
                let numbers = NUMBERS_OF_BITS[usize::from(bits)].map(|n| first + u16::from(n));
                list[*len..*len + LANES].copy_from_slice(&numbers);
                *len += bits.count_ones() as usize;
            }
        }
    }
    places.clear();
    for (list, len) in lists.iter().zip(lens) {
        places.extend_from_slice(&list[..len]);
        if let Some(last) = list[..len].last() {
            places.resize(places.len().next_multiple_of(W::GROUP), last | NOBODY);
        }
    }
}

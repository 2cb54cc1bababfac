//! Sobol points, scrambled as by Owen for each pixel and dimension.

use super::{MOST_TOGETHER, Request, SamplerEntry, block_by_block, mix};
use crate::vectorized::vectorized;
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};
use std::sync::OnceLock;

/// Two-dimensional Sobol points, Owen-scrambled by hashing (Burley, "Practical Hash-based Owen
/// Scrambling", JCGT 9(4), 2020). Any number of samples may be taken; powers of two are spread best.
pub(super) static ENTRY: SamplerEntry = SamplerEntry {
    name: "sobol",
    about: "Owen-scrambled Sobol points; powers of two are spread best",
    fill,
    fill_blocks,
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

/// Points of the first `1 << log_count` before scrambling, both coordinates with their bits reversed,
/// in the order of the cells of ever finer grids that they lie in: any `1 << n` of them that start at a
/// multiple of that share a cell of the grid of as many. Scrambling moves cells as wholes.
fn by_cell(log_count: u32) -> &'static [[u32; 2]] {
    static TABLES: [OnceLock<Vec<[u32; 2]>>; LONGEST.ilog2() as usize + 1] =
        [const { OnceLock::new() }; LONGEST.ilog2() as usize + 1];
    TABLES[log_count as usize].get_or_init(|| {
        let mut points = vec![[0; 2]; 1 << log_count];
        for index in 0..1 << log_count {
            let point = [index, table()[index as usize]];
            // The highest bits of both coordinates by turns, which tell all of these points apart.
            let cell = (0..log_count)
                .fold(0, |cell, bit| cell << 1 | point[bit as usize % 2] >> (bit / 2) & 1);
            points[cell as usize] = point;
        }
        points
    })
}

/// As `sobol_burley::sample_4d(index, 0, seed)`, its first two coordinates, for many points at once. A
/// power of two of them come in the order of [`by_cell`], so that rays near each other follow each
/// other.
fn fill(request: &Request, u: &mut [f32], v: &mut [f32]) {
    let Request { key, block, count, start } = *request;
    if count.is_power_of_two() && count <= LONGEST {
        let cells = &by_cell(count.ilog2())[start as usize..];
        let first = block * count;
        let seed = mix(key ^ u64::from(first / LONGEST)) as u32;
        let len = u.len().min(cells.len());
        vectorized(
            #[inline(always)]
            || block_by_cell(&cells[..len], [first % LONGEST, count], seed, u, v),
        );
        return;
    }
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

/// How a seed scrambles indices and both coordinates.
#[inline(always)]
fn scrambles(seed: u32) -> [u32; 3] {
    let [of_u, of_v] = [0x912f_69ba, 0x174f_18ab].map(|word| seed.wrapping_mul(0x9c8f_2d3b) ^ word);
    [seed ^ 0x79c6_8e4a, of_u, of_v].map(hash)
}

#[inline(always)]
fn shuffled(index: u32, shuffle: u32) -> u32 {
    owen_scramble_rev(index.reverse_bits(), shuffle).reverse_bits() % LONGEST
}

#[inline(always)]
fn scrambled(point: u32, scramble: u32) -> f32 {
    u32_to_f32_norm(owen_scramble_rev(point, scramble).reverse_bits())
}

/// Points of one sequence.
#[inline(always)]
fn part(table: &[u32], start: u32, seed: u32, u: &mut [f32], v: &mut [f32]) {
    let [shuffle, of_u, of_v] = scrambles(seed);
    let table = &table[..LONGEST as usize];
    let len = u.len();
    let v = &mut v[..len];
    for place in 0..len {
        let index = shuffled(start + place as u32, shuffle);
        u[place] = scrambled(index, of_u);
        v[place] = scrambled(table[index as usize], of_v);
    }
}

/// Points of the `count` of a sequence that begin at `first`, a multiple of it, by their cells among
/// the first as many.
#[inline(always)]
fn block_by_cell(
    cells: &[[u32; 2]],
    [first, count]: [u32; 2],
    seed: u32,
    u: &mut [f32],
    v: &mut [f32],
) {
    let [shuffle, of_u, of_v] = scrambles(seed);
    // Shuffling moves blocks as wholes, and points of a sum of indices are the sums of their points.
    let index = shuffled(first, shuffle) & !(count - 1);
    let of_block = [index, table()[index as usize]];
    let len = cells.len();
    let (u, v) = (&mut u[..len], &mut v[..len]);
    for place in 0..len {
        u[place] = scrambled(cells[place][0] ^ of_block[0], of_u);
        v[place] = scrambled(cells[place][1] ^ of_block[1], of_v);
    }
}

/// What points of several blocks are found from, number by number.
struct Lanes {
    seed: [u32; MOST_TOGETHER],
    /// The first point of the block, and the bits that its index has not.
    first: [u32; MOST_TOGETHER],
    rest: [u32; MOST_TOGETHER],
    /// Where the point is among the first as many before scrambling.
    cell: [[u32; MOST_TOGETHER]; 2],
}

impl Lanes {
    const EMPTY: Self = {
        let row = [0; MOST_TOGETHER];
        Self { seed: row, first: row, rest: row, cell: [row; 2] }
    };

    /// The points of the first lanes.
    #[inline(always)]
    fn points(&self, u: &mut [f32], v: &mut [f32]) {
        let Self { seed, first, rest, cell: [cell_u, cell_v] } = self;
        let (mut index, mut of_u, mut of_v) = (*seed, *seed, *seed);
        for lane in 0..MOST_TOGETHER {
            let shuffle;
            [shuffle, of_u[lane], of_v[lane]] = scrambles(seed[lane]);
            index[lane] = shuffled(first[lane], shuffle) & !rest[lane];
        }
        let table = &table()[..LONGEST as usize];
        let mut point = index;
        for lane in 0..MOST_TOGETHER {
            point[lane] = table[index[lane] as usize];
        }
        let len = u.len().min(v.len()).min(MOST_TOGETHER);
        let (u, v) = (&mut u[..len], &mut v[..len]);
        for lane in 0..len {
            u[lane] = scrambled(cell_u[lane] ^ index[lane], of_u[lane]);
            v[lane] = scrambled(cell_v[lane] ^ point[lane], of_v[lane]);
        }
    }
}

/// As [`fill`] for each request: a point of each is computed in a lane of vectors.
fn fill_blocks(requests: &[Request], u: &mut [f32], v: &mut [f32]) {
    let by_cells = |r: &Request| r.count.is_power_of_two() && r.count <= LONGEST;
    if !requests.iter().all(by_cells) {
        return block_by_block(fill, requests, u, v);
    }
    let (mut lanes, mut used) = (Lanes::EMPTY, 0);
    for &Request { key, block, count, .. } in requests {
        let first = block * count;
        let seed = mix(key ^ u64::from(first / LONGEST)) as u32;
        for &[cell_u, cell_v] in by_cell(count.ilog2()) {
            lanes.seed[used] = seed;
            lanes.first[used] = first % LONGEST;
            lanes.rest[used] = count - 1;
            (lanes.cell[0][used], lanes.cell[1][used]) = (cell_u, cell_v);
            used += 1;
        }
    }
    vectorized(
        #[inline(always)]
        || lanes.points(u, v),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those of the crate, in the order of their indices or, for blocks, in any.
    fn expected(key: u64, first: u32, count: u32) -> Vec<[f32; 2]> {
        let point = |place: u32| {
            let seed = mix(key ^ u64::from(place / LONGEST)) as u32;
            let [u, v, ..] = sobol_burley::sample_4d(place % LONGEST, 0, seed);
            [u, v]
        };
        (first..first + count).map(point).collect()
    }

    fn filled(request: &Request, len: u32) -> Vec<[f32; 2]> {
        let (mut u, mut v) = (vec![0.0; len as usize], vec![0.0; len as usize]);
        fill(request, &mut u, &mut v);
        u.into_iter().zip(v).map(|(u, v)| [u, v]).collect()
    }

    #[test]
    fn points_are_those_of_the_crate() {
        for (key, first, len) in [(1, 7, 64), (77, 1000, 17), (5, LONGEST - 8, 16)] {
            let request = Request { key, block: 0, count: first, start: first };
            assert_eq!(filled(&request, len), expected(key, first, len), "from {first} of {key}");
        }
    }

    #[test]
    fn blocks_are_those_of_the_crate_cell_by_cell() {
        for (key, block, log_count) in [(1, 0, 0u32), (2, 9, 3), (3, 0, 8), (4, 5, 13), (5, 2, 16)]
        {
            let count = 1 << log_count;
            let mut points = filled(&Request { key, block, count, start: 0 }, count);
            for log_cells in 0..=log_count {
                // Narrower than high by one bit at most.
                let sides = [log_cells.div_ceil(2), log_cells / 2].map(|log| (1 << log) as f32);
                let cell = |p: &[f32; 2]| [0, 1].map(|axis| (p[axis] * sides[axis]).floor());
                for together in points.chunks(1 << (log_count - log_cells)) {
                    assert!(together.iter().all(|p| cell(p) == cell(&together[0])), "{log_cells}");
                }
            }
            let mut expected = expected(key, block * count, count);
            let by_bits = |p: &[f32; 2]| p.map(f32::to_bits);
            points.sort_by_key(by_bits);
            expected.sort_by_key(by_bits);
            assert_eq!(points, expected, "block {block} of {count}");
        }
    }
}

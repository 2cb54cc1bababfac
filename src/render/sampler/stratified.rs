//! One point somewhere in each cell of a grid.

use super::{Request, SamplerEntry, block_by_block, mix, unit};

pub(super) static ENTRY: SamplerEntry = SamplerEntry {
    name: "stratified",
    about: "one uniform point in each cell of a grid as near to square as the number allows",
    fill,
    fill_blocks: |requests, u, v| block_by_block(fill, requests, u, v),
};

fn fill(request: &Request, u: &mut [f32], v: &mut [f32]) {
    let columns = columns(request.count);
    let rows = request.count / columns;
    let size = [columns, rows].map(|n| 1.0 / n as f32);
    // Products may round up to 1.
    let below_one = 1.0 - f32::EPSILON / 2.0;
    let first = u64::from(request.block) * u64::from(request.count);
    // As many as there are cells; what lies behind them means nothing.
    let points = u.iter_mut().zip(v).take((request.count - request.start) as usize);
    for (index, (u, v)) in (request.start..).zip(points) {
        let word = mix(request.key ^ mix(first + u64::from(index)));
        let cell = [index % columns, index / columns];
        *u = ((cell[0] as f32 + unit(word as u32)) * size[0]).min(below_one);
        *v = ((cell[1] as f32 + unit((word >> 32) as u32)) * size[1]).min(below_one);
    }
}

/// The largest divisor that is no larger than the square root.
fn columns(count: u32) -> u32 {
    (1..=count.isqrt()).rev().find(|n| count.is_multiple_of(*n)).unwrap_or(1)
}

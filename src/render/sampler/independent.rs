//! Points that know nothing of each other: the plain Monte Carlo method, for comparison.

use super::{Request, SamplerEntry, block_by_block, mix, unit};

pub(super) static ENTRY: SamplerEntry = SamplerEntry {
    name: "independent",
    about: "independent uniform points: plain Monte Carlo, for comparison",
    fill,
    fill_blocks: |requests, u, v| block_by_block(fill, requests, u, v),
};

fn fill(request: &Request, u: &mut [f32], v: &mut [f32]) {
    let points = u.iter_mut().zip(v);
    for (index, (u, v)) in points.enumerate() {
        let word = mix(request.key ^ mix(u64::from(request.first()) + index as u64));
        (*u, *v) = (unit(word as u32), unit((word >> 32) as u32));
    }
}

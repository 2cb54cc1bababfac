//! A coin for every node, tossed once from the seed: the control.

use super::{DependsOn, OrderEntry, kd, score_each, second_where};

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "random",
    about: "a fixed coin toss for every node, from the seed: the control",
    needs_training: false,
    plan_bvh2: |tree, context| second_where(tree, |index, _| coin(context.seed, index as u64)),
    depends_on: DependsOn::Nothing,
    box_score: None,
    plan_kd: Some(|tree, context| {
        kd::upper_where(tree, |index, _| coin(context.seed, index as u64))
    }),
    scores: Some(|tree, context| {
        score_each(tree, |index, _, side| hash(context.seed, (2 * index + side) as u64) as f64)
    }),
    score_part: None,
    at_split: None,
};

/// The finaliser of SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number
/// Generators", 2014): a toss that depends on the node, not on the threads.
fn coin(seed: u64, index: u64) -> bool {
    hash(seed, index) & 1 == 1
}

fn hash(seed: u64, index: u64) -> u64 {
    let z = seed ^ index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_coin_is_fair_and_follows_the_seed() {
        let heads = |seed| (0..10_000).filter(|&i| super::coin(seed, i)).count();
        assert!((4800..5200).contains(&heads(0)) && (4800..5200).contains(&heads(1)));
        assert!((0..64).any(|i| super::coin(0, i) != super::coin(1, i)));
    }
}

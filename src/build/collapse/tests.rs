use super::*;
use crate::build::{Leaves, find};
use crate::test_random::Random;

#[test]
fn trees_of_every_small_size_are_valid() {
    for count in 0..70 {
        let mesh = Random::new(count as u64).mesh(count);
        let binary = (find("binned").unwrap().build)(&mesh, Leaves::Wide);
        binary.validate(&mesh).unwrap();
        for triangle in [0.0, 0.1, 10.0] {
            let costs = WideCosts { triangle, ..WideCosts::default() };
            collapse(&binary, costs, |_, _| 0.0).validate(&mesh).unwrap();
        }
    }
}

#[test]
fn costs_decide_on_leaves_and_scores_on_the_order() {
    let mesh = Random::new(9).mesh(5000);
    let binary = (find("binned").unwrap().build)(&mesh, Leaves::Wide);
    let area = |node: usize, side: usize| binary.nodes[node].bounds[side].half_area();
    let of = |triangle| collapse(&binary, WideCosts { leaf: 1.0, triangle }, area);
    let (cheap, dear) = (of(0.0), of(1e3));
    assert!(5 * cheap.leaf_count() < 4 * dear.leaf_count(), "{} leaves", cheap.leaf_count());
    // None is put together.
    assert_eq!(dear.leaf_count(), binary.leaf_count());
    for node in &cheap.nodes {
        let areas: Vec<_> = (0..node.len as usize).map(|s| node.bounds(s).half_area()).collect();
        assert!(areas.is_sorted_by(|a, b| a >= b), "{areas:?}");
    }
    let children: u32 = dear.nodes.iter().map(|node| node.len).sum();
    let filled = f64::from(children) / (8.0 * dear.nodes.len() as f64);
    assert!(filled > 0.5, "{filled} of the slots are filled");
}

#[test]
fn the_validator_sees_what_is_wrong() {
    let mesh = Random::new(10).mesh(300);
    let binary = (find("binned").unwrap().build)(&mesh, Leaves::Wide);
    let good = collapse(&binary, WideCosts::default(), |_, _| 0.0);
    let broken = |change: fn(&mut Bvh8)| {
        let mut tree = good.clone();
        change(&mut tree);
        tree.validate(&mesh).unwrap_err()
    };
    assert!(broken(|t| t.nodes[0].planes[1][0][0] -= 1.0).contains("box"));
    assert!(broken(|t| t.nodes[0].children.swap(0, 1)).contains("box"));
    assert!(broken(|t| t.triangle_ids.swap(0, 299)).contains("corners"));
    assert!(broken(|t| t.nodes[0].len -= 1).contains("children"));
    assert!(broken(|t| t.leaves.truncate(100)).contains("numbers"));
}

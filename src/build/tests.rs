//! What every builder must do.

use super::*;
use crate::test_random::Random;
use crate::tree::{MAX_LEAF_TRIANGLES, MAX_WIDE_LEAF};
use glam::Vec3;

/// The trees of all builders, each first with leaves that fit.
fn checked(mesh: &TriangleMesh) -> Vec<Bvh2> {
    let checked = |builder: &&BuilderEntry| {
        [Leaves::Fit, Leaves::Wide].map(|leaves| {
            let tree = (builder.build)(mesh, leaves);
            tree.validate(mesh).unwrap_or_else(|wrong| panic!("{}: {wrong}", builder.name));
            for child in tree.nodes.iter().flat_map(|node| node.children) {
                let fits = !child.is_leaf() || child.leaf_slots().len() <= MAX_WIDE_LEAF;
                assert!(fits || leaves == Leaves::Fit, "{}", builder.name);
            }
            tree
        })
    };
    BUILDERS.iter().flat_map(checked).collect()
}

#[test]
fn trees_of_every_small_size_are_valid() {
    for count in 0..70 {
        checked(&Random::new(count as u64).mesh(count));
    }
}

#[test]
fn a_large_tree_is_valid_better_than_chance_and_the_same_on_any_threads() {
    let mesh = Random::new(7).mesh(150_000);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| checked(&mesh))
    };
    for (one, four) in on(1).into_iter().zip(on(4)) {
        assert_eq!(one.nodes, four.nodes);
        assert_eq!(one.triangle_ids, four.triangle_ids);
        assert!(one.sah_cost() < 0.01 * mesh.len() as f64, "{}", one.sah_cost());
    }
}

#[test]
fn coincident_triangles_are_halved() {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    for tree in checked(&TriangleMesh::new(corners, vec![[0, 1, 2]; 100_000])) {
        assert!(tree.leaf_count() > 100_000 / MAX_LEAF_TRIANGLES);
    }
}

#[test]
fn geometric_growth_does_not_run_out_of_depth() {
    // Each triangle is as large as all before it: the heuristic peels them off one by one.
    let mut corners = Vec::new();
    for i in 0..110 {
        let p = Vec3::splat((f64::from(i) - 60.0).exp2() as f32);
        corners.extend([p, p * 1.5, p * Vec3::new(1.5, 1.0, 1.2)]);
    }
    let triangles = (0..110).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    checked(&TriangleMesh::new(corners, triangles));
}

#[test]
fn areas_that_overflow_fall_back_to_halving() {
    let mut random = Random::new(3);
    let corners: Vec<Vec3> = (0..300).map(|_| random.point() * 1e37).collect();
    let triangles = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    checked(&TriangleMesh::new(corners, triangles));
}

use super::*;
use crate::test_random::Random;
use crate::tree::KD_INTERSECTION_COST;
use glam::Vec3;

fn checked(mesh: &TriangleMesh, splits: Splits) -> KdTree {
    let tree = build(mesh, splits).unwrap();
    tree.validate(mesh).unwrap();
    tree
}

fn both(mesh: &TriangleMesh) -> [KdTree; 2] {
    [checked(mesh, Splits::Perfect), checked(mesh, Splits::Boxes)]
}

/// Triangles with corners of their own.
fn soup(corners: Vec<Vec3>) -> TriangleMesh {
    let triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(corners, triangles.collect())
}

#[test]
fn trees_of_every_small_size_are_valid() {
    for count in 0..60 {
        both(&Random::new(count as u64).mesh(count));
    }
}

#[test]
fn the_same_tree_on_any_threads() {
    let mesh = Random::new(51).mesh(70_000);
    for splits in [Splits::Perfect, Splits::Boxes] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| build(&mesh, splits).unwrap())
        };
        let (one, four) = (on(1), on(4));
        assert!(one == four);
        one.validate(&mesh).unwrap();
    }
}

#[test]
fn perfect_splits_cost_less_than_boxes() {
    for (seed, count) in [(52, 300), (53, 3000), (54, 20_000)] {
        let [perfect, boxes] = both(&Random::new(seed).mesh(count)).map(|tree| tree.sah_cost());
        assert!(perfect < boxes, "{count}: {perfect} {boxes}");
        assert!(perfect < 0.5 * KD_INTERSECTION_COST * count as f64, "{count}: {perfect}");
    }
}

#[test]
fn flat_scenes_and_walls() {
    let mut random = Random::new(55);
    for axis in 0..3 {
        let corners = (0..600).map(|_| {
            let mut p = random.point();
            p[axis] = 1.0;
            p
        });
        both(&soup(corners.collect()));
    }
    // On a line, and at a point.
    both(&soup((0..90).map(|i| Vec3::X * (i % 17) as f32).collect()));
    both(&soup(vec![Vec3::ONE; 90]));
}

#[test]
fn a_wall_on_the_face_of_its_cell_is_cut_off() {
    let wall = [Vec3::ZERO, Vec3::Y * 4.0, Vec3::Z * 4.0];
    let far = [Vec3::X * 9.0, Vec3::new(9.0, 1.0, 0.0), Vec3::new(9.5, 0.0, 1.0)];
    let [tree, _] = both(&soup([wall, far].concat()));
    let flat = |index: usize, cell: &Aabb| tree.nodes[index].is_leaf() && cell.size().x == 0.0;
    let mut found = 0;
    tree.walk(|index, cell, _| found += usize::from(flat(index, cell)));
    assert_eq!(found, 1);
}

#[test]
fn coincident_triangles_end_in_leaves() {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, 1.0)];
    let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]; 5000]);
    for tree in both(&mesh) {
        assert!(tree.references.len() < 40 * mesh.len());
    }
}

#[test]
fn coordinates_of_all_sizes() {
    for exponent in [-140, -60, 60, 120] {
        let mut random = Random::new(56);
        let scale = f64::from(exponent).exp2() as f32;
        both(&soup((0..600).map(|_| random.point() * scale).collect()));
        let grown = |i: i32| random.point() * (f64::from(i - 100).exp2() as f32);
        both(&soup((0..200).map(grown).collect()));
    }
}

/// Points of triangles are found: by going down the tree to all cells that hold them.
#[test]
fn every_point_of_a_triangle_is_in_a_leaf_that_lists_it() {
    let mut random = Random::new(57);
    let mesh = random.mesh(2000);
    for tree in both(&mesh) {
        for (slot, triangle) in tree.triangles.iter().enumerate() {
            let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
            for sample in 0..20 {
                let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = match sample {
                    0 => a,
                    1 => b,
                    2 => c,
                    3 => a + (b - a) * u,
                    _ => a + (b - a) * u + (c - a) * v,
                };
                let point = point.as_vec3().clamp(tree.bounds.min, tree.bounds.max);
                assert!(is_listed(&tree, 0, point, slot as u32), "{point} of {triangle:?}");
            }
        }
    }
}

fn is_listed(tree: &KdTree, index: usize, point: Vec3, slot: u32) -> bool {
    let node = tree.nodes[index];
    if node.is_leaf() {
        return tree.references[node.leaf_range()].contains(&slot);
    }
    let at = point[node.axis()];
    let [lower, upper] = tree.children(index);
    // A rounded point may lie a hair on the wrong side.
    let hair = 4.0 * f32::EPSILON * at.abs().max(4.0);
    (at <= node.split() + hair && lower.is_some_and(|c| is_listed(tree, c, point, slot)))
        || (at >= node.split() - hair && upper.is_some_and(|c| is_listed(tree, c, point, slot)))
}

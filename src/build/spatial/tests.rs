use super::*;
use crate::build::find;
use crate::test_random::Random;
use glam::Vec3;

fn checked(mesh: &TriangleMesh) -> Bvh2 {
    let tree = build(mesh, Leaves::Fit);
    tree.validate(mesh).unwrap();
    tree
}

/// Small triangles and, one in eight, long ones across the scene, with corners scaled and moved.
fn mixed(count: u32, scale: f32, offset: Vec3) -> TriangleMesh {
    let mut random = Random::new(71);
    let corners = (0..count).flat_map(|i| {
        let (a, b) = (random.point(), random.point());
        let b = if i % 8 == 0 { b } else { a.lerp(b, 0.02) };
        [a, b, b + random.point() * 0.02].map(|corner| corner * scale + offset)
    });
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(corners.collect(), triangles)
}

#[test]
fn long_triangles_cost_less_within_the_budget() {
    let mesh = mixed(2000, 1.0, Vec3::ZERO);
    let tree = checked(&mesh);
    let added = tree.triangle_ids.len() - mesh.len();
    assert!(added > 500 && added <= mesh.len() * BUDGET_PERCENT / 100, "{added}");
    let whole = (find("binned").unwrap().build)(&mesh, Leaves::Fit);
    assert!(tree.sah_cost() < 0.9 * whole.sah_cost(), "{} {}", tree.sah_cost(), whole.sah_cost());
}

#[test]
fn any_budget_is_kept_and_the_tree_is_valid() {
    let mesh = mixed(300, 1.0, Vec3::ZERO);
    let triangles: Vec<_> = (0..mesh.len()).map(|i| mesh.triangle(i)).collect();
    let shared =
        Shared { instructions: Instructions::detect(), triangles: &triangles, least_overlap: 0.0 };
    for budget in [0, 1, 2, 7, 50, 3000] {
        let (references, extent) = references_to(&mesh);
        let part = Part { shared: &shared, references, extent, budget };
        let tree = top_down::build(&mesh, Some(part), Leaves::Fit, None);
        tree.validate(&mesh).unwrap();
        let added = tree.triangle_ids.len() - mesh.len();
        assert!(added <= budget && (budget < 50 || added > 10), "{added} of {budget}");
    }
}

#[test]
fn coordinates_of_all_sizes() {
    for exponent in [-140, -60, 0, 60, 120] {
        let scale = f64::from(exponent).exp2() as f32;
        for offset in [Vec3::ZERO, Vec3::new(1e5, -3e4, 7.0) * scale] {
            if offset.is_finite() {
                checked(&mixed(300, scale, offset));
            }
        }
    }
}

#[test]
fn the_validator_sees_what_is_cut_off() {
    let mesh = mixed(300, 1.0, Vec3::ZERO);
    let tree = checked(&mesh);
    let cut = tree.nodes.iter().position(|n| {
        let mut ids = n.children.iter().filter(|c| c.is_leaf()).flat_map(|c| c.leaf_slots());
        n.children[0].is_leaf() && ids.any(|slot| is_in_several(&tree, slot))
    });
    let mut broken = tree.clone();
    let bounds = &mut broken.nodes[cut.unwrap()].bounds[0];
    bounds.max = bounds.center();
    assert!(broken.validate(&mesh).is_err());
    let mut broken = tree.clone();
    let twice = (0..tree.triangle_ids.len()).find(|&slot| is_in_several(&tree, slot)).unwrap();
    let single = (0..tree.triangle_ids.len()).find(|&slot| !is_in_several(&tree, slot)).unwrap();
    broken.triangle_ids[single] = tree.triangle_ids[twice];
    broken.triangles[single] = tree.triangles[twice];
    assert!(broken.validate(&mesh).unwrap_err().contains("nowhere"));
}

fn is_in_several(tree: &Bvh2, slot: usize) -> bool {
    let id = tree.triangle_ids[slot];
    tree.triangle_ids.iter().filter(|&&other| other == id).count() > 1
}

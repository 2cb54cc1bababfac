//! Traversal orders: ties, threads, and what needs recorded rays.

mod common;

use common::random::Random;
use common::scene_of;
use sato::backend::{BuildContext, SharedTrees, build};
use sato::geometry::TriangleMesh;
use sato::order::{ORDERS, OrderContext, find};
use sato::ray_set::RaySet;
use sato::tree::{Bvh2, ChildRef, Plan};

fn built(mesh: &TriangleMesh) -> Bvh2 {
    (sato::build::find("binned").unwrap().build)(mesh, sato::build::Leaves::Fit)
}

/// A number for the triangles below a child: the larger one comes first.
type Key<'a> = &'a dyn Fn(&[u32]) -> f64;

/// Every triangle below a child, from the mesh.
fn triangles_below(tree: &Bvh2, child: ChildRef) -> Vec<u32> {
    if child.is_leaf() {
        return tree.triangle_ids[child.leaf_slots()].to_vec();
    }
    let children = tree.nodes[child.node_index()].children;
    children.iter().flat_map(|c| triangles_below(tree, *c)).collect()
}

/// Against areas and counts from the triangles themselves, on every node, ties included.
#[test]
fn simple_keys_agree_with_brute_force() {
    let mut random = Random::new(31);
    // The second one is full of ties.
    let grid: Vec<_> = (0..2000).map(|_| random.point().round()).collect();
    let triangles = (0..600).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let meshes = [(0, random.mesh(4000)), (1, TriangleMesh::new(grid, triangles))];
    for (least_ties, mesh) in meshes {
        let area = |ids: &[u32]| {
            let corners = ids.iter().flat_map(|&i| mesh.triangle(i as usize).0);
            let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for corner in corners {
                for axis in 0..3 {
                    min[axis] = min[axis].min(f64::from(corner[axis]));
                    max[axis] = max[axis].max(f64::from(corner[axis]));
                }
            }
            let [x, y, z] = [0, 1, 2].map(|axis| max[axis] - min[axis]);
            2.0 * (x * y + y * z + z * x)
        };
        let fewest = |ids: &[u32]| -(ids.len() as f64);
        let most = |ids: &[u32]| ids.len() as f64;
        let keys: [(&str, Key<'_>); 3] =
            [("node-sato", &area), ("prim-num", &fewest), ("prim-num-most", &most)];
        let tree = built(&mesh);
        for (order, key) in keys {
            let plan = (find(order).unwrap().plan_bvh2)(&tree, &OrderContext::new(&mesh));
            let Plan::Fixed(second_first) = plan else { panic!("a fixed order") };
            let mut ties = 0;
            for (index, node) in tree.nodes.iter().enumerate() {
                let keys = node.children.map(|c| key(&triangles_below(&tree, c)));
                ties += u32::from(keys[0] == keys[1]);
                assert_eq!(second_first.get(index), keys[1] > keys[0], "{order}: {keys:?}");
            }
            assert!(ties >= least_ties, "{order}: {ties}");
        }
    }
}

/// Orders change nothing but the order, and the same way on any number of threads.
#[test]
fn orders_are_the_same_on_any_number_of_threads() {
    let mut random = Random::new(32);
    let mesh = random.mesh(40_000);
    let rays: Vec<_> = (0..3000).map(|_| random.ray()).collect();
    let mut training = RaySet::default();
    training.push_batch(&rays);
    let tree = built(&mesh);
    for order in ORDERS {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let context = OrderContext { mesh: &mesh, seed: 5, training: Some(&training) };
            pool.install(|| (order.plan_bvh2)(&tree, &context))
        };
        assert_eq!(on(1), on(3), "{}", order.name);
    }
}

#[test]
fn trees_without_inner_nodes_have_any_order() {
    for count in 0..3 {
        let mesh = Random::new(33).mesh(count);
        for order in ORDERS {
            let tree = built(&mesh);
            let plan = (order.plan_bvh2)(&tree, &OrderContext::new(&mesh));
            assert!(!matches!(plan, Plan::Fixed(bits) if bits.count_ones() > 0 && count < 2));
        }
    }
}

#[test]
fn orders_that_learn_ask_for_rays() {
    let scene = scene_of(Random::new(34).mesh(100));
    for order in ORDERS.iter().filter(|o| o.needs_training) {
        let spec = format!("bvh2:order={}", order.name).parse().unwrap();
        let trees = SharedTrees::of(&scene);
        let context =
            BuildContext { scene: &scene, trees: &trees, threads: 1, seed: 0, training: None };
        let refusal = build(&spec, &context).err().expect("refused").to_string();
        assert!(refusal.contains("needs recorded rays"), "{refusal}");
    }
}

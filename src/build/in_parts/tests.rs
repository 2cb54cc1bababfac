use super::*;
use crate::build::{BUILDERS, BuilderEntry, collapse_and_keep, find, object_split};
use crate::order::{ORDERS, OrderContext};
use crate::test_random::Random;

/// Below a child of either tree: the same boxes in the same slots, and the same leaves.
fn assert_same(a: (&Bvh8, ChildRef), b: (&Bvh8, ChildRef), what: &str) {
    let (x, y) = (a.1, b.1);
    assert_eq!(x.is_leaf(), y.is_leaf(), "{what}");
    if x.is_leaf() {
        let leaf = |(tree, child): (&Bvh8, ChildRef)| {
            let slots = child.leaf_slots();
            let numbers = slots.start * LEAF_ROWS..slots.end * LEAF_ROWS;
            (tree.triangle_ids[slots].to_vec(), tree.leaves[numbers].to_vec())
        };
        assert_eq!(leaf(a), leaf(b), "{what}");
        return;
    }
    let (m, n) = (&a.0.nodes[x.node_index()], &b.0.nodes[y.node_index()]);
    assert_eq!((m.planes, m.len), (n.planes, n.len), "{what}");
    for slot in 0..m.len as usize {
        assert_same((a.0, m.children[slot]), (b.0, n.children[slot]), what);
    }
}

/// What the same builder's binary tree is collapsed to, for every order that goes part by part.
fn check(builder: &BuilderEntry, mesh: &TriangleMesh, build: impl Fn(PartOrder) -> BuiltInParts) {
    let binary = (builder.build)(mesh, Leaves::Wide);
    let context = OrderContext::new(mesh);
    let mut orders = 0;
    for order in ORDERS {
        let Some(score) = order.score_part else { continue };
        let what = format!("{} {} {} triangles", builder.name, order.name, mesh.len());
        let built = build(PartOrder { score, keeps_scores: true });
        built.tree.validate(mesh).unwrap_or_else(|fault| panic!("{what}: {fault}"));
        let scores = order.scores.expect("orders that go part by part have scores");
        let scores = scores(&binary, &context);
        let score = |node: usize, side: usize| scores[node][side];
        let (whole, kept) = collapse_and_keep(&binary, WideCosts::default(), score, true);
        assert_eq!(built.tree.nodes.len(), whole.nodes.len(), "{what}");
        assert_eq!(built.scores, kept, "{what}");
        if let Some((a, b)) = built.tree.root.zip(whole.root) {
            assert_same((&built.tree, a), (&whole, b), &what);
        }
        orders += 1;
    }
    assert!(orders >= 6, "{orders}");
}

#[test]
fn parts_make_the_tree_of_the_whole() {
    let mut random = Random::new(0x1a7);
    for builder in BUILDERS {
        let Some(in_parts) = builder.in_parts else { continue };
        for count in [0, 1, 3, 9, 300, 5000, 30_000] {
            let mesh = random.mesh(count);
            check(builder, &mesh, |order| in_parts(&mesh, order));
        }
    }
}

/// However small parts are, and where the heuristic finds nothing to tell triangles apart by.
#[test]
fn the_size_of_parts_does_not_show() {
    let mut random = Random::new(0x1a8);
    let mesh = random.mesh(4000);
    let mut alike = random.mesh(1);
    alike = TriangleMesh::new(alike.vertices().to_vec(), vec![[0, 1, 2]; 3000]);
    for (mesh, is_moved) in [(&mesh, false), (&mesh, true), (&alike, false), (&alike, true)] {
        let builder = find(if is_moved { "top-reinsertion" } else { "binned" }).unwrap();
        let sets = is_moved.then(|| Sets::of(mesh.len()));
        for most in [9, 16, 77, 1000, 10_000] {
            check(builder, mesh, |order| {
                let (mut references, extent) = object_split::references_to(mesh);
                let root = object_split::Set::new(&mut references, extent);
                of_size(mesh, Some(root), order, sets, most)
            });
        }
    }
}

#[test]
fn threads_do_not_show() {
    let mesh = Random::new(0x1a9).mesh(100_000);
    let in_parts = find("binned").unwrap().in_parts.unwrap();
    let score = ORDERS.iter().find(|order| order.name == "p-over-c").unwrap().score_part.unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| in_parts(&mesh, PartOrder { score, keeps_scores: false }).tree)
    };
    let (one, four) = (on(1), on(4));
    assert_eq!(one.nodes, four.nodes);
    assert_eq!(one.triangle_ids, four.triangle_ids);
    assert_eq!(one.leaves, four.leaves);
}

use super::super::{LEAST_GAIN, SECOND, Upkeep};
use super::refit::Part;
use super::*;
use crate::build::{BUILDERS, Leaves};
use crate::geometry::{Triangle, Vec3};
use crate::order::{self, ORDERS, OrderContext};
use crate::test_motion::{MOTIONS, moved};
use crate::test_random::Random;
use crate::tree::{ChildRef, MAX_DEPTH, Node2, Plan};

fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// All nodes of a small tree as one part, without leaves to refit.
fn whole<'a>(
    tree: &'a mut Bvh2,
    mesh: &'a TriangleMesh,
    heights: &'a mut [u8],
    touched: &'a mut Touched,
) -> Part<'a> {
    Part {
        mesh,
        ids: &tree.triangle_ids,
        nodes: &mut tree.nodes,
        first: 0,
        triangles: &mut tree.triangles,
        first_slot: 0,
        heights,
        disturbed: &mut [],
        closed: None,
        touched,
        second: None,
        cost: 0.0,
    }
}

#[test]
fn trees_are_right_wherever_their_triangles_go() {
    let mut rotations = 0;
    for (seed, count) in [(0xf1, 0), (0xf2, 1), (0xf3, 2), (0xf4, 60), (0xf5, 30_000)] {
        let mesh = Random::new(seed).mesh(count);
        for builder in BUILDERS {
            for rotates in [false, true] {
                let follow = || {
                    let mut tree = (builder.build)(&mesh, Leaves::Fit);
                    let mut follower = BinaryFollower::of(&tree, true);
                    let mut trees = Vec::new();
                    for (frame, motion) in MOTIONS.iter().enumerate() {
                        let mesh = moved(&mesh, *motion, seed ^ frame as u64);
                        let updated = follower.update(&mut tree, &mesh, rotates, None);
                        if let Err(fault) = follower.validate(&tree, &mesh, &updated) {
                            panic!("{} {count} {motion:?} {rotates}: {fault}", builder.name);
                        }
                        assert!(rotates || updated.rotations == 0);
                        trees.push((tree.nodes.clone(), updated));
                    }
                    trees
                };
                let (one, two) = (on_threads(1, follow), on_threads(2, follow));
                assert!(one == two, "{} {count} {rotates}: threads", builder.name);
                rotations += one.iter().map(|(_, updated)| updated.rotations).sum::<u64>();
            }
        }
    }
    assert!(rotations > 1000, "{rotations}");
}

/// Of the six ways, the one done leaves the least cost of the whole tree, and never more than before.
#[test]
fn the_best_of_all_rotations_is_done() {
    let mut done = 0;
    for seed in 0..400 {
        let mesh = Random::new(0x600 + seed).mesh(40);
        let mesh = moved(&mesh, MOTIONS[seed as usize % MOTIONS.len()], seed);
        let mut tree = (BUILDERS[0].build)(&mesh, Leaves::Fit);
        // Leaves in other places make a bad tree.
        let children = tree.nodes.iter().flat_map(|node| node.children);
        let mut leaves: Vec<ChildRef> = children.filter(|child| child.is_leaf()).collect();
        let mut random = Random::new(0x700 + seed);
        for i in (1..leaves.len()).rev() {
            leaves.swap(i, (random.bits() % (i as u64 + 1)) as usize);
        }
        let mut next = leaves.into_iter();
        for index in (0..tree.nodes.len()).rev() {
            for side in 0..2 {
                let child = tree.nodes[index].children[side];
                let count = if child.is_leaf() {
                    let leaf = next.next().unwrap();
                    tree.nodes[index].children[side] = leaf;
                    leaf.leaf_slots().len() as u32
                } else {
                    tree.nodes[child.node_index()].counts.iter().sum()
                };
                tree.nodes[index].counts[side] = count;
            }
        }
        BinaryFollower::of(&tree, false).update(&mut tree, &mesh, false, None);
        tree.validate_moved(&mesh).unwrap();
        let before = tree.sah_cost();
        for index in (0..tree.nodes.len()).rev() {
            let children = tree.nodes[index].children;
            let mut ways = Vec::new();
            for (side, child) in children.iter().enumerate().filter(|(_, c)| !c.is_leaf()) {
                let child = child.node_index();
                ways.extend([0, 1].map(|g| [(index, 1 - side), (child, g)]));
            }
            if let [false, false] = children.map(ChildRef::is_leaf) {
                let [a, b] = children.map(ChildRef::node_index);
                ways.extend([0, 1].map(|g| [(a, 0), (b, g)]));
            }
            let area = |child: usize| {
                let side = children.iter().position(|c| *c == ChildRef::inner(child)).unwrap();
                tree.nodes[index].bounds[side].half_area()
            };
            let then = tree.sah_cost();
            // Of those that gain enough for the boxes in between.
            let costs = ways.iter().filter_map(|places| {
                let mut other = tree.clone();
                let (mut heights, mut touched) = (Vec::new(), Touched::default());
                whole(&mut other, &mesh, &mut heights, &mut touched).exchange(*places);
                refit_any(&mut other);
                let between = places.iter().map(|place| place.0).filter(|&node| node != index);
                let gain = (then - other.sah_cost()) * tree.bounds.half_area();
                let least = between.map(area).sum::<f64>() * LEAST_GAIN;
                (gain > least * 1.001).then(|| other.sah_cost())
            });
            let best = costs.fold(f64::INFINITY, f64::min);
            let mut rotated = tree.clone();
            let mut heights = vec![1; tree.nodes.len()];
            let mut touched = Touched::default();
            let mut part = whole(&mut rotated, &mesh, &mut heights, &mut touched);
            let step = Step { index: index as u32, depth: 0 };
            let is_rotated = part.rotate(step) != [None; 2];
            let now = rotated.sah_cost();
            if is_rotated {
                assert!(now <= best.min(then) * (1.0 + 1e-5), "{seed} {index}: {now} {best}");
                done += 1;
            } else {
                assert!(best.is_infinite(), "{seed} {index}: {best} {then}");
            }
        }
        let mut follower = BinaryFollower::of(&tree, false);
        let after = follower.update(&mut tree, &mesh, true, None);
        assert!(after.sah_cost <= before, "{seed}: {} {before}", after.sah_cost);
        follower.validate(&tree, &mesh, &after).unwrap();
    }
    assert!(done > 300, "{done}");
}

/// Boxes and counts of all nodes from those of the leaves, whatever their order.
fn refit_any(tree: &mut Bvh2) {
    fn settle(tree: &mut Bvh2, child: ChildRef) -> Option<(Aabb, u32)> {
        if child.is_leaf() {
            return None;
        }
        let index = child.node_index();
        for side in 0..2 {
            let child = tree.nodes[index].children[side];
            if let Some((bounds, count)) = settle(tree, child) {
                tree.nodes[index].bounds[side] = bounds;
                tree.nodes[index].counts[side] = count;
            }
        }
        let node = &tree.nodes[index];
        Some((node.bounds[0].union(node.bounds[1]), node.counts[0] + node.counts[1]))
    }
    settle(tree, tree.root.unwrap());
}

/// The leaves as a fixed plan has them visited.
fn visited(tree: &Bvh2, plan: &Plan) -> Vec<ChildRef> {
    let Plan::Fixed(bits) = plan else { panic!("a fixed order") };
    let (mut pending, mut leaves) = (vec![tree.root.unwrap()], Vec::new());
    while let Some(child) = pending.pop() {
        if child.is_leaf() {
            leaves.push(child);
            continue;
        }
        let index = child.node_index();
        let first = usize::from(bits.get(index));
        let children = tree.nodes[index].children;
        pending.extend([children[1 - first], children[first]]);
    }
    leaves
}

/// A subtree that goes elsewhere and comes back leaves the tree and the order of visits as they were,
/// and in between each node's bit is right: it does not stay with the side.
#[test]
fn rotations_there_and_back_restore_tree_and_order() {
    let mesh = Random::new(0x81).mesh(2000);
    let context = OrderContext::new(&mesh);
    for name in ["node-sato", "prim-num", "prim-num-most"] {
        let order = order::find(name).unwrap();
        let mut tree = (BUILDERS[0].build)(&mesh, Leaves::Fit);
        let mut follower = BinaryFollower::of(&tree, false);
        let mut upkeep = PlanUpkeep::new(order, Upkeep::Selective).unwrap();
        let mut plan = upkeep.plan(&tree, &follower, &context);
        let (nodes, leaves) = (tree.nodes.clone(), visited(&tree, &plan));
        let (mut turned, mut tried) = (0, 0);
        for index in 0..nodes.len() {
            let children = nodes[index].children;
            for side in (0..2).filter(|&side| !children[side].is_leaf()) {
                let child = children[side].node_index();
                for grandchild in 0..2 {
                    let places = [(index, 1 - side), (child, grandchild)];
                    let before = plan.clone();
                    for is_back in [false, true] {
                        let (mut heights, mut touched) = (Vec::new(), Touched::default());
                        whole(&mut tree, &mesh, &mut heights, &mut touched).exchange(places);
                        refit_any(&mut tree);
                        let mut part = whole(&mut tree, &mesh, &mut heights, &mut touched);
                        part.second = upkeep.asks_of_exchanged();
                        for index in [index, child] {
                            part.note_exchanged(index as u32);
                        }
                        follower.touched[0] = touched;
                        upkeep.update(&mut tree, &mut follower, &mut plan, &context);
                        let scratch = (order.plan_bvh2)(&tree_with_notes(&tree), &context);
                        if let (Plan::Fixed(kept), Plan::Fixed(scratch)) = (&plan, &scratch) {
                            for touched in [index, child] {
                                assert_eq!(kept.get(touched), scratch.get(touched), "{name}");
                            }
                        }
                        turned += usize::from(!is_back && plan != before);
                        tried += 1;
                    }
                    assert!(tree.nodes == nodes && visited(&tree, &plan) == leaves, "{name}");
                }
            }
            if tried > 2000 {
                break;
            }
        }
        assert!(turned > 100, "{name}: a test in which no bit changes shows nothing: {turned}");
    }
}

fn tree_with_notes(tree: &Bvh2) -> Bvh2 {
    let (triangles, ids) = (tree.triangles.clone(), tree.triangle_ids.clone());
    Bvh2::new(tree.nodes.clone(), tree.root, tree.bounds, triangles, ids)
}

/// Rotations alone leave nothing stale; with motion too, full upkeep leaves nothing stale, and
/// selective upkeep no node that was touched and no number of triangles.
#[test]
fn bits_are_those_from_scratch_where_that_is_promised() {
    let mesh = Random::new(0x91).mesh(25_000);
    let exploded = moved(&mesh, MOTIONS[3], 5);
    for order in ORDERS.iter().filter(|order| !order.needs_training) {
        for upkeep in [Upkeep::Selective, Upkeep::Full] {
            let what = format!("{} {upkeep:?}", order.name);
            let context = OrderContext::new(&mesh);
            let mut tree = (BUILDERS[0].build)(&mesh, Leaves::Fit);
            let mut full = PlanUpkeep::new(order, Upkeep::Full).unwrap();
            let mut kept = PlanUpkeep::new(order, upkeep).unwrap();
            let mut follower = BinaryFollower::of(&tree, kept.needs_ancestors());
            full.plan(&tree, &follower, &context);
            let mut plan = kept.plan(&tree, &follower, &context);
            let context = OrderContext::new(&exploded);
            follower.update(&mut tree, &exploded, false, kept.asks_of_exchanged());
            if upkeep == Upkeep::Full {
                let looked_at = kept.update(&mut tree, &mut follower, &mut plan, &context);
                assert!(looked_at == tree.nodes.len() as u64 || looked_at == 0, "{what}");
                assert_eq!(kept.stale_share(&tree, &plan, &context), 0.0, "{what}: refit");
            }
            // From here on, only rotations.
            plan = kept.plan(&tree_with_notes(&tree), &follower, &context);
            for round in 0..3 {
                let updated = follower.update(&mut tree, &exploded, true, kept.asks_of_exchanged());
                assert!(updated.rotations > 0 || round > 0, "{what}");
                let looked_at = kept.update(&mut tree, &mut follower, &mut plan, &context);
                assert_eq!(kept.stale_share(&tree, &plan, &context), 0.0, "{what} {round}");
                let is_fixed = matches!(plan, Plan::Fixed(_)) && order.name != "random";
                let all = tree.nodes.len() as u64;
                if upkeep == Upkeep::Selective && is_fixed && updated.rotations > 0 {
                    assert!(looked_at > updated.rotations && looked_at < 2 * all, "{what}");
                }
            }
            // With motion, what was touched.
            let updated = follower.update(&mut tree, &mesh, true, kept.asks_of_exchanged());
            let context = OrderContext::new(&mesh);
            kept.update(&mut tree, &mut follower, &mut plan, &context);
            let stale = kept.stale_share(&tree, &plan, &context);
            let is_exact = upkeep == Upkeep::Full || order.name.starts_with("prim-num");
            assert!(updated.rotations > 100 && (!is_exact || stale == 0.0), "{what}: {stale}");
            if let (order::DependsOn::Children(second), Plan::Fixed(bits)) =
                (order.depends_on, &plan)
            {
                for &index in follower.touched.iter().flat_map(|touched| &touched.exchanged) {
                    let index = (index & !SECOND) as usize;
                    assert_eq!(bits.get(index), second(&tree.nodes[index]), "{what} {index}");
                }
            }
        }
    }
}

/// A chain as deep as trees may be: each of its nodes has a node of two leaves and the next of the chain.
fn chain() -> (Bvh2, TriangleMesh) {
    let levels = MAX_DEPTH - 1;
    let count = 2 * levels + 2;
    let vertices = (0..count).flat_map(|i| {
        let far = Vec3::new(i as f32 * 0.5, 0.0, 0.0);
        [far, far + Vec3::X * 0.1, far + Vec3::Y * 0.1]
    });
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let mesh = TriangleMesh::new(vertices.collect(), triangles.collect());
    let ids: Vec<u32> = (0..count as u32).collect();
    let corners: Vec<Triangle> = ids.iter().map(|&id| mesh.triangle(id as usize)).collect();
    let node = |children: [ChildRef; 2], counts: [usize; 2]| Node2 {
        bounds: [Aabb::EMPTY; 2],
        children,
        counts: counts.map(|count| count as u32),
    };
    let pair = |slot: usize| node([0, 1].map(|i| ChildRef::leaf(slot + i, 1)), [1, 1]);
    let mut nodes = Vec::new();
    for level in 0..levels {
        let own = nodes.len();
        let children = [ChildRef::inner(own + 1), ChildRef::inner(own + 2)];
        nodes.push(node(children, [2, count - 2 * level - 2]));
        nodes.push(pair(2 * level));
    }
    nodes.push(pair(count - 2));
    (Bvh2::new(nodes, Some(ChildRef::inner(0)), Aabb::EMPTY, corners, ids), mesh)
}

#[test]
fn rotations_keep_to_the_depth() {
    let mut random = Random::new(0xa1);
    let (mut near, mut refused) = (0, 0);
    for round in 0..60 {
        let (mut tree, mesh) = chain();
        let mut follower = BinaryFollower::of(&tree, false);
        assert_eq!(usize::from(follower.heights[0]), MAX_DEPTH);
        for frame in 0..6 {
            let mesh = mesh.moved(|vertices| {
                for (index, corners) in vertices.chunks_mut(3).enumerate() {
                    let mut to = Vec3::new(random.unit(), random.unit(), random.unit());
                    if round % 2 == 0 {
                        to *= 50.0;
                    } else if index % 2 == 0 {
                        // One of each pair lies far out: the rest of the chain suits the other.
                        to = (to + Vec3::ONE) * (30.0 - 0.25 * index as f32).exp2();
                    }
                    corners.iter_mut().for_each(|corner| *corner = *corner * 0.1 + to);
                }
            });
            follower.update(&mut tree, &mesh, false, None);
            refused += refused_for_depth(&mut tree, &mesh, &follower.heights);
            let updated = follower.update(&mut tree, &mesh, true, None);
            if let Err(fault) = follower.validate(&tree, &mesh, &updated) {
                panic!("{round} {frame}: {fault}");
            }
            near += usize::from(usize::from(follower.heights[0]) >= MAX_DEPTH);
        }
    }
    assert!(near >= 30 && refused > 100, "the limit was never near: {near} {refused}");
}

/// Nodes at which the best rotation puts a subtree deeper than there is room for: another is done
/// where it would be too deep by one level, and none other where it just fits.
fn refused_for_depth(tree: &mut Bvh2, mesh: &TriangleMesh, heights: &[u8]) -> usize {
    let mut refused = 0;
    for index in 0..tree.nodes.len() {
        let rotated_at = |depth: usize| {
            let (mut tree, mut heights) = (tree.clone(), heights.to_vec());
            let mut touched = Touched::default();
            let mut part = whole(&mut tree, mesh, &mut heights, &mut touched);
            part.rotate(Step { index: index as u32, depth: depth as u8 });
            tree.nodes
        };
        let best = rotated_at(0);
        // The child that went down, if one did.
        let down = tree.nodes[index].children.iter().find(|child| {
            let stays = best[index].children.contains(child);
            !stays
        });
        let Some(down) = down else { continue };
        let height = if down.is_leaf() { 0 } else { usize::from(heights[down.node_index()]) };
        let deepest = MAX_DEPTH - 2 - height;
        assert!(rotated_at(deepest) == best);
        assert!(rotated_at(deepest + 1) != best);
        refused += 1;
    }
    refused
}

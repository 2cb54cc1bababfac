use super::super::{LEAST_GAIN, Upkeep};
use super::*;
use crate::build::{BUILDERS, Leaves, collapse_and_keep};
use crate::geometry::Aabb;
use crate::intersect::Mode;
use crate::ray::{Ray, words_for};
use crate::test_motion::{MOTIONS, moved};
use crate::test_random::Random;
use crate::trace::shaft::Entry;
use crate::trace::wide::{Instructions, Query, Scratch, Structure, Way, any_hit};
use crate::tree::{Bvh2, MAX_WIDE_DEPTH, WIDTH};

fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// By area, with scores kept or without.
fn built(mesh: &TriangleMesh, builder: usize, keeps_scores: bool) -> (Bvh8, WideFollower) {
    let binary: Bvh2 = (BUILDERS[builder].build)(mesh, Leaves::Wide);
    let costs = WideCosts::default();
    let area = |node: usize, side: usize| binary.nodes[node].bounds[side].half_area();
    let (tree, scores) = collapse_and_keep(&binary, costs, area, keeps_scores);
    assert_eq!(scores.len(), if keeps_scores { tree.nodes.len() } else { 0 });
    let follower = WideFollower::of(&tree, scores, costs);
    (tree, follower)
}

fn whole<'a>(
    tree: &'a mut Bvh8,
    mesh: &'a TriangleMesh,
    follower: &'a mut WideFollower,
) -> Part<'a> {
    Part {
        mesh,
        ids: &tree.triangle_ids,
        costs: follower.costs,
        nodes: &mut tree.nodes,
        first: 0,
        leaves: &mut tree.leaves,
        first_slot: 0,
        heights: &mut follower.heights,
        scores: &mut follower.scores,
        closed: None,
        touched: &mut follower.touched[0],
        cost: 0.0,
    }
}

#[test]
fn kept_scores_lie_beside_their_children() {
    let mesh = Random::new(0xc1).mesh(20_000);
    let (tree, follower) = built(&mesh, 0, true);
    for (node, scores) in tree.nodes.iter().zip(&follower.scores) {
        for (slot, score) in scores.iter().enumerate() {
            let is_child = slot < node.len as usize;
            let area =
                if is_child { node.bounds(slot).half_area() as f32 } else { f32::NEG_INFINITY };
            assert_eq!(area, *score);
        }
    }
}

#[test]
fn trees_are_right_wherever_their_triangles_go() {
    let mut rotations = 0;
    for (seed, count) in [(0xd1, 0), (0xd2, 1), (0xd3, 9), (0xd4, 300), (0xd5, 20_000)] {
        let mesh = Random::new(seed).mesh(count);
        for (builder, rotates) in (0..BUILDERS.len()).flat_map(|b| [(b, false), (b, true)]) {
            let keeps_scores = builder % 2 == 0;
            let box_score: Option<fn(&Aabb) -> f64> = (!keeps_scores).then_some(Aabb::half_area);
            let follow = |upkeep: Upkeep| {
                let (mut tree, mut follower) = built(&mesh, builder, keeps_scores);
                let ranking = Ranking { box_score, upkeep };
                let mut trees = Vec::new();
                for (frame, motion) in MOTIONS.iter().enumerate() {
                    let mesh = moved(&mesh, *motion, seed ^ frame as u64);
                    let updated = follower.update(&mut tree, &mesh, rotates);
                    let looked_at = ranking.update(&mut tree, &mut follower);
                    if let Err(fault) = follower.validate(&tree, &mesh, &updated) {
                        panic!("{builder} {count} {motion:?} {rotates}: {fault}");
                    }
                    assert!(rotates || updated.rotations == 0);
                    assert!(upkeep != Upkeep::None || looked_at == 0);
                    check_order(&ranking, &tree, &follower);
                    trees.push((tree.nodes.clone(), updated));
                }
                trees
            };
            for upkeep in Upkeep::ALL {
                let one = on_threads(1, || follow(upkeep));
                assert!(one == on_threads(2, || follow(upkeep)), "{builder} {count} {rotates}");
                rotations += one.iter().map(|(_, updated)| updated.rotations).sum::<u64>();
            }
        }
    }
    assert!(rotations > 1000, "{rotations}");
}

/// What stopped rays before triangles moved must not be tried on those that come after.
#[test]
fn rays_meet_triangles_where_they_are_now() {
    let mut random = Random::new(0xd6);
    let mesh = random.mesh(300);
    let rays: Vec<Ray> = (0..400).map(|_| random.ray()).collect();
    let (mut tree, mut follower) = built(&mesh, 0, false);
    let mut scratch = Scratch::default();
    let mut early = 0;
    for (frame, motion) in MOTIONS.iter().enumerate() {
        let mesh = moved(&mesh, *motion, 0xd6 ^ frame as u64);
        follower.update(&mut tree, &mesh, false);
        for way in [Way::Single, Way::Stream] {
            let query = Query {
                structure: Structure::Tree(&tree),
                mesh: &mesh,
                way,
                mode: Mode::Exact,
                entry: &Entry::WHOLE,
                stratum: Some(0),
            };
            let answers = |scratch: &mut Scratch| {
                let mut occluded = vec![0; words_for(rays.len())];
                let early = any_hit(Instructions::detect(), &query, &rays, &mut occluded, scratch);
                (occluded, early)
            };
            let (expected, _) = answers(&mut Scratch::default());
            for _ in 0..3 {
                let (occluded, stopped_early) = answers(&mut scratch);
                assert_eq!(occluded, expected, "{motion:?} {way:?}");
                early += stopped_early;
            }
        }
    }
    assert!(early > 100, "{early} rays by what had stopped others");
}

/// Sorted are the children of all nodes after full upkeep, and of those touched after selective.
fn check_order(ranking: &Ranking, tree: &Bvh8, follower: &WideFollower) {
    let is_sorted = |index: usize| {
        let node = &tree.nodes[index];
        let score = |slot: usize| match ranking.box_score {
            Some(score) => score(&node.bounds(slot)),
            None => f64::from(follower.scores[index][slot]),
        };
        slots_in(node).map(score).is_sorted_by(|a, b| a >= b)
    };
    match ranking.upkeep {
        Upkeep::None => {}
        Upkeep::Selective => {
            let touched = follower.touched.iter().flat_map(|touched| &touched.exchanged);
            touched.for_each(|&index| assert!(is_sorted(index as usize), "{index}"));
        }
        Upkeep::Full => {
            assert!((0..tree.nodes.len()).all(is_sorted));
            assert!(ranking.stale_share(tree).is_none_or(|share| share == 0.0));
        }
    }
}

/// Of all ways at a node, found one by one, the one done leaves the least cost, and less than before.
#[test]
fn the_best_of_all_rotations_is_done() {
    let mut done = 0;
    for seed in 0..40 {
        let mesh = Random::new(0xe00 + seed).mesh(200);
        let mesh = moved(&mesh, MOTIONS[seed as usize % MOTIONS.len()], seed);
        let resting = Random::new(0xf00 + seed).mesh(200);
        let (mut tree, mut follower) = built(&resting, 0, true);
        follower.update(&mut tree, &mesh, false);
        // Children in other places make a bad tree.
        let costs = follower.costs;
        for index in (0..tree.nodes.len()).rev() {
            let before = costs.sah_cost(&tree);
            let mut ways = Vec::new();
            let node = tree.nodes[index];
            let inner: Vec<usize> =
                slots_in(&node).filter(|&slot| !node.children[slot].is_leaf()).collect();
            let below = |slot: usize| {
                let child = node.children[slot].node_index();
                slots_in(&tree.nodes[child]).map(move |place| (child, place))
            };
            for &donor in &inner {
                for slot in slots_in(&node).filter(|&slot| slot != donor) {
                    ways.extend(below(donor).map(|place| [(index, slot), place]));
                }
                for &other in inner.iter().filter(|&&other| other > donor) {
                    ways.extend(below(donor).flat_map(|a| below(other).map(move |b| [a, b])));
                }
            }
            let of_way = |places: &[(usize, usize); 2]| {
                let (mut tree, mut follower) = (tree.clone(), built_again(&follower));
                whole(&mut tree, &mesh, &mut follower).exchange(*places);
                for &slot in &inner {
                    let child = tree.nodes[index].children[slot];
                    if !child.is_leaf() {
                        let bounds = tree.nodes[child.node_index()].all_bounds();
                        tree.nodes[index].set_bounds(slot, &bounds);
                    }
                }
                costs.sah_cost(&tree)
            };
            let best = ways.iter().map(of_way).fold(f64::INFINITY, f64::min);
            let mut part = whole(&mut tree, &mesh, &mut follower);
            let rotated = part.rotate(Step { index: index as u32, depth: 0 }) != [None; 2];
            let after = costs.sah_cost(&tree);
            if rotated {
                assert!(after >= best * (1.0 - 1e-9), "{seed} {index}: {after} {best}");
                assert!(after < before, "{seed} {index}: {after} {before}");
                done += 1;
            } else {
                // Nothing can be exchanged, or none gains enough for the boxes in between.
                let between: f64 = inner.iter().map(|&slot| node.bounds(slot).half_area()).sum();
                let gain = (before - best) * tree.bounds.half_area();
                let is_too_small = gain <= LEAST_GAIN * between * 1.001;
                assert!(inner.is_empty() || is_too_small, "{seed} {index}: {gain} {between}");
            }
        }
    }
    assert!(done > 40, "{done}");
}

fn built_again(follower: &WideFollower) -> WideFollower {
    let WideFollower { heights, scores, costs, .. } = follower;
    WideFollower {
        pieces: Pieces { subtrees: Vec::new(), top: Vec::new() },
        slots: Vec::new(),
        numbers: Vec::new(),
        heights: heights.clone(),
        scores: scores.clone(),
        costs: *costs,
        touched: vec![Touched::default()],
    }
}

/// A child that goes elsewhere and comes back finds tree, scores and order as they were, and in between
/// both are in order.
#[test]
fn rotations_there_and_back_restore_tree_and_order() {
    let mesh = Random::new(0x1c1).mesh(3000);
    let (mut tree, mut follower) = built(&mesh, 0, true);
    let ranking = Ranking { box_score: None, upkeep: Upkeep::Selective };
    let mut moved_slots = 0;
    for index in 0..tree.nodes.len() {
        let node = tree.nodes[index];
        let Some(donor) = slots_in(&node).find(|&slot| !node.children[slot].is_leaf()) else {
            continue;
        };
        let slot = usize::from(donor == 0);
        let below = node.children[donor].node_index();
        let (nodes, scores) = (tree.nodes.clone(), follower.scores.clone());
        let taken = node.children[slot];
        let given = tree.nodes[below].children[0];
        whole(&mut tree, &mesh, &mut follower).exchange([(index, slot), (below, 0)]);
        let sort = |tree: &mut Bvh8, follower: &mut WideFollower| {
            follower.touched.iter_mut().for_each(Touched::clear);
            follower.touched[0].exchanged = vec![index as u32, below as u32];
            assert_eq!(ranking.update(tree, follower), 2);
            check_order(&ranking, tree, follower);
        };
        sort(&mut tree, &mut follower);
        let find = |tree: &Bvh8, index: usize, child| {
            tree.nodes[index].children.iter().position(|c| *c == child).unwrap()
        };
        let there = [(index, find(&tree, index, given)), (below, find(&tree, below, taken))];
        moved_slots += usize::from(there != [(index, slot), (below, 0)]);
        whole(&mut tree, &mesh, &mut follower).exchange(there);
        sort(&mut tree, &mut follower);
        let has_ties = [index, below].iter().any(|&index| {
            let scores = &scores[index][..nodes[index].len as usize];
            scores.windows(2).any(|pair| pair[0] == pair[1])
        });
        if has_ties {
            (tree.nodes, follower.scores) = (nodes, scores);
        } else {
            assert!(tree.nodes == nodes && follower.scores == scores, "node {index}");
        }
    }
    assert!(moved_slots > 20, "{moved_slots}");
}

#[test]
fn rotations_keep_to_the_depth() {
    let mesh = Random::new(0x1d1).mesh(4000);
    let mesh = moved(&mesh, MOTIONS[3], 1);
    let (mut tree, mut follower) = built(&Random::new(0x1d2).mesh(4000), 0, true);
    follower.update(&mut tree, &mesh, false);
    let mut refused = 0;
    for index in 0..tree.nodes.len() {
        let rotated_at = |depth: usize| {
            let (mut tree, mut follower) = (tree.clone(), built_again(&follower));
            let step = Step { index: index as u32, depth: depth as u8 };
            whole(&mut tree, &mesh, &mut follower).rotate(step);
            tree.nodes
        };
        let best = rotated_at(0);
        let node = &tree.nodes[index];
        let children = best[index].children;
        let Some(down) = node.children.iter().find(|child| !children.contains(child)) else {
            continue;
        };
        let height =
            if down.is_leaf() { 0 } else { usize::from(follower.heights[down.node_index()]) };
        let deepest = MAX_WIDE_DEPTH - 2 - height;
        assert!(rotated_at(deepest) == best, "{index}");
        assert!(rotated_at(deepest + 1) != best, "{index}");
        refused += 1;
    }
    assert!(refused > 20 && WIDTH == 8, "{refused}");
}

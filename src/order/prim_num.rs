//! PrimNumTO (Nah and Manocha, "SATO: Surface-Area Traversal Order for Shadow Ray Tracing",
//! Computer Graphics Forum 33(6), 2014): children by number of triangles.
//!
//! Fewest first, as the heuristic gives few triangles to nodes with large ones; Embree's builder
//! sorts likewise. The paper does not say which way round for hierarchies of boxes, so the other
//! one is here too.

use super::{DependsOn, OrderEntry, kd, score_each, score_each_of_part, second_where};
use crate::tree::Plan;

pub(super) static FEWEST: OrderEntry = OrderEntry {
    name: "prim-num",
    about: "the child with the fewest triangles first",
    needs_training: false,
    plan_bvh2: |tree, _| Plan::Fixed(tree.notes.second_fewer.clone()),
    depends_on: DependsOn::Children(|node| node.counts[1] < node.counts[0]),
    box_score: None,
    plan_kd: Some(kd::prim_num),
    scores: Some(|tree, _| score_each(tree, |_, node, side| -f64::from(node.counts[side]))),
    score_part: Some(|tree, _, scores| {
        score_each_of_part(tree, scores, |node, side| -f64::from(node.counts[side]))
    }),
    at_split: Some(|_, _, triangles| -(triangles.len() as f64)),
};

pub(super) static MOST: OrderEntry = OrderEntry {
    name: "prim-num-most",
    about: "the child with the most triangles first",
    needs_training: false,
    plan_bvh2: |tree, _| second_where(tree, |_, node| node.counts[1] > node.counts[0]),
    depends_on: DependsOn::Children(|node| node.counts[1] > node.counts[0]),
    box_score: None,
    plan_kd: Some(kd::prim_num_most),
    scores: Some(|tree, _| score_each(tree, |_, node, side| f64::from(node.counts[side]))),
    score_part: Some(|tree, _, scores| {
        score_each_of_part(tree, scores, |node, side| f64::from(node.counts[side]))
    }),
    at_split: Some(|_, _, triangles| triangles.len() as f64),
};

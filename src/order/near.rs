//! Front to back: the order of closest-hit rays, and the one that others are measured against.

use super::{DependsOn, OrderEntry};
use crate::tree::Plan;

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "near",
    about: "front to back: the child that the ray enters first",
    needs_training: false,
    plan_bvh2: |_, _| Plan::Near,
    depends_on: DependsOn::Nothing,
    box_score: None,
    plan_kd: Some(|_, _| Plan::Near),
    scores: None,
    score_part: None,
    at_split: None,
};

//! Back to front: a shadow ray starts on a surface, so the near child often holds just that.

use super::{DependsOn, OrderEntry};
use crate::tree::Plan;

pub(super) static ENTRY: OrderEntry = OrderEntry {
    name: "far",
    about: "back to front: the child that the ray enters last",
    needs_training: false,
    plan_bvh2: |_, _| Plan::Far,
    depends_on: DependsOn::Nothing,
    box_score: None,
    plan_kd: Some(|_, _| Plan::Far),
    scores: None,
    score_part: None,
    at_split: None,
};

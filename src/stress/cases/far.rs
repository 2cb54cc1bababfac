//! Closed meshes far from the world's origin, from inside.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::stress::shapes::{from_inside, icosphere, moved, tessellated_box};

pub(super) static MILLION: CaseEntry = CaseEntry {
    name: "far-million",
    about: "a sphere and a box at a million on each axis, from inside",
    stages: |_| Ok(stages(Vec3::splat(1e6))),
};

pub(super) static EMBREE_VERIFY: CaseEntry = CaseEntry {
    name: "far-embree",
    about: "the same at (148376, 1234, -223423), where Embree's own tests go",
    stages: |_| Ok(stages(Vec3::new(148_376.0, 1234.0, -223_423.0))),
};

fn stages(offset: Vec3) -> Vec<Stage> {
    let at = |label, mesh| {
        let mesh = moved(&mesh, |v| v + offset);
        Stage::new(label, mesh, move |mesh, random| {
            from_inside(mesh, random, offset, Vec3::splat(0.5))
        })
    };
    vec![at("sphere", icosphere(2)), at("box", tessellated_box(Vec3::new(0.7, 1.3, 2.9), 4))]
}

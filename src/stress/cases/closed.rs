//! Closed meshes, from inside: whatever a ray is aimed at, something is in its way.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::ray::Ray;
use crate::stress::shapes::{from_inside, icosphere, target, tessellated_box, torus};
use std::f32::consts::TAU;

pub(super) static ICOSPHERE: CaseEntry = CaseEntry {
    name: "icosphere",
    about: "from inside a sphere at vertices, edges and anywhere",
    stages: |_| {
        Ok(Stage::only(icosphere(3), |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.5))
        }))
    },
};

pub(super) static CUBE: CaseEntry = CaseEntry {
    name: "cube",
    about: "from inside a cube of twelve triangles, where much is exact",
    stages: |_| {
        Ok(Stage::only(tessellated_box(Vec3::ONE, 1), |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.75))
        }))
    },
};

pub(super) static TESSELLATED_BOX: CaseEntry = CaseEntry {
    name: "tessellated-box",
    about: "from inside a box of many triangles in six planes, at sizes that are not exact",
    stages: |_| {
        let half = Vec3::new(0.7, 1.3, 2.9);
        Ok(Stage::only(tessellated_box(half, 12), move |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, half * 0.8)
        }))
    },
};

pub(super) static TORUS: CaseEntry = CaseEntry {
    name: "torus",
    about: "from inside a torus's tube",
    stages: |_| {
        Ok(Stage::only(torus(0.4, 24, 60), |mesh, random| {
            let (s, c) = (TAU * random.unit()).sin_cos();
            let origin = Vec3::new(c, 0.0, s) + random.point() * 0.15;
            Ray::new(origin, target(mesh, random) - origin, f32::INFINITY)
        }))
    },
};

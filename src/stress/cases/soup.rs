//! Nothing special: what the others are measured against.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::ray::Ray;
use crate::stress::Random;
use crate::stress::shapes::{soup, target};

pub(super) static SOUP: CaseEntry = CaseEntry {
    name: "soup",
    about: "random triangles and rays, also along axes and at corners and edges",
    stages: |seed| {
        let mesh = soup(&mut Random::new(seed, "soup", 0), 500);
        Ok(Stage::only(mesh, |mesh, random| {
            let origin = random.point() * 1.5;
            let mut direction = match random.below(3) {
                0 => random.point(),
                _ => target(mesh, random) - origin,
            };
            match random.below(8) {
                0 => direction = Vec3::AXES[random.below(3)] * random.pick(&[0.5, -1.0]),
                1 => direction[random.below(3)] = random.pick(&[0.0, -0.0]),
                _ => {}
            }
            let t_max = random.pick(&[f32::INFINITY, 1.0, 0.5]);
            Ray::new(origin, direction, t_max)
        }))
    },
};

//! Triangles a million times as long as wide.

use super::{CaseEntry, Stage};
use crate::geometry::{Triangle, Vec3};
use crate::stress::Random;
use crate::stress::shapes::{any_triangle, from_inside, icosphere, moved, of_triangles, towards};

pub(super) static SLIVER_SOUP: CaseEntry = CaseEntry {
    name: "sliver-soup",
    about: "random triangles of aspect 1e6, aimed at along their length",
    stages: |seed| {
        let mut random = Random::new(seed, "sliver-soup", 0);
        let sliver = |_| {
            let (a, b) = (random.point(), random.point());
            let side = random.point() * (a - b).length() * 1e-6;
            Triangle([a, b, a.lerp(b, random.unit()) + side])
        };
        let mesh = of_triangles(&(0..500).map(sliver).collect::<Vec<_>>());
        Ok(Stage::only(mesh, |mesh, random| {
            let [a, b, c] = any_triangle(mesh, random);
            let along = a.lerp(b, random.unit());
            towards(random.point() * 1.5, along.lerp(c, random.unit() * random.unit()))
        }))
    },
};

pub(super) static SLIVER_SPHERE: CaseEntry = CaseEntry {
    name: "sliver-sphere",
    about: "a closed sphere drawn out to a million times its width, from inside",
    stages: |_| {
        let shape = Vec3::new(1.0, 1e6, 1.0);
        let mesh = moved(&icosphere(3), |v| v * shape);
        Ok(Stage::only(mesh, move |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, shape * 0.5)
        }))
    },
};

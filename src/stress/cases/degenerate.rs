//! Triangles that are there twice or not at all, and trees that cannot be balanced.

use super::{CaseEntry, Stage};
use crate::geometry::{Triangle, TriangleMesh, Vec3};
use crate::stress::Random;
use crate::stress::shapes::{any_triangle, from_inside, icosphere, of_triangles, target, towards};

pub(super) static DUPLICATES: CaseEntry = CaseEntry {
    name: "duplicates",
    about: "a sphere of which every triangle is there five times, from inside",
    stages: |_| {
        let sphere = icosphere(2);
        let triangles = sphere.triangles().repeat(5);
        let mesh = TriangleMesh::new(sphere.vertices().to_vec(), triangles);
        Ok(Stage::only(mesh, |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.5))
        }))
    },
};

pub(super) static ZERO_AREA: CaseEntry = CaseEntry {
    name: "zero-area",
    about: "triangles that are lines and points, and some with a bit of area, aimed at",
    stages: |seed| {
        let mut random = Random::new(seed, "zero-area", 0);
        let thin = |_| {
            let (a, b) = (random.point(), random.point());
            let middle = (a + b) * 0.5;
            Triangle(match random.below(5) {
                0 => [a, a, a],
                1 => [a, a, b],
                2 => [a, b, middle],
                3 => [a, b, a.lerp(b, random.unit())],
                _ => [a, b, middle.map(f32::next_up)],
            })
        };
        let mesh = of_triangles(&(0..500).map(thin).collect::<Vec<_>>());
        Ok(Stage::only(mesh, |mesh, random| towards(random.point() * 1.5, target(mesh, random))))
    },
};

pub(super) static COINCIDENT: CaseEntry = CaseEntry {
    name: "coincident",
    about: "a hundred thousand times the same triangle, aimed at within and beside it",
    stages: |_| {
        let corners = vec![Vec3::new(-1.0, -1.0, 0.1), Vec3::new(1.1, -0.9, 0.0), Vec3::Y];
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]; 100_000]);
        let mut stages = Stage::only(mesh, |mesh, random| {
            let [a, b, c] = any_triangle(mesh, random);
            let beside = random.pick(&[0.0, 0.0, 0.25, -1e-6, -0.25]);
            let target = a.lerp(b, random.unit()) + (c - a) * beside;
            towards(random.point() * 2.0, target)
        });
        // A ray that passes beside is tested against all of them.
        stages[0].most_rays = 1000;
        Ok(stages)
    },
};

pub(super) static DEEP_TREE: CaseEntry = CaseEntry {
    name: "deep-tree",
    about: "triangles that halve a hundred times towards a corner: trees as deep as they may be",
    stages: |_| {
        let mut triangles = Vec::new();
        for (index, offset) in [Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0)].into_iter().enumerate() {
            for level in 0..110 {
                let s = 0.5f32.powi(level) * [1.0, 0.9][index];
                let corners = [Vec3::new(s, s, 0.0), Vec3::new(s, 0.0, s), Vec3::new(0.0, s, s)];
                triangles.push(Triangle(corners.map(|p| p + offset)));
            }
        }
        Ok(Stage::only(of_triangles(&triangles), |mesh, random| {
            let origin = match random.below(3) {
                0 => random.point() * 4.0,
                1 => random.point() * 0.5f32.powi(random.below(100) as i32),
                _ => Vec3::ZERO,
            };
            towards(origin, target(mesh, random))
        }))
    },
};

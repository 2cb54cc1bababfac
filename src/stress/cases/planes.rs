//! Rays in the planes of triangles, faces and boxes.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::ray::Ray;
use crate::stress::Random;
use crate::stress::shapes::{any_triangle, soup, tessellated_box, towards};

pub(super) static FACE_PLANES: CaseEntry = CaseEntry {
    name: "face-planes",
    about: "in the planes of a box's faces, along and across the edges there",
    stages: |_| {
        let stages = [("cube", Vec3::ONE, 1), ("box", Vec3::new(0.7, 1.3, 2.9), 8)];
        let stage = |(label, half, cells): (&str, Vec3, u32)| {
            Stage::new(label, tessellated_box(half, cells), move |mesh, random| {
                let [a, b, _] = any_triangle(mesh, random);
                let axis = random.below(3);
                let mut origin = random.point() * half * 2.0;
                let mut target = a.lerp(b, random.pick(&[0.0, 0.5, 1.0, 3.0]));
                match random.below(3) {
                    // Along an edge, from its line.
                    0 => origin = a.lerp(b, random.pick(&[-1.0, -0.5, 0.0, 0.5, 2.0])),
                    // In a face's plane.
                    1 => {
                        origin[axis] = half[axis].copysign(a[axis]);
                        target[axis] = origin[axis];
                    }
                    // Along an axis, from a vertex's coordinates.
                    _ => {
                        origin = a;
                        origin[axis] = half[axis] * random.pick(&[-2.0, -1.0, 0.0, 1.0, 2.0]);
                        target = origin;
                        target[axis] = half[axis] * random.pick(&[-3.0, 3.0]);
                    }
                }
                towards(origin, target)
            })
        };
        Ok(stages.into_iter().map(stage).collect())
    },
};

pub(super) static TRIANGLE_PLANES: CaseEntry = CaseEntry {
    name: "triangle-planes",
    about: "in the planes of random triangles, up to rounding: through them and beside them",
    stages: |seed| {
        let mesh = soup(&mut Random::new(seed, "triangle-planes", 0), 200);
        Ok(Stage::only(mesh, |mesh, random| {
            let [a, b, c] = any_triangle(mesh, random);
            let mut weight = || random.unit() * 6.0 - 2.0;
            let mut point = || a + (b - a) * weight() + (c - a) * weight();
            let (origin, target) = (point(), point());
            towards(origin, target)
        }))
    },
};

pub(super) static SLAB_PLANES: CaseEntry = CaseEntry {
    name: "slab-planes",
    about: "origins on planes of boxes, directions with zeros of both signs",
    stages: |_| {
        let mut boxes = Vec::new();
        for x in -1i8..=1 {
            for y in -1i8..=1 {
                for z in -1i8..=1 {
                    let centre = Vec3::new(f32::from(x), f32::from(y), f32::from(z));
                    let part = tessellated_box(Vec3::splat(0.25), 1);
                    boxes.extend((0..part.len()).map(|i| {
                        let corners = part.triangle(i).0;
                        crate::geometry::Triangle(corners.map(|p| p + centre))
                    }));
                }
            }
        }
        let mesh = crate::stress::shapes::of_triangles(&boxes);
        Ok(Stage::only(mesh, |_, random| {
            let places = [-1.25, -1.0, -0.75, -0.25, -0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 2.0];
            let mut pick = || random.pick(&places);
            let origin = Vec3::new(pick(), pick(), pick());
            let mut direction = random.point();
            for axis in 0..3 {
                if random.below(2) == 0 {
                    direction[axis] = random.pick(&[0.0, -0.0]);
                }
            }
            if direction == Vec3::ZERO {
                direction[random.below(3)] = random.pick(&[-1.0, 1.0]);
            }
            Ray::new(origin, direction, random.pick(&[f32::INFINITY, 1.0, 0.5]))
        }))
    },
};

//! Numbers at the ends of `f32`, and what is no number.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::ray::Ray;
use crate::stress::Random;
use crate::stress::shapes::{from_inside, icosphere, moved, soup, target, towards};
use crate::{Error, Result, scene};
use std::fmt::Write;

pub(super) static DENORMALS: CaseEntry = CaseEntry {
    name: "denormals",
    about: "a sphere of a few hundred of the least numbers there are, and of the least normal ones",
    stages: |_| {
        let stage = |label, scale: f32| {
            let mesh = moved(&icosphere(2), |v| v * scale);
            Stage::new(label, mesh, move |mesh, random| {
                let ray = from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.5 * scale));
                // Directions of usual length too.
                let length = random.pick(&[1.0, 1.0 / scale.max(1e-38)]);
                Ray { direction: ray.direction * length, ..ray }
            })
        };
        Ok(vec![stage("least", 5e-43), stage("small", 1e-40), stage("normal", 2e-38)])
    },
};

pub(super) static HUGE: CaseEntry = CaseEntry {
    name: "huge",
    about: "a sphere of radius 1e18, the largest that loads, from inside and from up to 1e37 away",
    stages: |_| {
        let mesh = moved(&icosphere(2), |v| v * 9.9e17);
        Ok(Stage::only(mesh, |mesh, random| match random.below(2) {
            0 => from_inside(mesh, random, Vec3::ZERO, Vec3::splat(5e17)),
            _ => {
                let origin = random.point() * random.pick(&[2e18, 1e24, 1e30, 1e37]);
                let direction = target(mesh, random) - origin;
                let t_max = random.pick(&[f32::INFINITY, 1.0, 2.0]);
                Ray::new(origin, direction * random.pick(&[1.0, 1e-20]), t_max)
            }
        }))
    },
};

pub(super) static DIRECTION_LENGTHS: CaseEntry = CaseEntry {
    name: "direction-lengths",
    about: "directions from 2^-126 to 2^126 long, intervals that suit them",
    stages: |seed| {
        let mesh = soup(&mut Random::new(seed, "direction-lengths", 0), 300);
        Ok(Stage::only(mesh, |mesh, random| {
            let length = 2f32.powi(random.below(253) as i32 - 126);
            let ray = towards(random.point(), target(mesh, random));
            let ends = [f32::INFINITY, 1.0 / length, 0.5 / length];
            let t_min = random.pick(&[0.0, 0.0, -1.0 / length, 0.25 / length]);
            let t_max = random.pick(&ends);
            Ray { direction: ray.direction * length, t_min, t_max, ..ray }
        }))
    },
};

/// What is put where a number should be.
const ODD: [f32; 6] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 0.0];

pub(super) static NON_FINITE_RAYS: CaseEntry = CaseEntry {
    name: "non-finite-rays",
    about: "rays with NaN, infinities, the largest numbers and zeros anywhere, and empty intervals",
    stages: |seed| {
        let mesh = soup(&mut Random::new(seed, "non-finite-rays", 0), 300);
        Ok(Stage::only(mesh, |mesh, random| {
            let mut ray = towards(random.point(), target(mesh, random));
            for _ in 0..=random.below(2) {
                let odd = random.pick(&ODD);
                match random.below(9) {
                    axis @ 0..3 => ray.origin[axis] = odd,
                    axis @ 3..6 => ray.direction[axis - 3] = odd,
                    6 => ray.t_min = odd,
                    7 => ray.t_max = odd,
                    _ => (ray.t_min, ray.t_max) = (1.5, 0.5),
                }
            }
            ray
        }))
    },
};

pub(super) static NON_FINITE_VERTICES: CaseEntry = CaseEntry {
    name: "non-finite-vertices",
    about: "a sphere among triangles with NaN and infinite corners, loaded from an OBJ file",
    stages: |seed| {
        let mesh = loaded_with_odd_triangles(seed)?;
        Ok(Stage::only(mesh, |mesh, random| {
            from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.5))
        }))
    },
};

/// As many triangles with one odd corner as whole ones, in between.
fn loaded_with_odd_triangles(seed: u64) -> Result<crate::geometry::TriangleMesh> {
    let mut random = Random::new(seed, "non-finite-vertices", 0);
    let sphere = icosphere(2);
    let mut text = String::new();
    for vertex in sphere.vertices() {
        let _ = writeln!(text, "v {} {} {}", vertex.x, vertex.y, vertex.z);
    }
    for [a, b, c] in sphere.triangles() {
        let mut odd = ["0.1", "0.2", "0.3"];
        odd[random.below(3)] = random.pick(&["nan", "inf", "-inf"]);
        let _ = writeln!(text, "v {}\nf {} {} -1", odd.join(" "), a + 1, b + 1);
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    let folder = tempfile::tempdir().map_err(Error::io(std::env::temp_dir()))?;
    let path = folder.path().join("non-finite-vertices.obj");
    std::fs::write(&path, text).map_err(Error::io(&path))?;
    let scene = scene::load(&path)?;
    // The loader drops what is not finite and nothing else.
    if scene.mesh.len() == sphere.len() {
        Ok(scene.mesh.as_ref().clone())
    } else {
        let message = format!("{} of {} triangles loaded", scene.mesh.len(), sphere.len());
        Err(Error::CheckFailed(format!("non-finite-vertices: {message}")))
    }
}

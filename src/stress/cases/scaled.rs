//! One sphere at many scales.

use super::{CaseEntry, Stage};
use crate::geometry::Vec3;
use crate::stress::shapes::{from_inside, icosphere, moved};

pub(super) static BY_TWO: CaseEntry = CaseEntry {
    name: "scaled-by-2",
    about: "a sphere times powers of two from 2^-120 to 2^59, from inside",
    stages: |_| {
        let exponents = [-120, -90, -60, -40, -20, 20, 40, 59];
        Ok(exponents.into_iter().map(|k| stage(format!("2e{k}"), 2f32.powi(k))).collect())
    },
};

pub(super) static BY_TEN: CaseEntry = CaseEntry {
    name: "scaled-by-10",
    about: "a sphere times powers of ten from 1e-36 to 1e17, from inside",
    stages: |_| {
        let scales = [
            ("-36", 1e-36),
            ("-18", 1e-18),
            ("-6", 1e-6),
            ("-3", 1e-3),
            ("3", 1e3),
            ("6", 1e6),
            ("12", 1e12),
            ("17", 1e17),
        ];
        Ok(scales.into_iter().map(|(k, scale)| stage(format!("10e{k}"), scale)).collect())
    },
};

fn stage(label: String, scale: f32) -> Stage {
    let mesh = moved(&icosphere(2), |v| v * scale);
    Stage::new(label, mesh, move |mesh, random| {
        from_inside(mesh, random, Vec3::ZERO, Vec3::splat(0.5 * scale))
    })
}

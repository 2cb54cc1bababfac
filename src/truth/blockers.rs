//! Irradiance of lights behind convex blockers that hide a part of them.

use super::CaseEntry;
use super::form_factor::Receiver;
use super::stage::{FAR, Stage, quad, sheet};
use crate::geometry::Vec3;
use crate::scene::LightShape;

pub(super) static HALF_PLANE: CaseEntry = CaseEntry {
    name: "half-plane",
    about: "a square of 2 x 2 at height 1 behind a half-plane at height 0.5",
    make: || floor().blocked(square(), &[half_plane()]),
};

pub(super) static PENTAGON: CaseEntry = CaseEntry {
    name: "pentagon",
    about: "the square behind a slanted pentagon",
    make: || floor().blocked(square(), &[pentagon()]),
};

pub(super) static PENTAGON_TILTED: CaseEntry = CaseEntry {
    name: "pentagon-tilted",
    about: "a slope whose horizon cuts the light and the pentagon before it",
    make: || {
        let stage = Stage::tilted(Vec3::ZERO, Vec3::new(-1.0, 0.2, 0.15), 0.2, 0.1);
        stage.blocked(square(), &[pentagon()])
    },
};

pub(super) static SHEETS: CaseEntry = CaseEntry {
    name: "sheets-before-quad",
    about: "the square behind three sheets that overlap",
    make: || {
        let blockers =
            [pentagon(), sheet([-0.6, 0.0], [0.1, 0.5], 0.8), sheet([0.0, -1.0], [0.3, 1.0], 0.7)];
        floor().blocked(square(), &blockers)
    },
};

pub(super) static SHEARED: CaseEntry = CaseEntry {
    name: "sheared-behind-pentagon",
    about: "a parallelogram behind the pentagon",
    make: || {
        let light = quad([-1.0, -0.8, 1.2], [0.5, 1.5, 0.2], [1.5, -0.4, 0.3]);
        floor().blocked(light, &[pentagon()])
    },
};

pub(super) static DISK: CaseEntry = CaseEntry {
    name: "disk-behind-pentagon",
    about: "a disk behind the pentagon",
    make: || {
        let normal = Vec3::new(0.2, -0.1, -1.0).normalize();
        let light = LightShape::Disk { center: Vec3::new(0.1, 0.0, 1.2), normal, radius: 0.8 };
        floor().blocked(light, &[pentagon()])
    },
};

pub(super) static SPHERE: CaseEntry = CaseEntry {
    name: "sphere-behind-pentagon",
    about: "a sphere behind the pentagon",
    make: || {
        let light = LightShape::Sphere { center: Vec3::new(0.1, 0.0, 2.0), radius: 0.9 };
        floor().blocked(light, &[pentagon()])
    },
};

pub(super) static SUN: CaseEntry = CaseEntry {
    name: "sun-behind-half-plane",
    about: "the penumbra of a half-plane in a sun of 20 degrees",
    make: || {
        let direction = Vec3::new(0.1, 0.2, -1.0).normalize();
        let light = LightShape::Directional { direction, angular_diameter_degrees: 20.0 };
        floor().blocked(light, &[half_plane()])
    },
};

pub(super) static POINT: CaseEntry = CaseEntry {
    name: "point-behind-half-plane",
    about: "the sharp shadow of a half-plane",
    make: || {
        let position = Vec3::new(0.05, 0.3, 1.0);
        // At height 0.5 and half of the way, the edge is at x = 0.1.
        let shadow_end = 2.0 * f64::from(0.1f32) - f64::from(position.x);
        let value = move |r: &Receiver| {
            let to_light = position.as_dvec3() - r.at;
            let lit = r.at.x > shadow_end;
            if lit { to_light.dot(r.normal) / to_light.length().powi(3) } else { 0.0 }
        };
        let stage = floor().polygon(&half_plane());
        stage.irradiance(LightShape::Point { position }, value)
    },
};

/// A patch of the floor below all blockers.
fn floor() -> Stage {
    Stage::floor([0.05, 0.0], 0.4, 0.25)
}

/// A square of 2 x 2 at height 1 that faces down.
fn square() -> LightShape {
    quad([-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0])
}

/// x < 0.1 at height 0.5.
fn half_plane() -> Vec<Vec3> {
    sheet([-FAR, -FAR], [0.1, FAR], 0.5)
}

/// In the plane z = 0.5 + x / 8: slants and all corners are exact in `f32`.
fn pentagon() -> Vec<Vec3> {
    [[0.5, 0.0], [0.25, 0.5], [-0.375, 0.375], [-0.5, -0.25], [0.125, -0.5]]
        .map(|[x, y]| Vec3::new(x, y, 0.5 + x / 8.0))
        .into()
}

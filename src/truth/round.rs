//! Irradiance of disks, spheres, suns and points with nothing in the way.

use super::form_factor::{Receiver, parallel_disk};
use super::stage::Stage;
use super::{Case, CaseEntry};
use crate::geometry::Vec3;
use crate::scene::LightShape;
use std::f64::consts::PI;

pub(super) static DISK: CaseEntry = CaseEntry {
    name: "disk",
    about: "a disk of radius 1 at height 2, facing down",
    make: || parallel(2.0, 1.0, 1.0),
};

pub(super) static DISK_NEAR: CaseEntry = CaseEntry {
    name: "disk-near",
    about: "a disk half its radius away, over its edge",
    make: || parallel(0.5, 1.0, 1.2),
};

pub(super) static DISK_SETTING: CaseEntry = CaseEntry {
    name: "disk-setting",
    about: "a slanted disk that the horizon cuts",
    make: || {
        let normal = Vec3::new(-1.0, 0.3, -0.2).normalize();
        let light = LightShape::Disk { center: Vec3::new(2.0, 0.0, 0.3), normal, radius: 1.0 };
        Stage::floor([0.0, 0.0], 0.8, 0.5).blocked(light, &[])
    },
};

pub(super) static SPHERE: CaseEntry = CaseEntry {
    name: "sphere-light",
    about: "a sphere of radius 1 at height 2",
    make: || sphere([0.2, 0.0], 0.8, Vec3::Z * 2.0),
};

pub(super) static SPHERE_SETTING: CaseEntry = CaseEntry {
    name: "sphere-light-setting",
    about: "a sphere that the horizon halves",
    make: || sphere([0.0, 0.0], 0.6, Vec3::X * 2.0),
};

pub(super) static SPHERE_SET: CaseEntry = CaseEntry {
    name: "sphere-light-set",
    about: "a sphere whose top alone is above the horizon",
    make: || sphere([0.0, 0.0], 0.6, Vec3::new(2.0, 0.0, -0.7)),
};

pub(super) static SPHERE_NEAR: CaseEntry = CaseEntry {
    name: "sphere-light-near",
    about: "a sphere that nearly touches the floor",
    make: || sphere([0.3, 0.0], 0.4, Vec3::Z * 1.01).not_by_area(),
};

pub(super) static SPHERE_AROUND: CaseEntry = CaseEntry {
    name: "sphere-light-around",
    about: "inside of a sphere that emits outwards: dark",
    make: || {
        let light = LightShape::Sphere { center: Vec3::ZERO, radius: 1.0 };
        Stage::floor([0.0, 0.0], 0.4, 0.5).irradiance(light, |_| 0.0)
    },
};

pub(super) static SUN: CaseEntry = CaseEntry {
    name: "sun",
    about: "a sun of half a degree in the sky",
    make: || sun(Vec3::Z, Vec3::new(0.6, 0.0, -0.8), 0.53),
};

pub(super) static SUN_SETTING: CaseEntry = CaseEntry {
    name: "sun-setting",
    about: "a sun of half a degree on the horizon",
    make: || sun(Vec3::Z, Vec3::new(-1.0, 0.1, -1e-3), 0.53),
};

pub(super) static SUN_WIDE: CaseEntry = CaseEntry {
    name: "sun-wide",
    about: "a sun of 60 degrees across a slope's horizon",
    make: || sun(Vec3::new(-0.5, 0.4, 0.6), Vec3::new(-0.5, 0.8, -0.4), 60.0),
};

pub(super) static SUN_SHARP: CaseEntry = CaseEntry {
    name: "sun-sharp",
    about: "a sun without extent",
    make: || sun(Vec3::new(-0.5, 0.4, 0.6), Vec3::new(0.3, 0.2, -0.9), 0.0),
};

pub(super) static POINT: CaseEntry = CaseEntry {
    name: "point",
    about: "a point at height 1",
    make: || {
        let position = Vec3::new(0.5, 0.0, 1.0);
        let value = move |r: &Receiver| {
            let to_light = position.as_dvec3() - r.at;
            to_light.dot(r.normal).max(0.0) / to_light.length().powi(3)
        };
        Stage::floor([0.0, 0.0], 1.0, 0.5).irradiance(LightShape::Point { position }, value)
    },
};

/// A disk that faces the floor, over the origin; the patch is about x = `aside`.
fn parallel(height: f32, radius: f32, aside: f32) -> Case {
    let center = Vec3::Z * height;
    let light = LightShape::Disk { center, normal: Vec3::NEG_Z, radius };
    let value = move |r: &Receiver| {
        let away = center.as_dvec3() - r.at;
        PI * parallel_disk(away.z, away.truncate().length(), f64::from(radius))
    };
    Stage::floor([aside, 0.0], 0.8, 0.3).irradiance(light, value)
}

/// A sphere of radius 1 over or beside a patch of the floor.
fn sphere(patch: [f32; 2], half: f32, center: Vec3) -> Case {
    let light = LightShape::Sphere { center, radius: 1.0 };
    Stage::floor(patch, half, 0.3).irradiance(light, move |r| {
        let to_center = center.as_dvec3() - r.at;
        PI * r.cone(to_center, 1.0 / to_center.length())
    })
}

/// A sun over a patch with this normal.
fn sun(normal: Vec3, direction: Vec3, angular_diameter_degrees: f32) -> Case {
    let direction = direction.normalize();
    let light = LightShape::Directional { direction, angular_diameter_degrees };
    let half = 0.5 * f64::from(angular_diameter_degrees).to_radians();
    let axis = -direction.as_dvec3().normalize();
    Stage::tilted(Vec3::ZERO, normal, 0.5, 0.5).irradiance(light, move |r| {
        if half > 0.0 {
            r.cone(axis, half.sin()) / half.sin().powi(2)
        } else {
            axis.dot(r.normal).max(0.0)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// The closed forms of the cases against polygons of many corners.
    #[test]
    fn round_lights_are_polygons_of_many_corners() {
        for entry in [&DISK, &DISK_NEAR, &SPHERE, &SPHERE_SETTING, &SPHERE_SET, &SPHERE_NEAR, &SUN]
            .into_iter()
            .chain([&SUN_SETTING, &SUN_WIDE])
        {
            let case = (entry.make)();
            for (x, y) in [(0.0, 0.0), (0.3, -0.4), (-0.2, 0.5)] {
                let receiver = Receiver { at: DVec3::new(x, y, 0.0), normal: DVec3::Z };
                let expected = receiver.irradiance(&case.scene.lights[0].shape, &[]);
                let value = (case.value)(&receiver);
                let error = (value - expected).abs();
                assert!(error < 4e-6 * expected + 1e-9, "{entry:?}: {value} is not {expected}");
            }
        }
    }
}

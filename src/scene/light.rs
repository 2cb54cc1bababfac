//! Light sources: data only; how they are sampled is the renderer's.

use super::check::{self, InvalidValue};
use glam::Vec3;
use serde::Serialize;

/// A named light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Light {
    /// Name of its layers in the image; unique in a scene.
    pub name: String,
    /// Where it is.
    pub shape: LightShape,
    /// RGB strength. Quad, disk and sphere: radiance. Directional: irradiance on a surface facing
    /// it. Point: radiant intensity.
    pub strength: Vec3,
}

/// The place and extent of a light, in scene units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum LightShape {
    /// A parallelogram that emits on the side of `edge_u x edge_v`.
    Quad {
        /// One corner.
        corner: Vec3,
        /// First edge, from the corner.
        edge_u: Vec3,
        /// Second edge, from the corner; not parallel to the first.
        edge_v: Vec3,
    },
    /// A disk that emits on the side of `normal`.
    Disk {
        /// Centre.
        center: Vec3,
        /// Emission side; unit length.
        normal: Vec3,
        /// Radius, positive.
        radius: f32,
    },
    /// A sphere that emits outwards.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, positive.
        radius: f32,
    },
    /// Light from far away, like the sun.
    Directional {
        /// Direction in which the light travels; unit length.
        direction: Vec3,
        /// Apparent diameter in degrees, at least 0 and below 180; 0 gives hard shadows.
        angular_diameter_degrees: f32,
    },
    /// A point.
    Point {
        /// Position.
        position: Vec3,
    },
}

impl Light {
    /// Whether it can light a scene; the fault names the field as scene files do.
    pub fn check(&self) -> Result<(), InvalidValue> {
        check::layer_name("name", &self.name)?;
        self.shape.check()?;
        let key = self.shape.strength_key();
        check::finite(key, self.strength)?;
        if self.strength.min_element() < 0.0 {
            let message = format!("must not be negative: {}", check::numbers(self.strength));
            return Err(InvalidValue::new(key, message));
        }
        Ok(())
    }
}

impl LightShape {
    /// Its `type` in a scene file.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Quad { .. } => "quad",
            Self::Disk { .. } => "disk",
            Self::Sphere { .. } => "sphere",
            Self::Directional { .. } => "directional",
            Self::Point { .. } => "point",
        }
    }

    /// The radiometric quantity that [`Light::strength`] is for this shape, as scene files name it.
    pub fn strength_key(&self) -> &'static str {
        match self {
            Self::Quad { .. } | Self::Disk { .. } | Self::Sphere { .. } => "radiance",
            Self::Directional { .. } => "irradiance",
            Self::Point { .. } => "intensity",
        }
    }

    /// Whether it is finite and has an extent or a direction where it needs one.
    pub fn check(&self) -> Result<(), InvalidValue> {
        match *self {
            Self::Quad { corner, edge_u, edge_v } => {
                check::finite("corner", corner)?;
                check::direction("edge_u", edge_u)?;
                check::direction("edge_v", edge_v)?;
                let (u, v) = (edge_u.as_dvec3().normalize(), edge_v.as_dvec3().normalize());
                if u.cross(v).length() < 1e-6 {
                    let (u, v) = (check::numbers(edge_u), check::numbers(edge_v));
                    let message = format!("must not be parallel to edge_u (no area): {v}, {u}");
                    return Err(InvalidValue::new("edge_v", message));
                }
            }
            Self::Disk { center, normal, radius } => {
                check::finite("center", center)?;
                check::direction("normal", normal)?;
                check::positive("radius", radius)?;
            }
            Self::Sphere { center, radius } => {
                check::finite("center", center)?;
                check::positive("radius", radius)?;
            }
            Self::Directional { direction, angular_diameter_degrees } => {
                check::direction("direction", direction)?;
                if !(0.0..180.0).contains(&angular_diameter_degrees) {
                    let message =
                        format!("must be at least 0 and below 180, not {angular_diameter_degrees}");
                    return Err(InvalidValue::new("angular_diameter_degrees", message));
                }
            }
            Self::Point { position } => check::finite("position", position)?,
        }
        Ok(())
    }
}

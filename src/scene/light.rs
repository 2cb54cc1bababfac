//! Light sources: data only; how they are sampled is the renderer's.

use glam::Vec3;

/// A named light.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

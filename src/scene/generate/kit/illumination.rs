//! Short ways to write cameras and lights.

use super::math::V;
use crate::scene::{Camera, Light, LightShape};

/// A camera with y up.
pub(crate) fn camera(eye: V, look_at: V, fov_degrees: f32) -> Camera {
    Camera { eye: eye.as_vec3(), look_at: look_at.as_vec3(), up: glam::Vec3::Y, fov_degrees }
}

/// A light of `strength` times a colour.
pub(crate) fn light(name: &str, shape: LightShape, strength: f64, colour: V) -> Light {
    Light { name: name.into(), shape, strength: (colour * strength).as_vec3() }
}

/// A quad that shines straight down from around `center`.
pub(crate) fn down_quad(center: V, width: f64, depth: f64) -> LightShape {
    let (u, w) = (V::X * width, V::Z * depth);
    LightShape::Quad {
        corner: (center - u * 0.5 - w * 0.5).as_vec3(),
        edge_u: u.as_vec3(),
        edge_v: w.as_vec3(),
    }
}

/// A quad around `center` that shines at `target`, its lower edge level.
pub(crate) fn aimed_quad(center: V, target: V, width: f64, height: f64) -> LightShape {
    let forward = target - center;
    let forward = forward / forward.length();
    let right = V::Y.cross(forward);
    let right = right / right.length();
    let (u, w) = (right * width, forward.cross(right) * height);
    LightShape::Quad {
        corner: (center - u * 0.5 - w * 0.5).as_vec3(),
        edge_u: u.as_vec3(),
        edge_v: w.as_vec3(),
    }
}

//! The pinhole camera.

use crate::ray::Ray;
use glam::Vec3;

/// A pinhole camera with a vertical field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position, in scene units.
    pub eye: Vec3,
    /// A point in the middle of the picture, other than the eye.
    pub look_at: Vec3,
    /// Upward direction, not parallel to the view.
    pub up: Vec3,
    /// Vertical field of view in degrees, between 0 and 180 exclusive.
    pub fov_degrees: f32,
}

impl Camera {
    /// The ray through `(x, y)` in pixels (from the upper left corner, pixel centres at .5) of an
    /// image of `size` pixels. The direction has unit length.
    pub fn ray(&self, x: f32, y: f32, size: [u32; 2]) -> Ray {
        let [width, height] = size.map(|n| n as f32);
        let forward = (self.look_at - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * self.fov_degrees.to_radians()).tan();
        let half_width = half_height * width / height;
        let direction = forward
            + right * (half_width * (2.0 * x / width - 1.0))
            + up * (half_height * (1.0 - 2.0 * y / height));
        Ray::new(self.eye, direction.normalize(), f32::INFINITY)
    }
}

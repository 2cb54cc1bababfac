//! The pinhole camera.

use super::check::{self, InvalidValue};
use crate::ray::Ray;
use glam::Vec3;
use serde::Serialize;

/// A pinhole camera with a vertical field of view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
    /// Whether it can make a picture; the fault names the field.
    pub fn check(&self) -> Result<(), InvalidValue> {
        check::finite("eye", self.eye)?;
        check::finite("look_at", self.look_at)?;
        check::finite("up", self.up)?;
        if !(self.fov_degrees > 0.0 && self.fov_degrees < 180.0) {
            let message = format!("must be above 0 and below 180, not {}", self.fov_degrees);
            return Err(InvalidValue::new("fov_degrees", message));
        }
        let view = self.look_at - self.eye;
        if !(1e-15..1e19).contains(&view.as_dvec3().length()) {
            let eye = check::numbers(self.eye);
            let message = format!("must be apart from the eye, {eye}, and less than 1e19 away");
            return Err(InvalidValue::new("look_at", message));
        }
        check::direction("up", self.up)?;
        let (view, up) = (view.as_dvec3().normalize(), self.up.as_dvec3().normalize());
        if view.cross(up).length() < 1e-6 {
            let message = format!("must not be parallel to the view: {}", check::numbers(self.up));
            return Err(InvalidValue::new("up", message));
        }
        Ok(())
    }

    /// The ray through `(x, y)` in an image of `size` pixels: see [`View::ray`].
    pub fn ray(&self, x: f32, y: f32, size: [u32; 2]) -> Ray {
        self.view(size).ray(x, y)
    }

    /// What the rays of an image of `size` pixels have in common.
    pub fn view(&self, size: [u32; 2]) -> View {
        let [width, height] = size.map(|n| n as f32);
        let forward = (self.look_at - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * self.fov_degrees.to_radians()).tan();
        let half_width = half_height * width / height;
        View {
            eye: self.eye,
            axes: [forward, right, up],
            half: [half_width, half_height],
            size: [width, height],
        }
    }
}

/// A camera that is set up for an image of a certain size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: Vec3,
    /// Forwards, to the right and upwards, of unit length.
    axes: [Vec3; 3],
    /// Half of the image's width and height at distance 1.
    half: [f32; 2],
    /// Width and height in pixels.
    size: [f32; 2],
}

impl View {
    /// The ray through `(x, y)` in pixels, from the upper left corner, pixel centres at .5. The
    /// direction has unit length.
    #[inline]
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let ([width, height], [half_width, half_height]) = (self.size, self.half);
        let [forward, right, up] = self.axes;
        let direction = forward
            + right * (half_width * (2.0 * x / width - 1.0))
            + up * (half_height * (1.0 - 2.0 * y / height));
        Ray::new(self.eye, direction.normalize(), f32::INFINITY)
    }
}

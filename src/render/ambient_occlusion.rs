//! Ambient occlusion: the share of the cosine-weighted hemisphere in which nothing is near.

use super::sampler::Points;
use super::surface::SurfacePoint;
use super::warp::{self, Frame};
use crate::ray::Ray;
use crate::vectorized::vectorized;
use glam::Vec3;

/// The rays of one sample each: direction with density `cos(theta) / pi` about the normal, so that
/// visibility is the plain mean over samples. `radius` in scene units, beyond which nothing counts (a
/// hard cut); infinite for unbounded ambient occlusion.
///
/// Zhukov, Iones and Kronin, "An Ambient Light Illumination Model", Rendering Techniques 1998.
pub fn rays(
    surface: &SurfacePoint,
    points: &Points,
    radius: f32,
    directions: &mut Directions,
    rays: &mut Vec<Ray>,
) {
    directions.resize(points.coordinates().0.len());
    let axes = Frame::new(surface.normal).axes().map(|axis| axis.as_vec3());
    vectorized(
        #[inline(always)]
        || directions.set(axes, points),
    );
    let [x, y, z] = &directions.0;
    let directions = x.iter().zip(y).zip(z).take(points.len());
    rays.extend(
        directions.map(|((x, y), z)| Ray::new(surface.origin, Vec3::new(*x, *y, *z), radius)),
    );
}

/// Directions, number by number: memory to use again.
#[derive(Clone, Debug, Default)]
pub struct Directions([Vec<f32>; 3]);

impl Directions {
    fn resize(&mut self, len: usize) {
        self.0.iter_mut().for_each(|d| d.resize(len, 0.0));
    }

    #[inline(always)]
    fn set(&mut self, axes: [Vec3; 3], points: &Points) {
        let (u, v) = points.coordinates();
        let len = u.len();
        let v = &v[..len];
        let [x, y, z] = self.0.each_mut().map(|d| &mut d[..len]);
        for i in 0..len {
            let local = warp::cosine_hemisphere([u[i], v[i]]);
            let direction = axes[0] * local.x + axes[1] * local.y + axes[2] * local.z;
            (x[i], y[i], z[i]) = (direction.x, direction.y, direction.z);
        }
    }
}

/// The ray of a point of the unit square: see [`rays`].
pub fn ray(surface: &SurfacePoint, point: [f32; 2], radius: f32) -> Ray {
    let mut one = Vec::with_capacity(1);
    rays(surface, &Points::of(&[point]), radius, &mut Directions::default(), &mut one);
    one[0]
}

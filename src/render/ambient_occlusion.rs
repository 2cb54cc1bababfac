//! Ambient occlusion: the share of the cosine-weighted hemisphere in which nothing is near.

use super::surface::SurfacePoint;
use super::warp;
use crate::ray::Ray;

/// The ray of one sample: direction with density `cos(theta) / pi` about the normal, so that
/// visibility is the plain mean over samples. `point` in the unit square; `radius` in scene units,
/// beyond which nothing counts (a hard cut); infinite for unbounded ambient occlusion.
///
/// Zhukov, Iones and Kronin, "An Ambient Light Illumination Model", Rendering Techniques 1998.
#[inline]
pub fn ray(surface: &SurfacePoint, point: [f64; 2], radius: f32) -> Ray {
    let direction = warp::to_world(warp::cosine_hemisphere(point), surface.normal);
    Ray::new(surface.origin, direction.as_vec3(), radius)
}

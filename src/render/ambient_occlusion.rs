//! Ambient occlusion: the share of the cosine-weighted hemisphere in which nothing is near.

use super::light_samples::{BLOCK, in_blocks};
use super::sampler::{MOST_TOGETHER, Points};
use super::surface::SurfacePoint;
use super::warp::{self, Frame};
use crate::ray::Ray;
use crate::vectorized::vectorized;
use glam::{DVec3, Vec3};
use std::ops::Range;

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
    let axes = axes_at(surface.normal);
    vectorized(
        #[inline(always)]
        || {
            directions.set(
                points,
                #[inline(always)]
                |_| axes,
            );
        },
    );
    let ray = |direction| Ray::new(surface.origin, direction, radius);
    rays.extend(directions.some(0..points.len()).map(ray));
}

fn axes_at(normal: DVec3) -> [Vec3; 3] {
    Frame::new(normal).axes().map(|axis| axis.as_vec3())
}

/// Directions, number by number: memory to use again.
#[derive(Clone, Debug, Default)]
pub struct Directions([Vec<f32>; 3]);

impl Directions {
    fn resize(&mut self, len: usize) {
        self.0.iter_mut().for_each(|d| d.resize(len, 0.0));
    }

    /// Some of them.
    pub(super) fn some(&self, which: Range<usize>) -> impl Iterator<Item = Vec3> {
        let [x, y, z] = self.0.each_ref().map(|d| d[which.clone()].iter());
        x.zip(y).zip(z).map(|((x, y), z)| Vec3::new(*x, *y, *z))
    }

    /// Those of all points, about the last of the axes that each has by its place in its block.
    #[inline(always)]
    fn set(&mut self, points: &Points, axes_of: impl Fn(usize) -> [Vec3; 3]) {
        let (u, v) = points.coordinates();
        // As in `LightSamples::set_in_steps`.
        let mut block = [[0.0; BLOCK]; 3];
        in_blocks(
            u.len(),
            #[inline(always)]
            |range, len| {
                let (u, v) = (&u[range.clone()][..len], &v[range.clone()][..len]);
                let [x, y, z] = &mut block;
                let (x, y, z) = (&mut x[..len], &mut y[..len], &mut z[..len]);
                for i in 0..len {
                    let local = warp::cosine_hemisphere([u[i], v[i]]);
                    let axes = axes_of(i);
                    let direction = axes[0] * local.x + axes[1] * local.y + axes[2] * local.z;
                    (x[i], y[i], z[i]) = (direction.x, direction.y, direction.z);
                }
                for (all, own) in self.0.iter_mut().zip(&block) {
                    all[range.clone()].copy_from_slice(&own[..len]);
                }
            },
        );
    }
}

/// Surface points, a sample of each in a lane.
#[derive(Clone, Debug)]
pub(super) struct HemisphereLanes {
    /// The axes of each, coordinate by coordinate.
    rows: [[f32; MOST_TOGETHER]; 9],
}

impl Default for HemisphereLanes {
    fn default() -> Self {
        Self { rows: [[0.0; MOST_TOGETHER]; 9] }
    }
}

impl HemisphereLanes {
    /// Gives some lanes to a point with this normal.
    pub(super) fn set(&mut self, lanes: Range<usize>, normal: DVec3) {
        let axes = axes_at(normal).map(|axis| axis.to_array());
        for (row, number) in self.rows.iter_mut().zip(axes.as_flattened()) {
            row[lanes.clone()].fill(*number);
        }
    }

    /// The direction of each lane, as [`rays`] has it, bit by bit.
    pub(super) fn sample(&self, points: &Points, directions: &mut Directions) {
        assert!(points.len() <= MOST_TOGETHER);
        directions.resize(points.coordinates().0.len());
        let rows = &self.rows;
        vectorized(
            #[inline(always)]
            || {
                directions.set(
                    points,
                    #[inline(always)]
                    |i| {
                        [
                            Vec3::new(rows[0][i], rows[1][i], rows[2][i]),
                            Vec3::new(rows[3][i], rows[4][i], rows[5][i]),
                            Vec3::new(rows[6][i], rows[7][i], rows[8][i]),
                        ]
                    },
                );
            },
        );
    }
}

/// The ray of a point of the unit square: see [`rays`].
pub fn ray(surface: &SurfacePoint, point: [f32; 2], radius: f32) -> Ray {
    let mut one = Vec::with_capacity(1);
    rays(surface, &Points::of(&[point]), radius, &mut Directions::default(), &mut one);
    one[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn lanes_are_as_points_alone() {
        let mut random = Random::new(92);
        for per_point in [1, 3, 4] {
            let mut number = || f64::from(random.unit());
            let (mut lanes, mut points) = (HemisphereLanes::default(), Vec::new());
            let mut expected = Vec::new();
            for place in 0..MOST_TOGETHER / per_point {
                let normal = DVec3::new(number() - 0.5, number() - 0.5, number() - 0.5).normalize();
                lanes.set(place * per_point..(place + 1) * per_point, normal);
                let own: Vec<_> =
                    (0..per_point).map(|_| [number(), number()].map(|n| n as f32)).collect();
                let surface = SurfacePoint {
                    position: DVec3::ZERO,
                    origin: Vec3::ZERO,
                    normal,
                    distance: 1.0,
                };
                expected.extend(own.iter().map(|point| ray(&surface, *point, 1.0).direction));
                points.extend(own);
            }
            let mut directions = Directions::default();
            lanes.sample(&Points::of(&points), &mut directions);
            assert_eq!(directions.some(0..points.len()).collect::<Vec<_>>(), expected);
        }
    }
}

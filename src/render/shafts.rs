//! Groups of a tile's points, the shafts of their rays, and where rays to lights end.

use super::surface::SurfacePoint;
use crate::geometry::Aabb;
use crate::scene::{Light, LightShape};
use crate::trace::shaft::{Shaft, Target};
use glam::{DVec3, Vec3};

/// Points of one plane make a group of their own if there are so many.
const LEAST_OF_PLANE: usize = 8;

/// Points that are looked from together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Which of the points, rising.
    pub(super) members: Vec<usize>,
    /// Their normal, if they have one in common.
    pub(super) normal: Option<DVec3>,
}

/// Groups of points with the same normal, and all that are left.
pub(super) fn groups<'a>(surfaces: impl Iterator<Item = &'a SurfacePoint>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (index, surface) in surfaces.enumerate() {
        let normal = Some(surface.normal);
        match groups.iter_mut().rev().find(|group| group.normal == normal) {
            Some(group) => group.members.push(index),
            None => groups.push(Group { members: vec![index], normal }),
        }
    }
    let is_small = |group: &Group| group.members.len() < LEAST_OF_PLANE;
    if groups.len() > 1 && groups.iter().any(is_small) {
        let mut members: Vec<usize> =
            groups.iter().filter(|g| is_small(g)).flat_map(|g| g.members.iter().copied()).collect();
        members.sort_unstable();
        groups.retain(|group| !is_small(group));
        groups.push(Group { members, normal: None });
    }
    groups
}

/// Where the rays of some points go.
#[derive(Clone, Debug)]
pub(super) struct Aim {
    /// `None` for the hemisphere.
    target: Option<Target>,
    /// How far they go into it.
    radius: f32,
}

impl Aim {
    /// Into the hemisphere, so far.
    pub(super) fn into_hemisphere(radius: f32) -> Self {
        Self { target: None, radius }
    }

    /// From these points to a light, if anything can be said of such rays.
    pub(super) fn at_light(light: &Light, origins: &[Vec3], scene: &Aabb) -> Option<Self> {
        let target = Some(target(&light.shape, origins, scene)?);
        Some(Self { target, radius: f32::INFINITY })
    }

    /// The shaft of all rays from these points, which are those that it was made for or some of them.
    /// Below the horizon of `normal` rays do not count.
    pub(super) fn shaft(
        &self,
        origins: &[Vec3],
        normal: Option<DVec3>,
        scene: &Aabb,
    ) -> Option<Shaft<'_>> {
        match &self.target {
            None => Shaft::hemisphere(origins, normal, self.radius, scene),
            Some(target) => Shaft::to_target(origins, normal, target, scene),
        }
    }
}

/// Where the rays from these points to a light end, by
/// [`LightView`](super::soft_shadow::LightView): at most 36 units in the last place of coordinates in
/// front of a point of the light, and one off by the rounding of directions.
fn target(shape: &LightShape, origins: &[Vec3], scene: &Aabb) -> Option<Target> {
    let near = Aabb::of_points(origins.iter().copied());
    let largest = |v: DVec3| v.abs().max_element();
    let of_origins = largest(near.min.as_dvec3()).max(largest(near.max.as_dvec3()));
    let slack = |points: &[DVec3]| {
        let of_points = points.iter().map(|p| largest(*p)).fold(0.0, f64::max);
        64.0 * f64::from(f32::EPSILON) * (of_points + of_origins)
    };
    Some(match *shape {
        LightShape::Quad { corner, edge_u, edge_v } => {
            let [corner, u, v] = [corner, edge_u, edge_v].map(|v| v.as_dvec3());
            let corners = [corner, corner + u, corner + u + v, corner + v];
            Target::flat(&corners, slack(&corners), u.cross(v).normalize_or_zero())
        }
        LightShape::Disk { center, normal, radius } => {
            let (center, normal) = (center.as_dvec3(), normal.as_dvec3().normalize());
            let axes = super::warp::orthonormal_basis(normal).map(|a| a * f64::from(radius));
            let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
            let corners = signs.map(|[s, t]| center + axes[0] * s + axes[1] * t);
            Target::flat(&corners, slack(&corners), normal)
        }
        LightShape::Sphere { center, radius } => {
            let (center, radius) = (center.as_dvec3(), f64::from(radius));
            let slack = slack(&[center + radius, center - radius]);
            // So small that its normals are noise: nothing can be said of where its samples end.
            if radius < 1e-6 * slack {
                return None;
            }
            Target::new(&[center], radius + slack)
        }
        LightShape::Point { position } => {
            let position = position.as_dvec3();
            Target::new(&[position], slack(&[position]))
        }
        LightShape::Directional { direction, angular_diameter_degrees } => {
            // What matters of a cone is what lies within the scene: rays pass a ball beyond it.
            let half = 0.5 * f64::from(angular_diameter_degrees.max(0.0)).to_radians();
            if half > std::f64::consts::FRAC_PI_4 {
                return None;
            }
            let all = near.union(*scene);
            let distance = 2.0 * (all.max.as_dvec3() - all.min.as_dvec3()).length();
            let [low, high] = [near.min, near.max].map(|v| v.as_dvec3());
            let center = (low + high) * 0.5;
            let axis = -direction.as_dvec3().normalize();
            // Directions are rounded.
            let spread = half.tan() + 4.0 * f64::from(f32::EPSILON);
            Target::new(&[center + axis * distance], distance * spread + (high - center).length())
        }
    })
}

/// Where rays to a light end, roughly.
#[derive(Clone, Copy, Debug)]
pub(super) enum Ends {
    /// In a ball.
    Within { center: DVec3, radius: f64 },
    /// Nowhere: they go along a unit direction, but for an angle of this sine.
    Along { direction: DVec3, sine: f64 },
}

impl Ends {
    /// Of rays to such a light, whatever the surface.
    pub(super) fn of(shape: &LightShape) -> Self {
        let around = |points: &[DVec3], radius: f32| {
            let center = points.iter().sum::<DVec3>() / points.len() as f64;
            let farthest = points.iter().map(|p| (*p - center).length()).fold(0.0, f64::max);
            let slack = 1e-5 * points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
            Self::Within { center, radius: (farthest + f64::from(radius)) * (1.0 + 1e-5) + slack }
        };
        match *shape {
            LightShape::Quad { corner, edge_u, edge_v } => {
                let [corner, u, v] = [corner, edge_u, edge_v].map(|v| v.as_dvec3());
                around(&[corner, corner + u, corner + v, corner + u + v], 0.0)
            }
            LightShape::Disk { center, radius, .. } | LightShape::Sphere { center, radius } => {
                around(&[center.as_dvec3()], radius)
            }
            LightShape::Point { position } => around(&[position.as_dvec3()], 0.0),
            LightShape::Directional { direction, angular_diameter_degrees } => {
                let half = 0.5 * f64::from(angular_diameter_degrees.max(0.0)).to_radians();
                let direction = -direction.as_dvec3().normalize();
                Self::Along { direction, sine: half.sin() + 1e-5 }
            }
        }
    }
}

//! Soft shadows: sample points on lights, the rays to them, and what each would bring if nothing
//! were in the way.
//!
//! Quads with right angles are sampled uniformly in solid angle, as are spheres (in the cone in
//! which they are seen) and directional lights; other quads and disks uniformly in area, and all but
//! directional lights if [`LightSampling::Area`] is asked for.

use super::light_lift::{Lift, Plane, reach};
use super::light_samples::LightSamples;
use super::light_sampling::LightSampling;
use super::rectangle_light::RectangleView;
use super::sampled_light::SampledLight;
use super::sampler::Points;
use super::surface::{SurfacePoint, offset_distance};
use super::warp::{self, Frame};
use crate::ray::Ray;
use crate::scene::{Light, LightShape};
use crate::vectorized::{inverse_sqrt, vectorized};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// What one sample of a light brings to a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// The way to the light, ending just before it. Means nothing where `weight` is 0.
    pub ray: Ray,
    /// Irradiance that arrives if nothing is in the way, over the light's strength: cosines over
    /// density. 0 where the sample is below the surface's horizon or on the light's dark side.
    pub weight: f32,
}

/// Whether every sample of the light is the same, so that one is enough.
pub fn is_delta(shape: &LightShape) -> bool {
    match *shape {
        LightShape::Point { .. } => true,
        LightShape::Directional { angular_diameter_degrees, .. } => angular_diameter_degrees <= 0.0,
        _ => false,
    }
}

/// A light as one surface point sees it: made once for all samples there.
#[derive(Clone, Copy, Debug)]
pub struct LightView {
    pub(super) kind: Kind,
    pub(super) origin: DVec3,
    pub(super) ray_origin: Vec3,
    /// End of the rays: 1 where they go to a point.
    pub(super) t_max: f32,
    pub(super) normal: DVec3,
    pub(super) dark: bool,
}

/// How it is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// No direction shows the emitting side.
    Nothing,
    Rectangle(RectangleView),
    Parallelogram {
        corner: DVec3,
        edges: [DVec3; 2],
        area: f64,
        plane: Plane,
    },
    Disk {
        center: DVec3,
        radius: f64,
        frame: Frame,
        plane: Plane,
    },
    Sphere {
        center: DVec3,
        radius: f64,
        frame: Frame,
        distance: f64,
        one_minus_cos: f64,
    },
    SphereSurface {
        center: DVec3,
        radius: f64,
    },
    Directional {
        frame: Frame,
        one_minus_cos: f64,
        factor: f64,
    },
    Point {
        position: DVec3,
    },
}

impl LightView {
    /// The light as seen from `surface`.
    pub fn new(light: &Light, surface: &SurfacePoint, sampling: LightSampling) -> Self {
        SampledLight::new(light, sampling).seen_from(surface)
    }

    /// Whether all samples have weight 0, as far as can be seen without drawing any.
    pub fn is_dark(&self) -> bool {
        self.dark
    }

    /// The sample of a point of the unit square.
    pub fn sample(&self, point: [f32; 2]) -> LightSample {
        let mut samples = LightSamples::default();
        self.sample_all(&Points::of(&[point]), &mut samples);
        LightSample { ray: self.ray(samples.direction(0)), weight: samples.weights()[0] }
    }

    /// The ray of a sample with this direction.
    #[inline(always)]
    pub fn ray(&self, direction: Vec3) -> Ray {
        Ray::new(self.ray_origin, direction, self.t_max)
    }

    /// The light, if it is sampled as a rectangle.
    pub(super) fn as_rectangle(&self) -> Option<&RectangleView> {
        if let Kind::Rectangle(view) = &self.kind { Some(view) } else { None }
    }

    /// The samples of all points, and of what lies behind them.
    pub fn sample_all(&self, points: &Points, samples: &mut LightSamples) {
        samples.resize(points.coordinates().0.len());
        vectorized(
            #[inline(always)]
            || self.sample_each(points, samples),
        );
    }

    #[inline(always)]
    fn sample_each(&self, points: &Points, samples: &mut LightSamples) {
        let nothing = (DVec3::ZERO, 0.0);
        match self.kind {
            Kind::Nothing => samples.set(
                points,
                #[inline(always)]
                |_| nothing,
            ),
            Kind::Rectangle(view) => view.sample(points, samples),
            Kind::Parallelogram { corner, edges, area, plane } => {
                samples.set(
                    points,
                    #[inline(always)]
                    |point| {
                        let target = corner + edges[0] * point[0] + edges[1] * point[1];
                        self.by_area(target, area, &plane)
                    },
                );
            }
            Kind::Disk { center, radius, frame, plane } => samples.set(
                points,
                #[inline(always)]
                |point| {
                    let p = warp::concentric_disk(point) * radius;
                    let target = center + frame.to_world(p.extend(0.0));
                    self.by_area(target, PI * radius * radius, &plane)
                },
            ),
            Kind::Sphere { center, radius, frame, distance, one_minus_cos } => {
                let (inverse_radius, from_center) = (1.0 / radius, self.origin - center);
                // What is enough for all of the sphere.
                let offset =
                    offset_distance(reach(center) + radius, 4.0 * (reach(from_center) + radius));
                samples.set_in_steps(
                    points,
                    #[inline(always)]
                    |_, point| {
                        let (p, squared) = warp::polar_disk(point);
                        [p.x, p.y, squared, 0.0]
                    },
                    #[inline(always)]
                    |steps| {
                        steps.next(
                            #[inline(always)]
                            |_, [x, y, squared, _]| {
                                let local = warp::on_cone([x, y], squared, one_minus_cos);
                                let sin_squared = local.x * local.x + local.y * local.y;
                                let half_chord_squared =
                                    radius * radius - distance * distance * sin_squared;
                                [local.x, local.y, local.z, half_chord_squared.max(0.0)]
                            },
                        );
                    },
                    #[inline(always)]
                    |_, [x, y, z, squared]| {
                        let half_chord = squared * inverse_sqrt(squared);
                        let direction = frame.to_world(DVec3::new(x, y, z));
                        let way = distance * z - half_chord;
                        let whole = direction * way;
                        let normal = (from_center + whole) * inverse_radius;
                        let height = -normal.dot(whole);
                        let lift = Lift::off(normal, height, 1.0 / height, offset);
                        self.towards(whole, lift, TAU * one_minus_cos / way)
                    },
                );
            }
            Kind::SphereSurface { center, radius } => samples.set(
                points,
                #[inline(always)]
                |point| {
                    let normal = warp::uniform_sphere(point);
                    let target = center + normal * radius;
                    let plane = Plane::new(normal, self.origin, &[target]);
                    self.by_area(target, 2.0 * TAU * radius * radius, &plane)
                },
            ),
            Kind::Directional { frame, one_minus_cos, factor } => {
                samples.set(
                    points,
                    #[inline(always)]
                    |point| {
                        let direction = frame.to_world(warp::uniform_cone(point, one_minus_cos));
                        (direction, self.cosine(direction).max(0.0) as f32 * factor as f32)
                    },
                );
            }
            Kind::Point { position } => samples.set(
                points,
                #[inline(always)]
                |_| {
                    let to_light = position - self.origin;
                    let distance = to_light.length();
                    let offset = offset_distance(reach(position), reach(to_light));
                    let share = 1.0 - (offset / distance).min(0.5);
                    let lift = Lift { away: -to_light * (1.0 - share), share };
                    self.segment(position, lift, 1.0 / (distance * distance * distance))
                },
            ),
        }
    }

    /// Cosine to the normal of a direction of any length.
    #[inline(always)]
    fn cosine(&self, direction: DVec3) -> f64 {
        self.normal.dot(direction) / direction.length()
    }

    /// A sample whose density is uniform over a flat light.
    #[inline(always)]
    fn by_area(&self, target: DVec3, area: f64, plane: &Plane) -> (DVec3, f32) {
        let squared = (target - self.origin).length_squared();
        let density = area * plane.height.max(0.0) / (squared * squared);
        self.segment(target, plane.lift(target), density)
    }

    /// Direction and weight of the sample whose ray goes to `target`, or a little less far: `lift`
    /// keeps it off geometry that touches the light. `factor`: one over the density per solid angle
    /// and the distance of the target.
    #[inline(always)]
    fn segment(&self, target: DVec3, lift: Lift, factor: f64) -> (DVec3, f32) {
        self.towards(target - self.origin, lift, factor)
    }

    /// As [`segment`](Self::segment), given the whole way.
    #[inline(always)]
    fn towards(&self, whole: DVec3, lift: Lift, factor: f64) -> (DVec3, f32) {
        let height = self.normal.dot(whole + lift.away);
        (lift.shortened(whole, height), usable(self.normal.dot(whole) * factor))
    }
}

/// The weight, if it is one that counts.
#[inline(always)]
pub(super) fn usable(weight: f64) -> f32 {
    let weight = weight as f32;
    if (weight > 0.0) & weight.is_finite() { weight } else { 0.0 }
}

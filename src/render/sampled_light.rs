//! Lights ready to be sampled, and how they look from a surface point.

use super::light_lift::{Plane, reach};
use super::light_sampling::LightSampling;
use super::rectangle_light::{Rectangle, RectangleView};
use super::soft_shadow::{Kind, LightView};
use super::surface::SurfacePoint;
use super::warp::Frame;
use crate::scene::{Light, LightShape};
use glam::DVec3;

/// A light, with what is the same wherever it is seen from.
#[derive(Clone, Debug)]
pub(super) struct SampledLight {
    shape: Shape,
    by_area: bool,
}

#[derive(Clone, Debug)]
enum Shape {
    Quad {
        corners: [DVec3; 4],
        edges: [DVec3; 2],
        normal: DVec3,
        area: f64,
        /// If it is to be sampled as one: that has right angles, so that its corners lie elsewhere, by
        /// so much.
        rectangle: Option<(Rectangle, f64)>,
    },
    Disk {
        center: DVec3,
        frame: Frame,
        radius: f64,
    },
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Directional {
        frame: Frame,
        /// Of half the angle in which it is seen.
        sin: f64,
        one_minus_cos: f64,
        factor: f64,
    },
    Point {
        position: DVec3,
    },
}

impl SampledLight {
    /// Of a light whose points are chosen so.
    pub(super) fn new(light: &Light, sampling: LightSampling) -> Self {
        let by_area = sampling == LightSampling::Area;
        let shape = match light.shape {
            LightShape::Quad { corner, edge_u, edge_v } => {
                let corner = corner.as_dvec3();
                let edges @ [u, v] = [edge_u, edge_v].map(|e| e.as_dvec3());
                let corners = [corner, corner + u, corner + v, corner + u + v];
                let normal = u.cross(v).normalize_or_zero();
                let is_rectangle = !by_area && has_right_angles(edges);
                let skew = 2.0 * u.dot(v).abs() / u.length();
                let rectangle =
                    is_rectangle.then(|| (Rectangle::new(&corners, edges, normal), skew));
                Shape::Quad { corners, edges, normal, area: u.cross(v).length(), rectangle }
            }
            LightShape::Disk { center, normal, radius } => Shape::Disk {
                center: center.as_dvec3(),
                frame: Frame::new(normal.as_dvec3().normalize()),
                radius: radius.into(),
            },
            LightShape::Sphere { center, radius } => {
                Shape::Sphere { center: center.as_dvec3(), radius: radius.into() }
            }
            LightShape::Directional { direction, angular_diameter_degrees } => {
                let half = 0.5 * f64::from(angular_diameter_degrees.max(0.0)).to_radians();
                Shape::Directional {
                    frame: Frame::new(-direction.as_dvec3().normalize()),
                    sin: half.sin(),
                    one_minus_cos: 2.0 * (0.5 * half).sin().powi(2),
                    // Strength is the irradiance of a surface that faces the light: radiance times the
                    // projected solid angle, pi sin^2. Solid angle over that is this factor.
                    factor: 2.0 / (1.0 + half.cos()),
                }
            }
            LightShape::Point { position } => Shape::Point { position: position.as_dvec3() },
        };
        Self { shape, by_area }
    }

    /// The light as seen from `surface`.
    pub(super) fn seen_from(&self, surface: &SurfacePoint) -> LightView {
        // From where the rays really start: what is weighed is what is traced.
        let origin = surface.origin.as_dvec3();
        // What lies below the horizon by more than the rounding of any sample is dark as a whole.
        let below = |points: &[DVec3], margin: f64| {
            points.iter().all(|p| {
                let d = *p - origin;
                // Samples lie at coordinates, and are as precise as those.
                let rounding = 1e-14 * (reach(*p) + reach(origin));
                d.dot(surface.normal) + margin + rounding < -1e-9 * (d.length() + margin)
            })
        };
        let (kind, dark) = match self.shape {
            Shape::Quad { corners, edges, normal, area, rectangle } => {
                let plane = Plane::new(normal, origin, &corners);
                let skew = rectangle.map_or(0.0, |(_, skew)| skew);
                let dark = plane.height <= 0.0 || below(&corners, skew);
                // Whatever points of a dark light are drawn, they weigh nothing.
                let by_angle = rectangle
                    .filter(|_| !dark)
                    .and_then(|(of, _)| RectangleView::new(&of, [origin, surface.normal], plane));
                let parallelogram = Kind::Parallelogram { corner: corners[0], edges, area, plane };
                (by_angle.map_or(parallelogram, Kind::Rectangle), dark)
            }
            Shape::Disk { center, frame, radius } => {
                let [_, _, normal] = frame.axes();
                let mut plane = Plane::new(normal, origin, &[center]);
                plane.reach += radius;
                let dark = plane.height <= 0.0 || below(&[center], radius);
                (Kind::Disk { center, radius, frame, plane }, dark)
            }
            Shape::Sphere { center, radius } => {
                let (to_center, distance) = ((center - origin), (center - origin).length());
                let dark = distance <= radius || below(&[center], radius);
                let sin_squared = (radius / distance).powi(2);
                let kind = if distance <= radius {
                    Kind::Nothing
                } else if self.by_area {
                    Kind::SphereSurface { center, radius }
                } else {
                    let one_minus_cos = sin_squared / (1.0 + (1.0 - sin_squared).sqrt());
                    let frame = Frame::new(to_center / distance);
                    Kind::Sphere { center, radius, frame, distance, one_minus_cos }
                };
                (kind, dark)
            }
            Shape::Directional { frame, sin, one_minus_cos, factor } => {
                let [_, _, axis] = frame.axes();
                let dark = axis.dot(surface.normal) < -sin - 1e-9;
                (Kind::Directional { frame, one_minus_cos, factor }, dark)
            }
            Shape::Point { position } => (Kind::Point { position }, below(&[position], 0.0)),
        };
        let t_max = match kind {
            Kind::Directional { .. } => f32::INFINITY,
            _ => 1.0,
        };
        LightView { kind, origin, ray_origin: surface.origin, t_max, normal: surface.normal, dark }
    }
}

fn has_right_angles([u, v]: [DVec3; 2]) -> bool {
    u.dot(v).abs() <= 1e-6 * u.length() * v.length()
}

//! Estimates against closed forms, traced by brute force through the renderer's own samples.

mod common;

use common::{built, scene_of};
use glam::{DVec3, Vec3};
use sato::backend::Accelerator;
use sato::geometry::TriangleMesh;
use sato::ray::{Ray, RayBatch};
use sato::render::sampler::{Dimension, PixelSampler};
use sato::render::soft_shadow::LightView;
use sato::render::{LightSampling, SamplerEntry, SurfacePoint, ambient_occlusion};
use sato::scene::{Light, LightShape};
use std::f64::consts::PI;

/// Far enough to be infinite, near enough that nothing else happens in `f32`.
const FAR: f32 = 1e4;
const PIXELS: u32 = 64;
const SAMPLES: u32 = 256;

/// A point of the plane z = 0, with the normal up.
fn point(x: f64, y: f64) -> SurfacePoint {
    let at = DVec3::new(x, y, 0.0);
    SurfacePoint {
        position: at,
        origin: (at + DVec3::Z * 2e-6).as_vec3(),
        normal: DVec3::Z,
        distance: 1.0,
    }
}

fn quads(quads: &[[Vec3; 4]]) -> Box<dyn Accelerator> {
    let vertices: Vec<Vec3> = quads.iter().flatten().copied().collect();
    let triangles = (0..quads.len() as u32)
        .flat_map(|q| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| 4 * q + v)));
    let mesh = TriangleMesh::new(vertices, triangles.collect());
    built(&"brute".parse().unwrap(), &scene_of(mesh))
}

/// The plane x = `x` from the floor to `height`.
fn wall(x: f32, height: f32) -> [Vec3; 4] {
    let at = |y, z| Vec3::new(x, y, z);
    [at(-FAR, 0.0), at(FAR, 0.0), at(FAR, height), at(-FAR, height)]
}

/// Compares an estimate to its value: pixels are independent, so their spread says how far off
/// the mean may be.
fn assert_close(
    name: &str,
    expected: f64,
    dimension: Dimension,
    sample: impl Fn([f32; 2]) -> (Ray, f64),
    accelerator: &dyn Accelerator,
) {
    let pixels: Vec<f64> = (0..PIXELS)
        .map(|pixel| {
            let sampler = PixelSampler::new(SamplerEntry::sobol(), 11, pixel, 0);
            let points = sampler.points(dimension, SAMPLES);
            let (rays, weights): (Vec<Ray>, Vec<f64>) =
                (0..points.len()).map(|i| sample(points.get(i))).unzip();
            let mut words = vec![0; SAMPLES as usize / 64];
            accelerator.occluded(&RayBatch { rays: &rays }, &mut words);
            let lit = |(i, w): (usize, &f64)| if sato::ray::bit(&words, i) { 0.0 } else { *w };
            weights.iter().enumerate().map(lit).sum::<f64>() / f64::from(SAMPLES)
        })
        .collect();
    let n = f64::from(PIXELS);
    let mean = pixels.iter().sum::<f64>() / n;
    let variance = pixels.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let sigma = (variance / n).sqrt();
    println!("{name}: {mean:.6} for {expected:.6}, sigma {sigma:.1e}");
    // Quadrature of a constant has no spread: leave room for f32.
    assert!(
        (mean - expected).abs() < 4.0 * sigma + 2e-5,
        "{name}: {mean} is not {expected}, sigma {sigma}"
    );
}

fn assert_visibility(
    name: &str,
    expected: f64,
    radius: f32,
    at: SurfacePoint,
    accelerator: &dyn Accelerator,
) {
    let dimension = Dimension::AmbientOcclusion;
    let sample = |point| (ambient_occlusion::ray(&at, point, radius), 1.0);
    assert_close(name, expected, dimension, sample, accelerator);
}

fn assert_irradiance(
    name: &str,
    expected: f64,
    shape: LightShape,
    at: SurfacePoint,
    accelerator: &dyn Accelerator,
) {
    let light = Light { name: "light".into(), shape, strength: Vec3::ONE };
    for sampling in LightSampling::ALL {
        let view = LightView::new(&light, &at, sampling);
        let sample = |point| {
            let sample = view.sample(point);
            (sample.ray, f64::from(sample.weight))
        };
        let name = format!("{name}, {}", sampling.name());
        assert_close(&name, expected, Dimension::Light(0), sample, accelerator);
    }
}

#[test]
fn ambient_occlusion_beside_walls() {
    let infinite = f32::INFINITY;
    let far_wall = quads(&[wall(1.0, FAR)]);
    assert_visibility("infinite wall", 0.5, infinite, point(0.0, 0.0), &*far_wall);
    for (c, occlusion) in [(0.25, 0.342_519), (0.5, 0.195_501), (0.75, 0.072_147)] {
        let name = format!("wall at {c} of the radius");
        assert_visibility(&name, 1.0 - occlusion, 2.0, point(1.0 - 2.0 * c, 0.0), &*far_wall);
    }
    assert_visibility("wall beyond the radius", 1.0, 0.99, point(0.0, 0.0), &*far_wall);
    let low = quads(&[wall(1.0, 1.0)]);
    assert_visibility("wall as high as far", 1.0 - 0.146_447, infinite, point(0.0, 0.0), &*low);
    let across = wall(1.0, FAR).map(|p| Vec3::new(p.y, p.x, p.z));
    let corner = quads(&[wall(1.0, FAR), across]);
    assert_visibility("corner", 0.25, infinite, point(0.999, 0.999), &*corner);
}

#[test]
fn ambient_occlusion_in_wedges_boxes_and_under_a_sphere() {
    let infinite = f32::INFINITY;
    for degrees in [60.0f32, 120.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let at = |y, s: f32| Vec3::new(1.0 - s * cos, y, s * sin);
        let plane = quads(&[[at(-FAR, 0.0), at(FAR, 0.0), at(FAR, FAR), at(-FAR, FAR)]]);
        let expected = f64::from((1.0 - cos) / 2.0);
        assert_visibility(
            &format!("wedge of {degrees}"),
            expected,
            infinite,
            point(0.0, 0.0),
            &*plane,
        );
    }
    let mut sides = vec![];
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            sides.push([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| {
                let mut p = Vec3::splat(side);
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
                p
            }));
        }
    }
    let room = quads(&sides);
    assert_visibility("closed box", 0.0, infinite, point(0.3, -0.2), &*room);
    assert_visibility("closed box, small radius", 1.0, 0.5, point(0.3, -0.2), &*room);
    let pit = |h: f32| {
        let sides = sides[..4]
            .iter()
            .map(|s| s.map(|p| Vec3::new(p.x, p.y, if p.z > 0.0 { h } else { -1.0 })));
        quads(&sides.collect::<Vec<_>>())
    };
    assert_visibility("pit as deep as half wide", 0.554_126, infinite, point(0.0, 0.0), &*pit(1.0));
    assert_visibility("pit as deep as wide", 0.239_456, infinite, point(0.0, 0.0), &*pit(2.0));
}

fn quad(corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]) -> LightShape {
    LightShape::Quad { corner: corner.into(), edge_u: edge_u.into(), edge_v: edge_v.into() }
}

#[test]
fn irradiance_of_polygons() {
    let nothing = quads(&[]);
    // Down is the emitting side.
    let square = quad([-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0]);
    assert_irradiance("square above", 0.554_126 * PI, square, point(0.0, 0.0), &*nothing);
    let upward = quad([-1.0, -1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    assert_irradiance("square turned away", 0.0, upward, point(0.0, 0.0), &*nothing);
    let crossing = quad([1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]);
    assert_irradiance(
        "square across the horizon",
        0.111_468 * PI,
        crossing,
        point(0.0, 0.0),
        &*nothing,
    );
    let below = quad([-1.0, -1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    assert_irradiance("square below", 0.0, below, point(0.0, 0.0), &*nothing);
    // A sheared square is sampled by area; of two that make a 2 x 2 square, each is half by symmetry.
    for (start, end) in [(-1.0, 1.0), (1.0, -1.0)] {
        let height = 1.0;
        let sheared =
            quad([-1.0, start, height], [0.0, end - start, 0.0], [2.0, 0.01 * start, 0.0]);
        let straight = quad([-1.0, start, height], [0.0, end - start, 0.0], [2.0, 0.0, 0.0]);
        let [a, b] = [sheared, straight].map(|shape| mean_weight(shape, point(0.0, 0.0)));
        assert!((a - b).abs() < 5e-3, "{a} is not {b}");
    }
    let half = quads(&[
        [[-FAR, -FAR], [0.0, -FAR], [0.0, FAR], [-FAR, FAR]].map(|[x, y]| Vec3::new(x, y, 0.5))
    ]);
    assert_irradiance("half of the square", 0.277_063 * PI, square, point(0.0, 0.0), &*half);
    let more = quads(&[
        [[-FAR, -FAR], [0.1, -FAR], [0.1, FAR], [-FAR, FAR]].map(|[x, y]| Vec3::new(x, y, 0.5))
    ]);
    assert_irradiance("blocker to .1", 0.197_025 * PI, square, point(0.0, 0.0), &*more);
}

fn mean_weight(shape: LightShape, at: SurfacePoint) -> f64 {
    let light = Light { name: "light".into(), shape, strength: Vec3::ONE };
    let view = LightView::new(&light, &at, LightSampling::SolidAngle);
    let sampler = PixelSampler::new(SamplerEntry::sobol(), 1, 0, 0);
    let points = sampler.points(Dimension::Light(0), 4096);
    let weight = |i| f64::from(view.sample(points.get(i)).weight);
    (0..4096).map(weight).sum::<f64>() / 4096.0
}

#[test]
fn irradiance_of_round_and_distant_lights() {
    let nothing = quads(&[]);
    let half = quads(&[
        [[-FAR, -FAR], [0.0, -FAR], [0.0, FAR], [-FAR, FAR]].map(|[x, y]| Vec3::new(x, y, 0.5))
    ]);
    let (center, radius) = (Vec3::Z * 2.0, 1.0);
    let disk = LightShape::Disk { center, normal: Vec3::NEG_Z, radius };
    assert_irradiance("disk", PI / 5.0, disk, point(0.0, 0.0), &*nothing);
    assert_irradiance("half disk", PI / 10.0, disk, point(0.0, 0.0), &*half);
    let sphere = LightShape::Sphere { center, radius };
    assert_irradiance("sphere", PI / 4.0, sphere, point(0.0, 0.0), &*nothing);
    assert_irradiance("half sphere", PI / 8.0, sphere, point(0.0, 0.0), &*half);
    let inside = LightShape::Sphere { center: Vec3::ZERO, radius };
    assert_irradiance("inside the sphere", 0.0, inside, point(0.0, 0.0), &*nothing);
    let setting = LightShape::Sphere { center: Vec3::X * 2.0, radius };
    // A cone on the horizon: half of (R/D)^2 (alpha - sin alpha cos alpha) with sin alpha = R/D.
    let alpha = 0.5f64.asin();
    let expected = alpha - alpha.sin() * alpha.cos();
    assert_irradiance("setting sphere", expected, setting, point(0.0, 0.0), &*nothing);
    for angular_diameter_degrees in [0.0, 0.53, 30.0] {
        let sun = |direction: Vec3| LightShape::Directional { direction, angular_diameter_degrees };
        let name = format!("sun of {angular_diameter_degrees} degrees");
        assert_irradiance(&name, 1.0, sun(Vec3::NEG_Z), point(0.0, 0.0), &*nothing);
        let slanted = Vec3::new(0.6, 0.0, -0.8);
        assert_irradiance(&name, 0.8, sun(slanted), point(0.0, 0.0), &*nothing);
        assert_irradiance(&name, 0.0, sun(Vec3::Z), point(0.0, 0.0), &*nothing);
    }
    let lamp = LightShape::Point { position: Vec3::new(3.0, 0.0, 4.0) };
    assert_irradiance("point", 0.8 / 25.0, lamp, point(0.0, 0.0), &*nothing);
}

/// Every shadow ray ends before its light, on the side of the surface: a ceiling in which the light
/// is set does not shade it, at any scale and place, and the surface does not shade itself.
#[test]
fn rays_end_before_geometry_that_touches_the_light() {
    for scale in [1e-3f32, 1.0, 1e3, 1e6] {
        for translation in [0.0f32, 1e2, 1e5] {
            if translation > 1e3 * scale {
                continue;
            }
            let place = Vec3::new(1.0, -0.7, 0.3) * translation;
            let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * scale + place;
            let sheet =
                |z| [at(-9.0, -9.0, z), at(9.0, -9.0, z), at(9.0, 9.0, z), at(-9.0, 9.0, z)];
            let room = quads(&[sheet(0.0), sheet(3.0)]);
            let lights = [
                quad(at(-1.0, -1.0, 3.0).into(), [0.0, 2.0 * scale, 0.0], [2.0 * scale, 0.0, 0.0]),
                quad(
                    at(-1.0, -1.0, 3.0).into(),
                    [scale, 2.0 * scale, 0.0],
                    [2.0 * scale, 0.0, 0.0],
                ),
                LightShape::Disk { center: at(1.0, 1.0, 3.0), normal: Vec3::NEG_Z, radius: scale },
                LightShape::Sphere { center: at(1.0, 1.0, 2.0), radius: scale },
                LightShape::Point { position: at(0.5, 0.5, 3.0) },
            ];
            for (x, y) in [(0.1, 0.2), (8.9, -8.5), (-1.0, 5.0)] {
                let view = Ray::new(at(x, y, 2.0), Vec3::NEG_Z, f32::INFINITY);
                let hit = room.closest_hit(&view).expect("a floor");
                let [a, b, c] = [[0, 1, 2], [0, 2, 3]][hit.triangle as usize % 2];
                let corners = sheet(0.0);
                let triangle = sato::geometry::Triangle([corners[a], corners[b], corners[c]]);
                let surface = SurfacePoint::new(&triangle, &view);
                for shape in lights {
                    let light = Light { name: "light".into(), shape, strength: Vec3::ONE };
                    let view = LightView::new(&light, &surface, LightSampling::SolidAngle);
                    let sampler = PixelSampler::new(SamplerEntry::sobol(), 5, 0, 0);
                    let points = sampler.points(Dimension::Light(0), 256);
                    let rays: Vec<Ray> = (0..256)
                        .map(|i| view.sample(points.get(i)))
                        .filter(|sample| sample.weight > 0.0)
                        .map(|sample| sample.ray)
                        .collect();
                    assert!(rays.len() > 250, "{shape:?}");
                    let answers = common::occluded(&*room, &rays);
                    assert_eq!(
                        sato::ray_set::occluded_count(&answers),
                        0,
                        "{shape:?}, scale {scale}, at {translation}"
                    );
                    let gap = |ray: &Ray| match shape {
                        LightShape::Sphere { center, radius } => {
                            (ray.at(ray.t_max) - center).length() - radius
                        }
                        _ => at(0.0, 0.0, 3.0).z - ray.at(ray.t_max).z,
                    };
                    let reaches = |ray: &Ray| gap(ray).abs() < 3e-3 * scale;
                    assert!(rays.iter().all(reaches), "{shape:?}: ends far from the light");
                }
            }
        }
    }
}

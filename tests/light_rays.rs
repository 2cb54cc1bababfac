//! Where shadow rays to lights end. How many arrive is for `truth.rs`.

mod common;

use common::{built, scene_of};
use glam::Vec3;
use sato::backend::Accelerator;
use sato::geometry::TriangleMesh;
use sato::ray::Ray;
use sato::render::sampler::{Dimension, PixelSampler};
use sato::render::soft_shadow::LightView;
use sato::render::{LightSampling, SamplerEntry, SurfacePoint};
use sato::scene::{Light, LightShape};

fn quads(quads: &[[Vec3; 4]]) -> Box<dyn Accelerator> {
    let vertices: Vec<Vec3> = quads.iter().flatten().copied().collect();
    let triangles = (0..quads.len() as u32)
        .flat_map(|q| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| 4 * q + v)));
    let mesh = TriangleMesh::new(vertices, triangles.collect());
    built(&"brute".parse().unwrap(), &scene_of(mesh))
}

fn quad(corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]) -> LightShape {
    LightShape::Quad { corner: corner.into(), edge_u: edge_u.into(), edge_v: edge_v.into() }
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

//! Geometry that the picture cannot see, nor the shadows that it casts: not even built into a tree.

use super::settings::{Pass, RenderSettings};
use super::shafts::Ends;
use crate::geometry::TriangleMesh;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Part of the triangles that must go for a smaller mesh to pay.
const LEAST_SHARE: f64 = 0.1;

/// The scene without the triangles that no ray of its picture can meet, and how many they are; `None`
/// where they are too few to matter.
///
/// Camera rays, and so the points that they see, lie within the pyramid of the view. Shadow rays leave
/// it by a light's distance from each of its sides at most, or by the radius of ambient occlusion. The
/// rest of the mesh keeps its order, so the picture keeps its bits. Of a moving scene it is the first
/// frame's picture, and the part stands still.
pub fn seen_part(scene: &Scene, settings: &RenderSettings) -> Option<(Scene, u64)> {
    let sides = sides(scene, settings);
    if sides.is_empty() {
        return None;
    }
    let eye = scene.camera.eye.as_dvec3();
    let mesh = &scene.mesh;
    let is_seen = |triangle: &&[u32; 3]| {
        let corners = triangle.map(|vertex| mesh.vertices()[vertex as usize].as_dvec3() - eye);
        // Camera rays and points are rounded, each to a millionth of its distance at most.
        let far = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        let slack = 1e-5 * (far + eye.abs().max_element());
        sides.iter().all(|(normal, least)| {
            corners.iter().any(|corner| normal.dot(*corner) >= *least - slack)
        })
    };
    let kept: Vec<_> = mesh.triangles().par_iter().filter(is_seen).copied().collect();
    let left_out = mesh.len() - kept.len();
    if (left_out as f64) < LEAST_SHARE * mesh.len() as f64 {
        return None;
    }
    let mesh = Arc::new(TriangleMesh::new(mesh.vertices().to_vec(), kept));
    Some((Scene { mesh, motion: None, ..scene.clone() }, left_out as u64))
}

/// Planes through the eye, by their unit normals: rays lie where `normal . (x - eye)` is no less than
/// the number beside it. Those that rays may leave without end are left out.
fn sides(scene: &Scene, settings: &RenderSettings) -> Vec<(DVec3, f64)> {
    let [width, height] = settings.size.map(|n| n as f32);
    let view = scene.camera.view(settings.size);
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
    let corners = corners.map(|[x, y]| view.ray(x, y).direction.as_dvec3());
    let middle: DVec3 = corners.iter().sum();
    let eye = scene.camera.eye.as_dvec3();
    let side = |i: usize| {
        let normal = corners[i].cross(corners[(i + 1) % 4]).normalize_or_zero();
        let normal = if normal.dot(middle) < 0.0 { -normal } else { normal };
        let mut least = 0.0f64;
        for pass in &settings.passes {
            match pass {
                Pass::AmbientOcclusion => {
                    least = least.min(-1.01 * f64::from(settings.ao_radius));
                }
                Pass::AmbientOcclusionUnbounded => return None,
                Pass::Shadow => {
                    for light in &scene.lights {
                        least = least.min(match Ends::of(&light.shape) {
                            Ends::Within { center, radius } => normal.dot(center - eye) - radius,
                            Ends::Along { direction, sine } if normal.dot(direction) > sine => 0.0,
                            Ends::Along { .. } => return None,
                        });
                    }
                }
            }
        }
        (normal != DVec3::ZERO).then_some((normal, least))
    };
    // Of a view of almost 180 degrees, the sides say nothing that rounding leaves certain.
    let is_wide = scene.camera.fov_degrees > 150.0 || width > 20.0 * height;
    if is_wide { Vec::new() } else { (0..4).filter_map(side).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::BackendSpec;
    use crate::lab::Lab;
    use crate::render::{RenderOptions, render};
    use crate::scene;

    /// Pictures have the same bits without what they cannot see.
    #[test]
    fn what_is_not_seen_is_not_missed() {
        let mut left_out = 0;
        for name in ["bedroom", "carnival", "ship"] {
            let mut scene = scene::load(name).unwrap();
            // Looking down on a part of it.
            scene.camera.fov_degrees *= 0.4;
            for passes in [vec![Pass::AmbientOcclusion], vec![Pass::Shadow]] {
                let settings = RenderSettings {
                    size: [40, 24],
                    spp: 4,
                    passes,
                    ..RenderSettings::of_scene(&scene)
                };
                let film = |scene: &Scene| {
                    let spec: BackendSpec = "bvh8".parse().unwrap();
                    let backend = Lab::new(scene, 0).build(&spec).unwrap();
                    render(scene, &*backend, &settings, &RenderOptions::default()).unwrap().film
                };
                if let Some((part, count)) = seen_part(&scene, &settings) {
                    assert_eq!(part.mesh.len() as u64 + count, scene.mesh.len() as u64);
                    assert!(film(&part) == film(&scene), "{name}");
                    left_out += count;
                }
            }
        }
        assert!(left_out > 10_000, "{left_out}");
    }
}

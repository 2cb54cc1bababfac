//! What is in a scene, in numbers.

use super::{Camera, Light, Scene};
use crate::geometry::TriangleMesh;
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::fmt;

/// A triangle counts as degenerate below this share of its longest edge squared.
const DEGENERATE_AREA: f64 = 1e-10;

/// A record about a scene; lengths are in scene units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneInfo {
    /// Name of the scene.
    pub name: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices that they share.
    pub vertices: usize,
    /// Lower corner of the bounding box.
    pub bounds_min: [f32; 3],
    /// Upper corner of the bounding box.
    pub bounds_max: [f32; 3],
    /// Smallest area of a triangle, in scene units squared; degenerate ones are not counted in the
    /// three areas, which are absent if all are.
    pub area_min: Option<f64>,
    /// Median area (the upper one of two), in scene units squared.
    pub area_median: Option<f64>,
    /// Largest area, in scene units squared.
    pub area_max: Option<f64>,
    /// Triangles with an area below 1e-10 of their longest edge squared, or a corner twice.
    pub degenerate_triangles: usize,
    /// Triangles whose corners are those of an earlier one, in any order.
    pub duplicate_triangles: usize,
    /// How it moves, if it does.
    pub motion: Option<MotionInfo>,
    /// Bytes of vertices and indices.
    pub memory_bytes: usize,
    /// Length of ambient-occlusion rays.
    pub ao_radius: f32,
    /// Default width and height of an image, in pixels.
    pub size: [u32; 2],
    /// The view.
    pub camera: Camera,
    /// The lights.
    pub lights: Vec<Light>,
    /// What was repaired or dropped while loading.
    pub warnings: Vec<String>,
}

/// A record about the motion of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MotionInfo {
    /// Number of frames.
    pub frames: usize,
    /// Number of objects that it consists of.
    pub objects: usize,
    /// How many of them ever move.
    pub moving_objects: usize,
}

impl SceneInfo {
    /// Looks at every triangle of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let mesh = &scene.mesh;
        let bounds = mesh.bounds();
        let mut areas: Vec<f64> = (0..mesh.len()).filter_map(|i| sound_area(mesh, i)).collect();
        areas.sort_unstable_by(f64::total_cmp);
        Self {
            name: scene.name.clone(),
            triangles: mesh.len(),
            vertices: mesh.vertices().len(),
            bounds_min: bounds.min.to_array(),
            bounds_max: bounds.max.to_array(),
            area_min: areas.first().copied(),
            area_median: areas.get(areas.len() / 2).copied(),
            area_max: areas.last().copied(),
            degenerate_triangles: mesh.len() - areas.len(),
            duplicate_triangles: duplicates(mesh),
            motion: scene.motion.as_ref().map(|motion| MotionInfo {
                frames: motion.frames,
                objects: motion.objects.len(),
                moving_objects: motion.objects.iter().filter(|object| object.moves).count(),
            }),
            memory_bytes: mesh.memory_bytes(),
            ao_radius: scene.defaults.ao_radius,
            size: scene.defaults.size,
            camera: scene.camera,
            lights: scene.lights.clone(),
            warnings: scene.warnings.clone(),
        }
    }
}

/// The area of triangle `index` unless it is degenerate.
fn sound_area(mesh: &TriangleMesh, index: usize) -> Option<f64> {
    let triangle = mesh.triangle(index);
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let longest2 = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let area = triangle.area();
    (area > 0.0 && area >= DEGENERATE_AREA * longest2).then_some(area)
}

/// How many triangles have the corner positions of an earlier one.
fn duplicates(mesh: &TriangleMesh) -> usize {
    let mut first_at = HashMap::new();
    let places: Vec<u32> = (0u32..)
        .zip(mesh.vertices())
        // Adding zero makes the two zeros one.
        .map(|(i, v)| *first_at.entry(v.to_array().map(|x| (x + 0.0).to_bits())).or_insert(i))
        .collect();
    let mut seen = HashSet::with_capacity(mesh.len());
    let is_new = |t: &&[u32; 3]| {
        let mut corners = t.map(|i| places[i as usize]);
        corners.sort_unstable();
        seen.insert(corners)
    };
    mesh.len() - mesh.triangles().iter().filter(is_new).count()
}

impl fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let corner = |[x, y, z]: [f32; 3]| format!("({x}, {y}, {z})");
        let area = |area: Option<f64>| area.map_or("none".into(), |a| format!("{a:.4e}"));
        let mut row = |name: &str, value: String| writeln!(f, "{name:<22}{value}");
        row("scene", self.name.clone())?;
        row("triangles", self.triangles.to_string())?;
        row("vertices", self.vertices.to_string())?;
        row("bounds min", corner(self.bounds_min))?;
        row("bounds max", corner(self.bounds_max))?;
        row("area min", area(self.area_min))?;
        row("area median", area(self.area_median))?;
        row("area max", area(self.area_max))?;
        row("degenerate triangles", self.degenerate_triangles.to_string())?;
        row("duplicate triangles", self.duplicate_triangles.to_string())?;
        if let Some(MotionInfo { frames, objects, moving_objects }) = self.motion {
            row("frames", frames.to_string())?;
            row("objects", format!("{objects}, of which {moving_objects} move"))?;
        }
        row("memory", format!("{:.1} MiB", self.memory_bytes as f64 / f64::from(1 << 20)))?;
        row("AO radius", self.ao_radius.to_string())?;
        row("image size", format!("{} x {}", self.size[0], self.size[1]))?;
        let Camera { eye, look_at, fov_degrees, .. } = self.camera;
        let (eye, look_at) = (corner(eye.to_array()), corner(look_at.to_array()));
        row("camera", format!("{eye} to {look_at}, {fov_degrees} degrees high"))?;
        for Light { name, shape, strength } in &self.lights {
            let (kind, key) = (shape.kind(), shape.strength_key());
            let strength = corner(strength.to_array());
            row(&format!("light {name}"), format!("{kind}, {key} {strength}"))?;
        }
        self.warnings.iter().try_for_each(|warning| row("warning", warning.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Defaults;
    use glam::Vec3;

    #[test]
    fn counts_degenerate_and_duplicate_triangles() {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0, -Vec3::ZERO];
        let triangles = vec![[0, 1, 2], [2, 4, 1], [0, 1, 3], [0, 3, 2]];
        let mesh = TriangleMesh::new(vertices, triangles);
        let bounds = mesh.bounds();
        let scene = Scene {
            motion: None,
            name: "x".into(),
            mesh: mesh.into(),
            camera: super::super::suggest::camera(&bounds),
            lights: vec![super::super::suggest::light(&bounds)],
            defaults: Defaults { ao_radius: 1.0, size: [4, 2] },
            warnings: vec!["oh".into()],
        };
        let info = SceneInfo::of(&scene);
        assert_eq!((info.degenerate_triangles, info.duplicate_triangles), (1, 1));
        assert_eq!((info.area_min, info.area_median), (Some(0.5), Some(0.5)));
        assert_eq!(info.area_max, Some(1.0));
        let table = info.to_string();
        assert!(table.contains("light light1") && table.contains("quad"), "{table}");
        let json = serde_json::to_value(&info).unwrap();
        assert_eq!(json["bounds_max"][0], 2.0);
        assert_eq!(json["lights"][0]["shape"]["type"], "quad");
    }
}

//! What the cases' scenes have in common: a patch, a camera that looks at it, things around it.

use super::Case;
use super::form_factor::Receiver;
use crate::geometry::{TriangleMesh, Vec3};
use crate::render::Pass;
use crate::scene::{Camera, Defaults, Light, LightShape, Scene};
use glam::DVec3;

/// As good as endless beside patches of size 1, and near enough for `f32`.
pub(super) const FAR: f32 = 1e5;

/// Width and height of the pictures, in pixels.
const SIZE: u32 = 8;

/// A scene under construction.
pub(super) struct Stage {
    camera: Camera,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Stage {
    /// A patch of the floor z = 0, seen from `eye` above it. Pixels see the square of half size
    /// `half` about `center`; the patch is larger.
    pub(super) fn floor(center: [f32; 2], half: f32, eye: f32) -> Self {
        Self::tilted(Vec3::new(center[0], center[1], 0.0), Vec3::Z, half, eye)
    }

    /// The same at right angles to `normal`, of any length.
    pub(super) fn tilted(center: Vec3, normal: Vec3, half: f32, eye: f32) -> Self {
        let normal = normal.normalize();
        let up = if normal == Vec3::Z { Vec3::Y } else { normal.any_orthonormal_vector() };
        let right = up.cross(normal);
        let camera = Camera {
            eye: center + normal * eye,
            look_at: center,
            up,
            fov_degrees: 2.0 * (half / eye).atan().to_degrees(),
        };
        let [u, v] = [right, up].map(|axis| axis * (1.25 * half));
        let corners = [center - u - v, center + u - v, center + u + v, center - u + v];
        Self { camera, vertices: vec![], triangles: vec![] }.polygon(&corners)
    }

    /// With a convex polygon.
    pub(super) fn polygon(mut self, corners: &[Vec3]) -> Self {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners);
        let triangle = |i| [first, first + i, first + i + 1];
        self.triangles.extend((1..corners.len() as u32 - 1).map(triangle));
        self
    }

    /// With convex polygons.
    pub(super) fn polygons(self, polygons: &[Vec<Vec3>]) -> Self {
        polygons.iter().fold(self, |stage, polygon| stage.polygon(polygon))
    }

    /// The case of visibility up to `radius`, or without a limit.
    pub(super) fn visibility(
        self,
        radius: Option<f32>,
        value: impl Fn(&Receiver) -> f64 + Send + Sync + 'static,
    ) -> Case {
        let pass = radius.map_or(Pass::AmbientOcclusionUnbounded, |_| Pass::AmbientOcclusion);
        self.case(pass, radius.unwrap_or(1.0), Vec::new(), Box::new(value))
    }

    /// The case of a light's irradiance.
    pub(super) fn irradiance(
        self,
        shape: LightShape,
        value: impl Fn(&Receiver) -> f64 + Send + Sync + 'static,
    ) -> Case {
        let light = Light { name: "light".into(), shape, strength: Vec3::ONE };
        self.case(Pass::Shadow, 1.0, vec![light], Box::new(value))
    }

    /// The case of a light's irradiance behind convex blockers, of which the scene consists besides
    /// the patch.
    pub(super) fn blocked(self, shape: LightShape, blockers: &[Vec<Vec3>]) -> Case {
        let exact: Vec<_> = blockers.iter().map(|blocker| exact(blocker)).collect();
        let value = move |receiver: &Receiver| receiver.irradiance(&shape, &exact);
        self.polygons(blockers).irradiance(shape, value)
    }

    fn case(
        self,
        pass: Pass,
        ao_radius: f32,
        lights: Vec<Light>,
        value: Box<dyn Fn(&Receiver) -> f64 + Send + Sync>,
    ) -> Case {
        let scene = Scene {
            name: "truth".into(),
            mesh: TriangleMesh::new(self.vertices, self.triangles).into(),
            camera: self.camera,
            lights,
            defaults: Defaults { ao_radius, size: [SIZE; 2] },
            motion: None,
            warnings: Vec::new(),
        };
        Case { scene, pass, slack: 0.0, by_area: true, value }
    }
}

impl Case {
    /// With this slack.
    pub(super) fn within(self, slack: f64) -> Self {
        Self { slack, ..self }
    }

    /// Too near for points uniform in area.
    pub(super) fn not_by_area(self) -> Self {
        Self { by_area: false, ..self }
    }
}

/// Corners as they are in the scene.
pub(super) fn exact(corners: &[Vec3]) -> Vec<DVec3> {
    corners.iter().map(|c| c.as_dvec3()).collect()
}

/// A quad light.
pub(super) fn quad(corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]) -> LightShape {
    LightShape::Quad { corner: corner.into(), edge_u: edge_u.into(), edge_v: edge_v.into() }
}

/// The rectangle from `low` to `high` at height `z`.
pub(super) fn sheet(low: [f32; 2], high: [f32; 2], z: f32) -> Vec<Vec3> {
    let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    corners.map(|[x, y]| Vec3::new(x, y, z)).into()
}

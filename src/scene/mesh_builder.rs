//! Gathers the triangles of a scene into one index space and keeps the promises of
//! [`TriangleMesh`].

use crate::geometry::TriangleMesh;
use glam::{DAffine3, DVec3, Vec3};

/// Largest coordinate of a vertex, in scene units: areas and squared distances stay finite in `f32`.
pub(super) const MAX_COORDINATE: f32 = 1e18;

/// Some triangles with their own vertices; indices are in range.
#[derive(Debug, Default)]
pub(super) struct MeshPart {
    pub(super) vertices: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl MeshPart {
    /// Drops triangles with a vertex that is not finite, then what vertices nothing uses. Returns
    /// how many triangles went.
    pub(super) fn drop_non_finite(&mut self) -> usize {
        if self.vertices.iter().all(|v| v.is_finite()) {
            return 0;
        }
        let before = self.triangles.len();
        let vertices = &self.vertices;
        self.triangles.retain(|t| t.iter().all(|&i| vertices[i as usize].is_finite()));
        self.drop_unused_vertices();
        before - self.triangles.len()
    }

    fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
        let mut kept = 0;
        let new_index: Vec<u32> = used
            .iter()
            .map(|&used| {
                let index = kept;
                kept += u32::from(used);
                index
            })
            .collect();
        self.triangles.iter_mut().flatten().for_each(|i| *i = new_index[*i as usize]);
        let mut used = used.into_iter();
        self.vertices.retain(|_| used.next() == Some(true));
    }

    /// Whether no finite coordinate is beyond [`MAX_COORDINATE`].
    pub(super) fn check_coordinates(&self) -> Result<(), String> {
        let beyond = |v: &&Vec3| v.is_finite() && v.abs().max_element() > MAX_COORDINATE;
        match self.vertices.iter().find(beyond) {
            Some(v) => Err(format!("vertex {v:?} has a coordinate beyond {MAX_COORDINATE:e}")),
            None => Ok(()),
        }
    }
}

/// All triangles so far.
#[derive(Debug, Default)]
pub(super) struct MeshBuilder {
    all: MeshPart,
}

impl MeshBuilder {
    /// Adds `part`, whose vertices are finite, moved by `transform`. The error says what is wrong
    /// with the transformed vertices.
    pub(super) fn append(
        &mut self,
        mut part: MeshPart,
        transform: &DAffine3,
    ) -> Result<(), String> {
        // The identity must not touch a bit, not even the sign of a zero.
        if *transform != DAffine3::IDENTITY {
            let limit = DVec3::splat(f64::from(MAX_COORDINATE));
            for v in &mut part.vertices {
                let moved = transform.transform_point3(v.as_dvec3());
                if !moved.abs().cmple(limit).all() {
                    return Err(format!(
                        "the transform moves vertex {v:?} beyond {MAX_COORDINATE:e}"
                    ));
                }
                *v = moved.as_vec3();
            }
        }
        if self.all.vertices.is_empty() {
            self.all = part;
            return Ok(());
        }
        let first = self.all.vertices.len();
        if first + part.vertices.len() > u32::MAX as usize {
            return Err("more than 4294967295 vertices in the scene".into());
        }
        let first = first as u32;
        self.all.vertices.append(&mut part.vertices);
        self.all.triangles.extend(part.triangles.iter().map(|t| t.map(|i| first + i)));
        Ok(())
    }

    /// The mesh of all parts.
    pub(super) fn finish(self) -> TriangleMesh {
        TriangleMesh::new(self.all.vertices, self.all.triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> MeshPart {
        MeshPart { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]] }
    }

    #[test]
    fn parts_are_moved_and_share_one_index_space() {
        let mut builder = MeshBuilder::default();
        builder.append(triangle(), &DAffine3::IDENTITY).unwrap();
        builder.append(triangle(), &DAffine3::from_translation(DVec3::Z)).unwrap();
        let mesh = builder.finish();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(mesh.vertices()[4], Vec3::new(1.0, 0.0, 1.0));
    }

    #[test]
    fn a_transform_out_of_range_is_refused() {
        let far = DAffine3::from_scale(DVec3::splat(1e300));
        let message = MeshBuilder::default().append(triangle(), &far).unwrap_err();
        assert!(message.contains("beyond 1e18"), "{message}");
    }
}

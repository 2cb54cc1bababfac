//! Every triangle for every ray: the twin that all other native backends must agree with.

use super::catalogue::BackendEntry;
use super::{Accelerator, BuildStats, mode};
use crate::geometry::{Aabb, Triangle};
use crate::intersect::{Exact, Fast, Mode, PreparedRay, TriangleTest};
use crate::ray::{Hit, Ray, RayBatch, VisitCounts, set_bit};
use crate::trace::Counter;

pub(super) static ENTRY: BackendEntry = BackendEntry {
    name: "brute",
    about: "every triangle for every ray, no tree: the reference for tests",
    keys: &[mode::KEY],
    moving_keys: &[],
    unavailable: None,
    check: None,
    build: |spec, context| {
        let mesh = &context.scene.mesh;
        let triangles: Vec<_> = (0..mesh.len()).map(|i| mesh.triangle(i)).collect();
        let stats = BuildStats {
            memory_bytes: size_of_val(triangles.as_slice()) as u64,
            ..BuildStats::default()
        };
        Ok(Box::new(Brute { triangles, bounds: mesh.bounds(), mode: mode::of(spec), stats }))
    },
    build_moving: None,
};

struct Brute {
    triangles: Vec<Triangle>,
    bounds: Aabb,
    mode: Mode,
    stats: BuildStats,
}

impl Brute {
    fn any_hit(&self, ray: &Ray, counts: &mut VisitCounts) -> bool {
        match self.mode {
            Mode::Fast => self.any_hit_by(Fast, ray, counts),
            Mode::Exact => self.any_hit_by(Exact, ray, counts),
        }
    }

    fn any_hit_by<T: TriangleTest>(&self, test: T, ray: &Ray, counts: &mut VisitCounts) -> bool {
        PreparedRay::new(ray, &self.bounds).is_some_and(|prepared| {
            self.triangles.iter().any(|triangle| {
                counts.triangles(1);
                let (hit, by) = test.hits(&prepared, triangle);
                counts.settled(by);
                hit
            })
        })
    }
}

impl Accelerator for Brute {
    fn build_stats(&self) -> &BuildStats {
        &self.stats
    }

    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let prepared = PreparedRay::new(ray, &self.bounds)?;
        let hits = self
            .triangles
            .iter()
            .zip(0u32..)
            .filter_map(|(triangle, id)| prepared.triangle(triangle).map(|t| (t, id)));
        let (t, id) = hits.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        Some(prepared.hit(t, id))
    }

    fn occluded(&self, batch: &RayBatch<'_>, occluded: &mut [u64]) {
        for (index, ray) in batch.rays.iter().enumerate() {
            set_bit(occluded, index, self.any_hit(ray, &mut VisitCounts::default()));
        }
    }

    fn occluded_counted(
        &self,
        batch: &RayBatch<'_>,
        occluded: &mut [u64],
        counts: &mut [VisitCounts],
    ) -> bool {
        for (index, (ray, counts)) in batch.rays.iter().zip(counts).enumerate() {
            set_bit(occluded, index, self.any_hit(ray, counts));
        }
        true
    }
}

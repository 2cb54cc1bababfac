//! The closest triangle of each ray so far, and the scalar test of it.

use super::{Stream, closest};
use crate::intersect::{HIT_LANES, PreparedRay};
use crate::ray::Hit;
use crate::trace::wide::simd::Simd;

/// The closest triangle so far.
#[derive(Clone, Copy)]
pub(super) struct Best {
    pub(super) triangle: u32,
    /// Between these distances; the same two if the scalar test was asked.
    pub(super) lower: f32,
    pub(super) upper: f32,
}

impl Best {
    pub(super) const NONE: Self =
        Self { triangle: u32::MAX, lower: f32::INFINITY, upper: f32::INFINITY };

    fn is_settled(&self) -> bool {
        self.lower == self.upper
    }
}

impl Stream<'_, '_> {
    /// A triangle that the ray may hit: for certain, and within its bounds, or as the scalar test says.
    #[inline(always)]
    pub(super) fn consider(&mut self, index: usize, candidate: Best, is_certain: bool) {
        let best = &mut self.memory.best[index];
        if is_certain {
            if candidate.lower > best.upper {
                return;
            }
            if candidate.upper < best.lower {
                *best = candidate;
                self.rays.shorten(index, candidate.upper);
                return;
            }
        }
        self.settle(index, candidate.triangle);
    }

    /// As [`consider`](Self::consider), by the scalar test.
    #[cold]
    #[inline(never)]
    fn settle(&mut self, index: usize, triangle: u32) {
        let Some(prepared) = self.rays.prepared(index) else { return };
        let mesh = self.rays.mesh();
        let distance = |triangle: u32| prepared.triangle(&mesh.triangle(triangle as usize));
        let Some(t) = distance(triangle) else { return };
        let best = &mut self.memory.best[index];
        if t > best.upper {
            return;
        }
        if t >= best.lower && !best.is_settled() {
            match distance(best.triangle).filter(|t| *t <= best.upper) {
                Some(t) => (best.lower, best.upper) = (t, t),
                None => {
                    self.memory.misled |= 1 << index;
                    return;
                }
            }
        }
        if (t, triangle) < (best.lower, best.triangle) {
            *best = Best { triangle, lower: t, upper: t };
        }
        self.rays.shorten(index, best.upper);
    }

    /// Asks of each ray's best triangle where it is hit.
    #[inline(always)]
    pub(super) fn confirm<S: Simd>(&mut self, s: S, found: &mut impl FnMut(usize, Hit)) {
        let mut left = self.rays.valid;
        while left != 0 {
            let mut indices = [0; HIT_LANES];
            let mut lanes = 0;
            while left != 0 && lanes < HIT_LANES {
                let index = left.trailing_zeros() as usize;
                left &= left - 1;
                let best = &self.memory.best[index];
                if best.is_settled() || self.memory.misled >> index & 1 != 0 {
                    if let Some(hit) = self.hit(s, index) {
                        found(index, hit);
                    }
                    continue;
                }
                let triangle = self.rays.mesh().triangle(best.triangle as usize);
                self.memory.lanes.set(lanes, self.rays.given(index), &triangle);
                indices[lanes] = index;
                lanes += 1;
            }
            let distances = self.memory.lanes.distances(&self.structure.top().bounds);
            for (&index, t) in indices[..lanes].iter().zip(distances) {
                let Best { triangle, upper, .. } = self.memory.best[index];
                if t <= upper {
                    found(index, Hit { t, triangle });
                } else if let Some(hit) = self.hit(s, index) {
                    found(index, hit);
                }
            }
        }
    }

    /// What a ray hits, after all.
    #[inline(never)]
    fn hit<S: Simd>(&self, s: S, index: usize) -> Option<Hit> {
        let best = &self.memory.best[index];
        if self.memory.misled >> index & 1 == 0 {
            if best.triangle == Best::NONE.triangle {
                return None;
            }
            let prepared = self.rays.prepared(index)?;
            if let Some(t) = self.distance(&prepared, best) {
                return Some(prepared.hit(t, best.triangle));
            }
        }
        s.run(
            #[inline(always)]
            || closest::closest_hit(s, self.structure, self.rays.mesh(), self.rays.given(index)),
        )
    }

    /// The distance of the best triangle; `None` if it is not what it was taken for.
    fn distance(&self, prepared: &PreparedRay, best: &Best) -> Option<f32> {
        if best.is_settled() {
            return Some(best.lower);
        }
        let triangle = self.rays.mesh().triangle(best.triangle as usize);
        prepared.triangle(&triangle).filter(|t| *t <= best.upper)
    }
}

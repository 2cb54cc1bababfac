//! The triangle test as a parameter of any-hit kernels.

use super::{PreparedRay, Stage};
use crate::geometry::Triangle;

/// Which of the triangle tests answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// [`PreparedRay::triangle`]: rounded arithmetic, the same in every kernel.
    Fast,
    /// [`PreparedRay::hits_exactly`].
    #[default]
    Exact,
}

/// One of them, known when kernels are compiled.
pub trait TriangleTest: Copy {
    /// Whether `ray` hits `triangle`, and the arithmetic that settled it.
    fn hits(self, ray: &PreparedRay, triangle: &Triangle) -> (bool, Stage);
    /// Which one it is.
    const MODE: Mode;
}

/// [`Mode::Fast`].
#[derive(Clone, Copy, Debug)]
pub struct Fast;

impl TriangleTest for Fast {
    const MODE: Mode = Mode::Fast;
    #[inline(always)]
    fn hits(self, ray: &PreparedRay, triangle: &Triangle) -> (bool, Stage) {
        (ray.triangle(triangle).is_some(), Stage::Single)
    }
}

/// [`Mode::Exact`].
#[derive(Clone, Copy, Debug)]
pub struct Exact;

impl TriangleTest for Exact {
    const MODE: Mode = Mode::Exact;
    #[inline(always)]
    fn hits(self, ray: &PreparedRay, triangle: &Triangle) -> (bool, Stage) {
        ray.hits_exactly(triangle)
    }
}

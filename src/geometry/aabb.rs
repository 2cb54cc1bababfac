//! Axis-aligned bounding boxes.

use bytemuck::Zeroable;
use glam::Vec3;

/// A closed axis-aligned box; empty while `min > max` on some axis.
#[derive(Clone, Copy, Debug, PartialEq, Zeroable)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The box that holds nothing, neutral under [`union`](Self::union).
    pub const EMPTY: Self =
        Self { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) };

    /// The smallest box around `points`.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with_point)
    }

    /// This box grown to hold `point`.
    #[must_use]
    pub fn with_point(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// What both hold; empty where that is nothing.
    #[must_use]
    pub fn overlap(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether `other` lies inside or on this box. An empty `other` always does.
    pub fn contains(&self, other: &Self) -> bool {
        other.is_empty() || (self.min.cmple(other.min).all() && self.max.cmpge(other.max).all())
    }

    /// Edge lengths; negative infinity where empty.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Centre; meaningless for an empty box.
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Half the surface area, in scene units squared; 0 if empty. `f64`, so that it is finite for
    /// every finite box.
    pub fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        let d = max - min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Surface area, in scene units squared.
    pub fn surface_area(&self) -> f64 {
        2.0 * self.half_area()
    }

    /// Length of the diagonal, in scene units; 0 if empty.
    pub fn diagonal(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.size().length() }
    }
}

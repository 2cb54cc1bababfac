//! The box around the part of a triangle that lies in a cell: perfect splits (Havran and Bittner, "On
//! Improving KD-Trees for Ray Shooting", 2002). The original triangle is clipped each time, so that
//! errors do not add up.
//!
//! # What clipped boxes cover
//!
//! A hit is found in trees of clipped boxes if every part of a triangle's box keeps what lies in it
//! of `Q`, the [tiny box](Triangle::box_around) around a point `q` of the triangle, for every `q`
//! (see [`intersect`](crate::intersect)). Clipped boxes do, with a margin `s` for each axis, eight
//! `f32` half-ulps of the triangle's largest coordinate on it and four of the smallest normal number:
//!
//! - `Q` reaches less than `s / 2` from `q`: less than half of either term. Far from the origin, all
//!   of this grows alike. `q` is known in `f64`, to a few `2^-53` of the largest coordinate.
//! - Where `Q` meets the cell, `q` lies in the cell grown by `s / 2`. The triangle is clipped to the
//!   cell grown by `s`, in `f64`. Each cut puts its corners where the edges that it is given cross
//!   the plane, to a few `2^-53` of the coordinates, as the distances from the plane are single
//!   subtractions: a point that lies deeper than that stays. So the clipped polygon holds `q`.
//! - The box around the polygon is grown by `s` and rounded to `f32`, which takes one half-ulp of it
//!   at most. It holds all that is within `s / 2` of `q`: all of `Q`. Then it is cut to what the
//!   reference's box left, which holds the part of `Q` in the cell as well.
//!
//! So a reference's box cut in two can serve as the cells of its parts: by induction it covers what
//! planes have left of `Q`.

use crate::geometry::{Aabb, Triangle};
use glam::{DVec3, Vec3};

/// How far, on each axis, clipped boxes reach beyond the clipped triangle, as a share of the
/// triangle's largest coordinate there: eight `f32` half-ulps.
const SLACK: f64 = 8.0 / (1u32 << 24) as f64;

/// The margin of `triangle`'s clipped boxes; see the module's text.
fn slack(bounds: &Aabb) -> DVec3 {
    let largest = bounds.min.abs().max(bounds.max.abs()).as_dvec3();
    largest * SLACK + DVec3::splat(4.0 * f64::from(f32::MIN_POSITIVE))
}

/// Corners of a clipped triangle. Six cuts make nine at most; rounding, which can bend the polygon
/// inwards by a hair, may add some that lie between others.
const MAX_CORNERS: usize = 15;

struct Polygon {
    corners: [DVec3; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    /// Keeps what lies on the side of the plane where `sign * coordinate <= sign * position`
    /// (Sutherland and Hodgman, "Reentrant Polygon Clipping", 1974).
    fn cut(&mut self, axis: usize, position: f64, sign: f64) {
        let mut kept = Self { corners: [DVec3::ZERO; MAX_CORNERS], count: 0 };
        for i in 0..self.count {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (da, db) = (sign * (a[axis] - position), sign * (b[axis] - position));
            if da <= 0.0 {
                kept.push(a);
            }
            if (da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0) {
                let mut crossing = a + (b - a) * (da / (da - db));
                crossing[axis] = position;
                kept.push(crossing);
            }
        }
        *self = kept;
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }
}

/// The box around the part of `triangle` in `cell`, with a margin, but within `limit`; `None` if
/// there is none.
pub(super) fn clipped_bounds(triangle: &Triangle, cell: &Aabb, limit: &Aabb) -> Option<Aabb> {
    let own = triangle.bounds();
    let slack = slack(&own);
    let (cell_min, cell_max) = (cell.min.as_dvec3() - slack, cell.max.as_dvec3() + slack);
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let mut corners = [DVec3::ZERO; MAX_CORNERS];
    corners[..3].copy_from_slice(&[a, b, c]);
    let mut polygon = Polygon { corners, count: 3 };
    let (own_min, own_max) = (own.min.as_dvec3(), own.max.as_dvec3());
    for axis in 0..3 {
        if own_min[axis] < cell_min[axis] {
            polygon.cut(axis, cell_min[axis], -1.0);
        }
        if own_max[axis] > cell_max[axis] {
            polygon.cut(axis, cell_max[axis], 1.0);
        }
    }
    let (first, others) = polygon.corners[..polygon.count].split_first()?;
    let (min, max) = others.iter().fold((*first, *first), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    let clipped =
        Aabb { min: limit.min.max(to_f32(min - slack)), max: limit.max.min(to_f32(max + slack)) };
    (!clipped.is_empty()).then_some(clipped)
}

/// To the nearest `f32`; the slack covers that.
fn to_f32(v: DVec3) -> Vec3 {
    v.as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// Whatever planes cut a reference, through a point of its triangle, past it by a hair or
    /// anywhere: what they leave of the box around the point is covered.
    #[test]
    fn clipped_boxes_cover_the_box_around_any_point() {
        let mut random = Random::new(31);
        let mut cut = 0;
        for round in 0..20_000 {
            let scale = [1.0, 1e-30, 1e-38, 1e-42, 1e30][round % 5];
            let offset = [Vec3::ZERO, Vec3::new(1e5, -3e4, 7.0)][round / 5 % 2] * scale;
            let mut triangle = Triangle([0; 3].map(|_| random.point() * scale + offset));
            if round % 3 == 0 {
                triangle.0[2] = triangle.0[0].lerp(triangle.0[1], random.unit());
            }
            let mut weights = [0; 3].map(|_| f64::from(random.unit()));
            weights[round % 3] *= f64::from(random.bits() as u8 % 2);
            let sum = weights.iter().sum::<f64>().max(1e-9);
            let corners = triangle.0.map(|v| v.as_dvec3());
            let q = (0..3).map(|i| corners[i] * (weights[i] / sum)).sum::<DVec3>();
            let own = triangle.bounds();
            let q = q.clamp(own.min.as_dvec3(), own.max.as_dvec3());
            let (mut bounds, mut around) = (own, triangle.box_around(q));
            for _ in 0..12 {
                let axis = random.bits() as usize % 3;
                let position = match random.bits() % 4 {
                    0 => random.unit() * own.size()[axis] + own.min[axis],
                    1 => around.max[axis],
                    2 => around.min[axis].next_up(),
                    _ => around.min[axis],
                };
                if !(bounds.min[axis] < position && position < bounds.max[axis]) {
                    continue;
                }
                let mut halves = [bounds; 2];
                halves[0].max[axis] = position;
                halves[1].min[axis] = position;
                let first = random.bits() as usize % 2;
                let side = if around.overlap(halves[first]).is_empty() { 1 - first } else { first };
                let parts = halves.map(|half| clipped_bounds(&triangle, &half, &half));
                cut += usize::from(parts[side].is_some_and(|p| p != halves[side]));
                for (part, half) in parts.iter().zip(&halves) {
                    let left = around.overlap(*half);
                    let covered = left.is_empty() || part.is_some_and(|p| p.contains(&left));
                    assert!(covered, "round {round}: {triangle:?} {half:?} {part:?} {left:?}");
                }
                around = around.overlap(halves[side]);
                bounds = parts[side].expect("it covers something");
            }
        }
        assert!(cut > 1000, "{cut}");
    }

    #[test]
    fn flat_and_touching_triangles_stay() {
        let triangle = Triangle([Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0]);
        let cell = Aabb { min: Vec3::new(1.0, 1.0, -1.0), max: Vec3::new(2.0, 2.0, 1.0) };
        let limit = Aabb { min: Vec3::new(1.0, 1.0, 0.0), max: Vec3::new(2.0, 2.0, 0.0) };
        assert_eq!(clipped_bounds(&triangle, &cell, &limit), Some(limit));
        // The cell touches the long edge in a corner.
        let cell = Aabb { min: Vec3::new(2.0, 2.0, -1.0), max: Vec3::new(3.0, 3.0, 1.0) };
        let limit = Aabb { min: Vec3::new(2.0, 2.0, 0.0), max: Vec3::new(3.0, 3.0, 0.0) };
        let clipped = clipped_bounds(&triangle, &cell, &limit).unwrap();
        assert!(clipped.min == limit.min && clipped.size().max_element() < 1e-5, "{clipped:?}");
        let beyond = Aabb { min: cell.min + Vec3::splat(0.01), ..cell };
        assert_eq!(clipped_bounds(&triangle, &beyond, &limit), None);
    }
}

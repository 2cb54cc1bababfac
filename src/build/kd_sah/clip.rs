//! Perfect splits: the box around the part of a triangle that lies in a cell (Havran and Bittner,
//! "On Improving KD-Trees for Ray Shooting", 2002). The original triangle is clipped each time, so
//! that errors do not add up.

use crate::geometry::{Aabb, Triangle};
use glam::{DVec3, Vec3};

/// How far, on each axis, clipped boxes reach beyond the clipped triangle, as a share of the
/// triangle's largest coordinate there: eight `f32` half-ulps. See [`slack`].
const SLACK: f64 = 8.0 / (1u32 << 24) as f64;

/// The margin of `triangle`'s clipped boxes. With `q` any point of the triangle and `Q` the box of
/// half this margin around it, cut to the triangle's own box: where `Q` meets a cell, the clipped
/// box covers all of `Q` in that cell. It is far more than the rounding of clipping in `f64` and of
/// its result to `f32`.
fn slack(bounds: &Aabb) -> DVec3 {
    let largest = bounds.min.abs().max(bounds.max.abs()).as_dvec3();
    // The last term is two of the smallest numbers that `f32` has.
    largest * SLACK + DVec3::splat(f64::from(f32::from_bits(2)))
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

/// The box around the part of `triangle` in `cell`, rounded outwards, but within `limit`; `None` if
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

    /// Every point of the triangle in the cell is in the clipped box, and the box is no larger than
    /// such points need.
    #[test]
    fn clipped_boxes_cover_what_is_in_the_cell_and_not_more() {
        let mut random = Random::new(31);
        let (mut cut, mut gone) = (0, 0);
        for round in 0..3000 {
            let triangle = Triangle([0; 3].map(|_| random.point()));
            let cell = Aabb::of_points([random.point(), random.point()]);
            let own = triangle.bounds();
            let limit = Aabb { min: own.min.max(cell.min), max: own.max.min(cell.max) };
            if limit.is_empty() {
                continue;
            }
            let clipped = clipped_bounds(&triangle, &cell, &limit);
            cut += usize::from(clipped.is_some_and(|c| c != limit));
            gone += usize::from(clipped.is_none());
            let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
            let mut around = Aabb::EMPTY;
            for _ in 0..400 {
                let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = (a + (b - a) * u + (c - a) * v).as_vec3();
                if cell.contains(&Aabb { min: point, max: point }) {
                    around = around.with_point(point);
                }
            }
            let covered = clipped.is_some_and(|c| c.contains(&around)) || around.is_empty();
            assert!(covered, "round {round}: {triangle:?} {cell:?} {clipped:?} {around:?}");
        }
        assert!(cut > 100 && gone > 100, "{cut} cut, {gone} gone");
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

//! Slow twins of the exact probability: the sum over pairs of face patches, each in closed form
//! with standard functions, and simulation.

use crate::geometry::Aabb;
use crate::test_random::Random;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

fn x_ln_y(x: f64, y: f64) -> f64 {
    if x == 0.0 || y == 0.0 { 0.0 } else { x * y.ln() }
}

/// Sum over the four corner combinations of two intervals, with signs.
fn corners(a: [f64; 2], b: [f64; 2], mut f: impl FnMut(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            sum += if (i + j) % 2 == 0 { f(a - b) } else { -f(a - b) };
        }
    }
    sum
}

/// Area times form factor of parallel rectangles at distance `z`.
fn parallel(x: [[f64; 2]; 2], y: [[f64; 2]; 2], z: f64) -> f64 {
    let term = |dx: f64, dy: f64| {
        let (s1, s2) = (dx.hypot(z), dy.hypot(z));
        dy * s1 * dy.atan2(s1) + dx * s2 * dx.atan2(s2)
            - x_ln_y(z * z / 2.0, dx * dx + dy * dy + z * z)
    };
    corners(x[0], x[1], |dx| corners(y[0], y[1], |dy| term(dx, dy))).abs() / TAU
}

/// Area times form factor of rectangles at right angles: their intervals on the common axis, and
/// of the distances from the line in which their planes meet.
fn perpendicular(common: [[f64; 2]; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let term = |dy: f64, b: f64, c: f64| {
        let s = b.hypot(c);
        let sign = if dy < 0.0 { -1.0 } else { 1.0 };
        let dy = sign * dy;
        dy * s * dy.atan2(s) + x_ln_y((dy * dy - s * s) / 4.0, dy * dy + s * s)
    };
    let ends = |i: usize, j: usize| corners(common[0], common[1], |dy| term(dy, b[i], c[j]));
    (ends(0, 0) - ends(0, 1) - ends(1, 0) + ends(1, 1)).abs() / TAU
}

/// As [`super::lines_through_both`].
pub(super) fn lines_through_both(left: &Aabb, right: &Aabb) -> f64 {
    let l = [left.min.as_dvec3(), left.max.as_dvec3()];
    let r = [right.min.as_dvec3(), right.max.as_dvec3()];
    let span = |b: &[DVec3; 2], axis: usize| [b[0][axis], b[1][axis]];
    let common = DVec3::min(l[1], r[1]) - DVec3::max(l[0], r[0]);
    let mut sum = if common.min_element() < 0.0 {
        0.0
    } else {
        common.x * common.y + common.y * common.z + common.z * common.x
    };
    for i in 0..6 {
        let (axis_i, upper_i) = (i / 2, i % 2);
        // Distance beyond the plane of the left face, on its outer side.
        let face_i = l[upper_i][axis_i];
        let beyond_i = |x: f64| if upper_i == 1 { x - face_i } else { face_i - x };
        for j in 0..6 {
            let (axis_j, upper_j) = (j / 2, j % 2);
            let face_j = r[upper_j][axis_j];
            let beyond_j = |x: f64| if upper_j == 1 { x - face_j } else { face_j - x };
            if axis_i == axis_j {
                let gap = beyond_i(face_j);
                if upper_i != upper_j && gap > 0.0 {
                    let [u, v] = [(axis_i + 1) % 3, (axis_i + 2) % 3];
                    sum += parallel([span(&l, u), span(&r, u)], [span(&l, v), span(&r, v)], gap);
                }
                continue;
            }
            let common = 3 - axis_i - axis_j;
            let outside = |ends: [f64; 2]| {
                let clipped = ends.map(|x| x.max(0.0));
                (clipped[0] != clipped[1]).then_some(clipped)
            };
            let of_left = outside(span(&l, axis_j).map(beyond_j));
            let of_right = outside(span(&r, axis_i).map(beyond_i));
            if let (Some(b), Some(c)) = (of_left, of_right) {
                sum += perpendicular([span(&l, common), span(&r, common)], b, c);
            }
        }
    }
    sum
}

/// Whether the line through `origin` along `direction` meets `bounds`.
pub(super) fn line_meets(bounds: &Aabb, origin: DVec3, direction: DVec3) -> bool {
    let (min, max) = (bounds.min.as_dvec3() - origin, bounds.max.as_dvec3() - origin);
    let (a, b) = (min / direction, max / direction);
    a.min(b).max_element() <= a.max(b).min_element()
}

/// A random line that meets `bounds`: from a point of its surface, uniform by area, along a
/// direction with a density of the cosine.
pub(super) fn random_line(bounds: &Aabb, random: &mut Random) -> (DVec3, DVec3) {
    let size = bounds.size().as_dvec3();
    let areas = [size.y * size.z, size.z * size.x, size.x * size.y];
    let mut unit = || f64::from(random.unit()) + f64::from(random.unit()) / f64::from(1 << 24);
    let mut pick = unit() * areas.iter().sum::<f64>();
    let axis = (0..2).find(|&k| {
        pick -= areas[k];
        pick < 0.0
    });
    let axis = axis.unwrap_or(2);
    let (upper, u, v) = (unit() < 0.5, (axis + 1) % 3, (axis + 2) % 3);
    let mut origin = bounds.min.as_dvec3();
    origin[u] += size[u] * unit();
    origin[v] += size[v] * unit();
    let (radius, angle) = (unit().sqrt(), 2.0 * PI * unit());
    let mut direction = DVec3::ZERO;
    direction[u] = radius * angle.cos();
    direction[v] = radius * angle.sin();
    direction[axis] = (1.0 - radius * radius).sqrt();
    if upper {
        origin[axis] = f64::from(bounds.max[axis]);
        direction[axis] = -direction[axis];
    }
    (origin, direction)
}

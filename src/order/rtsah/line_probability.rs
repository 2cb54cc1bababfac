//! The measure of the lines that meet two axis-aligned boxes: the exact probability that RTSAH asks
//! for (Ize and Hansen, "RTSAH Traversal Order for Occlusion Rays", Computer Graphics Forum 30(2),
//! 2011).
//!
//! Lines that meet a convex body measure in proportion to its surface area, and lines from one
//! patch to another as the area times the form factor between them. Lines that meet both boxes
//! either cross the boxes' intersection, or leave one box through a face before they enter the
//! other through a face. For such a pair of faces only those parts count that lie outside the
//! other's box, on the side that the line goes to.
//!
//! The form factor of two polygons is a double integral of `ln r` along both outlines (Sparrow, "A
//! New and Simpler Formulation for Radiative Angle Factors", 1963), in which only edges of the same
//! direction meet. So the sum over all pairs of patches is a sum over pairs of edges along x, y and
//! z, and edges that two patches share cancel: about half of the terms of a sum over patches are
//! left, and for boxes apart on all axes, a third.

use super::lanes::{self, Lanes, map, zip};
use crate::geometry::Aabb;
use crate::vectorized::vectorized;

/// The measure of the lines that meet both boxes, neither of them empty, in units in which the
/// lines that meet one box measure [`half_area`](Aabb::half_area).
pub fn lines_through_both(left: &Aabb, right: &Aabb) -> f64 {
    vectorized(
        #[inline(always)]
        || measure(left, right),
    )
}

#[inline(always)]
fn measure(left: &Aabb, right: &Aabb) -> f64 {
    let (low, high) = (left.min.min(right.min), left.max.max(right.max));
    let extent = (high.as_dvec3() - low.as_dvec3()).max_element();
    if extent == 0.0 {
        return 0.0;
    }
    let scale = 1.0 / extent;
    let axes = [
        Axis::new([left.min.x, left.max.x], [right.min.x, right.max.x], scale),
        Axis::new([left.min.y, left.max.y], [right.min.y, right.max.y], scale),
        Axis::new([left.min.z, left.max.z], [right.min.z, right.max.z], scale),
    ];
    let [x, y, z] = &axes;
    let common = half_area_of([x.common, y.common, z.common]);
    let mut terms = Terms { pairs: [EdgePairs::default(); MOST], count: 0, in_line: [[0.0; 4]; 3] };
    terms.add_edges(0, x, y, z);
    terms.add_edges(1, y, z, x);
    terms.add_edges(2, z, x, y);
    (common + terms.sum(&axes).abs() / std::f64::consts::TAU) * extent * extent
}

/// Half the area of a box with the given edges; 0 if an edge is negative.
#[inline(always)]
fn half_area_of([x, y, z]: [f64; 3]) -> f64 {
    if x.min(y).min(z) < 0.0 { 0.0 } else { x * y + y * z + z * x }
}

/// Two intervals on one axis, scaled.
struct Axis {
    /// Length of the intersection, negative if there is none.
    common: f64,
    /// 1 where the right interval sticks out of the left one, at the lower and upper end.
    right_out: [f64; 2],
    /// 1 where the left interval sticks out of the right one.
    left_out: [f64; 2],
    /// How far, at the lower and upper end.
    out: [f64; 2],
    /// The gap between the intervals, and 1 if there is one.
    gap: f64,
    apart: f64,
    /// From the lower end of one interval to the upper end of the other, both ways, and 1 where
    /// this is the gap.
    across: [f64; 2],
    across_is_gap: [f64; 2],
    /// All distances from an end of the left interval to one of the right interval.
    ends: [f64; 4],
}

impl Axis {
    #[inline(always)]
    fn new(left: [f32; 2], right: [f32; 2], scale: f64) -> Self {
        let [l0, l1] = [f64::from(left[0]), f64::from(left[1])];
        let [r0, r1] = [f64::from(right[0]), f64::from(right[1])];
        let one_if = |condition: bool| if condition { 1.0 } else { 0.0 };
        let out = [(l0 - r0).abs() * scale, (l1 - r1).abs() * scale];
        let across = [(l0 - r1).abs() * scale, (l1 - r0).abs() * scale];
        let across_is_gap = [one_if(l0 > r1), one_if(r0 > l1)];
        Self {
            common: (l1.min(r1) - l0.max(r0)) * scale,
            right_out: [one_if(r0 < l0), one_if(r1 > l1)],
            left_out: [one_if(l0 < r0), one_if(l1 > r1)],
            out,
            gap: across[0] * across_is_gap[0] + across[1] * across_is_gap[1],
            apart: across_is_gap[0] + across_is_gap[1],
            across,
            across_is_gap,
            ends: [out[0], across[0], across[1], out[1]],
        }
    }
}

/// Keeps `0 ln 0` and `0 atan(0 / 0)` finite, and is lost in rounding otherwise.
const TINY: f64 = 1e-290;

/// At most eight pairs of edges for each axis, and one that is overwritten.
const MOST: usize = 25;

/// Pairs of edges that lie alike: with the same distances between their ends along their axis.
#[derive(Clone, Copy, Default)]
struct EdgePairs {
    /// Which axis.
    along: usize,
    /// How often they count.
    weight: f64,
    /// Square of their distance from each other.
    across_squared: f64,
}

/// The integral of `ln r` over two parallel edges at distance `s` is the sum of
/// `d s atan(d / s) + (d^2 - s^2) / 4 ln(d^2 + s^2)`, with signs, over the distances `d` between
/// their ends along them. Here is what the sum over all pairs of edges of two boxes takes.
struct Terms {
    pairs: [EdgePairs; MOST],
    count: usize,
    /// For each axis, the terms of all pairs with `s = 0`, the most frequent and simplest ones.
    in_line: [Lanes; 3],
}

impl Terms {
    /// Adds the pairs of edges along an axis that outline patches which see each other; `u` and `v`
    /// are the other two axes.
    #[inline(always)]
    fn add_edges(&mut self, axis: usize, along: &Axis, u: &Axis, v: &Axis) {
        // Faces at right angles: one box's face across u at end s, the other's across v at end t.
        // They see each other if the second box sticks out at s and the first at t.
        let faces =
            |s: usize, t: usize| u.right_out[s] * v.left_out[t] + u.left_out[s] * v.right_out[t];
        let [f00, f01, f10, f11] = [faces(0, 0), faces(0, 1), faces(1, 0), faces(1, 1)];
        let squared = |du: f64, dv: f64| du * du + dv * dv;
        let mut add = |weight: f64, across_squared: f64| {
            self.pairs[self.count] =
                EdgePairs { along: axis, weight, across_squared: across_squared + TINY };
            // Without a branch, which would often be mispredicted.
            self.count += usize::from(weight != 0.0);
        };
        // Each pair of patches has four pairs of edges: where the boxes end, and where the patches
        // are cut.
        let [[u0, u1], [v0, v1]] = [u.out, v.out];
        add(f00, squared(u0, v0));
        add(f01, squared(u0, v1));
        add(f10, squared(u1, v0));
        add(f11, squared(u1, v1));
        let cut = (f00 + f01) + (f10 + f11);
        if u.apart + v.apart == 0.0 {
            add(-(f00 + f01), u0 * u0);
            add(-(f10 + f11), u1 * u1);
            add(-(f00 + f10), v0 * v0);
            add(-(f01 + f11), v1 * v1);
            if cut != 0.0 {
                let squares = map(along.ends, |d| d * d);
                let logs = lanes::ln(map(squares, |square| square + TINY));
                self.in_line[axis] = zip(squares, logs, |square, log| 0.25 * cut * square * log);
            }
        } else {
            // At a gap patches end there, and faces that look at each other across it add their
            // own pairs of edges.
            add(v.apart - (f00 + f01), squared(u0, v.gap));
            add(v.apart - (f10 + f11), squared(u1, v.gap));
            add(u.apart - (f00 + f10), squared(u.gap, v0));
            add(u.apart - (f01 + f11), squared(u.gap, v1));
            add(cut - 2.0 * u.apart * v.apart, squared(u.gap, v.gap));
            add(u.apart * (v.across_is_gap[0] - 1.0), squared(u.gap, v.across[0]));
            add(u.apart * (v.across_is_gap[1] - 1.0), squared(u.gap, v.across[1]));
            add(v.apart * (u.across_is_gap[0] - 1.0), squared(u.across[0], v.gap));
            add(v.apart * (u.across_is_gap[1] - 1.0), squared(u.across[1], v.gap));
        }
    }

    #[inline(always)]
    fn sum(&self, axes: &[Axis; 3]) -> f64 {
        let mut terms = [[0.0; 4]; MOST];
        for (pair, term) in self.pairs[..self.count].iter().zip(&mut terms) {
            let ends = axes[pair.along].ends;
            let s2 = pair.across_squared;
            let s = s2.sqrt();
            let squares = map(ends, |d| d * d);
            let logs = lanes::ln(map(squares, |d2| d2 + s2));
            let angles = lanes::atan_ratio(ends, [s; 4]);
            let logs = zip(squares, logs, |d2, log| 0.25 * (d2 - s2) * log);
            let angles = zip(ends, angles, |d, angle| d * s * angle);
            *term = zip(logs, angles, |log, angle| pair.weight * (log + angle));
        }
        let mut sums = self.in_line[0];
        for term in self.in_line[1..].iter().chain(&terms[..self.count]) {
            sums = zip(sums, *term, |sum, term| sum + term);
        }
        (sums[0] + sums[3]) - (sums[1] + sums[2])
    }
}

//! A body around rays of a batch, held against boxes and triangles: what lies outside is in nobody's way.
//!
//! It is the convex hull of two boxes, where the rays start and where they end, or what lies in front of planes
//! along one axis each that touch both boxes: as a [`shaft`](crate::trace::shaft), but made from nothing but the
//! rays (Haines and Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", Eurographics Workshop on
//! Rendering 1991).
//!
//! # Why nothing is overlooked
//!
//! With `u = 2^-24`, a computed end `e` of a ray from `o` has two roundings at most: it is off by less than `1.01
//! u (2 |e| + |o|)`, on each axis. Boxes are padded by more. So in exact mode the hull holds all of each ray's
//! interval that can lie in the scene: where ends are cut, the least size of some component of all directions
//! takes rays out of the scene before. A hit is a point of that, and of the box of each node above its triangle.
//! Rays with a NaN, of which nothing may be kept, hit nothing.
//!
//! In fast mode a hit is what the box test and the plain test say, and [`around`](super::around) shows how far
//! from the segment between start and end a box can be that they find met: boxes are padded by that as well.
//!
//! Components of a plane's normal add up to 1; they come from `f64` and are rounded once. What is computed of a
//! point in `f32` is off by less than `4 u` of the largest coordinate, and planes give way by twice that.

use super::leaf::facets_of;
use super::numbers::{FARTHEST, Target, UNIT};
use super::simd::{LANES, Simd};
use crate::geometry::TriangleMesh;
use crate::intersect::Mode;
use crate::ray::Ray;
use crate::tree::{Bvh8, ChildRef, Node8};

/// Planes that touch both boxes, at most: one for each two axes and side on both.
const MOST_PLANES: usize = 12;

/// A plane along one axis: what lies where `a x + b y < height` is outside.
#[derive(Clone, Copy)]
struct Plane {
    /// Of a node's six rows of planes those that reach inside furthest.
    rows: [usize; 2],
    normal: [f32; 2],
    height: f32,
}

/// A box: lower and upper corner.
type Corners = [[f64; 3]; 2];

/// A convex body around rays.
pub(super) struct Hull {
    lower: [f32; 3],
    upper: [f32; 3],
    planes: [Plane; MOST_PLANES],
    plane_count: usize,
    /// Middles of the boxes around starts and around ends, and how far these reach from there.
    middles: [[f32; 3]; 2],
    reaches: [[f32; 3]; 2],
}

/// Of many rays the least and the most of their starts and ends, in four numbers each, of the sizes of
/// directions, and the most of where intervals start and end.
#[derive(Default)]
struct Extremes {
    least: [f32; LANES],
    most: [f32; LANES],
    slowest: [f32; LANES],
    fastest: [f32; LANES],
    longest: [f32; LANES],
}

impl Hull {
    /// Around some rays of a batch; `None` if nothing can be said of them.
    #[inline(always)]
    pub(super) fn around<S: Simd>(
        s: S,
        batch: &[Ray],
        places: &[u16],
        target: Target<'_>,
    ) -> Option<Self> {
        // Further than unit directions take rays through the scene.
        let farthest = 4.0 * (target.bounds.max - target.bounds.min).element_sum();
        let cut = s.splat(farthest);
        // Two of each, as one would wait for itself.
        let mut least = [s.splat(f32::INFINITY); 2];
        let mut most = [s.splat(f32::NEG_INFINITY); 2];
        let mut longest = [s.splat(0.0); 2];
        for pair in places.chunks(2) {
            for (i, place) in pair.iter().enumerate() {
                let [origin, direction, ends] = s.start_and_end(&batch[usize::from(*place)]);
                let points = s.mul_add(direction, s.min(ends, cut), origin);
                least[i] = s.min(points, least[i]);
                most[i] = s.max(points, most[i]);
                longest[i] = s.max(s.abs(ends), longest[i]);
            }
        }
        let mut of_all = Extremes::default();
        s.store(&mut of_all.least, s.min(least[0], least[1]));
        s.store(&mut of_all.most, s.max(most[0], most[1]));
        s.store(&mut of_all.longest, s.max(longest[0], longest[1]));
        let [starts_late, is_cut] = [of_all.longest[0] > 0.0, of_all.longest[4] > farthest];
        if starts_late || is_cut {
            let (mut slowest, mut fastest) = (s.splat(f32::INFINITY), s.splat(0.0));
            for place in places {
                let [_, direction, _] = s.start_and_end(&batch[usize::from(*place)]);
                slowest = s.min(s.abs(direction), slowest);
                fastest = s.max(s.abs(direction), fastest);
            }
            s.store(&mut of_all.slowest, slowest);
            s.store(&mut of_all.fastest, fastest);
        }
        Self::of(&of_all, is_cut.then_some(farthest), target)
    }

    /// Of such rays, of which some are cut after so many of their directions.
    fn of(rays: &Extremes, cut: Option<f32>, target: Target<'_>) -> Option<Self> {
        let corner =
            |of: &[f32; LANES], end: usize| [0, 1, 2].map(|axis| f64::from(of[4 * end + axis]));
        let boxes = [0, 1].map(|end| [corner(&rays.least, end), corner(&rays.most, end)]);
        let scene = [target.bounds.min, target.bounds.max].map(|c| c.to_array().map(f64::from));
        let numbers = boxes.as_flattened().iter().chain(&scene).flatten();
        if !numbers.copied().all(|x| x.abs() < f64::from(FARTHEST)) {
            return None;
        }
        // Origins are no further than this from starts.
        let way = f64::from(rays.longest[0]) * corner(&rays.fastest, 0).iter().sum::<f64>();
        let [lower, upper] = boxes[0];
        let from_scene =
            (0..3).map(|axis| (upper[axis] - scene[0][axis]).max(scene[1][axis] - lower[axis]));
        let extent = from_scene.fold(0.0, f64::max) + way;
        let speed = corner(&rays.slowest, 0).into_iter().fold(0.0, f64::max);
        if cut.is_some_and(|cut| speed * f64::from(cut) <= 2.0 * extent) {
            return None;
        }
        let boxes = padded(boxes, way, extent, target.mode);
        let mut hull = Self::in_box(&boxes);
        // Where rays start among their ends, planes would cut off next to nothing.
        let [starts, ends] = &boxes;
        if (0..3).any(|axis| starts[1][axis] < ends[0][axis] || ends[1][axis] < starts[0][axis]) {
            let all = boxes.as_flattened().iter().chain(&scene).flatten();
            let scale = all.copied().map(f64::abs).fold(0.0, f64::max);
            for axes in [[0, 1], [1, 2], [2, 0]] {
                for sides in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                    hull.add_plane(&boxes, axes, sides, scale);
                }
            }
        }
        Some(hull)
    }

    /// Without planes.
    fn in_box(boxes: &[Corners; 2]) -> Self {
        let both = |side: usize, pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|axis| pick(boxes[0][side][axis], boxes[1][side][axis]))
        };
        let middles = boxes
            .map(|[lower, upper]| [0, 1, 2].map(|axis| ((lower[axis] + upper[axis]) * 0.5) as f32));
        let reach = |end: usize, axis: usize| {
            let (middle, [lower, upper]) = (f64::from(middles[end][axis]), &boxes[end]);
            ((upper[axis] - middle).max(middle - lower[axis]) as f32).next_up()
        };
        Self {
            lower: both(0, f64::min).map(|x| (x as f32).next_down()),
            upper: both(1, f64::max).map(|x| (x as f32).next_up()),
            planes: [Plane { rows: [0; 2], normal: [0.0; 2], height: 0.0 }; MOST_PLANES],
            plane_count: 0,
            middles,
            reaches: [0, 1].map(|end| [0, 1, 2].map(|axis| reach(end, axis))),
        }
    }

    /// Adds the plane that touches these sides of both boxes on two axes, if both lie inwards of it on both axes.
    /// No coordinate is larger than `scale`.
    fn add_plane(&mut self, boxes: &[Corners; 2], axes: [usize; 2], sides: [usize; 2], scale: f64) {
        let edge = |of: &Corners| [of[sides[0]][axes[0]], of[sides[1]][axes[1]]];
        let (p, q) = (edge(&boxes[0]), edge(&boxes[1]));
        let along = [q[0] - p[0], q[1] - p[1]];
        // Inwards: up from the lower sides, down from the upper ones.
        let inwards = sides.map(|side| 1.0 - 2.0 * side as f64);
        let turn = if along[1] * inwards[0] > 0.0 { 1.0 } else { -1.0 };
        let size = along[0].abs() + along[1].abs();
        let normal = [along[1] * turn / size, -along[0] * turn / size];
        if !(normal[0] * inwards[0] > 0.0 && normal[1] * inwards[1] > 0.0) {
            return;
        }
        let height = normal[0] * p[0] + normal[1] * p[1];
        let row = |i: usize| 2 * axes[i] + 1 - sides[i];
        self.planes[self.plane_count] = Plane {
            rows: [row(0), row(1)],
            normal: normal.map(|x| x as f32),
            height: (height - 8.0 * f64::from(UNIT) * scale) as f32,
        };
        self.plane_count += 1;
    }

    /// The children of a node that it may meet, one bit each.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, node: &Node8) -> u32 {
        let mut inside = s.less_equal(s.splat(0.0), s.splat(0.0));
        for (axis, [lower, upper]) in node.planes.iter().enumerate() {
            inside = s.both(inside, s.less_equal(s.load(lower), s.splat(self.upper[axis])));
            inside = s.both(inside, s.less_equal(s.splat(self.lower[axis]), s.load(upper)));
        }
        let rows = node.planes.as_flattened();
        for plane in &self.planes[..self.plane_count] {
            let [x, y] = plane.rows.map(|row| s.load(&rows[row % 6]));
            let reach = plane.of(s, x, y);
            inside = s.both(inside, s.less_equal(s.splat(plane.height), reach));
        }
        s.bits(inside) as u32 & node.occupied()
    }

    /// Whether any triangle of a leaf may be in the way.
    #[inline(always)]
    pub(super) fn meets_leaf<S: Simd>(
        &self,
        s: S,
        tree: &Bvh8,
        mesh: &TriangleMesh,
        leaf: ChildRef,
    ) -> bool {
        let slots = leaf.leaf_slots();
        let all = (1 << slots.len()) - 1;
        let left = !self.beside(s, tree, leaf) & all;
        left != 0 && self.meets_triangles(s, &tree.triangle_ids[slots], mesh) & left != 0
    }

    /// Of a leaf's triangles those that all starts and ends are on one side of, one bit each.
    ///
    /// With `C` from the corner to a middle and `m` the most of a component of `C` with the reach on that axis,
    /// and by what [`leaf`](super::leaf) says of normals, a middle's height is off by less than `5.2 u` of the
    /// product of each component, and so is a reach along the normal: by `9.1 u m` in all, as the components of a
    /// unit normal come to less than the root of three. What underflows is far less than what reaches begin with.
    /// Either mode finds planes exactly or in `f64`, and meets none between points that are off it on one side by
    /// more.
    #[inline(always)]
    fn beside<S: Simd>(&self, s: S, tree: &Bvh8, leaf: ChildRef) -> u32 {
        let facets = facets_of(s, tree, leaf);
        let size = facets.normal.map(|n| s.abs(n));
        let (mut above, mut below) = (s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
        for (middle, reach) in self.middles.iter().zip(&self.reaches) {
            let (mut height, mut along, mut most) =
                (s.splat(0.0), s.splat(f32::MIN_POSITIVE), s.splat(0.0));
            for axis in 0..3 {
                let reach = s.splat(reach[axis]);
                let from_corner = s.sub(s.splat(middle[axis]), facets.corner[axis]);
                height = s.mul_add(facets.normal[axis], from_corner, height);
                along = s.mul_add(size[axis], reach, along);
                most = s.max(s.add(s.abs(from_corner), reach), most);
            }
            let along = s.mul_add(most, s.splat(BESIDE_SLACK), along);
            above = s.min(s.sub(height, along), above);
            below = s.max(s.add(height, along), below);
        }
        (s.bits(s.less(s.splat(0.0), above)) | s.bits(s.less(below, s.splat(0.0)))) as u32
    }

    /// Which triangles may reach inside, one bit each: not those with all corners on the outside of one plane.
    #[inline(always)]
    fn meets_triangles<S: Simd>(&self, s: S, ids: &[u32], mesh: &TriangleMesh) -> u32 {
        // For each axis and corner a number of each triangle.
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for (lane, id) in ids.iter().enumerate().take(LANES) {
            for (corner, vertex) in mesh.triangles()[*id as usize].into_iter().enumerate() {
                let vertex = mesh.vertices()[vertex as usize];
                for (axis, corners) in corners.iter_mut().enumerate() {
                    corners[corner][lane] = vertex[axis];
                }
            }
        }
        let corners = corners.each_ref().map(
            #[inline(always)]
            |[a, b, c]| [s.load(a), s.load(b), s.load(c)],
        );
        let mut inside = s.less_equal(s.splat(0.0), s.splat(0.0));
        for (axis, [a, b, c]) in corners.into_iter().enumerate() {
            let (least, most) = (s.min(s.min(a, b), c), s.max(s.max(a, b), c));
            inside = s.both(inside, s.less_equal(least, s.splat(self.upper[axis])));
            inside = s.both(inside, s.less_equal(s.splat(self.lower[axis]), most));
        }
        for plane in &self.planes[..self.plane_count] {
            let [x, y] = plane.rows.map(|row| &corners[row / 2 % 3]);
            let mut most = s.splat(f32::NEG_INFINITY);
            for (x, y) in x.iter().zip(y) {
                most = s.max(plane.of(s, *x, *y), most);
            }
            inside = s.both(inside, s.less_equal(s.splat(plane.height), most));
        }
        s.bits(inside) as u32
    }
}

impl Plane {
    /// `a x + b y`.
    #[inline(always)]
    fn of<S: Simd>(&self, s: S, x: S::Floats, y: S::Floats) -> S::Floats {
        let [a, b] = self.normal.map(|n| s.splat(n));
        s.mul_add(a, x, s.mul(b, y))
    }
}

/// Of the largest distance on an axis, for heights above a triangle's plane.
const BESIDE_SLACK: f32 = 10.0 * UNIT;

/// Boxes of starts and ends, grown by what these and the tests are off by. Origins are within `way` of starts,
/// and `extent` is that of the scene from there.
fn padded(boxes: [Corners; 2], way: f64, extent: f64, mode: Mode) -> [Corners; 2] {
    let unit = f64::from(UNIT);
    let largest = |of: &Corners, axis: usize| of[0][axis].abs().max(of[1][axis].abs());
    let mut grown = boxes;
    for (end, corners) in grown.iter_mut().enumerate() {
        for axis in 0..3 {
            let far_out = largest(&boxes[0], axis) + way;
            let of_tests = match mode {
                Mode::Exact => 0.0,
                Mode::Fast => {
                    let farther_out = far_out.max(largest(&boxes[1], axis));
                    unit * (32.0 * farther_out + 64.0 * extent) + f64::from(f32::MIN_POSITIVE)
                }
            };
            for (corner, outwards) in corners.iter_mut().zip([-1.0, 1.0]) {
                // Starts at origins are not computed.
                let is_given = end == 0 && way == 0.0;
                let of_ends = if is_given { 0.0 } else { 2.1 * corner[axis].abs() + 1.1 * far_out };
                corner[axis] += outwards * (unit * of_ends + of_tests);
            }
        }
    }
    grown
}

//! Samples of a light with right angles, for many points of one view or for few of each of many.

use super::light_lift::{Lift, Plane};
use super::light_samples::LightSamples;
use super::sampler::{MOST_TOGETHER, Points};
use super::soft_shadow::usable;
use super::spherical_rectangle::SphericalRectangle;
use crate::vectorized::vectorized;
use glam::DVec3;

/// The light as a surface point sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RectangleView {
    shape: SphericalRectangle,
    /// From the surface point to its foot on the plane, and the axes from there.
    foot: DVec3,
    axes: [DVec3; 2],
    /// What is enough for all of the light.
    lift: Lift,
    /// Products of the surface's normal with foot, axes and lift, of which sums make cosines.
    above: [f64; 4],
}

/// A quad with right angles, with what is the same wherever it is seen from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    corner: DVec3,
    lengths: [f64; 2],
    axes: [DVec3; 2],
    /// The largest absolute coordinates of any corner.
    farthest: DVec3,
}

impl Rectangle {
    /// With these corners, edges from the first of them, and unit normal.
    pub(super) fn new(corners: &[DVec3; 4], edges: [DVec3; 2], normal: DVec3) -> Self {
        let lengths = edges.map(DVec3::length);
        let x_axis = edges[0] / lengths[0];
        let axes = [x_axis, normal.cross(x_axis)];
        let farthest = corners.iter().fold(DVec3::ZERO, |all, corner| all.max(corner.abs()));
        Self { corner: corners[0], lengths, axes, farthest }
    }
}

impl RectangleView {
    /// If the rectangle looks large enough from `origin`, where the surface has this normal.
    pub(super) fn new(
        rectangle: &Rectangle,
        [origin, normal]: [DVec3; 2],
        plane: Plane,
    ) -> Option<Self> {
        if plane.height.is_nan() || plane.height <= 0.0 {
            return None;
        }
        let Rectangle { corner, lengths, axes, farthest } = *rectangle;
        let to_corner = corner - origin;
        let span = |i: usize| {
            let start = to_corner.dot(axes[i]);
            [start, start + lengths[i]]
        };
        let shape = SphericalRectangle::new(span(0), span(1), plane.height)?;
        let (foot, lift) = (-plane.normal * plane.height, plane.lift(farthest));
        let above = [foot, axes[0], axes[1], lift.away].map(|v| normal.dot(v));
        Some(Self { shape, foot, axes, lift, above })
    }

    /// The samples of all points.
    #[inline(always)]
    pub(super) fn sample(&self, points: &Points, samples: &mut LightSamples) {
        sample(
            points,
            samples,
            #[inline(always)]
            |_| *self,
        );
    }

    /// All numbers but the axes, in the order that [`of_lane`](Self::of_lane) knows.
    fn numbers(&self) -> [f64; NUMBERS] {
        let Self { shape, foot, axes: _, lift, above } = self;
        let mut numbers = [0.0; NUMBERS];
        let (of_shape, others) = numbers.split_at_mut(SphericalRectangle::NUMBERS);
        of_shape.copy_from_slice(&shape.numbers());
        let [x, y, z] = foot.to_array();
        let [away_x, away_y, away_z] = lift.away.to_array();
        others[..7].copy_from_slice(&[x, y, z, away_x, away_y, away_z, lift.share]);
        others[7..].copy_from_slice(above);
        numbers
    }

    /// The view with the numbers of a lane.
    #[inline(always)]
    fn of_lane(rows: &[[f64; MOST_TOGETHER]; NUMBERS], lane: usize, axes: [DVec3; 2]) -> Self {
        let [of_shape @ .., x, y, z, away_x, away_y, away_z, share, a, b, c, d] = rows;
        let lift =
            Lift { away: DVec3::new(away_x[lane], away_y[lane], away_z[lane]), share: share[lane] };
        Self {
            shape: SphericalRectangle::of_lane(of_shape, lane),
            foot: DVec3::new(x[lane], y[lane], z[lane]),
            axes,
            lift,
            above: [a[lane], b[lane], c[lane], d[lane]],
        }
    }
}

/// The samples of all points, each of the view that `view_of` gives by the point's place in its block.
#[inline(always)]
fn sample(points: &Points, samples: &mut LightSamples, view_of: impl Fn(usize) -> RectangleView) {
    samples.set_in_steps(
        points,
        #[inline(always)]
        |i, point| view_of(i).shape.phi(point),
        #[inline(always)]
        |steps| {
            steps.next(
                #[inline(always)]
                |i, numbers| view_of(i).shape.x(numbers),
            );
            steps.next(
                #[inline(always)]
                |i, numbers| view_of(i).shape.h(numbers),
            );
        },
        #[inline(always)]
        |i, numbers| {
            let RectangleView { shape, foot, axes, lift, above } = view_of(i);
            let ([x, y], inverse_distance) = shape.y_and_distance(numbers);
            let whole = foot + axes[0] * x + axes[1] * y;
            let height = above[0] + above[1] * x + above[2] * y;
            let weight = height * (shape.solid_angle() * inverse_distance);
            (lift.shortened(whole, height + above[3]), usable(weight))
        },
    );
}

const NUMBERS: usize = SphericalRectangle::NUMBERS + 11;

/// Views of one light, a sample of each in a lane: vectors are as full as if one view had them all.
#[derive(Clone, Debug)]
pub(super) struct RectangleLanes {
    rows: [[f64; MOST_TOGETHER]; NUMBERS],
    axes: [DVec3; 2],
}

impl Default for RectangleLanes {
    fn default() -> Self {
        // A view that lanes without one can be computed with.
        Self { rows: [[1.0; MOST_TOGETHER]; NUMBERS], axes: [DVec3::X, DVec3::Y] }
    }
}

impl RectangleLanes {
    /// Gives some lanes to a view: all lanes are of one light.
    pub(super) fn set(&mut self, lanes: std::ops::Range<usize>, view: &RectangleView) {
        self.axes = view.axes;
        for (row, number) in self.rows.iter_mut().zip(view.numbers()) {
            row[lanes.clone()].fill(number);
        }
    }

    /// The sample of each lane: as [`RectangleView::sample`] has it, bit by bit.
    pub(super) fn sample(&self, points: &Points, samples: &mut LightSamples) {
        assert!(points.len() <= MOST_TOGETHER);
        samples.resize(points.coordinates().0.len());
        vectorized(
            #[inline(always)]
            || {
                // A copy of its own can plainly not overlap with what is written: else loops would not
                // become vector code.
                let Self { rows, axes } = self.clone();
                sample(
                    points,
                    samples,
                    #[inline(always)]
                    |i| RectangleView::of_lane(&rows, i, axes),
                );
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn lanes_are_as_views_alone() {
        let mut random = Random::new(91);
        for per_view in [1, 2, 3, 5, 8] {
            let (mut lanes, mut views) = (RectangleLanes::default(), Vec::new());
            let mut points = Vec::new();
            let mut number = || f64::from(random.unit());
            let (corner, normal) = (DVec3::new(number(), number(), 2.0), DVec3::Z);
            let edges = [DVec3::X * (0.1 + number()), DVec3::Y * (0.1 + number())];
            let corners = [0, 1, 2, 3].map(|i| {
                let [along_x, along_y] = [i & 1, i >> 1].map(f64::from);
                corner + edges[0] * along_x + edges[1] * along_y
            });
            let rectangle = Rectangle::new(&corners, edges, -DVec3::Z);
            let count = MOST_TOGETHER / per_view;
            for view in 0..count {
                let origin = DVec3::new(4.0 * number(), 4.0 * number(), number());
                let plane = Plane::new(-DVec3::Z, origin, &corners);
                let seen = RectangleView::new(&rectangle, [origin, normal], plane).unwrap();
                lanes.set(view * per_view..(view + 1) * per_view, &seen);
                views.push(seen);
                points.extend((0..per_view).map(|_| [number(), number()].map(|n| n as f32)));
            }
            let (mut together, mut alone) = (LightSamples::default(), LightSamples::default());
            lanes.sample(&Points::of(&points), &mut together);
            for (place, view) in views.iter().enumerate() {
                let own = &points[place * per_view..(place + 1) * per_view];
                let own = Points::of(own);
                alone.resize(own.coordinates().0.len());
                view.sample(&own, &mut alone);
                for index in 0..per_view {
                    let lane = place * per_view + index;
                    assert_eq!(together.direction(lane), alone.direction(index));
                    assert_eq!(together.weights()[lane], alone.weights()[index]);
                    assert!(alone.weights()[index] > 0.0);
                }
            }
        }
    }
}

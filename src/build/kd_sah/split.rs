//! The search for the cheapest plane: one sweep over each axis's events.

use super::events::{EventKind, EventList};
use crate::geometry::Aabb;
use crate::tree::{KD_INTERSECTION_COST, KD_TRAVERSAL_COST};

/// The share of its cost that a split which cuts off empty space is charged (Wald and Havran).
const EMPTY_BONUS: f64 = 0.8;

/// A side of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Lower = 0,
    Upper = 1,
}

/// A plane, and the side on which references that lie in it go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub(super) axis: usize,
    pub(super) position: f32,
    pub(super) planar_side: Side,
    /// References on each side, where no cut shows that one does not reach it after all.
    pub(super) counts: [usize; 2],
    /// Times half the surface area of the cell.
    pub(super) cost: f64,
}

impl Split {
    /// The side of a reference with these bounds; `None` for both.
    #[inline(always)]
    pub(super) fn side(&self, bounds: &Aabb) -> Option<Side> {
        let (min, max) = (bounds.min[self.axis], bounds.max[self.axis]);
        if min == max && min == self.position {
            Some(self.planar_side)
        } else if max <= self.position {
            Some(Side::Lower)
        } else if min >= self.position {
            Some(Side::Upper)
        } else {
            None
        }
    }
}

/// What leaving `count` references in one leaf costs, as [`Split::cost`].
pub(super) fn leaf_cost(count: usize, cell: &Aabb) -> f64 {
    KD_INTERSECTION_COST * count as f64 * cell.half_area()
}

/// The cheapest split of `cell` on `axis`, with `count` references whose events these are; `None`
/// where there is none.
pub(super) fn best_on_axis(
    events: &EventList,
    axis: usize,
    count: usize,
    cell: &Aabb,
) -> Option<Split> {
    let (min, max) = (f64::from(cell.min[axis]), f64::from(cell.max[axis]));
    // A flat cell cannot be cut along the axis on which it is flat.
    if min >= max {
        return None;
    }
    let size = cell.max.as_dvec3() - cell.min.as_dvec3();
    let (u, v) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
    let (cross_section, half_perimeter) = (u * v, u + v);
    let entering = KD_TRAVERSAL_COST * cell.half_area();
    let mut best: Option<Split> = None;
    let mut best_cost = f64::INFINITY;
    let (mut lower, mut upper) = (0, count);
    let mut rest = events.as_slice();
    while let Some(&first) = rest.first() {
        let mut at_plane = [0usize; 3];
        let mut length = 0;
        while let Some(event) = rest.get(length).filter(|e| e.coincides(first)) {
            at_plane[event.kind() as usize] += 1;
            length += 1;
        }
        rest = &rest[length..];
        let planar = at_plane[EventKind::Planar as usize];
        upper -= planar + at_plane[EventKind::End as usize];
        let position = first.position();
        let at = f64::from(position);
        let areas = [at - min, max - at].map(|length| cross_section + half_perimeter * length);
        let mut consider = |counts: [usize; 2], planar_side: Side| {
            let sides = areas[0] * counts[0] as f64 + areas[1] * counts[1] as f64;
            let cost = entering + KD_INTERSECTION_COST * sides;
            let cost = if counts.contains(&0) { EMPTY_BONUS * cost } else { cost };
            if cost < best_cost {
                best_cost = cost;
                best = Some(Split { axis, position, planar_side, counts, cost });
            }
        };
        // A plane on the cell's face makes a flat cell: only for what lies in it.
        if at > min && (at < max || planar > 0) {
            consider([lower, upper + planar], Side::Upper);
        }
        if at < max && planar > 0 {
            consider([lower + planar, upper], Side::Lower);
        }
        lower += planar + at_plane[EventKind::Start as usize];
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::events::push_events;
    use super::*;
    use crate::test_random::Random;
    use glam::Vec3;

    /// All planes at all ends of boxes, counted one by one.
    fn by_counting(boxes: &[Aabb], axis: usize, cell: &Aabb) -> f64 {
        let mut best = f64::INFINITY;
        if cell.size()[axis] == 0.0 {
            return best;
        }
        for plane in boxes.iter().flat_map(|b| [b.min[axis], b.max[axis]]) {
            for planar_side in [Side::Lower, Side::Upper] {
                let mut split =
                    Split { axis, position: plane, planar_side, counts: [0; 2], cost: 0.0 };
                let (mut cells, mut planar) = ([*cell; 2], false);
                cells[0].max[axis] = plane;
                cells[1].min[axis] = plane;
                for bounds in boxes {
                    let side = split.side(bounds);
                    planar |= bounds.min[axis] == plane && bounds.max[axis] == plane;
                    split.counts[0] += usize::from(side != Some(Side::Upper));
                    split.counts[1] += usize::from(side != Some(Side::Lower));
                }
                let flat = [plane == cell.min[axis], plane == cell.max[axis]];
                let planar_goes_there = flat[planar_side as usize] && planar;
                if (flat[0] || flat[1]) && !planar_goes_there {
                    continue;
                }
                let sides: f64 =
                    (0..2).map(|i| cells[i].half_area() * split.counts[i] as f64).sum();
                let cost = KD_TRAVERSAL_COST * cell.half_area() + KD_INTERSECTION_COST * sides;
                let bonus = if split.counts.contains(&0) { EMPTY_BONUS } else { 1.0 };
                best = best.min(bonus * cost);
            }
        }
        best
    }

    #[test]
    fn the_sweep_finds_what_counting_finds() {
        let mut random = Random::new(21);
        for round in 0..200 {
            let boxes: Vec<Aabb> = (0..1 + round % 20)
                .map(|i| {
                    let (a, mut b) = (random.point(), random.point());
                    b[i % 3] = if random.bits().is_multiple_of(2) { a[i % 3] } else { b[i % 3] };
                    Aabb::of_points([a, b])
                })
                .collect();
            let cell = boxes.iter().fold(Aabb::EMPTY, |b, x| b.union(*x));
            for axis in 0..3 {
                let mut events = Vec::new();
                for (index, bounds) in boxes.iter().enumerate() {
                    push_events(&mut events, bounds, axis, index);
                }
                events.sort_unstable();
                let found = best_on_axis(&events, axis, boxes.len(), &cell);
                let cost = found.map_or(f64::INFINITY, |s| s.cost);
                let expected = by_counting(&boxes, axis, &cell);
                let close = (cost - expected).abs() <= 1e-9 * expected || cost == expected;
                assert!(close, "round {round}: {cost} {expected}");
            }
        }
    }

    #[test]
    fn planar_references_may_have_a_flat_cell_and_nothing_else_may() {
        let flat = Aabb { min: Vec3::ZERO, max: Vec3::new(0.0, 1.0, 1.0) };
        let cell = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let mut events = Vec::new();
        push_events(&mut events, &flat, 0, 0);
        let split = best_on_axis(&events, 0, 1, &cell).unwrap();
        assert_eq!((split.position, split.planar_side, split.counts), (0.0, Side::Lower, [1, 0]));
        // The flat cell itself is cut no further along that axis.
        assert_eq!(best_on_axis(&events, 0, 1, &flat), None);
        let mut events = Vec::new();
        push_events(&mut events, &cell, 0, 0);
        assert_eq!(best_on_axis(&events, 0, 1, &cell), None);
    }
}

//! Events: where the boxes of a node's references begin and end along an axis.

use super::super::ordered;
use super::split::Side;
use crate::geometry::Aabb;

/// A box's end, planar extent or start at a position on one axis, packed so that sorting the plain
/// numbers sorts by position, then ends before planar extents before starts, then by reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Event(u64);

/// What happens at an event; in the order in which a sweep must see them at one position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum EventKind {
    End = 0,
    Planar = 1,
    Start = 2,
}

const KIND_SHIFT: u32 = 30;
/// Most references of a node.
pub(super) const MAX_REFERENCES: usize = 1 << KIND_SHIFT;

impl Event {
    fn new(position: f32, kind: EventKind, reference: usize) -> Self {
        debug_assert!(reference < MAX_REFERENCES);
        Self(
            u64::from(ordered(position)) << 32
                | u64::from(kind as u32) << KIND_SHIFT
                | reference as u64,
        )
    }

    #[inline(always)]
    pub(super) fn position(self) -> f32 {
        position_of((self.0 >> 32) as u32)
    }

    #[inline(always)]
    pub(super) fn kind(self) -> EventKind {
        match (self.0 as u32) >> KIND_SHIFT {
            0 => EventKind::End,
            1 => EventKind::Planar,
            _ => EventKind::Start,
        }
    }

    #[inline(always)]
    pub(super) fn reference(self) -> usize {
        (self.0 & (MAX_REFERENCES as u64 - 1)) as usize
    }

    /// The same event of another reference.
    #[inline(always)]
    fn renamed(self, reference: u32) -> Self {
        Self(self.0 & !(MAX_REFERENCES as u64 - 1) | u64::from(reference))
    }

    /// Whether both lie at one position.
    #[inline(always)]
    pub(super) fn coincides(self, other: Self) -> bool {
        (self.0 ^ other.0) >> 32 == 0
    }
}

#[inline(always)]
fn position_of(ordered: u32) -> f32 {
    f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
}

/// Sorted events of one axis.
pub(super) type EventList = Vec<Event>;

/// Appends the events of `bounds` on `axis`.
#[inline]
pub(super) fn push_events(events: &mut EventList, bounds: &Aabb, axis: usize, reference: usize) {
    let (min, max) = (bounds.min[axis], bounds.max[axis]);
    if min == max {
        events.push(Event::new(min, EventKind::Planar, reference));
    } else {
        events.push(Event::new(min, EventKind::Start, reference));
        events.push(Event::new(max, EventKind::End, reference));
    }
}

/// Where a node's reference goes: to one side under a new number there, or to both (or nowhere),
/// in which case its new boxes have events of their own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target(u32);

impl Target {
    pub(super) const RENEWED: Self = Self(u32::MAX);

    pub(super) fn new(side: Side, reference: usize) -> Self {
        Self((side as u32) << 31 | reference as u32)
    }
}

/// The events of both sides of a split, sorted: those of references that go to one side, filtered
/// from the parent's, merged with the sorted `renewed` ones of references that are cut.
pub(super) fn distribute(
    events: EventList,
    targets: &[Target],
    renewed: [EventList; 2],
    expected: [usize; 2],
) -> [EventList; 2] {
    let mut sides = expected.map(|references| Vec::with_capacity(2 * references));
    let mut waiting = [0, 0];
    for event in events {
        let target = targets[event.reference()];
        if target.0 == u32::MAX {
            continue;
        }
        let side = (target.0 >> 31) as usize;
        let event = event.renamed(target.0 & !(1 << 31));
        let next = &mut waiting[side];
        while let Some(&new) = renewed[side].get(*next).filter(|new| **new < event) {
            sides[side].push(new);
            *next += 1;
        }
        sides[side].push(event);
    }
    for ((list, new), next) in sides.iter_mut().zip(&renewed).zip(waiting) {
        list.extend_from_slice(&new[next..]);
    }
    sides
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_sort_by_position_then_kind() {
        let positions = [f32::MIN, -1.0, -1e-45, 0.0, 1e-45, 0.5, 2.0, f32::MAX];
        let kinds = [EventKind::End, EventKind::Planar, EventKind::Start];
        let all: Vec<_> = positions
            .iter()
            .flat_map(|&p| kinds.map(|k| (p, k)))
            .map(|(p, k)| (p, k, Event::new(p, k, 7)))
            .collect();
        for pair in all.windows(2) {
            assert!(pair[0].2 < pair[1].2);
            assert_eq!(pair[0].0 == pair[1].0, pair[0].2.coincides(pair[1].2));
        }
        for (position, kind, event) in all {
            assert_eq!((event.position(), event.kind(), event.reference()), (position, kind, 7));
        }
        assert_eq!(Event::new(-0.0, EventKind::End, 0), Event::new(0.0, EventKind::End, 0));
    }
}

//! The skeleton of top-down building, on all threads. Builders bring the way to split.
//!
//! A part that may end in `n` references owns `n` reference slots and `n - 1` node slots before it is
//! split, its lower side the first of them: threads never wait for each other, and the tree does not
//! depend on how many there are. Slots that leaves of several triangles, or unused room, leave empty
//! are closed up at the end.

use super::top_reinsertion::Sets;
use super::{Leaves, WideCosts};
use crate::geometry::{Aabb, TriangleMesh};
use crate::tree::{
    Bvh2, ChildRef, MAX_DEPTH, MAX_LEAF_TRIANGLES, MAX_WIDE_LEAF, Node2, SplitNotes,
};
use bytemuck::Zeroable;
use rayon::prelude::*;

/// Cost of entering an inner node, in units of a triangle test.
pub(super) const TRAVERSAL_COST: f32 = 1.0;

/// A leaf may hold more only where its triangles cannot be told apart.
const MAX_SAH_LEAF: usize = 8;

/// Parts that are worth another thread.
const PARALLEL_PART: usize = 4096;

/// A set of references to triangles, at least one, that becomes a subtree. No triangle is in it
/// twice.
pub(super) trait Part: Sized + Send {
    /// How to split it.
    type Split;

    /// Where leaves are tested at once, sets of so many are leaves without a look for a split.
    const ALWAYS_WIDE_LEAF: usize = 1;

    /// Number of references.
    fn count(&self) -> usize;

    /// Most references that its leaves may hold together: more than now, if splitting can add some.
    /// That of the two sides is no more than that of the whole.
    fn capacity(&self) -> usize;

    /// The box around the references' boxes.
    fn bounds(&self) -> Aabb;

    /// Indices of the triangles in the mesh.
    fn triangle_ids(&self) -> impl Iterator<Item = u32>;

    /// The cheapest split, and its cost: in triangle tests, times half the area of `bounds`. `None`
    /// where the heuristic finds none.
    fn best_split(&mut self) -> Option<(Self::Split, f32)>;

    /// The two sides of `split`, neither of them empty nor larger than the whole.
    fn divide(self, split: Self::Split) -> [Self; 2];

    /// Two sides of equal numbers, for what the heuristic cannot tell apart.
    fn halve(self) -> [Self; 2];
}

const EMPTY_SLOT: u32 = u32::MAX;

/// Builds the tree of all of `mesh` from its root; `None` for an empty mesh. Where `sets` are to be moved
/// they have the depth for it.
pub(super) fn build<P: Part>(
    mesh: &TriangleMesh,
    root: Option<P>,
    leaves: Leaves,
    sets: Option<Sets>,
) -> Bvh2 {
    let capacity = root.as_ref().map_or(0, P::capacity);
    let bounds = root.as_ref().map_or(Aabb::EMPTY, P::bounds);
    let mut nodes: Vec<Node2> = bytemuck::zeroed_vec(capacity.saturating_sub(1));
    let mut notes = vec![0; nodes.len()];
    let mut triangle_ids = vec![EMPTY_SLOT; capacity];
    let root = root.map(|part| {
        let room = Room { nodes: &mut nodes, notes: &mut notes, slots: &mut triangle_ids };
        let most_of_set = sets.map_or(0, |sets| sets.most);
        grow(part, room, Place { most_of_set, ..Place::default() }, leaves).child
    });
    let root = close_up(&mut nodes, &mut notes, &mut triangle_ids, root);
    // Few at a time, so that small trees are built on the one thread that asks for them.
    let ids = triangle_ids.par_iter().with_min_len(1 << 14);
    let triangles = ids.map(|&i| mesh.triangle(i as usize)).collect();
    let notes = SplitNotes::from_bytes(&notes);
    Bvh2 { nodes, root, bounds, triangles, triangle_ids, notes }
}

/// What a part owns of the tree to be.
struct Room<'a> {
    nodes: &'a mut [Node2],
    /// What is noted of each node: see [`SplitNotes`].
    notes: &'a mut [u8],
    slots: &'a mut [u32],
}

/// Where that begins, and the inner nodes above it.
#[derive(Clone, Copy, Default)]
struct Place {
    first_node: usize,
    first_slot: usize,
    depth: usize,
    /// Most references of a set that can be moved.
    most_of_set: usize,
}

/// A finished subtree.
struct Grown {
    child: ChildRef,
    /// Around the references in its leaves, which may be smaller than they were further up.
    bounds: Aabb,
    count: usize,
}

/// What becomes of a set.
pub(super) enum Fate<P> {
    Leaf(P),
    /// A leaf, which is known only now that the set has been divided.
    LeafOf([P; 2]),
    Sides([P; 2]),
}

/// Decides on a set with `depth` inner nodes above it, and divides it.
#[inline]
pub(super) fn fate<P: Part>(mut part: P, depth: usize, leaves: Leaves) -> Fate<P> {
    let count = part.count();
    if count == 1 || leaves == Leaves::Wide && count <= P::ALWAYS_WIDE_LEAF {
        return Fate::Leaf(part);
    }
    let bounds = part.bounds();
    // From here on halving must lead to leaves before the depth runs out.
    let must_halve = MAX_DEPTH - depth <= count.ilog2() as usize + 1;
    let may_be_leaf = count <= MAX_SAH_LEAF && leaves != Leaves::Single;
    let best = if must_halve { None } else { part.best_split() };
    let sides = match best {
        Some((split, cost)) => {
            if leaves == Leaves::Fit && may_be_leaf && count as f32 * half_area(&bounds) <= cost {
                return Fate::Leaf(part);
            }
            part.divide(split)
        }
        None if may_be_leaf => return Fate::Leaf(part),
        None => part.halve(),
    };
    // Where triangles were cut, the whole is no longer at hand.
    let is_cut = sides[0].count() + sides[1].count() > count;
    if leaves == Leaves::Wide && count <= MAX_WIDE_LEAF && !is_cut {
        let cost = |part: &P| WideCosts::default().leaf(part.count()) * half_area(&part.bounds());
        let whole = WideCosts::default().leaf(count) * half_area(&bounds);
        if whole <= cost(&sides[0]) + cost(&sides[1]) {
            return Fate::LeafOf(sides);
        }
    }
    Fate::Sides(sides)
}

fn grow<P: Part>(part: P, room: Room<'_>, mut place: Place, leaves: Leaves) -> Grown {
    let (count, bounds) = (part.count(), part.bounds());
    if count <= place.most_of_set {
        place = Place { depth: Sets::depth(place.depth), most_of_set: 0, ..place };
    }
    let sides = match fate(part, place.depth, leaves) {
        Fate::Leaf(part) => return leaf(part.triangle_ids(), count, bounds, room, place),
        Fate::LeafOf(sides) => {
            let ids = sides.iter().flat_map(P::triangle_ids);
            return leaf(ids, count, bounds, room, place);
        }
        Fate::Sides(sides) => sides,
    };
    let middle = sides[0].capacity();
    let (node, below) = room.nodes.split_first_mut().expect("a part owns capacity - 1 nodes");
    let (lower_nodes, upper_nodes) = below.split_at_mut(middle - 1);
    let (note, below) = room.notes.split_first_mut().expect("as many notes as nodes");
    let (lower_notes, upper_notes) = below.split_at_mut(middle - 1);
    let (lower_slots, upper_slots) = room.slots.split_at_mut(middle);
    let depth = place.depth + 1;
    let lower_place = Place { first_node: place.first_node + 1, depth, ..place };
    let upper_place = Place {
        first_node: place.first_node + middle,
        first_slot: place.first_slot + middle,
        depth,
        ..place
    };
    let [lower, upper] = sides;
    let lower_room = Room { nodes: lower_nodes, notes: lower_notes, slots: lower_slots };
    let upper_room = Room { nodes: upper_nodes, notes: upper_notes, slots: upper_slots };
    let (lower, upper) = if count > PARALLEL_PART {
        rayon::join(
            || grow(lower, lower_room, lower_place, leaves),
            || grow(upper, upper_room, upper_place, leaves),
        )
    } else {
        (grow(lower, lower_room, lower_place, leaves), grow(upper, upper_room, upper_place, leaves))
    };
    *node = Node2 {
        bounds: [lower.bounds, upper.bounds],
        children: [lower.child, upper.child],
        counts: [lower.count as u32, upper.count as u32],
    };
    // While both sides are at hand it costs next to nothing.
    let larger = u8::from(node.second_is_larger()) * SplitNotes::LARGER;
    let fewer = u8::from(upper.count < lower.count) * SplitNotes::FEWER;
    *note = larger | fewer;
    Grown {
        child: ChildRef::inner(place.first_node),
        bounds: lower.bounds.union(upper.bounds),
        count: lower.count + upper.count,
    }
}

fn leaf(
    triangle_ids: impl Iterator<Item = u32>,
    count: usize,
    bounds: Aabb,
    room: Room<'_>,
    place: Place,
) -> Grown {
    for (slot, id) in room.slots.iter_mut().zip(triangle_ids) {
        *slot = id;
    }
    let child = ChildRef::leaf(place.first_slot, count.min(MAX_LEAF_TRIANGLES));
    Grown { child, bounds, count }
}

/// In `f32`, as costs are only compared. The box is not empty.
#[inline(always)]
pub(super) fn half_area(bounds: &Aabb) -> f32 {
    let d = bounds.size();
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// Removes unused slots of nodes and triangles, keeping the order of the others.
fn close_up(
    nodes: &mut Vec<Node2>,
    notes: &mut Vec<u8>,
    triangle_ids: &mut Vec<u32>,
    root: Option<ChildRef>,
) -> Option<ChildRef> {
    let used_nodes = Used::of(nodes, |node| node.counts[0] != 0);
    let filled = Used::of(triangle_ids, |id| *id != EMPTY_SLOT);
    let renumbered = |child: ChildRef| {
        if child.is_leaf() {
            let slots = child.leaf_slots();
            ChildRef::leaf(filled.places[slots.start] as usize, slots.len())
        } else {
            ChildRef::inner(used_nodes.places[child.node_index()] as usize)
        }
    };
    *notes = used_nodes.kept(notes, |note| *note);
    *nodes =
        used_nodes.kept(nodes, |node| Node2 { children: node.children.map(renumbered), ..*node });
    *triangle_ids = filled.kept(triangle_ids, |id| *id);
    root.map(renumbered)
}

/// Which of many slots are used.
struct Used {
    /// For each slot, how many used ones are before it.
    places: Vec<u32>,
    /// How many there are.
    count: usize,
}

impl Used {
    /// Slots that one thread goes through at once.
    const CHUNK: usize = 1 << 14;

    fn of<T: Sync>(items: &[T], is_used: impl Fn(&T) -> bool + Sync) -> Self {
        let mut places = vec![0; items.len()];
        let chunks = places.par_chunks_mut(Self::CHUNK).zip(items.par_chunks(Self::CHUNK));
        let counts: Vec<u32> = chunks
            .map(|(places, items)| {
                let mut count = 0;
                for (place, item) in places.iter_mut().zip(items) {
                    *place = count;
                    count += u32::from(is_used(item));
                }
                count
            })
            .collect();
        let mut before = 0;
        let firsts: Vec<u32> = counts.iter().map(|count| (before, before += count).0).collect();
        let chunks = places.par_chunks_mut(Self::CHUNK).zip(firsts);
        chunks.for_each(|(places, first)| places.iter_mut().for_each(|place| *place += first));
        Self { places, count: before as usize }
    }

    /// The used ones of `items`, each as `keep` has it.
    fn kept<T, R>(&self, items: &[T], keep: impl Fn(&T) -> R + Sync) -> Vec<R>
    where
        T: Sync,
        R: Zeroable + Send,
    {
        let mut kept = bytemuck::zeroed_vec(self.count);
        let mut rest = kept.as_mut_slice();
        let mut tasks = Vec::new();
        for first in (0..items.len()).step_by(Self::CHUNK) {
            let end = items.len().min(first + Self::CHUNK);
            let place = |slot: usize| self.places.get(slot).map_or(self.count, |p| *p as usize);
            let (own, others) = std::mem::take(&mut rest).split_at_mut(place(end) - place(first));
            rest = others;
            tasks.push((first..end, own));
        }
        tasks.into_par_iter().for_each(|(slots, kept)| {
            let first = self.places[slots.start];
            for slot in slots {
                let next = self.places.get(slot + 1).map_or(self.count, |p| *p as usize);
                if next > self.places[slot] as usize {
                    kept[(self.places[slot] - first) as usize] = keep(&items[slot]);
                }
            }
        });
        kept
    }
}

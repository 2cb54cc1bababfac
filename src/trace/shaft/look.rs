//! What of a tree a shaft can meet.

use super::Shaft;
use crate::geometry::{Aabb, Triangle};
use crate::tree::{ChildRef, WIDTH};
use glam::Vec3;

/// What stands in the way of a group of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Nothing, for any of them.
    Open,
    /// Something, for each of them.
    Blocked,
    /// No such thing can be said.
    Partly,
}

/// A subtree.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its node or leaf.
    pub child: ChildRef,
    /// The box around it.
    pub bounds: Aabb,
}

/// Up to eight subtrees, in the order in which they are to be visited.
#[derive(Clone, Debug)]
pub struct Parts {
    /// For each axis the lower and the upper planes of their boxes.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// What they are.
    pub children: [ChildRef; WIDTH],
    /// How many there are.
    pub len: usize,
}

impl Parts {
    /// None.
    const NONE: Self =
        Self { planes: [[[0.0; WIDTH]; 2]; 3], children: [ChildRef::UNUSED; WIDTH], len: 0 };

    /// Adds one to fewer than eight.
    pub fn push(&mut self, part: &Part) {
        for axis in 0..3 {
            self.planes[axis][0][self.len] = part.bounds.min[axis];
            self.planes[axis][1][self.len] = part.bounds.max[axis];
        }
        self.children[self.len] = part.child;
        self.len += 1;
    }

    fn get(&self, index: usize) -> Part {
        let corner = |side: usize| Vec3::from_array(self.planes.map(|axis| axis[side][index]));
        let bounds = Aabb { min: corner(0), max: corner(1) };
        Part { child: self.children[index], bounds }
    }
}

/// A tree that can be looked through.
pub trait Hierarchy {
    /// All of it; `None` if it holds nothing.
    fn root(&self) -> Option<Part>;
    /// Whether this is a leaf.
    fn is_leaf(&self, child: ChildRef) -> bool;
    /// Sets `into` to the children of an inner node.
    fn children(&self, of: &Part, into: &mut Parts);
    /// Tells the triangles of a leaf, for as long as `wants_more` is true of each.
    fn triangles(&self, leaf: ChildRef, wants_more: &mut dyn FnMut(&Triangle) -> bool);
}

/// Where rays of a group may start, instead of at the root: subtrees that hold all that is in the way
/// of any of them.
#[derive(Clone, Debug, Default)]
pub struct Entry {
    /// At most eight, in the order in which they are to be visited; `None` stands for the whole tree.
    parts: Option<Vec<Part>>,
}

impl Entry {
    /// The whole tree.
    pub const WHOLE: Self = Self { parts: None };
    /// Most subtrees.
    pub const MOST: usize = WIDTH;

    /// The subtrees, if they are not the whole tree.
    pub fn parts(&self) -> Option<&[Part]> {
        self.parts.as_deref()
    }

    /// Makes it the whole tree.
    pub fn clear(&mut self) {
        self.parts = None;
    }
}

/// How much may be looked at for one shaft.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Inner nodes that are opened.
    pub nodes: usize,
    /// Triangles that are looked at.
    pub triangles: usize,
}

/// Subtrees under consideration: more than an entry may have, as many of them may turn out empty.
const MOST_PARTS: usize = 24;

/// Looks through the part of a tree that `from` is, and sets `entry` to what of it may be in the way
/// of the shaft's rays.
pub fn look(
    tree: &impl Hierarchy,
    shaft: &Shaft<'_>,
    from: &Entry,
    mut budget: Budget,
    entry: &mut Entry,
) -> View {
    let mut fresh = Parts::NONE;
    match from.parts() {
        Some(all) => all.iter().for_each(|part| fresh.push(part)),
        None => tree.root().iter().for_each(|part| fresh.push(part)),
    }
    let (mut first, mut second) = (List::NONE, List::NONE);
    let (mut parts, mut next) = (&mut first, &mut second);
    parts.extend(shaft, &fresh);
    // Level by level, for as long as there is room.
    let noted = entry.parts.get_or_insert_default();
    noted.clear();
    noted.extend_from_slice(parts.get());
    while budget.nodes > 0 && parts.get().iter().any(|part| !tree.is_leaf(part.child)) {
        next.len = 0;
        for part in parts.get() {
            if budget.nodes == 0 || tree.is_leaf(part.child) {
                next.push(*part);
            } else {
                budget.nodes -= 1;
                fresh.len = 0;
                tree.children(part, &mut fresh);
                next.extend(shaft, &fresh);
            }
            if next.len > MOST_PARTS {
                break;
            }
        }
        if next.len > MOST_PARTS {
            break;
        }
        std::mem::swap(&mut parts, &mut next);
        if parts.len <= Entry::MOST {
            noted.clear();
            noted.extend_from_slice(parts.get());
        }
    }
    // Boxes have said what they can: now the triangles of what is left.
    let mut view = View::Open;
    noted.retain(|part| {
        if view == View::Blocked || !tree.is_leaf(part.child) {
            view = if view == View::Blocked { view } else { View::Partly };
            return true;
        }
        let of_leaf = look_at_leaf(tree, shaft, part.child, &mut budget.triangles);
        if of_leaf != View::Open && view != View::Blocked {
            view = of_leaf;
        }
        of_leaf != View::Open
    });
    view
}

/// What a leaf is to the rays; once there is something in the way of some, whether one triangle stops
/// all is looked for with what is left of the budget.
fn look_at_leaf(tree: &impl Hierarchy, shaft: &Shaft, leaf: ChildRef, budget: &mut usize) -> View {
    let mut view = View::Open;
    tree.triangles(leaf, &mut |triangle| {
        if *budget == 0 {
            view = View::Partly;
            return false;
        }
        *budget -= 1;
        match shaft.view(triangle) {
            View::Open => true,
            View::Partly => {
                view = View::Partly;
                shaft.can_be_blocked()
            }
            View::Blocked => {
                view = View::Blocked;
                false
            }
        }
    });
    view
}

/// Subtrees in the order in which they are to be visited.
struct List {
    parts: [Part; MOST_PARTS + WIDTH + 1],
    len: usize,
}

impl List {
    const NONE: Self = Self {
        parts: [Part { child: ChildRef::UNUSED, bounds: Aabb::EMPTY }; MOST_PARTS + WIDTH + 1],
        len: 0,
    };

    fn get(&self) -> &[Part] {
        &self.parts[..self.len]
    }

    fn push(&mut self, part: Part) {
        self.parts[self.len] = part;
        self.len += 1;
    }

    /// Appends those that the shaft may meet.
    fn extend(&mut self, shaft: &Shaft<'_>, fresh: &Parts) {
        let mut met = shaft.meets(&fresh.planes) & ((1 << fresh.len) - 1);
        while met != 0 {
            self.push(fresh.get(met.trailing_zeros() as usize));
            met &= met - 1;
        }
    }
}

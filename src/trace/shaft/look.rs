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

    /// Moves a part to the place of another, at or before it.
    fn move_to(&mut self, from: usize, to: usize) {
        for sides in self.planes.as_flattened_mut() {
            sides[to] = sides[from];
        }
        self.children[to] = self.children[from];
    }

    /// Part `index`.
    pub fn get(&self, index: usize) -> Part {
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
#[derive(Clone, Debug)]
pub struct Entry {
    is_whole: bool,
    parts: Parts,
}

impl Default for Entry {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl Entry {
    /// The whole tree.
    pub const WHOLE: Self = Self { is_whole: true, parts: Parts::NONE };
    /// Most subtrees.
    pub const MOST: usize = WIDTH;

    /// The subtrees, in the order in which they are to be visited; `None` stands for the whole tree.
    #[inline]
    pub fn parts(&self) -> Option<&Parts> {
        if self.is_whole { None } else { Some(&self.parts) }
    }

    /// Makes it the whole tree.
    pub fn clear(&mut self) {
        self.is_whole = true;
    }

    /// Makes it these subtrees, at most eight.
    fn set(&mut self, parts: &[Part]) {
        self.is_whole = false;
        self.parts.len = 0;
        parts.iter().for_each(|part| self.parts.push(part));
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
    let start = match from.parts() {
        Some(parts) => parts,
        None => {
            tree.root().iter().for_each(|part| fresh.push(part));
            &fresh
        }
    };
    entry.is_whole = false;
    entry.parts.len = 0;
    each_met(shaft, start, |part| entry.parts.push(&part));
    if budget.nodes > 0 {
        open_nodes(tree, shaft, budget.nodes, entry);
    }
    // Boxes have said what they can: now the triangles of what is left.
    let mut view = View::Open;
    let mut kept = 0;
    for index in 0..entry.parts.len {
        let child = entry.parts.children[index];
        let of_part = if view == View::Blocked || !tree.is_leaf(child) {
            View::Partly
        } else {
            look_at_leaf(tree, shaft, child, &mut budget.triangles)
        };
        if of_part != View::Open {
            entry.parts.move_to(index, kept);
            kept += 1;
            view = if view == View::Blocked { view } else { of_part };
        }
    }
    entry.parts.len = kept;
    view
}

/// Opens nodes level by level, for as long as there is room, and sets the entry to the last of the
/// parts that it has room for.
fn open_nodes(tree: &impl Hierarchy, shaft: &Shaft<'_>, mut budget: usize, entry: &mut Entry) {
    let mut fresh = Parts::NONE;
    let (mut first, mut second) = (List::NONE, List::NONE);
    let (mut parts, mut next) = (&mut first, &mut second);
    (0..entry.parts.len).for_each(|index| parts.push(entry.parts.get(index)));
    while budget > 0 && parts.get().iter().any(|part| !tree.is_leaf(part.child)) {
        next.len = 0;
        for part in parts.get() {
            if budget == 0 || tree.is_leaf(part.child) {
                next.push(*part);
            } else {
                budget -= 1;
                fresh.len = 0;
                tree.children(part, &mut fresh);
                each_met(shaft, &fresh, |part| next.push(part));
            }
            if next.len > MOST_PARTS {
                return;
            }
        }
        std::mem::swap(&mut parts, &mut next);
        if parts.len <= Entry::MOST {
            entry.set(parts.get());
        }
    }
}

/// Tells those parts that the shaft may meet.
#[inline]
fn each_met(shaft: &Shaft<'_>, parts: &Parts, mut tell: impl FnMut(Part)) {
    let mut met = shaft.meets(&parts.planes) & ((1 << parts.len) - 1);
    while met != 0 {
        tell(parts.get(met.trailing_zeros() as usize));
        met &= met - 1;
    }
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
}

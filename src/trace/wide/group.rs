//! A group of rays, as many as a register holds numbers, against one box or triangle after the
//! other. All rays of a group go into one octant, so that they enter a box by the same planes.

use super::around::Around;
use super::leaf::{Facets, Lines, test};
use super::occluders::Occluders;
use super::rays::{Bits, Rays, Row, STREAM, load_3};
use super::simd::{LANES, Simd, Wide};
use super::stack::Stack;
use super::stream::{Trees, Triangles};
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, Node8, WIDTH};

/// The bits of one group's rays, from the lowest on.
#[inline(always)]
pub(super) fn of_group<W: Wide>(mask: Bits, group: usize) -> u64 {
    (mask >> (group * W::GROUP)) as u64 & ((1 << W::GROUP) - 1)
}

/// Groups with an active ray, one after the other.
#[inline(always)]
pub(super) fn groups_of<W: Wide>(w: W, active: Bits) -> impl Iterator<Item = usize> {
    let mut left = w.groups(active);
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let group = (left != 0).then_some(left.trailing_zeros() as usize % (STREAM / W::GROUP));
            left &= left.wrapping_sub(1);
            group
        },
    )
}

/// What a group's rays are tested against boxes with.
struct Slabs<W: Wide> {
    reciprocal: [W::Floats; 3],
    near: [W::Floats; 3],
    far: [W::Floats; 3],
    t_min: W::Floats,
    t_max: W::Floats,
    begin: W::Floats,
    /// For each axis the side of the entry plane.
    entry_side: [usize; 3],
}

impl<W: Wide> Slabs<W> {
    #[inline(always)]
    fn new(w: W, rays: &Rays<'_>, group: usize) -> Self {
        let octant = usize::from(rays.octants[group]);
        Self {
            reciprocal: load_3(w, &rays.reciprocal, group),
            near: load_3(w, &rays.near, group),
            far: load_3(w, &rays.far, group),
            t_min: w.load(&rays.t_min, group),
            t_max: w.load(&rays.t_max, group),
            begin: w.load(&rays.begin, group),
            entry_side: [octant & 1, octant >> 1 & 1, octant >> 2 & 1],
        }
    }

    /// The rays that meet a child's box, and where all enter it, which is not before `begin`.
    #[inline(always)]
    fn meets(&self, w: W, node: &Node8, slot: usize, begin: W::Floats) -> (W::Mask, W::Floats) {
        let ([rx, ry, rz], [nx, ny, nz], [fx, fy, fz]) = (self.reciprocal, self.near, self.far);
        let ([side_x, side_y, side_z], [planes_x, planes_y, planes_z]) =
            (self.entry_side, &node.planes);
        let enters_x = w.mul_sub(w.splat(planes_x[side_x][slot]), rx, nx);
        let enters_y = w.mul_sub(w.splat(planes_y[side_y][slot]), ry, ny);
        let enters_z = w.mul_sub(w.splat(planes_z[side_z][slot]), rz, nz);
        let leaves_x = w.mul_sub(w.splat(planes_x[1 - side_x][slot]), rx, fx);
        let leaves_y = w.mul_sub(w.splat(planes_y[1 - side_y][slot]), ry, fy);
        let leaves_z = w.mul_sub(w.splat(planes_z[1 - side_z][slot]), rz, fz);
        let entry = w.max(enters_z, w.max(enters_y, w.max(enters_x, begin)));
        let exit = w.min(leaves_z, w.min(leaves_y, w.min(leaves_x, self.t_max)));
        (w.less_equal(entry, exit), entry)
    }
}

/// For each child the rays that meet it: of some groups, one bit each, all of them, active or not.
#[inline(always)]
pub(super) fn node_by_group<S: Simd, W: Wide>(
    s: S,
    w: W,
    node: &Node8,
    rays: &Rays<'_>,
    around: &Around,
    mut groups: u32,
) -> W::Words {
    let (all, some) = around.sort(s, node);
    // Each result is written once: words would be read again for each group.
    let mut bytes = [[[0u8; 8]; WIDTH]; 2];
    let some = some & !all;
    while groups != 0 {
        let group = groups.trailing_zeros() as usize % (STREAM / W::GROUP);
        groups &= groups - 1;
        let half = &mut bytes[group / (STREAM / W::GROUP / 2)];
        let place = group % (STREAM / W::GROUP / 2);
        let slabs = Slabs::new(w, rays, group);
        let mut left = some;
        while left != 0 {
            let slot = left.trailing_zeros() as usize % WIDTH;
            left &= left - 1;
            let bits = w.bits(slabs.meets(w, node, slot, slabs.begin).0).to_le_bytes();
            let size = W::GROUP / 8;
            half[slot][place * size..][..size].copy_from_slice(&bits[..size]);
        }
    }
    // All ones where all rays start inside.
    w.words(bytes.map(|half| half.map(u64::from_le_bytes)), all)
}

/// As [`node_by_group`], for some of the children, one bit each. Writes where rays enter the boxes, a row
/// for each child. Returns lower and upper halves.
#[inline(always)]
pub(super) fn entries_by_group<W: Wide>(
    w: W,
    node: &Node8,
    children: u32,
    rays: &Rays<'_>,
    active: Bits,
    entries: &mut [Row; WIDTH],
) -> ([[u64; 2]; WIDTH], u32) {
    let mut met = [[0; 2]; WIDTH];
    let mut any = 0;
    for group in groups_of(w, active) {
        let here = of_group::<W>(active, group);
        let slabs = Slabs::new(w, rays, group);
        let mut left = children;
        while left != 0 {
            let slot = left.trailing_zeros() as usize % WIDTH;
            left &= left - 1;
            let (meet, entry) = slabs.meets(w, node, slot, slabs.t_min);
            w.store(&mut entries[slot], group, entry);
            let meet = w.bits(meet);
            met[slot][group * W::GROUP / 64] |= (meet & here) << (group * W::GROUP % 64);
            any |= u32::from(meet & here != 0) << slot;
        }
    }
    (met, any)
}

/// Those of a group's rays `here` that a triangle of a leaf stops, one triangle after the other.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the stream has at hand")]
pub(super) fn leaf_by_group<W: Wide>(
    w: W,
    trees: Triangles<'_>,
    leaf: ChildRef,
    rays: &Rays<'_>,
    group: usize,
    mut here: u64,
    stack: &mut Stack,
    occluders: &mut Occluders,
) -> u64 {
    let Triangles { tree, number } = trees;
    let (first_slot, count) = (leaf.leaf_slots().start, leaf.leaf_slots().len().min(WIDTH));
    let lines = lines_of(w, rays, group);
    // All triangles before anything is made of it, as no processor foresees what rays meet.
    let (mut hits, mut doubtful) = ([0; WIDTH], [0; WIDTH]);
    let (mut any_hits, mut any_doubtful) = (0, 0);
    for triangle in 0..count {
        let certain = test(w, &facet_of(w, tree, leaf, triangle), &lines);
        hits[triangle % WIDTH] = certain.hits & here;
        doubtful[triangle % WIDTH] = certain.doubtful(here);
        any_hits |= hits[triangle % WIDTH];
        any_doubtful |= doubtful[triangle % WIDTH];
    }
    if any_doubtful & !any_hits != 0 {
        for (triangle, doubtful) in doubtful[..count].iter().enumerate() {
            let id = tree.triangle_ids[first_slot + triangle];
            stack.doubt_all(group * W::GROUP, doubtful & !any_hits, id);
        }
    }
    if any_hits != 0 {
        for (triangle, hits) in hits[..count].iter().enumerate() {
            occluders.note(rays.octants[group], (number, leaf), triangle, hits & here);
            here &= !hits;
        }
    }
    any_hits
}

/// The rays of a group, one in each lane.
#[inline(always)]
pub(super) fn lines_of<W: Wide>(w: W, rays: &Rays<'_>, group: usize) -> Lines<W> {
    Lines {
        origin: load_3(w, &rays.origin, group),
        direction: load_3(w, &rays.direction, group),
        start: w.load(&rays.start, group),
        end: w.load(&rays.end, group),
        slope_slack: w.load(&rays.slope_slack, group),
        edge_slack: w.load(&rays.edge_slack, group),
        start_slack: w.load(&rays.start_slack, group),
        end_slack: w.load(&rays.end_slack, group),
        height_slack: w.load(&rays.height_slack, group),
    }
}

/// One triangle of a leaf, in all lanes.
#[inline(always)]
pub(super) fn facet_of<W: Wide>(w: W, tree: &Bvh8, leaf: ChildRef, triangle: usize) -> Facets<W> {
    let slots = leaf.leaf_slots();
    let count = slots.len();
    let block = &tree.leaves[slots.start * LEAF_ROWS + triangle..][..(LEAF_ROWS - 1) * count + 1];
    let at = |row: usize| w.splat(block[row * count]);
    Facets {
        corner: [at(0), at(1), at(2)],
        first: [at(3), at(4), at(5)],
        second: [at(6), at(7), at(8)],
        normal: [at(9), at(10), at(11)],
        height: at(12),
    }
}

/// Those of a group's active rays that one triangle of a leaf stops for certain; remembers those in
/// doubt.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the loops above have at hand")]
fn stopped_by<W: Wide>(
    w: W,
    tree: &Bvh8,
    leaf: ChildRef,
    triangle: usize,
    lines: &Lines<W>,
    group: usize,
    active: u64,
    stack: &mut Stack,
) -> u64 {
    let certain = test(w, &facet_of(w, tree, leaf, triangle), lines);
    let doubtful = certain.doubtful(active);
    if doubtful != 0 {
        let id = tree.triangle_ids[leaf.leaf_slots().start + triangle];
        stack.doubt_all(group * W::GROUP, doubtful, id);
    }
    certain.hits & active
}

/// Those of the active rays that a known occluder stops.
#[inline(always)]
pub(super) fn stopped_by_occluders<T: Trees, W: Wide, C: PacketCounter>(
    w: W,
    trees: T,
    rays: &Rays<'_>,
    active: Bits,
    stack: &mut Stack,
    occluders: &mut Occluders,
    counter: &mut C,
) -> Bits {
    let mut all = 0;
    for group in 0..STREAM / W::GROUP {
        let here = of_group::<W>(active, group);
        let hits = occluders.stopped(
            rays.octants[group],
            here,
            #[inline(always)]
            |(number, leaf), triangle, here| {
                let Some(tree) = trees.of_occluder(number) else { return 0 };
                counter.triangle(Bits::from(here) << (group * W::GROUP));
                let lines = lines_of(w, rays, group);
                stopped_by(w, tree, leaf, triangle, &lines, group, here, stack)
            },
        );
        all |= Bits::from(hits) << (group * W::GROUP);
    }
    all
}

const _: () = assert!(LANES == WIDTH);

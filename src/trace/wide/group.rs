//! A group of rays, as many as a register holds numbers, against one box or triangle after the
//! other. All rays of a group go into one octant, so that they enter a box by the same planes.

use super::leaf::{HEIGHT_SLACK, UNDERFLOW};
use super::occluders::Occluders;
use super::rays::{Rays, STREAM};
use super::simd::{LANES, Wide};
use crate::trace::packet::PacketCounter;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS, Node8, WIDTH};

/// The bits of one group's rays, from the lowest on.
#[inline(always)]
pub(super) fn of_group<W: Wide>(mask: u64, group: usize) -> u64 {
    mask >> (group * W::GROUP) & (u64::MAX >> (STREAM - W::GROUP))
}

/// For each child the active rays that meet it, and which children any meet.
#[inline(always)]
pub(super) fn node_by_group<W: Wide>(
    w: W,
    node: &Node8,
    rays: &Rays,
    active: u64,
) -> ([u64; WIDTH], u32) {
    let mut met = [0; WIDTH];
    let mut any = 0;
    for group in 0..STREAM / W::GROUP {
        let here = of_group::<W>(active, group);
        if here == 0 {
            continue;
        }
        let octant = usize::from(rays.octants[group]);
        let (side_x, side_y, side_z) = (octant & 1, octant >> 1 & 1, octant >> 2 & 1);
        let [rx, ry, rz] = load_3(w, &rays.reciprocal, group);
        let [nx, ny, nz] = load_3(w, &rays.near, group);
        let [fx, fy, fz] = load_3(w, &rays.far, group);
        let (t_min, t_max) = (w.load(&rays.t_min, group), w.load(&rays.t_max, group));
        let [planes_x, planes_y, planes_z] = &node.planes;
        for slot in 0..(node.len as usize).min(WIDTH) {
            let enters_x = w.mul_sub(w.splat(planes_x[side_x][slot]), rx, nx);
            let enters_y = w.mul_sub(w.splat(planes_y[side_y][slot]), ry, ny);
            let enters_z = w.mul_sub(w.splat(planes_z[side_z][slot]), rz, nz);
            let leaves_x = w.mul_sub(w.splat(planes_x[1 - side_x][slot]), rx, fx);
            let leaves_y = w.mul_sub(w.splat(planes_y[1 - side_y][slot]), ry, fy);
            let leaves_z = w.mul_sub(w.splat(planes_z[1 - side_z][slot]), rz, fz);
            let entry = w.max(enters_z, w.max(enters_y, w.max(enters_x, t_min)));
            let exit = w.min(leaves_z, w.min(leaves_y, w.min(leaves_x, t_max)));
            let meet = w.less_equal(entry, exit) & here;
            met[slot] |= meet << (group * W::GROUP);
            any |= u32::from(meet != 0) << slot;
        }
    }
    (met, any)
}

#[inline(always)]
fn load_3<W: Wide>(w: W, rows: &[super::rays::Row; 3], group: usize) -> [W::Floats; 3] {
    [w.load(&rows[0], group), w.load(&rows[1], group), w.load(&rows[2], group)]
}

/// Those of the active rays that a triangle of a leaf stops. Steps and bounds are those of
/// [`hits_leaf`](super::leaf::hits_leaf).
///
/// The two sheared coordinates of a corner are sums of three products, of which one is with 1 and
/// one with 0: these are exact, so the numbers are those of the watertight test. (Products of zero
/// and infinity are NaN, which turns nothing away.)
#[inline(always)]
pub(super) fn leaf_by_group<W: Wide>(
    w: W,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays,
    active: u64,
    occluders: &mut Occluders,
) -> u64 {
    let mut all = 0;
    for group in 0..STREAM / W::GROUP {
        let mut here = of_group::<W>(active, group);
        if here == 0 {
            continue;
        }
        let before = here;
        for triangle in 0..leaf.leaf_slots().len() {
            let hits = stopped_by(w, tree, leaf, triangle, rays, group, here);
            occluders.note(rays.octants[group], leaf, triangle, hits);
            here &= !hits;
            if here == 0 {
                break;
            }
        }
        all |= (before & !here) << (group * W::GROUP);
    }
    all
}

/// Those of a group's active rays that one triangle of a leaf stops.
#[inline(always)]
pub(super) fn stopped_by<W: Wide>(
    w: W,
    tree: &Bvh8,
    leaf: ChildRef,
    triangle: usize,
    rays: &Rays,
    group: usize,
    active: u64,
) -> u64 {
    let slots = leaf.leaf_slots();
    let count = slots.len();
    let block = &tree.leaves[slots.start * LEAF_ROWS..slots.end * LEAF_ROWS];
    let zero = w.splat(0.0);
    let origin = load_3(w, &rays.origin, group);
    let (first, second) = (load_3(w, &rays.across[0], group), load_3(w, &rays.across[1], group));
    let mut corners = [[zero; 3]; 3];
    let mut projected = [[zero; 2]; 3];
    for corner in 0..3 {
        for axis in 0..3 {
            let number = block[(3 * corner + axis) * count + triangle];
            corners[corner][axis] = w.sub(w.splat(number), origin[axis]);
        }
        projected[corner] = [dot(w, corners[corner], first), dot(w, corners[corner], second)];
    }
    let [a, b, c] = projected;
    let uvt = [cross(w, c, b), cross(w, a, c), cross(w, b, a)];
    let below = w.less(w.min(w.min(uvt[0], uvt[1]), uvt[2]), zero);
    let above = w.less(zero, w.max(w.max(uvt[0], uvt[1]), uvt[2]));
    let candidates = !(below & above) & active;
    if candidates == 0 {
        return 0;
    }
    let [x, y, z] = [9 * count, 10 * count, 11 * count];
    let normal = [block[x + triangle], block[y + triangle], block[z + triangle]];
    let (mut hits, mut doubtful) =
        judge(w, rays, group, candidates, corners[0], projected, normal, uvt);
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize;
        doubtful &= doubtful - 1;
        let hit = rays.confirm(group * W::GROUP + lane, &tree.triangle(leaf, triangle));
        hits |= u64::from(hit) << lane;
    }
    hits
}

/// Those of the active rays that a known occluder stops.
#[inline(always)]
pub(super) fn stopped_by_occluders<W: Wide, C: PacketCounter>(
    w: W,
    tree: &Bvh8,
    rays: &Rays,
    active: u64,
    occluders: &mut Occluders,
    counter: &mut C,
) -> u64 {
    let mut all = 0;
    for group in 0..STREAM / W::GROUP {
        let here = of_group::<W>(active, group);
        let hits = occluders.stopped(
            rays.octants[group],
            here,
            #[inline(always)]
            |leaf, triangle, here| {
                counter.triangle(here << (group * W::GROUP));
                stopped_by(w, tree, leaf, triangle, rays, group, here)
            },
        );
        all |= hits << (group * W::GROUP);
    }
    all
}

/// Which of the candidates hit a triangle for certain, and which may. `corner`, the first one, is
/// relative to the origins; `projected` are all, across the lines.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what the step before has in registers")]
fn judge<W: Wide>(
    w: W,
    rays: &Rays,
    group: usize,
    mut candidates: u64,
    corner: [W::Floats; 3],
    projected: [[W::Floats; 2]; 3],
    normal: [f32; 3],
    uvt: [W::Floats; 3],
) -> (u64, u64) {
    let normal = [w.splat(normal[0]), w.splat(normal[1]), w.splat(normal[2])];
    let direction = load_3(w, &rays.direction, group);
    let [x, y, z] = corner;
    let (height, slope) = (dot(w, normal, corner), dot(w, normal, direction));
    let reach = w.add(w.add(w.abs(x), w.abs(y)), w.add(w.abs(z), w.splat(UNDERFLOW)));
    let slack = w.mul(reach, w.splat(HEIGHT_SLACK));
    let height = w.flip_sign(height, slope);
    let slope = w.abs(slope);
    let slope_slack = w.load(&rays.slope_slack, group);
    let (start, end) = (w.load(&rays.start, group), w.load(&rays.end, group));
    let (at_start, at_end) = (w.mul(start, slope), w.mul(end, slope));
    let (start_slack, end_slack) =
        (w.mul(w.abs(start), slope_slack), w.mul(w.abs(end), slope_slack));
    let sure_of_side = w.less(slope_slack, slope);
    let before = w.less(w.add(height, slack), w.sub(at_start, start_slack));
    let after = w.less(w.add(at_end, end_slack), w.sub(height, slack));
    candidates &= !((before | after) & sure_of_side);
    if candidates == 0 {
        return (0, 0);
    }
    let unbounded = w.less(w.splat(f32::MAX), end);
    let product = w.abs(w.mul(w.mul(uvt[0], uvt[1]), uvt[2]));
    let no_doubt = w.less_equal(w.splat(f32::MIN_POSITIVE), product)
        & w.less_equal(product, w.splat(f32::MAX));
    let started = w.less(w.add(at_start, start_slack), w.sub(height, slack));
    let not_ended = unbounded | w.less(w.add(height, slack), w.sub(at_end, end_slack));
    // As `clear_of_edges` of `leaf` has it.
    let far = |p: [W::Floats; 2]| w.add(w.abs(p[0]), w.abs(p[1]));
    let farthest = w.max(w.max(far(projected[0]), far(projected[1])), far(projected[2]));
    let least = w.min(w.min(w.abs(uvt[0]), w.abs(uvt[1])), w.abs(uvt[2]));
    let clear = w.less(w.mul(w.load(&rays.edge_slack, group), farthest), least);
    let certain = candidates & sure_of_side & no_doubt & started & not_ended & clear;
    (certain, candidates & !certain)
}

#[inline(always)]
fn dot<W: Wide>(w: W, a: [W::Floats; 3], b: [W::Floats; 3]) -> W::Floats {
    w.add(w.add(w.mul(a[0], b[0]), w.mul(a[1], b[1])), w.mul(a[2], b[2]))
}

#[inline(always)]
fn cross<W: Wide>(w: W, p: [W::Floats; 2], q: [W::Floats; 2]) -> W::Floats {
    w.sub(w.mul(p[0], q[1]), w.mul(p[1], q[0]))
}

/// Groups with an active ray.
#[inline(always)]
pub(super) fn groups<W: Wide>(active: u64) -> u32 {
    let mut any = active;
    let mut shift = W::GROUP / 2;
    while shift > 0 {
        any |= any >> shift;
        shift /= 2;
    }
    let first_of_each = u64::MAX / (u64::MAX >> (STREAM - W::GROUP));
    (any & first_of_each).count_ones()
}

const _: () = assert!(LANES == WIDTH);

//! Several rays of a group, four lanes each, against four triangles of a leaf at once: where few rays visit
//! a leaf of few triangles, a ray against all triangles or a triangle against all rays leaves most lanes empty.

use super::leaf::{Facets, Lines, test};
use super::rays::{Rays, Row};
use super::simd::Wide;
use super::stack::Stack;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS};

/// Triangles that are tested at once.
const QUAD: usize = 4;

/// The first of each four bits.
const OF_EACH: u64 = 0x1111_1111_1111_1111;

/// Rays that are.
const fn rays_at_once<W: Wide>() -> usize {
    W::GROUP / QUAD
}

/// Whether this is quicker than one ray after the other: it is not for two.
pub(super) const fn are_quicker<W: Wide>() -> bool {
    rays_at_once::<W>() > 2
}

/// Those of a group's rays `here` that a triangle of a leaf stops for certain; remembers those in doubt.
#[inline(always)]
pub(super) fn leaf_by_quads<W: Wide>(
    w: W,
    tree: &Bvh8,
    leaf: ChildRef,
    rays: &Rays<'_>,
    group: usize,
    here: u64,
    stack: &mut Stack,
) -> u64 {
    let count = leaf.leaf_slots().len();
    let (mut left, mut stopped) = (here, 0);
    while left != 0 {
        let lines = lines_of(w, rays, group, left);
        let lanes = (1 << (QUAD * rays_at_once::<W>().min(left.count_ones() as usize))) - 1;
        // Of each ray four bits, for the first four triangles and for the others.
        let (mut hits, mut doubtful) = ([0; 2], [0; 2]);
        for quad in 0..count.div_ceil(QUAD) {
            let certain = test(w, &facets_of(w, tree, leaf, quad), &lines);
            let there = lanes & (OF_EACH * ((1 << (count - quad * QUAD).min(QUAD)) - 1));
            hits[quad % 2] = certain.hits & there;
            doubtful[quad % 2] = certain.doubtful(there);
        }
        let any = hits[0] | hits[1] | doubtful[0] | doubtful[1];
        if any == 0 {
            for _ in 0..rays_at_once::<W>() {
                left &= left.wrapping_sub(1);
            }
            continue;
        }
        for ray in 0..rays_at_once::<W>().min(left.count_ones() as usize) {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let own = 0xf << (QUAD * ray);
            let is_hit = (hits[0] | hits[1]) & own != 0;
            stopped |= u64::from(is_hit) << lane;
            if (doubtful[0] | doubtful[1]) & own != 0 && !is_hit {
                for (quad, doubtful) in doubtful.into_iter().enumerate() {
                    let mut doubtful = doubtful >> (QUAD * ray) & 0xf;
                    while doubtful != 0 {
                        let triangle = quad * QUAD + doubtful.trailing_zeros() as usize;
                        let id = tree.triangle_ids[leaf.leaf_slots().start + triangle];
                        stack.doubt(group * W::GROUP + lane, id);
                        doubtful &= doubtful - 1;
                    }
                }
            }
        }
    }
    stopped
}

/// The first of some rays of a group, in four lanes each.
#[inline(always)]
fn lines_of<W: Wide>(w: W, rays: &Rays<'_>, group: usize, some: u64) -> Lines<W> {
    let lanes = w.four_of_each(some);
    Lines {
        origin: load_3(w, &rays.origin, group, lanes),
        direction: load_3(w, &rays.direction, group, lanes),
        start: w.load_lanes(&rays.start, group, lanes),
        end: w.load_lanes(&rays.end, group, lanes),
        slope_slack: w.load_lanes(&rays.slope_slack, group, lanes),
        edge_slack: w.load_lanes(&rays.edge_slack, group, lanes),
        start_slack: w.load_lanes(&rays.start_slack, group, lanes),
        end_slack: w.load_lanes(&rays.end_slack, group, lanes),
        height_slack: w.load_lanes(&rays.height_slack, group, lanes),
    }
}

#[inline(always)]
fn load_3<W: Wide>(w: W, rows: &[Row; 3], group: usize, lanes: W::Lanes) -> [W::Floats; 3] {
    [
        w.load_lanes(&rows[0], group, lanes),
        w.load_lanes(&rows[1], group, lanes),
        w.load_lanes(&rows[2], group, lanes),
    ]
}

/// Four triangles of a leaf, again and again; after the last one there is something else.
#[inline(always)]
fn facets_of<W: Wide>(w: W, tree: &Bvh8, leaf: ChildRef, quad: usize) -> Facets<W> {
    let slots = leaf.leaf_slots();
    let count = slots.len();
    let first = slots.start * LEAF_ROWS + quad * QUAD;
    let block = &tree.leaves[first..][..(LEAF_ROWS - 1) * count + QUAD];
    Facets {
        corner: rows_of(w, block, count, 0),
        first: rows_of(w, block, count, 3),
        second: rows_of(w, block, count, 6),
        normal: rows_of(w, block, count, 9),
        height: row_of(w, block, count, 12),
    }
}

/// Three rows of a leaf of `count` triangles.
#[inline(always)]
fn rows_of<W: Wide>(w: W, block: &[f32], count: usize, first: usize) -> [W::Floats; 3] {
    [
        row_of(w, block, count, first),
        row_of(w, block, count, first + 1),
        row_of(w, block, count, first + 2),
    ]
}

#[inline(always)]
fn row_of<W: Wide>(w: W, block: &[f32], count: usize, row: usize) -> W::Floats {
    w.repeat(block[row * count..][..QUAD].try_into().expect("four numbers"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::small_tree;
    use crate::intersect::Mode;
    use crate::ray::Ray;
    use crate::test_random::Random;
    use crate::trace::NoCount;
    use crate::trace::wide::group::of_group;
    use crate::trace::wide::numbers::Target;
    use crate::trace::wide::octants::{EntryPoint, Places};
    use crate::trace::wide::rays::{Bits, Numbers, STREAM};
    use crate::trace::wide::simd::{Portable, Simd};
    use crate::trace::wide::stream::leaf_by_ray;
    use crate::trace::wide::tests::rays as random_rays;
    use crate::trace::wide::{Instructions, MOST_SORTED, Set};

    /// Whatever the instructions, whichever rays, and however many triangles there are.
    #[test]
    fn quads_find_what_single_rays_find() {
        let mut random = Random::new(0x9ad);
        let [mut hits, mut doubts] = [0; 2];
        for round in 0..600 {
            let mesh = random.mesh(1 + round % 60);
            let ids: Vec<u32> = (0..mesh.len() as u32).collect();
            let tree = small_tree(&mesh, &ids, |_, bounds, _| bounds.half_area());
            let mut given = random_rays(&mut random, &mesh, STREAM);
            // Some go for corners, which leaves them in doubt, and some through triangles.
            for (index, ray) in given.iter_mut().enumerate() {
                let corners = mesh.triangle(random.bits() as usize % mesh.len()).0;
                let target = match index % 3 {
                    0 => corners[0],
                    1 => (corners[0] + corners[1] + corners[2]) / 3.0,
                    _ => continue,
                };
                *ray = Ray { direction: target - ray.origin, t_min: 0.0, t_max: 2.0, ..*ray };
            }
            let mode = [Mode::Exact, Mode::Fast][round % 2];
            let target = Target { bounds: &tree.bounds, mesh: &mesh, mode };
            for set in Instructions::all() {
                let found = match set.0 {
                    Set::Portable => check(Portable, Portable, &tree, &given, target, &mut random),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx2(avx2) => check(avx2, avx2, &tree, &given, target, &mut random),
                    #[cfg(target_arch = "x86_64")]
                    Set::Avx512(avx2, avx512) => {
                        check(avx2, avx512, &tree, &given, target, &mut random)
                    }
                };
                hits += found[0];
                doubts += found[1];
            }
        }
        assert!(hits > 10_000 && doubts > 1000, "{hits} hits, {doubts} after a doubt");
    }

    /// Returns how many rays were stopped for certain, and how many were after a doubt.
    fn check<S: Simd, W: Wide>(
        s: S,
        w: W,
        tree: &Bvh8,
        given: &[Ray],
        target: Target<'_>,
        random: &mut Random,
    ) -> [u32; 2] {
        let (mut numbers, mut places) = (Numbers::ZERO, Places::default());
        let (mut by_quads, mut by_ray) = (Stack::EMPTY, Stack::EMPTY);
        let mut found = [0; 2];
        places.list(s, w, given, MOST_SORTED, |_| EntryPoint::Whole);
        for picked in places.streams(given) {
            let rays = Rays::new(s, w, &mut numbers, target, picked);
            let nodes = tree.nodes.iter().flat_map(|node| &node.children[..node.len as usize]);
            for &leaf in nodes.chain(&tree.root).filter(|child| child.is_leaf()) {
                for group in 0..STREAM / W::GROUP {
                    let first = group * W::GROUP;
                    let some = random.bits() & (random.bits() | random.bits());
                    let here = of_group::<W>(rays.valid, group) & some;
                    by_quads.begin();
                    by_ray.begin();
                    let stopped = leaf_by_quads(w, tree, leaf, &rays, group, here, &mut by_quads);
                    let expected = leaf_by_ray(s, tree, leaf, &rays, first, here, &mut by_ray);
                    assert_eq!(stopped, expected, "{leaf:?}");
                    let left = Bits::from(here & !stopped) << first;
                    let settled = rays.settle(s, left, &mut by_quads, &mut NoCount);
                    assert_eq!(
                        settled,
                        rays.settle(s, left, &mut by_ray, &mut NoCount),
                        "{leaf:?}"
                    );
                    found[0] += stopped.count_ones();
                    found[1] += settled.count_ones();
                }
            }
        }
        found
    }
}

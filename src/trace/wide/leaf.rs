//! Lines against triangles: what rounding cannot change is settled here, for either
//! [`Mode`](crate::intersect::Mode); what is left in doubt is given to the scalar test.
//!
//! # The numbers
//!
//! With `C = a - o`, the edges `e1 = b - a` and `e2 = c - a`, the unit normal `n`, a power of two `l` that
//! is no smaller than any component of an edge, and `h = |e1 x e2| / l`:
//!
//! ```text
//! D = n d    T = n C    U = (C x d) (e2 / l)    V = (C x d) (-e1 / l)    W = h D - U - V
//! ```
//!
//! The line passes through the triangle if `U`, `V` and `W` have the sign of `D` or are zero, and meets
//! the plane at `T / D`: see [`intersect::exact`](crate::intersect), of which these are multiples.
//!
//! # Their errors
//!
//! `u = 2^-24`, norms are sums of components, but for `|C|`, which is twice the largest one: so are sums of
//! `|C|`'s and others' products in `C x d` bounded, and the sum of all `|n C|`. `C` has one rounding, so a
//! component of `C x d` has three at most and all of them together are off by less than `3.01 u |C| |d|`.
//! Components of `e / l` are at most 1, with one rounding; with three for the products and sums, `U` and `V`
//! are off by less than `7.1 u |C| |d|`. Components of `n` are off by one rounding and `2^-30` (see
//! [`Bvh8::leaves`]), so `D` is off by less than `4.2 u |d|`, `h D` by `6.5 u h |d|` and `W` by `19 u
//! |C| |d| + 8.5 u h |d|`, its own rounding included. `E`, 20 times `u (|C| + h) |d|`, covers all three, and
//! `5 u |d|` the first. `T` is off by less than `5.2 u |C|`, and `T - t D` by `6.3 u |C| + 5.3 u |t|
//! |d|`. Rays whose numbers might overflow are NaN here, of which no comparison holds; what underflow
//! takes is less than the constant in each slack.
//!
//! Where `U`, `V` and `W` are all larger than `E`, they are no less than `3 E` in all, which but for
//! roundings is `h D`: so `D` is larger than `50 u |d|`, and its sign is certain without asking.
//!
//! # Heights
//!
//! What `T` is off by is found for each line and triangle where a miss is to be told, as rays start close to
//! planes. For hits a bound does that all planes have in common: where the scene has an extent `m` from the
//! origin, `T - t D` is off by less than `12.6 u m + 5.3 u |t| |d|`.
//!
//! # The plain test
//!
//! [`PreparedRay::triangle`](crate::intersect::PreparedRay) sees corners that are off by `6.5 u m` in
//! each sheared coordinate, and is exact in what it
//! makes of their signs. So it agrees where the line is further than `9.2 u m` from the triangle, or
//! from its edges inside. In those coordinates an edge is no longer than `2.9 l`, so an edge function
//! of `U` lies at `|U| / (2.9 |d|)`: with `28 u m |d|` on top of the slack of `U`, that is far enough. In
//! the interval it compares `f64`, whose errors are far less than the slack here.

use super::rays::Rays;
use super::simd::{LANES, Simd, Vector};
use super::stack::Stack;
use crate::tree::{Bvh8, ChildRef, LEAF_ROWS};

const UNIT: f32 = 1.0 / (1u32 << 24) as f32;
/// Of `|d|`.
pub(super) const SLOPE_SLACK: f32 = 5.0 * UNIT;
/// Of `|C| + h`, in units of the slack of `D`.
const EDGE_SLACK: f32 = 4.0;
/// Of `m |d|`, more in [`Mode::Fast`](crate::intersect::Mode).
pub(super) const EDGE_SLACK_FAST: f32 = 28.0 * UNIT;
/// Of `m`, for all heights.
pub(super) const ANY_HEIGHT_SLACK: f32 = 14.0 * UNIT;
/// Of `|C|`, for a height.
const HEIGHT_SLACK: f32 = 7.0 * UNIT;
/// Of `|t| |d|`.
pub(super) const END_SLACK: f32 = 6.0 * UNIT;
/// Keeps slacks above what underflow takes.
pub(super) const UNDERFLOW: f32 = f32::MIN_POSITIVE;

/// A triangle, or one in each lane: its rows in a leaf.
#[derive(Clone, Copy)]
pub(super) struct Facets<V: Vector> {
    pub(super) corner: [V::Floats; 3],
    /// `-e1 / l`.
    pub(super) first: [V::Floats; 3],
    /// `e2 / l`.
    pub(super) second: [V::Floats; 3],
    pub(super) normal: [V::Floats; 3],
    pub(super) height: V::Floats,
}

/// A ray, or one in each lane.
#[derive(Clone, Copy)]
pub(super) struct Lines<V: Vector> {
    pub(super) origin: [V::Floats; 3],
    pub(super) direction: [V::Floats; 3],
    pub(super) start: V::Floats,
    pub(super) end: V::Floats,
    pub(super) slope_slack: V::Floats,
    pub(super) edge_slack: V::Floats,
    pub(super) start_slack: V::Floats,
    pub(super) end_slack: V::Floats,
    pub(super) height_slack: V::Floats,
}

/// What is certain of lines and triangles, one bit each.
#[derive(Clone, Copy)]
pub(super) struct Certain {
    pub(super) hits: u64,
    /// Those that may be hits, and those that are.
    pub(super) not_misses: u64,
}

impl Certain {
    /// Those of some that are in doubt.
    #[inline(always)]
    pub(super) fn doubtful(&self, of: u64) -> u64 {
        self.not_misses & !self.hits & of
    }
}

/// Where lines meet triangles' planes, and what is certain of them.
#[derive(Clone, Copy)]
pub(super) struct Crossings<V: Vector> {
    pub(super) certain: Certain,
    /// `|D|`.
    slope: V::Floats,
    /// `T`, with the sign of `D` taken out.
    height: V::Floats,
    /// `|C| / 2`.
    half_reach: V::Floats,
}

/// Tests in all lanes.
#[inline(always)]
pub(super) fn test<V: Vector>(v: V, facets: &Facets<V>, lines: &Lines<V>) -> Certain {
    crossings(v, facets, lines).certain
}

/// As [`test`], and keeps what distances are found from.
#[inline(always)]
pub(super) fn crossings<V: Vector>(v: V, facets: &Facets<V>, lines: &Lines<V>) -> Crossings<V> {
    let to_corner: [V::Floats; 3] =
        std::array::from_fn(|i| v.sub(facets.corner[i], lines.origin[i]));
    let moment = v.cross(to_corner, lines.direction);
    let slope = v.dot(facets.normal, lines.direction);
    let turned = |value| v.flip_sign(value, slope);
    let first = turned(v.dot(moment, facets.second));
    let second = turned(v.dot(moment, facets.first));
    let height = turned(v.dot(facets.normal, to_corner));
    let slope = v.abs(slope);
    let third = v.sub(v.mul_sub(slope, facets.height, first), second);
    let [x, y, z] = to_corner;
    let half_reach = v.larger_size(v.larger_size(x, y), z);
    let scale = v.mul(lines.slope_slack, v.splat(EDGE_SLACK));
    let edge_slack = v.mul_add(scale, facets.height, lines.edge_slack);
    let edge_slack = v.mul_add(v.add(scale, scale), half_reach, edge_slack);
    let least = v.min(v.min(first, second), third);
    // How far the plane lies before the start and the end.
    let to_start = v.mul_sub(lines.start, slope, height);
    let to_end = v.mul_sub(lines.end, slope, height);
    let minus = |value| v.sub(v.splat(0.0), value);
    let hits = v.less(to_start, minus(v.add(lines.start_slack, lines.height_slack)));
    let hits = v.less_where(hits, v.add(lines.end_slack, lines.height_slack), to_end);
    let hits = v.less_where(hits, edge_slack, least);
    let start_slack = v.mul_add(half_reach, v.splat(2.0 * HEIGHT_SLACK), lines.start_slack);
    let below_end = v.mul_sub(half_reach, v.splat(-2.0 * HEIGHT_SLACK), lines.end_slack);
    let unsure = v.not_less(lines.slope_slack, slope);
    let near = v.not_less(start_slack, to_start);
    let near = v.not_less_where(near, to_end, below_end);
    let near = v.not_less_where(near, least, minus(edge_slack));
    let certain = Certain { hits: v.bits(hits), not_misses: v.bits(v.either(unsure, near)) };
    Crossings { certain, slope, height, half_reach }
}

impl<V: Vector> Crossings<V> {
    /// Bounds of the distance at which the plain test finds the plane, and the lanes that they hold for,
    /// one bit each.
    ///
    /// They are held against the plane as the ends of an interval are, so how they were found does not
    /// matter.
    #[inline(always)]
    pub(super) fn distances(&self, v: V, lines: &Lines<V>) -> ([V::Floats; 2], u64) {
        let unit = v.mul(lines.slope_slack, v.splat(END_SLACK / SLOPE_SLACK));
        let slack = |t| {
            let of_t = v.mul_add(v.abs(t), unit, v.splat(UNDERFLOW));
            v.mul_add(self.half_reach, v.splat(2.0 * HEIGHT_SLACK), of_t)
        };
        let reciprocal = v.div(v.splat(1.0), self.slope);
        let slack_here = slack(v.mul(self.height, reciprocal));
        let twice = v.add(slack_here, slack_here);
        let lower = v.mul(v.sub(self.height, twice), reciprocal);
        let upper = v.mul(v.add(self.height, twice), reciprocal);
        let after_lower = v.sub(v.splat(0.0), v.mul_sub(lower, self.slope, self.height));
        let before_upper = v.mul_sub(upper, self.slope, self.height);
        let hold = v.both(v.less(slack(lower), after_lower), v.less(slack(upper), before_upper));
        ([lower, upper], v.bits(hold))
    }
}

/// Ray `index` in all lanes.
#[inline(always)]
pub(super) fn one_of<S: Simd>(s: S, rays: &Rays<'_>, index: usize) -> Lines<S> {
    let all = |row: &super::rays::Row| s.splat(row.0[index]);
    Lines {
        origin: rays.origin.each_ref().map(all),
        direction: rays.direction.each_ref().map(all),
        start: all(&rays.start),
        end: all(&rays.end),
        slope_slack: all(&rays.slope_slack),
        edge_slack: all(&rays.edge_slack),
        start_slack: all(&rays.start_slack),
        end_slack: all(&rays.end_slack),
        height_slack: all(&rays.height_slack),
    }
}

/// The triangles of a leaf, read whole: lanes beyond the last one hold something else.
#[inline(always)]
pub(super) fn facets_of<S: Simd>(s: S, tree: &Bvh8, leaf: ChildRef) -> Facets<S> {
    let slots = leaf.leaf_slots();
    let count = slots.len();
    let block = &tree.leaves[slots.start * LEAF_ROWS..][..(LEAF_ROWS - 1) * count + LANES];
    let row = |row: usize| {
        let first = row * count;
        s.load(block[first..first + LANES].try_into().expect("eight numbers"))
    };
    Facets {
        corner: [row(0), row(1), row(2)],
        first: [row(3), row(4), row(5)],
        second: [row(6), row(7), row(8)],
        normal: [row(9), row(10), row(11)],
        height: row(12),
    }
}

/// The first triangle of a leaf that a ray hits for certain, from 0 on; remembers those in doubt for ray
/// `index`.
#[inline(always)]
pub(super) fn hits_leaf<S: Simd>(
    s: S,
    tree: &Bvh8,
    leaf: ChildRef,
    lines: &Lines<S>,
    index: usize,
    stack: &mut Stack,
) -> Option<usize> {
    let certain = test(s, &facets_of(s, tree, leaf), lines);
    let slots = leaf.leaf_slots();
    let there = (1 << slots.len()) - 1;
    let hits = certain.hits & there;
    if hits != 0 {
        return Some(hits.trailing_zeros() as usize);
    }
    let mut doubtful = certain.doubtful(there);
    while doubtful != 0 {
        let slot = slots.start + doubtful.trailing_zeros() as usize;
        stack.doubt(index, tree.triangle_ids[slot]);
        doubtful &= doubtful - 1;
    }
    None
}

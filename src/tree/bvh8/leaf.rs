//! The numbers of a leaf's triangles.

use super::{LEAF_ROWS, MAX_WIDE_LEAF, WIDTH};
use crate::geometry::{Aabb, Triangle, TriangleMesh};
use crate::vectorized::{cross, dot, inverse_sqrt, minus};
use glam::DVec3;

/// Of the angle between two edges, for the normal to be certain.
const LEAST_SINE_SQUARED: f64 = 1.0 / (1u64 << 40) as f64;
/// Of the cross product, likewise: what underflow takes is far less.
const LEAST_SQUARED: f64 = 1e-290;

/// A triangle's numbers in a leaf: see [`Bvh8::leaves`](super::Bvh8).
///
/// Edges and normals are rounded once from numbers that are off by less than `2^-30`. Where a normal
/// would be less certain it is zero, and so are the last number and all that follows from them, which
/// then is in doubt. A triangle that has no area for certain is one that lines miss: it has two edges
/// that point away from each other, so that no line is within all three.
fn leaf_numbers(triangle: &Triangle) -> [f32; LEAF_ROWS] {
    const ANY_EDGE: DVec3 = DVec3::new(0.36, 0.48, 0.8);
    let [a, b, c] = triangle.0.map(|v| v.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let cross = ab.cross(ac);
    let largest = ab.abs().max(ac.abs()).max_element();
    // A power of two that is no smaller, so that scaling rounds nothing.
    let scale = f64::from_bits(((largest.to_bits() >> 52) + 1) << 52);
    // Products of two edges lose at most 2^-51 of their lengths.
    let squared = cross.length_squared();
    let lengths = ab.length_squared() * ac.length_squared();
    let shrink = reciprocal_of_power(scale);
    let (ab, ac) = (ab * -shrink, ac * shrink);
    let (ab, ac, normal, height) =
        if squared > lengths * LEAST_SINE_SQUARED && squared > LEAST_SQUARED {
            let unit = inverse_sqrt(squared);
            (ab, ac, cross * unit, squared * unit * shrink)
        } else if is_difference(a, b) && is_difference(a, c) && are_parallel(b - a, c - a) {
            (ANY_EDGE, -ANY_EDGE, DVec3::splat(3f64.sqrt().recip()), 0.0)
        } else {
            (ab, ac, DVec3::ZERO, 0.0)
        };
    let [first, second, normal] = [ab, ac, normal].map(|v| v.as_vec3().to_array());
    let [a, b, c] = triangle.0[0].to_array();
    let [d, e, f] = first;
    let [g, h, i] = second;
    let [j, k, l] = normal;
    [a, b, c, d, e, f, g, h, i, j, k, l, height as f32]
}

/// One over a power of two from `2^-1022` to `2^1022`, without a rounding.
#[inline(always)]
fn reciprocal_of_power(power: f64) -> f64 {
    f64::from_bits((2046 << 52) - power.to_bits())
}

/// Whether the difference of the two is exact: then both can be had back from it.
fn is_difference(from: DVec3, to: DVec3) -> bool {
    let difference = to - from;
    from + difference == to && to - difference == from
}

/// Whether the cross product is zero without rounding.
fn are_parallel(a: DVec3, b: DVec3) -> bool {
    // Rounded, and what that took.
    let product = |a: f64, b: f64| (a * b, a.mul_add(b, -(a * b)));
    product(a.x, b.y) == product(a.y, b.x)
        && product(a.y, b.z) == product(a.z, b.y)
        && product(a.z, b.x) == product(a.x, b.z)
}

/// Writes a leaf of these triangles, at most [`MAX_WIDE_LEAF`], into its block of [`LEAF_ROWS`]
/// numbers for each: see [`Bvh8::leaves`](super::Bvh8).
pub(crate) fn write_leaf(block: &mut [f32], triangles: &[Triangle]) {
    let count = triangles.len();
    debug_assert_eq!(block.len(), count * LEAF_ROWS);
    for (index, triangle) in triangles.iter().enumerate() {
        for (row, number) in leaf_numbers(triangle).into_iter().enumerate() {
            block[row * count + index] = number;
        }
    }
}

/// As [`write_leaf`], bit for bit, several triangles at once: for loops under
/// [`vectorized`](crate::vectorized).
#[inline(always)]
pub(crate) fn write_leaf_in_lanes(block: &mut [f32], triangles: &[Triangle]) {
    debug_assert_eq!(block.len(), triangles.len() * LEAF_ROWS);
    if triangles.len() <= WIDTH / 2 {
        write_lanes::<{ WIDTH / 2 }>(block, triangles);
    } else {
        write_lanes::<WIDTH>(block, triangles);
    }
}

/// Writes the leaf of these triangles of a mesh, in lanes, and returns the box around them.
#[inline(always)]
pub(crate) fn refit_leaf(mesh: &TriangleMesh, ids: &[u32], block: &mut [f32]) -> Aabb {
    let mut triangles = [Triangle::default(); MAX_WIDE_LEAF];
    let triangles = &mut triangles[..ids.len()];
    let mut bounds = Aabb::EMPTY;
    for (triangle, &id) in triangles.iter_mut().zip(ids) {
        *triangle = mesh.triangle(id as usize);
        bounds = bounds.union(triangle.bounds());
    }
    write_leaf_in_lanes(block, triangles);
    bounds
}

#[inline(always)]
fn write_lanes<const LANES: usize>(block: &mut [f32], triangles: &[Triangle]) {
    let count = triangles.len();
    let mut corners = [[[0.0f64; LANES]; 3]; 3];
    for (lane, triangle) in triangles.iter().enumerate() {
        for (corner, point) in corners.iter_mut().zip(&triangle.0) {
            for (axis, numbers) in corner.iter_mut().enumerate() {
                numbers[lane] = f64::from(point[axis]);
            }
        }
    }
    let mut rows = [[0.0f32; LANES]; LEAF_ROWS];
    let mut is_certain = [false; LANES];
    for lane in 0..LANES {
        let [a, b, c] = [0, 1, 2]
            .map(|i: usize| [corners[i][0][lane], corners[i][1][lane], corners[i][2][lane]]);
        let (ab, ac) = (minus(b, a), minus(c, a));
        let normal = cross(ab, ac);
        let mut largest = 0.0;
        for component in [ab[0], ab[1], ab[2], ac[0], ac[1], ac[2]] {
            let size = component.abs();
            largest = if size > largest { size } else { largest };
        }
        let scale = f64::from_bits(((largest.to_bits() >> 52) + 1) << 52);
        let squared = dot(normal, normal);
        let lengths = dot(ab, ab) * dot(ac, ac);
        // Where it is not, branches decide, one triangle at a time.
        is_certain[lane] = (squared > lengths * LEAST_SINE_SQUARED) & (squared > LEAST_SQUARED);
        let shrink = reciprocal_of_power(scale);
        let unit = inverse_sqrt(squared);
        for axis in 0..3 {
            rows[axis][lane] = a[axis] as f32;
            rows[3 + axis][lane] = (ab[axis] * -shrink) as f32;
            rows[6 + axis][lane] = (ac[axis] * shrink) as f32;
            rows[9 + axis][lane] = (normal[axis] * unit) as f32;
        }
        rows[12][lane] = (squared * unit * shrink) as f32;
    }
    for (row, numbers) in rows.iter().enumerate() {
        let rest = &mut block[row * count..];
        // All lanes where there is room, which is quicker: the rows that follow overwrite the unused ones.
        match rest.first_chunk_mut() {
            Some(all) => *all = *numbers,
            None => rest[..count].copy_from_slice(&numbers[..count]),
        }
    }
    for (lane, triangle) in triangles.iter().enumerate() {
        if !is_certain[lane] {
            for (row, number) in leaf_numbers(triangle).into_iter().enumerate() {
                block[row * count + lane] = number;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use crate::vectorized::vectorized;

    #[test]
    fn lanes_write_the_same_bits() {
        let mut random = Random::new(0xb1);
        let mut doubtful = 0;
        for round in 0..20_000 {
            let count = 1 + round % WIDTH;
            let exponent = [-149, -130, -60, -20, 0, 0, 10, 60, 120][round % 9];
            let scale = f64::from(exponent).exp2() as f32;
            let mut triangles = [Triangle::default(); WIDTH];
            for triangle in &mut triangles[..count] {
                let [a, b, c] = [0; 3].map(|_| random.point() * scale);
                *triangle = match random.bits() % 6 {
                    0 => Triangle([a, a, b]),
                    1 => Triangle([a, b, a.lerp(b, 0.5)]),
                    2 => Triangle([a, b, b + (c - b) * 1e-6]),
                    3 => Triangle([a; 3]),
                    _ => Triangle([a, b, c]),
                };
            }
            let triangles = &triangles[..count];
            let mut simple = vec![0.0; count * LEAF_ROWS];
            let mut lanes = simple.clone();
            write_leaf(&mut simple, triangles);
            vectorized(
                #[inline(always)]
                || write_leaf_in_lanes(&mut lanes, triangles),
            );
            let bits = |block: &[f32]| block.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&simple), bits(&lanes), "{triangles:?}");
            doubtful += usize::from(simple[12 * count..].iter().any(|&height| height <= 0.0));
        }
        assert!(doubtful > 1000, "{doubtful}");
    }
}

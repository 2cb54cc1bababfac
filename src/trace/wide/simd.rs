//! The vector operations that the kernels are written in, and their portable twin.
//!
//! Kernels are generic over [`Simd`] and [`Wide`], so that each exists once. Operations are those of
//! IEEE 754, the same bits from every implementation, but for [`mul_add`](Vector::mul_add) and
//! [`mul_sub`](Vector::mul_sub), which may round once or twice: what is computed with them allows
//! for either.

use super::octants::WORD;
use super::rays::{Bits, Row, STREAM};
use super::stack::Slots;
use crate::ray::Ray;
use crate::tree::ChildRef;

/// Numbers that are computed at once where one ray is tested against several things.
pub(super) const LANES: usize = 8;

/// Operations on all numbers of a register.
pub(super) trait Vector: Copy {
    type Floats: Copy;
    type Mask: Copy;

    fn splat(self, value: f32) -> Self::Floats;
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// `a * b + c`, rounded once or twice.
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// `a * b - c`, rounded once or twice.
    fn mul_sub(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// `a < b ? a : b`: `b` if either is NaN.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// `a > b ? a : b`: `b` if either is NaN.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn abs(self, a: Self::Floats) -> Self::Floats;
    /// `|a| > |b| ? |a| : |b|`; neither is NaN.
    #[inline(always)]
    fn larger_size(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        self.max(self.abs(a), self.abs(b))
    }
    /// `a`, negated where `sign` has the sign bit.
    fn flip_sign(self, a: Self::Floats, sign: Self::Floats) -> Self::Floats;
    fn less(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    fn less_equal(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    /// `!(a < b)`: also where either is NaN.
    fn not_less(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    /// [`less`](Self::less) where `mask` is.
    #[inline(always)]
    fn less_where(self, mask: Self::Mask, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        self.both(mask, self.less(a, b))
    }
    /// [`not_less`](Self::not_less) where `mask` is.
    #[inline(always)]
    fn not_less_where(self, mask: Self::Mask, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        self.both(mask, self.not_less(a, b))
    }
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn either(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Does `work` with this instruction set enabled; what is inlined into it is compiled for it.
    fn run<R>(self, work: impl FnOnce() -> R) -> R;
    /// One bit for each lane, from the lowest on.
    fn bits(self, mask: Self::Mask) -> u64;
    /// The least of all numbers, and the most; none is NaN.
    fn least(self, a: Self::Floats) -> f32;
    fn most(self, a: Self::Floats) -> f32;

    #[inline(always)]
    fn dot(self, a: [Self::Floats; 3], b: [Self::Floats; 3]) -> Self::Floats {
        self.mul_add(a[2], b[2], self.mul_add(a[1], b[1], self.mul(a[0], b[0])))
    }
    #[inline(always)]
    fn cross(self, a: [Self::Floats; 3], b: [Self::Floats; 3]) -> [Self::Floats; 3] {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            self.mul_sub(a[j], b[k], self.mul(a[k], b[j]))
        })
    }
}

/// Operations on eight numbers.
pub(super) trait Simd: Vector {
    fn load(self, from: &[f32; LANES]) -> Self::Floats;
    fn store(self, to: &mut [f32; LANES], value: Self::Floats);
    /// The numbers of eight rays: origins, starts of intervals, directions, ends of intervals.
    fn rays(self, rays: [&Ray; LANES]) -> [Self::Floats; LANES];
    /// Bit `i` of byte `r` becomes bit `r` of word `i`.
    fn transpose(self, bytes: &[u8; 64]) -> [u64; LANES];
    /// Writes the children that have a bit, the one of the highest bit first, and whatever after them.
    fn pick(self, children: &[ChildRef; LANES], bits: u32, to: &mut [ChildRef; LANES]);
    /// As [`pick`](Self::pick), of numbers.
    fn pick_numbers(self, numbers: &[f32; LANES], bits: u32, to: &mut [f32; LANES]);
    /// Twice a ray's origin, twice its direction, and where it starts and ends, four times each: of each four
    /// numbers the last one is something else.
    fn start_and_end(self, ray: &Ray) -> [Self::Floats; 3];
    /// Of numbers taken as integers, which takes a fraction of the time: right where neither is negative, nor
    /// NaN; a number with a sign is less than any without.
    fn quick_max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// As [`quick_max`](Self::quick_max); one of them with a sign if any has one.
    fn quick_min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// As [`quick_max`](Self::quick_max), one bit for each lane; what lies above the eight is not zero.
    fn quick_less_equal(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Has what lies at the address brought near, if the processor can.
    #[inline(always)]
    fn prefetch<T>(self, _place: &T) {}
    /// Has what lies at any address brought nearer than memory, if there is something and the processor can.
    #[inline(always)]
    fn prefetch_ahead<T>(self, _place: *const T) {}
    /// The signs of a ray's direction, one bit for each axis.
    #[inline(always)]
    fn octant(self, ray: &Ray) -> u8 {
        let d = ray.direction;
        (d.x.to_bits() >> 31 | d.y.to_bits() >> 31 << 1 | d.z.to_bits() >> 31 << 2) as u8
    }
}

/// Operations on the numbers of a group of rays: as many as a register holds.
pub(super) trait Wide: Vector {
    /// Rays of a group: divides 64, so that each is in one half of a stream.
    const GROUP: usize;
    /// For each child of a node the rays that meet it, one bit each.
    type Words: Copy;
    /// Ray `index` meets some children as well, one bit each.
    fn with_ray(self, words: Self::Words, children: u32, index: usize) -> Self::Words;
    /// Writes those of some children, one bit each, that one of the rays `here` meets, and which of
    /// these do, the last child first, and whatever after them; returns how many there are.
    fn unload(
        self,
        words: Self::Words,
        here: Bits,
        children: &[ChildRef; LANES],
        some: u32,
        to: Slots<'_>,
    ) -> usize;
    /// Groups with an active ray, one bit each.
    #[inline(always)]
    fn groups(self, active: Bits) -> u32 {
        let mut groups = 0;
        for group in 0..STREAM / Self::GROUP {
            let of_group = active >> (group * Self::GROUP) & ((1 << Self::GROUP) - 1);
            groups |= u32::from(of_group != 0) << group;
        }
        groups
    }
    /// The numbers of one group.
    fn load(self, row: &Row, group: usize) -> Self::Floats;
    fn store(self, row: &mut Row, group: usize, value: Self::Floats);
    /// The words of children: their lower halves, their upper halves, and those that all rays meet, one bit
    /// each.
    fn words(self, words: [[u64; LANES]; 2], all: u32) -> Self::Words;
    /// Lanes of a group, one for each lane.
    type Lanes: Copy;
    /// The first `GROUP / 4` of some rays of a group, one bit each: each in four lanes. Whatever there is where
    /// there are fewer.
    fn four_of_each(self, rays: u64) -> Self::Lanes;
    /// The numbers of these rays of a group.
    fn load_lanes(self, row: &Row, group: usize, lanes: Self::Lanes) -> Self::Floats;
    /// Four numbers again and again.
    fn repeat(self, four: &[f32; 4]) -> Self::Floats;
    /// Writes the numbers of the bits that are set, counted from `first`, and whatever after them; returns how
    /// many there are.
    #[inline(always)]
    fn numbers_of_bits(self, bits: u64, first: u16, to: &mut [u16; WORD]) -> usize {
        let mut len = 0;
        // Eight bits at a time and without branches, as no processor foresees them.
        for (byte, bits) in bits.to_le_bytes().into_iter().enumerate() {
            let first = first + (byte * LANES) as u16;
            let numbers = NUMBERS_OF_BITS[usize::from(bits)].map(|n| first + u16::from(n));
            to[len..len + LANES].copy_from_slice(&numbers);
            len += bits.count_ones() as usize;
        }
        len
    }
}

/// For each byte the numbers of the bits that are set, and zeros.
static NUMBERS_OF_BITS: [[u8; LANES]; 256] = {
    let mut all = [[0; LANES]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut len) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][len] = bit as u8;
                len += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
};

/// Plain arrays, for every processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

type Array = [f32; LANES];

#[inline(always)]
fn zip(a: Array, b: Array, f: impl Fn(f32, f32) -> f32) -> Array {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn compare(a: Array, b: Array, f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..LANES).fold(0, |bits, i| bits | u32::from(f(a[i], b[i])) << i)
}

impl Vector for Portable {
    type Floats = Array;
    type Mask = u32;

    #[inline(always)]
    fn run<R>(self, work: impl FnOnce() -> R) -> R {
        work()
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Array {
        [value; LANES]
    }
    #[inline(always)]
    fn add(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, a: Array, b: Array, c: Array) -> Array {
        zip(zip(a, b, |a, b| a * b), c, |product, c| product + c)
    }
    #[inline(always)]
    fn mul_sub(self, a: Array, b: Array, c: Array) -> Array {
        zip(zip(a, b, |a, b| a * b), c, |product, c| product - c)
    }
    #[inline(always)]
    fn min(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Array) -> Array {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn flip_sign(self, a: Array, sign: Array) -> Array {
        zip(a, sign, |a, sign| f32::from_bits(a.to_bits() ^ (sign.to_bits() & 1 << 31)))
    }
    #[inline(always)]
    fn less(self, a: Array, b: Array) -> u32 {
        compare(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn less_equal(self, a: Array, b: Array) -> u32 {
        compare(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn not_less(self, a: Array, b: Array) -> u32 {
        self.less(a, b) ^ ((1 << LANES) - 1)
    }
    #[inline(always)]
    fn both(self, a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    fn either(self, a: u32, b: u32) -> u32 {
        a | b
    }
    #[inline(always)]
    fn bits(self, mask: u32) -> u64 {
        mask.into()
    }
    #[inline(always)]
    fn least(self, a: Array) -> f32 {
        a.into_iter().fold(f32::INFINITY, |least, a| if a < least { a } else { least })
    }
    #[inline(always)]
    fn most(self, a: Array) -> f32 {
        a.into_iter().fold(f32::NEG_INFINITY, |most, a| if a > most { a } else { most })
    }
}

impl Simd for Portable {
    #[inline(always)]
    fn quick_max(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| f32::from_bits(i32::max(a.to_bits() as i32, b.to_bits() as i32) as u32))
    }
    #[inline(always)]
    fn quick_min(self, a: Array, b: Array) -> Array {
        zip(a, b, |a, b| f32::from_bits(i32::min(a.to_bits() as i32, b.to_bits() as i32) as u32))
    }
    #[inline(always)]
    fn quick_less_equal(self, a: Array, b: Array) -> u32 {
        !compare(a, b, |a, b| a.to_bits() as i32 > b.to_bits() as i32)
    }
    #[inline(always)]
    fn load(self, from: &Array) -> Array {
        *from
    }
    #[inline(always)]
    fn store(self, to: &mut Array, value: Array) {
        *to = value;
    }
    #[inline(always)]
    fn rays(self, rays: [&Ray; LANES]) -> [Array; LANES] {
        let mut rows = [[0.0; LANES]; LANES];
        for (row, ray) in rows.iter_mut().zip(rays) {
            *row = numbers(ray);
        }
        std::array::from_fn(|column| std::array::from_fn(|ray| rows[ray][column]))
    }
    #[inline(always)]
    fn pick(self, children: &[ChildRef; LANES], bits: u32, to: &mut [ChildRef; LANES]) {
        pick(children, bits, to);
    }
    #[inline(always)]
    fn pick_numbers(self, numbers: &Array, bits: u32, to: &mut Array) {
        pick(numbers, bits, to);
    }
    #[inline(always)]
    fn start_and_end(self, ray: &Ray) -> [Array; 3] {
        let [ox, oy, oz, start, dx, dy, dz, end] = numbers(ray);
        let ends = [start, start, start, start, end, end, end, end];
        [[ox, oy, oz, start, ox, oy, oz, start], [dx, dy, dz, end, dx, dy, dz, end], ends]
    }
    #[inline(always)]
    fn transpose(self, bytes: &[u8; 64]) -> [u64; LANES] {
        let mut words = [0; LANES];
        for (group, bytes) in bytes.as_chunks::<8>().0.iter().enumerate() {
            let turned = transpose_8x8(u64::from_le_bytes(*bytes));
            for (word, byte) in words.iter_mut().zip(turned.to_le_bytes()) {
                *word |= u64::from(byte) << (8 * group);
            }
        }
        words
    }
}

impl Wide for Portable {
    const GROUP: usize = LANES;
    /// Their lower and their upper halves.
    type Words = [[u64; LANES]; 2];

    #[inline(always)]
    fn words(self, mut words: [[u64; LANES]; 2], all: u32) -> [[u64; LANES]; 2] {
        for half in &mut words {
            for (slot, word) in half.iter_mut().enumerate() {
                *word |= 0u64.wrapping_sub(u64::from(all >> slot & 1));
            }
        }
        words
    }
    #[inline(always)]
    fn with_ray(
        self,
        mut words: [[u64; LANES]; 2],
        children: u32,
        index: usize,
    ) -> [[u64; LANES]; 2] {
        for (slot, word) in words[index / 64 % 2].iter_mut().enumerate() {
            *word |= u64::from(children >> slot & 1) << (index % 64);
        }
        words
    }
    #[inline(always)]
    fn unload(
        self,
        [lower, upper]: [[u64; LANES]; 2],
        here: Bits,
        children: &[ChildRef; LANES],
        some: u32,
        to: Slots<'_>,
    ) -> usize {
        let mut len = 0;
        for slot in (0..LANES).rev() {
            let (lower, upper) = (lower[slot] & here as u64, upper[slot] & (here >> 64) as u64);
            // At most seven have been written.
            to.0[len % LANES] = children[slot];
            to.1[0][len % LANES] = lower;
            to.1[1][len % LANES] = upper;
            len += usize::from(lower | upper != 0 && some >> slot & 1 != 0);
        }
        len
    }

    type Lanes = [usize; LANES];

    #[inline(always)]
    fn four_of_each(self, rays: u64) -> [usize; LANES] {
        let others = rays & rays.wrapping_sub(1);
        let [first, second] = [rays, others].map(|rays| rays.trailing_zeros() as usize % LANES);
        [first, first, first, first, second, second, second, second]
    }
    #[inline(always)]
    fn load_lanes(self, row: &Row, group: usize, lanes: [usize; LANES]) -> Array {
        lanes.map(|lane| row.group(group)[lane])
    }
    #[inline(always)]
    fn repeat(self, &[a, b, c, d]: &[f32; 4]) -> Array {
        [a, b, c, d, a, b, c, d]
    }
    #[inline(always)]
    fn load(self, row: &Row, group: usize) -> Self::Floats {
        Simd::load(self, row.group(group))
    }
    #[inline(always)]
    fn store(self, row: &mut Row, group: usize, value: Self::Floats) {
        Simd::store(self, row.group_mut(group), value);
    }
}

#[inline(always)]
fn pick<T: Copy>(all: &[T; LANES], bits: u32, to: &mut [T; LANES]) {
    let mut len = 0;
    for slot in (0..LANES).rev() {
        to[len % LANES] = all[slot];
        len += (bits >> slot & 1) as usize;
    }
}

/// A ray's numbers as they lie in memory.
#[inline(always)]
pub(super) fn numbers(ray: &Ray) -> Array {
    let Ray { origin: o, t_min, direction: d, t_max } = *ray;
    [o.x, o.y, o.z, t_min, d.x, d.y, d.z, t_max]
}

/// Bit `i` of byte `j` becomes bit `j` of byte `i` (Warren, "Hacker's Delight", 2002).
#[inline(always)]
fn transpose_8x8(mut x: u64) -> u64 {
    for (shift, mask) in
        [(7, 0x00aa_00aa_00aa_00aa), (14, 0x0000_cccc_0000_cccc), (28, 0x0000_0000_f0f0_f0f0)]
    {
        let t = (x ^ (x >> shift)) & mask;
        x ^= t ^ (t << shift);
    }
    x
}

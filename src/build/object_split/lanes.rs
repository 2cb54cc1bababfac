//! The vector operations that sets are split with: eight numbers at once, the same bits from every
//! implementation.

use glam::Vec4;

/// Eight numbers as they lie in memory.
pub(super) type Row = [f32; 8];

/// Operations on eight numbers.
pub(super) trait Lanes: Copy {
    type Eight: Copy;
    /// One answer for all eight.
    type Mask: Copy;

    fn load(self, from: &Row) -> Self::Eight;
    fn store(self, to: &mut Row, value: Self::Eight);
    fn splat(self, value: f32) -> Self::Eight;
    fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// `a < b ? a : b`: `b` if either is NaN.
    fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// A box and how many are in it, its last lane: with one more in it, whose last lane is infinite.
    fn add_to_box(self, all: Self::Eight, one: Self::Eight) -> Self::Eight;
    /// The upper four in the place of the lower four, and the other way round.
    fn swap_halves(self, a: Self::Eight) -> Self::Eight;
    /// One of the lower four in all lanes.
    fn spread(self, a: Self::Eight, lane: usize) -> Self::Eight;
    /// The integers below the first three, which are at least 0 and below 2^22.
    fn integers(self, a: Self::Eight) -> [u32; 3];
    /// Whether `a` is less than `b`: of numbers that are the same in all lanes.
    fn is_less(self, a: Self::Eight, b: Self::Eight) -> Self::Mask;
    /// The opposite answer.
    fn not(self, mask: Self::Mask) -> Self::Mask;
    /// `a`, or NaN if the mask is set.
    fn unless(self, mask: Self::Mask, a: Self::Eight) -> Self::Eight;
    /// 1 if the mask is set, 0 if it is not.
    fn bit(self, mask: Self::Mask) -> usize;
}

/// The vectors that every processor of an architecture has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

impl Lanes for Portable {
    type Eight = [Vec4; 2];
    type Mask = glam::BVec4A;

    #[inline(always)]
    fn load(self, from: &Row) -> [Vec4; 2] {
        [Vec4::from_slice(&from[..4]), Vec4::from_slice(&from[4..])]
    }
    #[inline(always)]
    fn store(self, to: &mut Row, [lower, upper]: [Vec4; 2]) {
        lower.write_to_slice(&mut to[..4]);
        upper.write_to_slice(&mut to[4..]);
    }
    #[inline(always)]
    fn splat(self, value: f32) -> [Vec4; 2] {
        [Vec4::splat(value); 2]
    }
    #[inline(always)]
    fn sub(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        [a[0] - b[0], a[1] - b[1]]
    }
    #[inline(always)]
    fn mul(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        [a[0] * b[0], a[1] * b[1]]
    }
    #[inline(always)]
    fn min(self, a: [Vec4; 2], b: [Vec4; 2]) -> [Vec4; 2] {
        let less = |a: Vec4, b: Vec4| Vec4::select(a.cmplt(b), a, b);
        if cfg!(target_arch = "x86_64") {
            // Which is what its instruction does.
            [a[0].min(b[0]), a[1].min(b[1])]
        } else {
            [less(a[0], b[0]), less(a[1], b[1])]
        }
    }
    #[inline(always)]
    fn add_to_box(self, all: [Vec4; 2], one: [Vec4; 2]) -> [Vec4; 2] {
        let [lower, upper] = self.min(all, one);
        [lower, upper + Vec4::new(-0.0, -0.0, -0.0, 1.0)]
    }
    #[inline(always)]
    fn swap_halves(self, [lower, upper]: [Vec4; 2]) -> [Vec4; 2] {
        [upper, lower]
    }
    #[inline(always)]
    fn spread(self, [lower, _]: [Vec4; 2], lane: usize) -> [Vec4; 2] {
        [Vec4::splat(lower.to_array()[lane & 3]); 2]
    }
    #[inline(always)]
    fn integers(self, a: [Vec4; 2]) -> [u32; 3] {
        let [x, y, z, _] = a[0].to_array();
        // By way of signed ones, to which there is an instruction.
        [x, y, z].map(|number| number as i32 as u32)
    }
    #[inline(always)]
    fn is_less(self, a: [Vec4; 2], b: [Vec4; 2]) -> glam::BVec4A {
        a[0].cmplt(b[0])
    }
    #[inline(always)]
    fn not(self, mask: glam::BVec4A) -> glam::BVec4A {
        !mask
    }
    #[inline(always)]
    fn unless(self, mask: glam::BVec4A, a: [Vec4; 2]) -> [Vec4; 2] {
        a.map(|half| Vec4::select(mask, Vec4::NAN, half))
    }
    #[inline(always)]
    fn bit(self, mask: glam::BVec4A) -> usize {
        (mask.bitmask() & 1) as usize
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    #![allow(unsafe_code, reason = "processor instructions that need a check at run time")]

    use super::{Lanes, Row};
    pub(crate) use crate::processor::Avx2;
    use std::arch::x86_64::*;

    /// Calls an intrinsic of AVX2 without memory operands.
    macro_rules! avx2 {
        ($($call:tt)*) => {
            // SAFETY: `self` shows that the processor has the instruction, which touches registers only.
            unsafe { $($call)* }
        };
    }

    impl Lanes for Avx2 {
        type Eight = __m256;
        type Mask = __m256;

        #[inline(always)]
        fn load(self, from: &Row) -> __m256 {
            // SAFETY: as in `avx2!`; the eight numbers behind the reference may be read.
            unsafe { _mm256_loadu_ps(from.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, to: &mut Row, value: __m256) {
            // SAFETY: as in `avx2!`; the eight numbers behind the reference may be written.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) }
        }
        #[inline(always)]
        fn splat(self, value: f32) -> __m256 {
            avx2!(_mm256_set1_ps(value))
        }
        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            avx2!(_mm256_sub_ps(a, b))
        }
        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            avx2!(_mm256_mul_ps(a, b))
        }
        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            avx2!(_mm256_min_ps(a, b))
        }
        #[inline(always)]
        fn add_to_box(self, all: __m256, one: __m256) -> __m256 {
            avx2! {
                // Nothing is changed by a zero below zero.
                let count = _mm256_setr_ps(-0.0, -0.0, -0.0, -0.0, -0.0, -0.0, -0.0, 1.0);
                _mm256_add_ps(_mm256_min_ps(all, one), count)
            }
        }
        #[inline(always)]
        fn swap_halves(self, a: __m256) -> __m256 {
            avx2!(_mm256_permute2f128_ps::<1>(a, a))
        }
        #[inline(always)]
        fn spread(self, a: __m256, lane: usize) -> __m256 {
            avx2!(_mm256_permutevar8x32_ps(a, _mm256_set1_epi32((lane & 3) as i32)))
        }
        #[inline(always)]
        fn integers(self, a: __m256) -> [u32; 3] {
            avx2! {
                let integers = _mm_cvttps_epi32(_mm256_castps256_ps128(a));
                let first_two = _mm_cvtsi128_si64(integers) as u64;
                [first_two as u32, (first_two >> 32) as u32, _mm_extract_epi32::<2>(integers) as u32]
            }
        }
        #[inline(always)]
        fn is_less(self, a: __m256, b: __m256) -> __m256 {
            avx2!(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b))
        }
        #[inline(always)]
        fn not(self, mask: __m256) -> __m256 {
            avx2!(_mm256_xor_ps(mask, _mm256_castsi256_ps(_mm256_set1_epi32(-1))))
        }
        #[inline(always)]
        fn unless(self, mask: __m256, a: __m256) -> __m256 {
            // All ones are a NaN.
            avx2!(_mm256_or_ps(mask, a))
        }
        #[inline(always)]
        fn bit(self, mask: __m256) -> usize {
            (avx2!(_mm_cvtsi128_si32(_mm_castps_si128(_mm256_castps256_ps128(mask)))) & 1) as usize
        }
    }
}

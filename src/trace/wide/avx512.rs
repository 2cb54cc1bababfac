//! The operations on groups of sixteen rays of x86-64 processors with AVX-512.
#![allow(unsafe_code, reason = "processor instructions that need a check at run time")]

use super::octants::WORD;
use super::rays::{Bits, Row};
use super::simd::{LANES, Vector, Wide};
use super::stack::Slots;
pub(super) use crate::processor::Avx512;
use crate::tree::ChildRef;
use std::arch::x86_64::*;

/// Calls an intrinsic of AVX-512 without memory operands.
macro_rules! avx512 {
    ($($call:tt)*) => {
        // SAFETY: `self` shows that the processor has the instruction, which touches registers only.
        unsafe { $($call)* }
    };
}

impl Vector for Avx512 {
    type Floats = __m512;
    type Mask = __mmask16;

    #[inline(always)]
    fn run<R>(self, work: impl FnOnce() -> R) -> R {
        Self::run(self, work)
    }
    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        avx512!(_mm512_set1_ps(value))
    }
    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_add_ps(a, b))
    }
    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_sub_ps(a, b))
    }
    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_mul_ps(a, b))
    }
    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_div_ps(a, b))
    }
    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        avx512!(_mm512_fmadd_ps(a, b, c))
    }
    #[inline(always)]
    fn mul_sub(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        avx512!(_mm512_fmsub_ps(a, b, c))
    }
    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_min_ps(a, b))
    }
    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        avx512!(_mm512_max_ps(a, b))
    }
    #[inline(always)]
    fn abs(self, a: __m512) -> __m512 {
        avx512!(_mm512_abs_ps(a))
    }
    #[inline(always)]
    fn larger_size(self, a: __m512, b: __m512) -> __m512 {
        /// The larger one of the sizes, without a sign.
        const LARGER_SIZE: i32 = 0b1011;
        avx512!(_mm512_range_ps::<LARGER_SIZE>(a, b))
    }
    #[inline(always)]
    fn flip_sign(self, a: __m512, sign: __m512) -> __m512 {
        /// `a ^ (b & c)`.
        const FLIP: i32 = 0xf0 ^ (0xcc & 0xaa);
        avx512! {
            let (a, sign) = (_mm512_castps_si512(a), _mm512_castps_si512(sign));
            let sign_bit = _mm512_set1_epi32(i32::MIN);
            _mm512_castsi512_ps(_mm512_ternarylogic_epi32::<FLIP>(a, sign, sign_bit))
        }
    }
    #[inline(always)]
    fn less(self, a: __m512, b: __m512) -> __mmask16 {
        avx512!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b))
    }
    #[inline(always)]
    fn less_equal(self, a: __m512, b: __m512) -> __mmask16 {
        avx512!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b))
    }
    #[inline(always)]
    fn not_less(self, a: __m512, b: __m512) -> __mmask16 {
        avx512!(_mm512_cmp_ps_mask::<_CMP_NLT_UQ>(a, b))
    }
    #[inline(always)]
    fn less_where(self, mask: __mmask16, a: __m512, b: __m512) -> __mmask16 {
        avx512!(_mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(mask, a, b))
    }
    #[inline(always)]
    fn not_less_where(self, mask: __mmask16, a: __m512, b: __m512) -> __mmask16 {
        avx512!(_mm512_mask_cmp_ps_mask::<_CMP_NLT_UQ>(mask, a, b))
    }
    #[inline(always)]
    fn both(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }
    #[inline(always)]
    fn either(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }
    #[inline(always)]
    fn bits(self, mask: __mmask16) -> u64 {
        mask.into()
    }
    #[inline(always)]
    fn least(self, a: __m512) -> f32 {
        avx512!(_mm512_reduce_min_ps(a))
    }
    #[inline(always)]
    fn most(self, a: __m512) -> f32 {
        avx512!(_mm512_reduce_max_ps(a))
    }
}

impl Wide for Avx512 {
    const GROUP: usize = 16;
    /// Their lower and their upper halves.
    type Words = [__m512i; 2];

    #[inline(always)]
    fn words(self, words: [[u64; LANES]; 2], all: u32) -> [__m512i; 2] {
        let [lower, upper] = &words;
        // SAFETY: as in `avx512!`; the eight words behind each reference may be read.
        unsafe {
            let ones = _mm512_set1_epi64(-1);
            let lower = _mm512_loadu_si512(lower.as_ptr().cast());
            let upper = _mm512_loadu_si512(upper.as_ptr().cast());
            let all = all as __mmask8;
            [_mm512_mask_mov_epi64(lower, all, ones), _mm512_mask_mov_epi64(upper, all, ones)]
        }
    }
    #[inline(always)]
    fn with_ray(self, [lower, upper]: [__m512i; 2], children: u32, index: usize) -> [__m512i; 2] {
        let bit = 1i64 << (index % 64);
        let is_upper = (index >> 6 & 1) as i64;
        avx512! {
            let in_lower = _mm512_set1_epi64(bit & (is_upper - 1));
            let in_upper = _mm512_set1_epi64(bit & -is_upper);
            [
                _mm512_mask_or_epi64(lower, children as __mmask8, lower, in_lower),
                _mm512_mask_or_epi64(upper, children as __mmask8, upper, in_upper),
            ]
        }
    }
    #[inline(always)]
    fn groups(self, active: Bits) -> u32 {
        avx512! {
            let active = _mm_set_epi64x((active >> 64) as i64, active as i64);
            _mm_test_epi16_mask(active, active).into()
        }
    }
    #[inline(always)]
    fn unload(
        self,
        [lower, upper]: [__m512i; 2],
        here: Bits,
        children: &[ChildRef; LANES],
        some: u32,
        to: Slots<'_>,
    ) -> usize {
        // SAFETY: as in `avx512!`; what is behind the references may be read and written, eight words each,
        // of 32 bits for children.
        unsafe {
            let some = some as __mmask8;
            let lower = _mm512_maskz_and_epi64(some, lower, _mm512_set1_epi64(here as i64));
            let upper = _mm512_maskz_and_epi64(some, upper, _mm512_set1_epi64((here >> 64) as i64));
            let last_first = _mm512_setr_epi64(7, 6, 5, 4, 3, 2, 1, 0);
            let lower = _mm512_permutexvar_epi64(last_first, lower);
            let upper = _mm512_permutexvar_epi64(last_first, upper);
            let there = _mm512_test_epi64_mask(lower, lower) | _mm512_test_epi64_mask(upper, upper);
            let children = _mm256_loadu_si256(children.as_ptr().cast());
            let children =
                _mm256_permutevar8x32_epi32(children, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
            let children = _mm256_maskz_compress_epi32(there, children);
            _mm256_storeu_si256(to.0.as_mut_ptr().cast(), children);
            let [to_lower, to_upper] = to.1;
            let lower = _mm512_maskz_compress_epi64(there, lower);
            let upper = _mm512_maskz_compress_epi64(there, upper);
            _mm512_storeu_si512(to_lower.as_mut_ptr().cast(), lower);
            _mm512_storeu_si512(to_upper.as_mut_ptr().cast(), upper);
            there.count_ones() as usize
        }
    }

    #[inline(always)]
    fn numbers_of_bits(self, bits: u64, first: u16, to: &mut [u16; WORD]) -> usize {
        let mut len = 0;
        for quarter in 0..4 {
            let bits = (bits >> (16 * quarter)) as u16;
            let first = i32::from(first) + 16 * quarter;
            let to: &mut [u16; 16] = (&mut to[len..len + 16]).try_into().expect("sixteen");
            // SAFETY: as in `avx512!`; the sixteen numbers behind the reference may be written.
            unsafe {
                let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
                let numbers = _mm512_add_epi32(lanes, _mm512_set1_epi32(first));
                let numbers = _mm512_maskz_compress_epi32(bits, numbers);
                _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm512_cvtepi32_epi16(numbers));
            }
            len += bits.count_ones() as usize;
        }
        len
    }

    type Lanes = __m512i;

    #[inline(always)]
    fn four_of_each(self, rays: u64) -> __m512i {
        avx512! {
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let first = _mm512_maskz_compress_epi32(rays as __mmask16, lanes);
            let each = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            _mm512_permutexvar_epi32(each, first)
        }
    }
    #[inline(always)]
    fn load_lanes(self, row: &Row, group: usize, lanes: __m512i) -> __m512 {
        avx512!(_mm512_permutexvar_ps(lanes, self.load(row, group)))
    }
    #[inline(always)]
    fn repeat(self, four: &[f32; 4]) -> __m512 {
        // SAFETY: as in `avx512!`; the four numbers behind the reference may be read.
        unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(four.as_ptr())) }
    }
    #[inline(always)]
    fn load(self, row: &Row, group: usize) -> __m512 {
        let numbers: &[f32; Self::GROUP] = &row.0.as_chunks().0[group];
        // SAFETY: as in `avx512!`; the sixteen numbers behind the reference may be read.
        unsafe { _mm512_loadu_ps(numbers.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, row: &mut Row, group: usize, value: __m512) {
        let numbers: &mut [f32; Self::GROUP] = &mut row.0.as_chunks_mut().0[group];
        // SAFETY: as in `avx512!`; the sixteen numbers behind the reference may be written.
        unsafe { _mm512_storeu_ps(numbers.as_mut_ptr(), value) }
    }
}

//! The operations on groups of sixteen rays of x86-64 processors with AVX-512.
#![allow(unsafe_code, reason = "processor instructions that need a check at run time")]

use super::rays::Row;
use super::simd::{Vector, Wide};
pub(super) use crate::processor::Avx512;
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
    fn flip_sign(self, a: __m512, sign: __m512) -> __m512 {
        avx512!(_mm512_xor_ps(a, _mm512_and_ps(_mm512_set1_ps(-0.0), sign)))
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
}

impl Wide for Avx512 {
    const GROUP: usize = 16;

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

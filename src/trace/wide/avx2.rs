//! The vector operations of x86-64 processors with AVX2 and FMA.
#![allow(unsafe_code, reason = "processor instructions that need a check at run time")]

use super::rays::{Bits, Row};
use super::simd::{LANES, Simd, Vector, Wide, numbers};
use super::stack::Slots;
pub(super) use crate::processor::Avx2;
use crate::ray::Ray;
use crate::tree::ChildRef;
use std::arch::x86_64::*;

/// Calls an intrinsic of AVX2 or FMA without memory operands.
macro_rules! avx2 {
    ($($call:tt)*) => {
        // SAFETY: `self` shows that the processor has the instruction, which touches registers only.
        unsafe { $($call)* }
    };
}

impl Vector for Avx2 {
    type Floats = __m256;
    type Mask = __m256;

    #[inline(always)]
    fn run<R>(self, work: impl FnOnce() -> R) -> R {
        Self::run(self, work)
    }
    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        avx2!(_mm256_set1_ps(value))
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_add_ps(a, b))
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
    fn div(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_div_ps(a, b))
    }
    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        avx2!(_mm256_fmadd_ps(a, b, c))
    }
    #[inline(always)]
    fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        avx2!(_mm256_fmsub_ps(a, b, c))
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_min_ps(a, b))
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_max_ps(a, b))
    }
    #[inline(always)]
    fn abs(self, a: __m256) -> __m256 {
        avx2!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a))
    }
    #[inline(always)]
    fn flip_sign(self, a: __m256, sign: __m256) -> __m256 {
        avx2!(_mm256_xor_ps(a, _mm256_and_ps(_mm256_set1_ps(-0.0), sign)))
    }
    #[inline(always)]
    fn less(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b))
    }
    #[inline(always)]
    fn less_equal(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b))
    }
    #[inline(always)]
    fn not_less(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_cmp_ps::<_CMP_NLT_UQ>(a, b))
    }
    #[inline(always)]
    fn both(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_and_ps(a, b))
    }
    #[inline(always)]
    fn either(self, a: __m256, b: __m256) -> __m256 {
        avx2!(_mm256_or_ps(a, b))
    }
    #[inline(always)]
    fn bits(self, mask: __m256) -> u64 {
        u64::from(avx2!(_mm256_movemask_ps(mask)) as u32)
    }
    #[inline(always)]
    fn least(self, a: __m256) -> f32 {
        avx2! {
            let a = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            let a = _mm_min_ps(a, _mm_movehl_ps(a, a));
            _mm_cvtss_f32(_mm_min_ss(a, _mm_movehdup_ps(a)))
        }
    }
    #[inline(always)]
    fn most(self, a: __m256) -> f32 {
        avx2! {
            let a = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            let a = _mm_max_ps(a, _mm_movehl_ps(a, a));
            _mm_cvtss_f32(_mm_max_ss(a, _mm_movehdup_ps(a)))
        }
    }
}

impl Simd for Avx2 {
    #[inline(always)]
    fn quick_max(self, a: __m256, b: __m256) -> __m256 {
        avx2! {
            let (a, b) = (_mm256_castps_si256(a), _mm256_castps_si256(b));
            _mm256_castsi256_ps(_mm256_max_epi32(a, b))
        }
    }
    #[inline(always)]
    fn quick_min(self, a: __m256, b: __m256) -> __m256 {
        avx2! {
            let (a, b) = (_mm256_castps_si256(a), _mm256_castps_si256(b));
            _mm256_castsi256_ps(_mm256_min_epi32(a, b))
        }
    }
    #[inline(always)]
    fn quick_less_equal(self, a: __m256, b: __m256) -> u32 {
        avx2! {
            let (a, b) = (_mm256_castps_si256(a), _mm256_castps_si256(b));
            !_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b))) as u32
        }
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> __m256 {
        // SAFETY: as in `avx2!`; the eight numbers behind the reference may be read.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; LANES], value: __m256) {
        // SAFETY: as in `avx2!`; the eight numbers behind the reference may be written.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) }
    }
    #[inline(always)]
    fn rays(self, rays: [&Ray; LANES]) -> [__m256; LANES] {
        let mut rows = [self.splat(0.0); LANES];
        for (row, ray) in rows.iter_mut().zip(rays) {
            *row = Simd::load(self, &numbers(ray));
        }
        let [a, b, c, d, e, f, g, h] = rows;
        let (left, right) =
            (self.transpose_halves([a, b, c, d]), self.transpose_halves([e, f, g, h]));
        for column in 0..4 {
            let (left, right) = (left[column], right[column]);
            rows[column] = avx2!(_mm256_permute2f128_ps::<0x20>(left, right));
            rows[column + 4] = avx2!(_mm256_permute2f128_ps::<0x31>(left, right));
        }
        rows
    }
    #[inline(always)]
    fn transpose(self, bytes: &[u8; 64]) -> [u64; LANES] {
        let (first, second) = (bytes.as_ptr().cast(), bytes[32..].as_ptr().cast());
        // SAFETY: as in `avx2!`; the two halves of the array may be read.
        unsafe {
            let (mut low, mut high) = (_mm256_loadu_si256(first), _mm256_loadu_si256(second));
            let mut words = [0; LANES];
            for word in words.iter_mut().rev() {
                let (first, second) = (_mm256_movemask_epi8(low), _mm256_movemask_epi8(high));
                *word = u64::from(first as u32) | u64::from(second as u32) << 32;
                (low, high) = (_mm256_add_epi8(low, low), _mm256_add_epi8(high, high));
            }
            words
        }
    }
    #[inline(always)]
    fn pick(self, children: &[ChildRef; LANES], bits: u32, to: &mut [ChildRef; LANES]) {
        // SAFETY: as in `avx2!`; what is behind the references may be read and written, eight words of 32 bits
        // each.
        unsafe {
            let all = _mm256_loadu_si256(children.as_ptr().cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), self.picked(all, bits));
        }
    }
    #[inline(always)]
    fn pick_numbers(self, numbers: &[f32; LANES], bits: u32, to: &mut [f32; LANES]) {
        // SAFETY: as in `pick`.
        unsafe {
            let all = _mm256_loadu_si256(numbers.as_ptr().cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), self.picked(all, bits));
        }
    }
    #[inline(always)]
    fn start_and_end(self, ray: &Ray) -> [__m256; 3] {
        let ray = std::ptr::from_ref(ray).cast::<f32>();
        // SAFETY: as in `avx2!`; a ray is eight numbers, in the order of `numbers`.
        unsafe {
            let all = _mm256_loadu_ps(ray);
            let origin = _mm256_broadcast_ps(&*ray.cast());
            let direction = _mm256_broadcast_ps(&*ray.add(4).cast());
            [origin, direction, _mm256_permute_ps::<0b11_11_11_11>(all)]
        }
    }
    #[inline(always)]
    fn prefetch<T>(self, place: &T) {
        let place = std::ptr::from_ref(place).cast();
        // SAFETY: a hint, which reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place) }
    }
    #[inline(always)]
    fn prefetch_ahead<T>(self, place: *const T) {
        // SAFETY: a hint, which reads nothing, wherever that is.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(place.cast()) }
    }
    #[inline(always)]
    fn octant(self, ray: &Ray) -> u8 {
        let [.., x, y, z, t_max] = numbers(ray);
        (avx2!(_mm_movemask_ps(_mm_setr_ps(x, y, z, t_max))) & 7) as u8
    }
}

impl Wide for Avx2 {
    const GROUP: usize = LANES;
    /// Lower halves of the first four children and of the others, and upper halves of both.
    type Words = [[__m256i; 2]; 2];

    #[inline(always)]
    fn words(self, [lower, upper]: [[u64; LANES]; 2], all: u32) -> [[__m256i; 2]; 2] {
        let all = self.where_bits(all);
        [self.with_bits(lower, all), self.with_bits(upper, all)]
    }
    #[inline(always)]
    fn with_ray(
        self,
        [lower, upper]: [[__m256i; 2]; 2],
        children: u32,
        index: usize,
    ) -> [[__m256i; 2]; 2] {
        let picked = self.where_bits(children);
        let bit = 1i64 << (index % 64);
        let is_upper = (index >> 6 & 1) as i64;
        avx2! {
            let in_lower = _mm256_set1_epi64x(bit & (is_upper - 1));
            let in_upper = _mm256_set1_epi64x(bit & -is_upper);
            [
                [
                    _mm256_or_si256(lower[0], _mm256_and_si256(picked[0], in_lower)),
                    _mm256_or_si256(lower[1], _mm256_and_si256(picked[1], in_lower)),
                ],
                [
                    _mm256_or_si256(upper[0], _mm256_and_si256(picked[0], in_upper)),
                    _mm256_or_si256(upper[1], _mm256_and_si256(picked[1], in_upper)),
                ],
            ]
        }
    }
    #[inline(always)]
    fn groups(self, active: Bits) -> u32 {
        avx2! {
            let active = _mm_set_epi64x((active >> 64) as i64, active as i64);
            let none = _mm_cmpeq_epi8(active, _mm_setzero_si128());
            !_mm_movemask_epi8(none) as u32 & 0xffff
        }
    }
    #[inline(always)]
    fn unload(
        self,
        [lower, upper]: [[__m256i; 2]; 2],
        here: Bits,
        children: &[ChildRef; LANES],
        some: u32,
        to: Slots<'_>,
    ) -> usize {
        let picked = self.where_bits(some);
        let here = [here as u64, (here >> 64) as u64];
        let (first, there) = self.of_half([lower[0], upper[0]], picked[0], here);
        let (others, others_there) = self.of_half([lower[1], upper[1]], picked[1], here);
        self.pick(children, (there | others_there << 4) as u32, to.0);
        let len = others_there.count_ones() as usize;
        // At most four have been written.
        // SAFETY: as in `avx2!`; the eight numbers behind each reference of the table may be read, and four words
        // behind the other pointers written, as these are at least four before the end.
        unsafe {
            let order = _mm256_loadu_si256(WORDS_DOWNWARDS[there].as_ptr().cast());
            let order_of_others = _mm256_loadu_si256(WORDS_DOWNWARDS[others_there].as_ptr().cast());
            for ((to, first), others) in to.1.into_iter().zip(first).zip(others) {
                let others = _mm256_permutevar8x32_epi32(others, order_of_others);
                let first = _mm256_permutevar8x32_epi32(first, order);
                _mm256_storeu_si256(to.as_mut_ptr().cast(), others);
                _mm256_storeu_si256(to[len % 5..].as_mut_ptr().cast(), first);
            }
        }
        len + there.count_ones() as usize
    }
    type Lanes = __m256i;

    #[inline(always)]
    fn four_of_each(self, rays: u64) -> __m256i {
        let others = rays & rays.wrapping_sub(1);
        let [first, second] = [rays, others].map(|rays| rays.trailing_zeros() as i32 % 8);
        avx2!(_mm256_set_m128i(_mm_set1_epi32(second), _mm_set1_epi32(first)))
    }
    #[inline(always)]
    fn load_lanes(self, row: &Row, group: usize, lanes: __m256i) -> __m256 {
        avx2!(_mm256_permutevar8x32_ps(Wide::load(self, row, group), lanes))
    }
    #[inline(always)]
    fn repeat(self, four: &[f32; 4]) -> __m256 {
        // SAFETY: as in `avx2!`; the four numbers behind the reference may be read.
        unsafe { _mm256_broadcast_ps(&_mm_loadu_ps(four.as_ptr())) }
    }
    #[inline(always)]
    fn load(self, row: &Row, group: usize) -> __m256 {
        Simd::load(self, row.group(group))
    }
    #[inline(always)]
    fn store(self, row: &mut Row, group: usize, value: __m256) {
        Simd::store(self, row.group_mut(group), value);
    }
}

/// For each four bits the halves of those of four words that are set, the last word first, and zeros.
static WORDS_DOWNWARDS: [[u32; LANES]; 16] = {
    let mut all = [[0; LANES]; 16];
    let mut bits = 0;
    while bits < 16 {
        let (mut bit, mut len) = (4, 0);
        while bit > 0 {
            bit -= 1;
            if bits >> bit & 1 == 1 {
                all[bits][len] = 2 * bit;
                all[bits][len + 1] = 2 * bit + 1;
                len += 2;
            }
        }
        bits += 1;
    }
    all
};

/// For each byte the numbers of the bits that are set, the highest first, and zeros.
static BITS_DOWNWARDS: [[u8; LANES]; 256] = {
    let mut all = [[0; LANES]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut len) = (8, 0);
        while bit > 0 {
            bit -= 1;
            if byte >> bit & 1 == 1 {
                all[byte][len] = bit as u8;
                len += 1;
            }
        }
        byte += 1;
    }
    all
};

impl Avx2 {
    /// All ones in the words of eight that have a bit.
    #[inline(always)]
    fn where_bits(self, bits: u32) -> [__m256i; 2] {
        avx2! {
            let bits = _mm256_set1_epi64x(i64::from(bits));
            let (first, others) = (_mm256_setr_epi64x(1, 2, 4, 8), _mm256_setr_epi64x(16, 32, 64, 128));
            [
                _mm256_cmpeq_epi64(_mm256_and_si256(bits, first), first),
                _mm256_cmpeq_epi64(_mm256_and_si256(bits, others), others),
            ]
        }
    }

    /// The first four words and the others, with some bits as well.
    #[inline(always)]
    fn with_bits(self, words: [u64; LANES], bits: [__m256i; 2]) -> [__m256i; 2] {
        let (first, others) = (words.as_ptr().cast(), words[LANES / 2..].as_ptr().cast());
        // SAFETY: as in `avx2!`; the two halves of the array may be read.
        unsafe {
            let (first, others) = (_mm256_loadu_si256(first), _mm256_loadu_si256(others));
            [_mm256_or_si256(first, bits[0]), _mm256_or_si256(others, bits[1])]
        }
    }

    /// Of four words, lower and upper halves, what is `picked` and `here`, and for which that is not nothing,
    /// one bit each.
    #[inline(always)]
    fn of_half(
        self,
        [lower, upper]: [__m256i; 2],
        picked: __m256i,
        here: [u64; 2],
    ) -> ([__m256i; 2], usize) {
        avx2! {
            let lower_here = _mm256_and_si256(picked, _mm256_set1_epi64x(here[0] as i64));
            let upper_here = _mm256_and_si256(picked, _mm256_set1_epi64x(here[1] as i64));
            let lower = _mm256_and_si256(lower, lower_here);
            let upper = _mm256_and_si256(upper, upper_here);
            let none = _mm256_cmpeq_epi64(_mm256_or_si256(lower, upper), _mm256_setzero_si256());
            ([lower, upper], !_mm256_movemask_pd(_mm256_castsi256_pd(none)) as usize & 15)
        }
    }

    /// The words that have a bit, the one of the highest bit first, and whatever after them.
    #[inline(always)]
    fn picked(self, all: __m256i, bits: u32) -> __m256i {
        let numbers: &[u8; LANES] = &BITS_DOWNWARDS[(bits & 255) as usize];
        // SAFETY: as in `avx2!`; the eight bytes behind the reference may be read.
        unsafe {
            let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(numbers.as_ptr().cast()));
            _mm256_permutevar8x32_epi32(all, order)
        }
    }

    /// Transposes the lower four and the upper four columns of four rows, each on their own.
    #[inline(always)]
    fn transpose_halves(self, [a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        avx2! {
            let (ab, ab_upper) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (cd, cd_upper) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            [
                _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_upper, cd_upper),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_upper, cd_upper),
            ]
        }
    }
}

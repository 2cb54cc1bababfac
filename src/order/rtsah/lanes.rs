//! Natural logarithm and arc tangent of four `f64` at a time, without branches, tables or unsafe
//! code, so that compilers turn them into vector instructions. Everything is inlined, to be compiled
//! for the instruction set of the caller. Polynomials and range reductions are
//! those of FDLIBM (Sun Microsystems, "Freely Distributable Math Library", 1993); the error is a few
//! units in the last place.

/// Four numbers.
pub(super) type Lanes = [f64; 4];

/// `f` of each lane.
#[inline(always)]
pub(super) fn map(x: Lanes, f: impl Fn(f64) -> f64) -> Lanes {
    [f(x[0]), f(x[1]), f(x[2]), f(x[3])]
}

/// `f` of each pair of lanes.
#[inline(always)]
pub(super) fn zip(x: Lanes, y: Lanes, f: impl Fn(f64, f64) -> f64) -> Lanes {
    [f(x[0], y[0]), f(x[1], y[1]), f(x[2], y[2]), f(x[3], y[3])]
}

/// All bits where `condition` holds of a pair of lanes, none elsewhere. With [`kept`] it makes
/// choices without branches.
#[inline(always)]
fn mask(x: Lanes, y: Lanes, condition: impl Fn(f64, f64) -> bool) -> [u64; 4] {
    let of = |i: usize| u64::from(condition(x[i], y[i])).wrapping_neg();
    [of(0), of(1), of(2), of(3)]
}

/// `x` where the mask is set, 0 elsewhere.
#[inline(always)]
fn kept(x: Lanes, mask: [u64; 4]) -> Lanes {
    let of = |i: usize| f64::from_bits(x[i].to_bits() & mask[i]);
    [of(0), of(1), of(2), of(3)]
}

/// Sums of powers, in groups of four coefficients from the lowest on (Estrin's scheme: short chains
/// of operations that wait for each other).
#[inline(always)]
fn polynomial<const GROUPS: usize>(x: Lanes, coefficients: [[f64; 4]; GROUPS]) -> Lanes {
    let x2 = map(x, |x| x * x);
    let x4 = map(x2, |x2| x2 * x2);
    let group = |[c0, c1, c2, c3]: [f64; 4]| {
        let low = map(x, |x| c0 + x * c1);
        let high = zip(x2, map(x, |x| c2 + x * c3), |x2, high| x2 * high);
        zip(low, high, |low, high| low + high)
    };
    let mut sum = group(coefficients[GROUPS - 1]);
    let mut k = GROUPS - 1;
    while k > 0 {
        k -= 1;
        let higher = zip(x4, sum, |x4, sum| x4 * sum);
        sum = zip(group(coefficients[k]), higher, |g, h| g + h);
    }
    sum
}

/// Natural logarithms of positive, normal, finite numbers.
#[inline(always)]
pub(super) fn ln(x: Lanes) -> Lanes {
    // x = 2^k m with sqrt(1/2) <= m < sqrt(2).
    const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    const TWO_52: u64 = 0x4330_0000_0000_0000;
    const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
    let bits = |x: f64| x.to_bits().wrapping_add(ONE - SQRT_HALF);
    // An integer below 2^52 becomes a float by putting it into the mantissa of 2^52.
    let k = map(x, |x| f64::from_bits(bits(x) >> 52 | TWO_52) - (f64::from_bits(TWO_52) + 1023.0));
    let f = map(x, |x| f64::from_bits((bits(x) & MANTISSA).wrapping_add(SQRT_HALF)) - 1.0);
    let s = map(f, |f| f / (2.0 + f));
    let series = polynomial(
        map(s, |s| s * s),
        [
            [2.0, 6.666_666_666_666_735e-1, 3.999_999_999_940_942e-1, 2.857_142_874_366_239e-1],
            [
                2.222_219_843_214_978_4e-1,
                1.818_357_216_161_805e-1,
                1.531_383_769_920_937_3e-1,
                1.479_819_860_511_658_6e-1,
            ],
        ],
    );
    let mantissa = zip(s, series, |s, p| s * p);
    zip(k, mantissa, |k, m| k * std::f64::consts::LN_2 + m)
}

/// `atan(y / x)` of non-negative numbers that are not both 0.
#[inline(always)]
pub(super) fn atan_ratio(y: Lanes, x: Lanes) -> Lanes {
    use std::f64::consts::FRAC_PI_4;
    const TAN_PI_8: f64 = std::f64::consts::SQRT_2 - 1.0;
    // From a start of 0, pi/4 or pi/2, whichever is nearest, the rest is at most pi/8.
    let not_low = mask(y, x, |y, x| y >= TAN_PI_8 * x);
    let not_high = mask(y, x, |y, x| x >= TAN_PI_8 * y);
    let numerator = zip(kept(y, not_high), kept(x, not_low), |y, x| y - x);
    let denominator = zip(kept(x, not_high), kept(y, not_low), |x, y| x + y);
    let q = zip(numerator, denominator, |n, d| n / d);
    // pi/4 twice, once or not at all.
    let quarter = [FRAC_PI_4; 4];
    let start = zip(kept(quarter, not_low), kept(quarter, not_high), |a, b| FRAC_PI_4 + a - b);
    let series = polynomial(
        map(q, |q| -q * q),
        [
            [1.0, 3.333_333_333_333_293e-1, 1.999_999_999_987_648_3e-1, 1.428_571_427_250_346_6e-1],
            [
                1.111_111_040_546_235_6e-1,
                9.090_887_133_436_507e-2,
                7.691_876_205_044_83e-2,
                6.661_073_137_387_531e-2,
            ],
            [
                5.833_570_133_790_573_5e-2,
                4.976_877_994_615_932e-2,
                3.653_157_274_421_691_6e-2,
                1.628_582_011_536_578_2e-2,
            ],
        ],
    );
    zip(start, zip(q, series, |q, series| q * series), |start, rest| start + rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn as_the_standard_library_has_them() {
        let mut random = Random::new(41);
        for _ in 0..200_000 {
            let mut any = || {
                f64::from(random.unit() + 1e-9) * (f64::from(random.unit()) * 80.0 - 60.0).exp2()
            };
            let (x, y) = ([any(), any(), any(), any()], [any(), any(), any(), any()]);
            let (logs, angles) = (ln(x), atan_ratio(y, x));
            for i in 0..4 {
                assert!(
                    (logs[i] - x[i].ln()).abs() <= 4e-16 * x[i].ln().abs().max(1.0),
                    "{}",
                    x[i]
                );
                assert!((angles[i] - y[i].atan2(x[i])).abs() <= 4e-16, "{} {}", y[i], x[i]);
            }
        }
        assert_eq!(atan_ratio([0.0, 1.0, 2.0, 0.0], [1.0, 0.0, 2.0, 3.0])[0], 0.0);
        assert_eq!(ln([1.0; 4]), [0.0; 4]);
    }
}

//! Plain loops as vector code.

/// Runs `work` compiled for the best vectors that the processor has, without unsafe code here: loops
/// over arrays in it become vector instructions. Its bits do not depend on that, as compilers neither
/// fuse nor reorder arithmetic. Closures must be `#[inline(always)]`, and so must all that they call.
#[inline(always)]
pub(crate) fn vectorized<R>(work: impl FnOnce() -> R) -> R {
    struct Work<F>(F);
    impl<R, F: FnOnce() -> R> pulp::WithSimd for Work<F> {
        type Output = R;
        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> R {
            (self.0)()
        }
    }
    pulp::Arch::new().dispatch(Work(work))
}

/// One over the root of a positive number, to 3e-12 of it: by Halley's method, as vectors wait long
/// for roots and quotients. Of 0 a large number, so that times 0 it is 0.
#[inline(always)]
pub(crate) fn inverse_sqrt(x: f64) -> f64 {
    // Halving the bits of a number halves its exponent: a guess within 3.5 %.
    const OF_ONE: u64 = 0x5fe6_eb50_c7b5_37a9;
    let better = |y: f64| {
        let near_one = x * y * y;
        y * (1.875 - near_one * (1.25 - 0.375 * near_one))
    };
    better(better(f64::from_bits(OF_ONE - (x.to_bits() >> 1))))
}

/// `a - b`; as those below without a branch, in whatever loop it is.
#[inline(always)]
pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The dot product.
#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product.
#[inline(always)]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

#[cfg(test)]
mod tests {
    use super::inverse_sqrt;

    #[test]
    fn inverse_roots_of_all_sizes() {
        for exponent in -1000..1000 {
            for part in 0..64 {
                let x = (1.0 + f64::from(part) / 64.0) * 2f64.powi(exponent);
                let error = inverse_sqrt(x) * x.sqrt() - 1.0;
                assert!(error.abs() <= 3e-12, "{x}: off by {error}");
            }
        }
        assert_eq!(inverse_sqrt(0.0) * 0.0, 0.0);
        assert!(inverse_sqrt(f64::MAX) > 0.0);
    }
}

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

//! What the processor can do: found at run time, and shown by tokens that only finding it makes.

/// Whether the environment says `SATO_PORTABLE=1`: code for particular processors is not to be used.
pub(crate) fn is_portable_wanted() -> bool {
    std::env::var_os("SATO_PORTABLE").is_some_and(|value| value == "1")
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86_64::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    #![allow(unsafe_code, reason = "processor instructions that need a check at run time")]

    /// Shows that the processor has AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT: made by
    /// [`detect`](Self::detect) alone.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct Avx2(());

    impl Avx2 {
        /// `None` where the processor lacks one of them.
        pub(crate) fn detect() -> Option<Self> {
            let all = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            all.then_some(Self(()))
        }

        /// Does `work` with these instructions enabled; what is inlined into it is compiled for them.
        #[inline(always)]
        pub(crate) fn run<R>(self, work: impl FnOnce() -> R) -> R {
            /// # Safety
            /// The processor has these features.
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            unsafe fn enabled<R>(work: impl FnOnce() -> R) -> R {
                work()
            }
            // SAFETY: `self` shows that the processor has the features.
            unsafe { enabled(work) }
        }
    }

    /// Shows that the processor has AVX-512F, BW, DQ and VL, besides all of [`Avx2`]'s instructions:
    /// made by [`detect`](Self::detect) alone.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct Avx512(());

    impl Avx512 {
        /// `None` where the processor lacks one of them.
        pub(crate) fn detect() -> Option<(Avx2, Self)> {
            let all = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            Avx2::detect().filter(|_| all).map(|avx2| (avx2, Self(())))
        }

        /// As [`Avx2::run`].
        #[inline(always)]
        pub(crate) fn run<R>(self, work: impl FnOnce() -> R) -> R {
            /// # Safety
            /// The processor has these features.
            #[target_feature(
                enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512dq,avx512vl"
            )]
            unsafe fn enabled<R>(work: impl FnOnce() -> R) -> R {
                work()
            }
            // SAFETY: `self` shows that the processor has the features.
            unsafe { enabled(work) }
        }
    }
}

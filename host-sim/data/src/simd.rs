//! Vector instructions: the widest that this machine has, chosen when the program runs.

#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "calls for machines that have AVX")
)]

/// Frames computed side by side: enough to hide the cost of a loop, few enough for the first cache.
pub const LANES: usize = 64;

/// Numbers of [`LANES`] frames side by side. Loops over all lanes, whether or not each has a frame, need
/// no bounds check and no remainder.
pub type Lanes<T = f64> = [T; LANES];

/// Computes `work` compiled for the machine's widest vectors (AVX-512 or AVX2 on most x86-64, NEON on AArch64).
///
/// Code that is to be vectorised must be inlined into `work`: what it calls needs `#[inline(always)]`. Results do
/// not depend on the machine, since the compiler never contracts or reorders floating-point operations by itself.
///
/// ```
/// let sum = taxel_data::widest!([1.0_f64, 2.0].iter().map(|x| x * x).sum::<f64>());
/// assert_eq!(sum, 5.0);
/// ```
#[macro_export]
macro_rules! widest {
    ($work:expr) => {
        $crate::simd::run(
            #[inline(always)]
            || $work,
        )
    };
}

/// Runs `work`, which is to be inlined, as [`widest`] does.
#[inline]
pub fn run<R>(mut work: impl FnMut() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx512f")
        && std::is_x86_feature_detected!("avx512dq")
        && std::is_x86_feature_detected!("avx512vl")
    {
        // SAFETY: this machine has these parts of AVX-512.
        return unsafe { with_avx512(work) };
    }
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has AVX2.
        return unsafe { with_avx2(work) };
    }
    work()
}

/// Runs `work` with AVX-512, as [`with_avx2`] does.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn with_avx512<R>(mut work: impl FnMut() -> R) -> R {
    work()
}

/// Runs `work` with AVX2. It is called through `FnMut`: `FnOnce::call_once` would be a function of its own around the
/// closure, compiled for the oldest machine unless the compiler happens to inline it.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<R>(mut work: impl FnMut() -> R) -> R {
    work()
}

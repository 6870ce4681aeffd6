//! The widest vector instructions that this machine has, chosen when the program runs.

/// Runs `work` compiled for the machine's widest vectors (AVX2 on most x86-64, NEON on AArch64).
///
/// What is to be vectorised must be inlined into `work` (`#[inline(always)]`). Results do not depend on
/// the machine: the compiler never contracts or reorders floating-point operations by itself.
///
/// ```
/// let sum = host_sim::simd::widest(|| [1.0_f64, 2.0].iter().map(|x| x * x).sum::<f64>());
/// assert_eq!(sum, 5.0);
/// ```
#[inline]
pub fn widest<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

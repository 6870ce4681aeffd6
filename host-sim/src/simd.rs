//! The widest vector instructions that this machine has, chosen when the program runs.

/// What [`widest`] runs: a closure, or a struct of your own.
pub use pulp::NullaryFnOnce as Work;

/// Lanes of a block, one frame each: enough to hide what a loop costs, few enough for the first cache.
pub const LANES: usize = 64;

/// One number a frame. Loops over all lanes, whether or not each has a frame, need no bounds check and
/// no remainder.
pub type Lanes<T = f64> = [T; LANES];

/// Runs `work` compiled for the machine's widest vectors (AVX2 on most x86-64, NEON on AArch64).
///
/// What is to be vectorised must be inlined into `work` (`#[inline(always)]`). The compiler may leave
/// the body of a long closure outside, and it is then compiled for the oldest machine: give a struct that
/// implements [`Work`] with an `#[inline(always)]` method instead. Results do not depend on the machine:
/// the compiler never contracts or reorders floating-point operations by itself.
///
/// ```
/// let sum = host_sim::simd::widest(|| [1.0_f64, 2.0].iter().map(|x| x * x).sum::<f64>());
/// assert_eq!(sum, 5.0);
/// ```
#[inline]
pub fn widest<W: Work>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(work)
}

//! Recursive least squares in square-root information form.
//!
//! Minimises Σ_t λ^(T−t)·‖y_t − Wᵀh_t‖² + ‖W‖²/δ, one sample at a time, by keeping the upper
//! triangular R with RᵀR = Σ λ^(T−t) h hᵀ + I/δ and the transformed targets z. Each sample is
//! rotated into (R, z) by Givens rotations (Gentleman, "Least squares computations by Givens
//! transformations without square roots", J. Inst. Maths Applics 12, 1973; Haykin, Adaptive
//! Filter Theory, QRD-RLS). The covariance RLS of the paper (its eq. 14–16) solves the same
//! problem, but in f32 it reaches NaN within a few thousand samples on overlapping Gaussians:
//! it squares the condition number and loses symmetry. This form does neither, and λ = 1 makes it
//! equal to ridge regression with penalty 1/δ.
//!
//! **Leakage.** With λ < 1 alone, what was known of a direction that no sample excites fades away, and noise takes its
//! place: a sensor at rest drove weights to 1e19 in f32. So every update gives back the share of I/δ that it forgets
//! (Gunnarsson, "Combining tracking and regularization in recursive least squares identification", CDC 1996). Weights
//! and R stay bounded for any number of samples, and unexcited directions fade towards weight 0.
//!
//! **Unusable samples** change nothing: one NaN in R would stay for good.
//!
//! The trainer of host-sim calls [`solve`] alone, on a square R. It gets R and z from a QR decomposition of many samples
//! at once, or from this recursion in vector lanes, with the same bits. All else keeps R's upper triangle alone, row
//! after row. Recalibration on the host rotates presses into it.
//!
//! Without forgetting (λ = 1) the sums outgrow f32: rounding makes the error 1.05 times that in f64 after 1e6 samples,
//! 1.4 times after 1e7. Choose λ < 1 for recursions that never end.

use core::ops::{Add, Div, Mul, Sub};

/// A floating-point type that the recursion can work in: `f32` or `f64`.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// The number 0.
    const ZERO: Self;
    /// The number 1.
    const ONE: Self;
    /// √(smallest normal number): the square of a smaller diagonal or entry is not a normal number.
    const NEGLIGIBLE: Self;
    /// Largest entry of a sample: sums of many squares of it are still finite.
    const LARGEST: Self;
    /// Square root of the number.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Whether the number is neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

macro_rules! real {
    ($float:ident, $sqrt:path, $negligible:expr, $largest:expr) => {
        impl Real for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const NEGLIGIBLE: Self = $negligible;
            const LARGEST: Self = $largest;
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }
        }
    };
}
real!(f32, libm::sqrtf, 1.084_202_2e-19, 1e15);
real!(f64, libm::sqrt, 1.491_668_146_240_041_3e-154, 1e150);

/// Why a recursion cannot be started, or a sample cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RlsError {
    /// The initial covariance δ is not a positive finite number, or 1/δ is none.
    #[error("initial covariance must be a positive finite number (ridge penalty is 1 over it)")]
    InitialCovariance,
    /// The forgetting factor λ is not in (0, 1].
    #[error("forgetting factor must be above 0 and at most 1")]
    ForgettingFactor,
    /// The memory does not have the length that the numbers of regressors and outputs ask for.
    #[error("memory of {found} numbers; the recursion needs {expected}")]
    Memory {
        /// Number of values that the recursion needs.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// The sample holds a number that is not finite or too large, or another number of values. It changed nothing.
    #[error(
        "the sample holds a number that is not finite or too large, or another number of values"
    )]
    UnusableSample,
}

/// Number of values in the upper triangle of R for `n` regressors.
pub const fn triangle_values(n: usize) -> usize {
    n.saturating_mul(n.saturating_add(1)) / 2
}

/// Rows of a triangle for `n` regressors: the first has n values, the last one.
fn rows_mut<T>(triangle: &mut [T], n: usize) -> impl Iterator<Item = &mut [T]> {
    let mut rest = triangle;
    (0..n).map_while(move |i| {
        let (row, after) = core::mem::take(&mut rest).split_at_mut_checked(n - i)?;
        rest = after;
        Some(row)
    })
}

/// Makes a triangle that of R = I·`diagonal`.
pub fn start<T: Real>(triangle: &mut [T], n: usize, diagonal: T) {
    for row in rows_mut(triangle, n) {
        row.fill(T::ZERO);
        row.iter_mut().take(1).for_each(|place| *place = diagonal);
    }
}

/// Forgets: multiplies R and z by `root_forgetting`, √λ.
pub fn forget<T: Real>(triangle: &mut [T], projection: &mut [T], root_forgetting: T) {
    let values = triangle.iter_mut().chain(projection);
    values.for_each(|value| *value = *value * root_forgetting);
}

/// Whether every value of a sample is finite, and not so large that its square would not be.
pub fn is_usable<T: Real>(sample: &[T]) -> bool {
    sample.iter().all(|&value| value <= T::LARGEST && T::ZERO - value <= T::LARGEST)
}

/// Rotates one sample into R and z. `regressor` (h, n) and `target` (y, one value an output) must be
/// [usable](is_usable); they hold rotated values afterwards.
///
/// Work: 3n² + 6n·outputs floating-point operations. Leading zeros of h take none.
pub fn rotate<T: Real>(
    triangle: &mut [T],
    projection: &mut [T],
    regressor: &mut [T],
    target: &mut [T],
) {
    let outputs = target.len().max(1);
    let rows = rows_mut(triangle, regressor.len()).zip(projection.chunks_exact_mut(outputs));
    for (i, (row, z_row)) in rows.enumerate() {
        let Some((_, h)) = regressor.split_at_mut_checked(i) else { return };
        let (Some(&pivot), Some(&entry)) = (row.first(), h.first()) else { return };
        let length = (pivot * pivot + entry * entry).sqrt();
        if entry == T::ZERO || length <= T::ZERO {
            continue;
        }
        let (cosine, sine) = (pivot / length, entry / length);
        for (r, h) in row.iter_mut().zip(h) {
            (*r, *h) = (cosine * *r + sine * *h, cosine * *h - sine * *r);
        }
        for (z, y) in z_row.iter_mut().zip(target.iter_mut()) {
            (*z, *y) = (cosine * *z + sine * *y, cosine * *y - sine * *z);
        }
    }
}

/// Solves R·W = z as [`solve`] does, with the `triangle` of `n` regressors.
pub fn solve_triangle<T: Real>(triangle: &[T], projection: &[T], n: usize, weights: &mut [T]) {
    let outputs = (weights.len() / n.max(1)).max(1);
    let (mut above, mut z_above) = (triangle, projection);
    for i in (0..n).rev() {
        let Some((rest, row)) = above.split_at_checked(above.len().saturating_sub(n - i)) else {
            return;
        };
        let Some((z_rest, z_row)) = z_above.split_at_checked(i * outputs) else { return };
        (above, z_above) = (rest, z_rest);
        let Some((head, solved)) = weights.split_at_mut_checked((i + 1) * outputs) else { return };
        let Some((_, w_row)) = head.split_at_mut_checked(i * outputs) else { return };
        solve_row(row, z_row, w_row, solved);
    }
}

/// Solves R·W = z by back substitution into `weights` (`n × outputs` row-major), with a square R (`n × n` row-major).
///
/// A direction that was never excited, and whose information forgetting has faded to nothing, gets weight 0.
pub fn solve<T: Real>(information_root: &[T], projection: &[T], n: usize, weights: &mut [T]) {
    let n = n.max(1);
    let outputs = (weights.len() / n).max(1);
    let rows = information_root.chunks_exact(n).zip(projection.chunks_exact(outputs));
    for (i, (r_row, z_row)) in rows.enumerate().rev() {
        let Some((head, solved)) = weights.split_at_mut_checked((i + 1) * outputs) else { return };
        let Some((_, w_row)) = head.split_at_mut_checked(i * outputs) else { return };
        let Some((_, r)) = r_row.split_at_checked(i) else { return };
        solve_row(r, z_row, w_row, solved);
    }
}

/// Solves one row of R·W = z into `w_row`; `r` begins with the diagonal, and later rows are `solved`.
fn solve_row<T: Real>(r: &[T], z_row: &[T], w_row: &mut [T], solved: &[T]) {
    let Some((&pivot, r_rest)) = r.split_first() else { return };
    if pivot <= T::NEGLIGIBLE {
        w_row.fill(T::ZERO);
        return;
    }
    for (w, &z) in w_row.iter_mut().zip(z_row) {
        *w = z;
    }
    for (&r, later) in r_rest.iter().zip(solved.chunks_exact(w_row.len().max(1))) {
        for (w, &l) in w_row.iter_mut().zip(later) {
            *w = *w - r * l;
        }
    }
    for w in w_row.iter_mut() {
        *w = *w / pivot;
    }
}

/// Recursive least squares in memory that the caller lends.
///
/// There are as many regressors as activations, affine inputs and the bias's 1 together. A never-ending recursion
/// needs λ < 1; [`is_excited`](Self::is_excited) tells whether its weights are worth anything.
///
/// ```
/// use taxel_core::rls::{Rls, RlsError};
/// let mut memory = [0.0_f32; Rls::<f32>::values(2, 1)];
/// let mut rls = Rls::try_new(&mut memory, [2, 1], 1e6, 0.999)?;
/// for t in 0..100 {
///     let x = t as f32 / 100.0;
///     rls.update(&mut [x, 1.0], &mut [3.0 * x - 1.0])?; // y = 3x − 1
/// }
/// let mut weights = [0.0; 2];
/// rls.weights(&mut weights);
/// assert!((weights[0] - 3.0).abs() < 1e-3 && (weights[1] + 1.0).abs() < 1e-3);
/// assert!(rls.is_excited(1e3));
/// assert_eq!(rls.update(&mut [f32::NAN, 1.0], &mut [0.0]), Err(RlsError::UnusableSample));
/// # Ok::<(), RlsError>(())
/// ```
#[derive(Debug, PartialEq)]
pub struct Rls<'m, T> {
    triangle: &'m mut [T],
    projection: &'m mut [T],
    /// Room for the sample that gives back what is forgotten of one direction.
    leak: &'m mut [T],
    outputs: usize,
    root_forgetting: T,
    /// 1/√δ.
    diagonal: T,
    /// What a direction gets back at its turn, once in as many updates as there are regressors.
    share: T,
    turn: usize,
}

impl<'m, T: Real> Rls<'m, T> {
    /// Number of values of memory for so many `regressors` and `outputs`.
    pub const fn values(regressors: usize, outputs: usize) -> usize {
        triangle_values(regressors)
            .saturating_add(regressors.saturating_mul(outputs))
            .saturating_add(regressors)
            .saturating_add(outputs)
    }

    /// Starts with weights 0, covariance δ·I and forgetting factor λ (1 forgets nothing), in memory of
    /// [`values`](Self::values).
    ///
    /// # Errors
    /// [`RlsError`]: δ is not positive and finite, λ is not in (0, 1], or the memory has another length.
    pub fn try_new(
        memory: &'m mut [T],
        [regressors, outputs]: [usize; 2],
        initial_covariance: T,
        forgetting_factor: T,
    ) -> Result<Self, RlsError> {
        let diagonal = T::ONE / initial_covariance.sqrt();
        let is_number = initial_covariance > T::ZERO && initial_covariance.is_finite();
        if !(is_number && diagonal <= T::LARGEST && diagonal > T::NEGLIGIBLE) {
            return Err(RlsError::InitialCovariance);
        }
        if !(forgetting_factor > T::ZERO && forgetting_factor <= T::ONE) {
            return Err(RlsError::ForgettingFactor);
        }
        let (expected, found) = (Self::values(regressors, outputs), memory.len());
        let wrong = RlsError::Memory { expected, found };
        if expected != found {
            return Err(wrong);
        }
        memory.fill(T::ZERO);
        let (triangle, rest) =
            memory.split_at_mut_checked(triangle_values(regressors)).ok_or(wrong)?;
        let (projection, leak) = rest.split_at_mut_checked(regressors * outputs).ok_or(wrong)?;
        start(triangle, regressors, diagonal);
        // What λ leaves of the information 1/δ in as many updates as there are regressors.
        let left = (0..regressors).fold(T::ONE, |left, _| left * forgetting_factor);
        let share = diagonal * (T::ONE - left).sqrt();
        let root_forgetting = forgetting_factor.sqrt();
        Ok(Self { triangle, projection, leak, outputs, root_forgetting, diagonal, share, turn: 0 })
    }

    /// Updates the recursion with one sample: the network's `regressor`s and the true `target`. Both are working space,
    /// and hold other values afterwards.
    ///
    /// # Errors
    /// [`RlsError::UnusableSample`]: the sample changed nothing.
    pub fn update(&mut self, regressor: &mut [T], target: &mut [T]) -> Result<(), RlsError> {
        let regressors = self.leak.len().saturating_sub(self.outputs);
        let fits = regressor.len() == regressors && target.len() == self.outputs;
        if !(fits && is_usable(regressor) && is_usable(target)) {
            return Err(RlsError::UnusableSample);
        }
        forget(self.triangle, self.projection, self.root_forgetting);
        rotate(self.triangle, self.projection, regressor, target);
        if self.share > T::ZERO {
            self.leak.fill(T::ZERO);
            if let Some(place) = self.leak.get_mut(self.turn) {
                *place = self.share;
            }
            if let Some((h, y)) = self.leak.split_at_mut_checked(regressors) {
                rotate(self.triangle, self.projection, h, y);
            }
            self.turn = if self.turn + 1 < regressors { self.turn + 1 } else { 0 };
        }
        Ok(())
    }

    /// Writes the weights that fit all samples so far best, in the least-squares sense: regressor after regressor,
    /// one value an output.
    pub fn weights(&self, weights: &mut [T]) {
        let regressors = self.leak.len().saturating_sub(self.outputs);
        solve_triangle(self.triangle, self.projection, regressors, weights);
    }

    /// Whether the samples so far say at least `times` as much about every weight as the initial 1/δ does, if the
    /// weights after it were known. Where they do not, weights are the starting point, not knowledge.
    pub fn is_excited(&self, times: T) -> bool {
        is_excited(
            self.triangle,
            self.leak.len().saturating_sub(self.outputs),
            self.diagonal,
            times,
        )
    }
}

/// Whether every diagonal of R, squared, is at least `times` that of the start, `diagonal`².
pub fn is_excited<T: Real>(triangle: &[T], n: usize, diagonal: T, times: T) -> bool {
    let least = diagonal * times.sqrt();
    let mut rest = triangle;
    (0..n).all(|i| match rest.split_at_checked(n - i) {
        Some((row, after)) => {
            rest = after;
            row.first().is_some_and(|&pivot| pivot >= least)
        }
        None => false,
    })
}

#[cfg(test)]
mod tests;

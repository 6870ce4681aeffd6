//! Recursive least squares in square-root information form.
//!
//! Minimises Σ_t λ^(T−t)·‖y_t − Wᵀh_t‖² + λ^T·‖W‖²/δ, one sample at a time, by keeping the upper
//! triangular R with RᵀR = Σ λ^(T−t) h hᵀ + λ^T I/δ and the transformed targets z. Each sample is
//! rotated into (R, z) by Givens rotations (Gentleman, "Least squares computations by Givens
//! transformations without square roots", J. Inst. Maths Applics 12, 1973; Haykin, Adaptive
//! Filter Theory, QRD-RLS). The covariance RLS of the paper (its eq. 14–16) solves the same
//! problem, but in f32 it reaches NaN within a few thousand samples on overlapping Gaussians:
//! it squares the condition number and loses symmetry. This form does neither, and λ = 1 makes it
//! equal to ridge regression with penalty 1/δ.
//!
//! The free functions work on slices, for sizes known when they run; [`Rls`] wraps them for
//! sizes known when compiled.
//!
//! The trainer of host-sim calls [`solve`] alone, and gets R and z from a QR decomposition of many samples at
//! once. [`start`], [`update`] and [`Rls`] are for recalibration on the device, which no firmware does yet. Tests
//! compare them with batch ridge regression and the host with the emulator; the link check proves that they
//! cannot panic.

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
    /// Square root of the number.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Whether the number is neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

macro_rules! real {
    ($float:ident, $sqrt:path, $negligible:expr) => {
        impl Real for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const NEGLIGIBLE: Self = $negligible;
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
real!(f32, libm::sqrtf, 1.084_202_2e-19);
real!(f64, libm::sqrt, 1.491_668_146_240_041_3e-154);

/// Why a recursion cannot be started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RlsError {
    /// The initial covariance δ is not a positive finite number.
    #[error("initial covariance must be a positive finite number (ridge penalty is 1 over it)")]
    InitialCovariance,
    /// The forgetting factor λ is not in (0, 1].
    #[error("forgetting factor must be above 0 and at most 1")]
    ForgettingFactor,
}

/// Starts a recursion: `information_root` (R, `n × n` row-major) becomes I/√δ and `projection`
/// (z, `n × outputs`) becomes 0.
///
/// # Errors
/// [`RlsError::InitialCovariance`] for a δ that is not positive and finite.
pub fn start<T: Real>(
    information_root: &mut [T],
    projection: &mut [T],
    n: usize,
    initial_covariance: T,
) -> Result<(), RlsError> {
    if !(initial_covariance > T::ZERO && initial_covariance.is_finite()) {
        return Err(RlsError::InitialCovariance);
    }
    let diagonal = T::ONE / initial_covariance.sqrt();
    for (i, row) in information_root.chunks_exact_mut(n.max(1)).enumerate() {
        for (j, r) in row.iter_mut().enumerate() {
            *r = if i == j { diagonal } else { T::ZERO };
        }
    }
    projection.fill(T::ZERO);
    Ok(())
}

/// Updates R and z with one sample. `regressor` (h, `n`) and `target` (y, `outputs`) are working space and
/// hold rotated values afterwards: `target` the rotated residual.
///
/// `root_forgetting` is √λ. Work: 3n² + 6n·outputs floating-point operations.
#[inline]
pub fn update<T: Real>(
    information_root: &mut [T],
    projection: &mut [T],
    regressor: &mut [T],
    target: &mut [T],
    root_forgetting: T,
) {
    let n = regressor.len().max(1);
    let outputs = target.len().max(1);
    let rows = information_root.chunks_exact_mut(n).zip(projection.chunks_exact_mut(outputs));
    for (i, (r_row, z_row)) in rows.enumerate() {
        let Some((_, r)) = r_row.split_at_mut_checked(i) else { return };
        let Some((_, h)) = regressor.split_at_mut_checked(i) else { return };
        let (Some(&pivot), Some(&entry)) = (r.first(), h.first()) else { return };
        let pivot = pivot * root_forgetting;
        let length = (pivot * pivot + entry * entry).sqrt();
        let (cosine, sine) =
            if length > T::ZERO { (pivot / length, entry / length) } else { (T::ONE, T::ZERO) };
        // √λ belongs to the old row only; fold it into the two factors that meet that row.
        let (old_cosine, old_sine) = (cosine * root_forgetting, sine * root_forgetting);
        for (r, h) in r.iter_mut().zip(h.iter_mut()) {
            (*r, *h) = (old_cosine * *r + sine * *h, cosine * *h - old_sine * *r);
        }
        for (z, y) in z_row.iter_mut().zip(target.iter_mut()) {
            (*z, *y) = (old_cosine * *z + sine * *y, cosine * *y - old_sine * *z);
        }
    }
}

/// Solves R·W = z by back substitution into `weights` (`n × outputs` row-major).
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
        let Some((&pivot, r_rest)) = r.split_first() else { return };
        if pivot <= T::NEGLIGIBLE {
            w_row.fill(T::ZERO);
            continue;
        }
        for (w, &z) in w_row.iter_mut().zip(z_row) {
            *w = z;
        }
        for (&r, later) in r_rest.iter().zip(solved.chunks_exact(outputs)) {
            for (w, &l) in w_row.iter_mut().zip(later) {
                *w = *w - r * l;
            }
        }
        for w in w_row.iter_mut() {
            *w = *w / pivot;
        }
    }
}

/// Recursive least squares with sizes known at compile time, for use on the device.
///
/// `REGRESSORS` counts activations, affine inputs and the bias's 1. RAM: `REGRESSORS` ×
/// (`REGRESSORS` + `OUTPUTS`) values.
///
/// ```
/// use model_core::rls::Rls;
/// let mut rls = Rls::<f32, 2, 1>::try_new(1e6, 1.0)?;
/// for t in 0..100 {
///     let x = t as f32 / 100.0;
///     rls.update([x, 1.0], [3.0 * x - 1.0]); // y = 3x − 1
/// }
/// let weights = rls.output_weights();
/// assert!((weights[0][0] - 3.0).abs() < 1e-4 && (weights[1][0] + 1.0).abs() < 1e-4);
/// # Ok::<(), model_core::rls::RlsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Rls<T, const REGRESSORS: usize, const OUTPUTS: usize> {
    information_root: [[T; REGRESSORS]; REGRESSORS],
    projection: [[T; OUTPUTS]; REGRESSORS],
    root_forgetting: T,
}

impl<T: Real, const REGRESSORS: usize, const OUTPUTS: usize> Rls<T, REGRESSORS, OUTPUTS> {
    /// Starts with weights 0, covariance δ·I and forgetting factor λ (1 forgets nothing).
    ///
    /// # Errors
    /// [`RlsError`]: δ is not positive and finite, or λ is not in (0, 1].
    pub fn try_new(initial_covariance: T, forgetting_factor: T) -> Result<Self, RlsError> {
        if !(forgetting_factor > T::ZERO && forgetting_factor <= T::ONE) {
            return Err(RlsError::ForgettingFactor);
        }
        let mut rls = Self {
            information_root: [[T::ZERO; REGRESSORS]; REGRESSORS],
            projection: [[T::ZERO; OUTPUTS]; REGRESSORS],
            root_forgetting: forgetting_factor.sqrt(),
        };
        start(
            rls.information_root.as_flattened_mut(),
            rls.projection.as_flattened_mut(),
            REGRESSORS,
            initial_covariance,
        )?;
        Ok(rls)
    }

    /// Updates the recursion with one sample: the network's `regressor`s and the true `target`.
    pub fn update(&mut self, mut regressor: [T; REGRESSORS], mut target: [T; OUTPUTS]) {
        update(
            self.information_root.as_flattened_mut(),
            self.projection.as_flattened_mut(),
            &mut regressor,
            &mut target,
            self.root_forgetting,
        );
    }

    /// The weights that fit all samples so far best, in the least-squares sense: `[regressor][output]`.
    #[must_use]
    pub fn output_weights(&self) -> [[T; OUTPUTS]; REGRESSORS] {
        let mut weights = [[T::ZERO; OUTPUTS]; REGRESSORS];
        solve(
            self.information_root.as_flattened(),
            self.projection.as_flattened(),
            REGRESSORS,
            weights.as_flattened_mut(),
        );
        weights
    }
}

#[cfg(test)]
mod tests;

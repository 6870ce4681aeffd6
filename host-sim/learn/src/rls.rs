//! Recursive least squares: one sample after another, in memory that does not grow with their number.
//!
//! The paper trains output weights by "recursive least squares", and says no more of it: it has no formula for it, no
//! initial covariance and no forgetting factor. (Its eq. 13–17 are interpolation, by as many centres as samples.) The
//! form here, δ and λ are ours.
//!
//! It minimises Σ_t λ^(T−t)·‖y_t − Wᵀh_t‖² + ‖W‖²/δ by keeping the upper triangular R with RᵀR = Σ λ^(T−t) h hᵀ + I/δ
//! and the transformed targets z. Each sample is rotated into (R, z) by Givens rotations (Gentleman, "Least squares
//! computations by Givens transformations without square roots", J. Inst. Maths Applics 12, 1973; Haykin, Adaptive
//! Filter Theory, QRD-RLS). With λ = 1 it is ridge regression with penalty 1/δ. The covariance form of textbooks,
//! P ← (P − k·hᵀP)/λ, solves the same problem, but squares the condition number and loses symmetry: in f32 it reaches
//! NaN within a few thousand samples on overlapping Gaussians.
//!
//! **Leakage.** With λ < 1 alone, what was known of a direction that no sample excites fades away, and noise takes its
//! place: a sensor at rest drove weights to 1e19 in f32. So every update gives back the share of I/δ that it forgets
//! (Gunnarsson, "Combining tracking and regularization in recursive least squares identification", CDC 1996). Weights
//! and R stay bounded for any number of samples, and unexcited directions fade towards weight 0.

use std::fmt;

use taxel_data::{BadValue, require, widest};

/// √(smallest normal number): the square of a smaller diagonal or entry is not a normal number.
const NEGLIGIBLE: f64 = 1.491_668_146_240_041_3e-154;
/// Largest entry of a sample: sums of many squares of it are still finite.
pub const LARGEST: f64 = 1e150;

/// A sample holds a number that is not finite or too large. It changed nothing: one NaN in R would stay for good.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnusableSample;

impl fmt::Display for UnusableSample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the sample holds a number that is not finite or too large")
    }
}

impl std::error::Error for UnusableSample {}

/// Recursive least squares over samples of so many regressors and outputs.
///
/// There are as many regressors as activations, affine inputs and the bias's 1 together.
///
/// ```
/// use taxel_learn::rls::{Rls, UnusableSample};
/// let mut rls = Rls::new([2, 1], 1e6, 0.999)?;
/// for t in 0..100 {
///     let x = f64::from(t) / 100.0;
///     rls.update(&mut [x, 1.0], &mut [3.0 * x - 1.0]).unwrap(); // y = 3x − 1
/// }
/// let weights = rls.weights();
/// assert!((weights[0] - 3.0).abs() < 1e-3 && (weights[1] + 1.0).abs() < 1e-3);
/// assert_eq!(rls.update(&mut [f64::NAN, 1.0], &mut [0.0]), Err(UnusableSample));
/// # Ok::<(), taxel_data::BadValue>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Rls {
    /// Triangle R, `regressors × regressors`, row-major.
    pub(crate) root: Vec<f64>,
    /// Transformed targets z, `regressors × outputs`.
    pub(crate) projection: Vec<f64>,
    regressors: usize,
    outputs: usize,
    root_forgetting: f64,
    /// What a direction gets back at its turn, once in as many updates as there are regressors.
    share: f64,
    turn: usize,
}

impl Rls {
    /// Starts with weights 0, covariance δ·I and forgetting factor λ (1 forgets nothing).
    ///
    /// # Errors
    /// [`BadValue`] if δ is not positive and finite or 1/δ is out of range, and if λ is not in (0, 1].
    pub fn new(
        [regressors, outputs]: [usize; 2],
        initial_covariance: f64,
        forgetting_factor: f64,
    ) -> Result<Self, BadValue> {
        let diagonal = 1.0 / initial_covariance.sqrt();
        require(
            diagonal > NEGLIGIBLE && diagonal <= LARGEST,
            "initial_covariance",
            format!("{initial_covariance:?}"),
            || "give a positive number, such as 1e6".into(),
        )?;
        require(
            forgetting_factor > 0.0 && forgetting_factor <= 1.0,
            "forgetting_factor",
            format!("{forgetting_factor:?}"),
            || "give a number above 0, up to 1".into(),
        )?;
        let mut root = vec![0.0; regressors * regressors];
        start(&mut root, regressors, diagonal);
        // What λ leaves of the information 1/δ in as many updates as there are regressors.
        let left = (0..regressors).fold(1.0, |left, _| left * forgetting_factor);
        Ok(Self {
            root,
            projection: vec![0.0; regressors * outputs],
            regressors,
            outputs,
            root_forgetting: forgetting_factor.sqrt(),
            share: diagonal * (1.0 - left).sqrt(),
            turn: 0,
        })
    }

    /// Updates the recursion with one sample: the network's `regressor`s and the true `target`. Both are working space,
    /// and hold other values afterwards. It takes 3n² + 6n·outputs operations, and about as many again with forgetting.
    ///
    /// # Errors
    /// [`UnusableSample`]: the sample changed nothing.
    ///
    /// # Panics
    /// If there are not as many regressors or targets as the recursion was made for.
    pub fn update(
        &mut self,
        regressor: &mut [f64],
        target: &mut [f64],
    ) -> Result<(), UnusableSample> {
        assert_eq!([regressor.len(), target.len()], [self.regressors, self.outputs]);
        if !(is_usable(regressor) && is_usable(target)) {
            return Err(UnusableSample);
        }
        let Self { root, projection, root_forgetting, share, .. } = self;
        if *root_forgetting < 1.0 {
            let values = root.iter_mut().chain(&mut *projection);
            values.for_each(|value| *value *= *root_forgetting);
        }
        rotate(root, projection, regressor, target);
        if *share > 0.0 {
            regressor.fill(0.0);
            target.fill(0.0);
            regressor[self.turn] = *share;
            rotate(root, projection, regressor, target);
            self.turn = (self.turn + 1) % self.regressors;
        }
        Ok(())
    }

    /// Weights that fit all samples so far best, in the least-squares sense: `regressors × outputs`.
    pub fn weights(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.projection.len()];
        solve(&self.root, &self.projection, self.regressors, &mut weights);
        weights
    }
}

/// Whether every value of a sample is finite, and not so large that its square would not be.
pub fn is_usable(sample: &[f64]) -> bool {
    sample.iter().all(|value| value.abs() <= LARGEST)
}

/// Makes a triangle of `n` regressors that of R = I·`diagonal`.
pub(crate) fn start(root: &mut [f64], n: usize, diagonal: f64) {
    root.fill(0.0);
    root.iter_mut().step_by(n + 1).for_each(|place| *place = diagonal);
}

/// Rotates one sample into R and z. `regressor` (h, n) and `target` (y, one value an output) must be
/// [usable](is_usable); they hold rotated values afterwards. Leading zeros of h take no work.
pub(crate) fn rotate(
    root: &mut [f64],
    projection: &mut [f64],
    regressor: &mut [f64],
    target: &mut [f64],
) {
    widest!(rotate_inlined(root, projection, regressor, target));
}

#[inline(always)]
fn rotate_inlined(
    root: &mut [f64],
    projection: &mut [f64],
    regressor: &mut [f64],
    target: &mut [f64],
) {
    let rows = root.chunks_exact_mut(regressor.len());
    for (i, (row, z_row)) in rows.zip(projection.chunks_exact_mut(target.len())).enumerate() {
        let (row, h) = (&mut row[i..], &mut regressor[i..]);
        let (pivot, entry) = (row[0], h[0]);
        let length = (pivot * pivot + entry * entry).sqrt();
        if entry == 0.0 || length <= 0.0 {
            continue;
        }
        let (cosine, sine) = (pivot / length, entry / length);
        let turn = |r: &mut f64, h: &mut f64| {
            (*r, *h) = (cosine * *r + sine * *h, cosine * *h - sine * *r);
        };
        row.iter_mut().zip(h).for_each(|(r, h)| turn(r, h));
        z_row.iter_mut().zip(&mut *target).for_each(|(z, y)| turn(z, y));
    }
}

/// Solves R·W = z by back substitution into `weights` (`n × outputs` row-major), with a square R (`n × n` row-major).
///
/// A direction that was never excited, and whose information forgetting has faded to nothing, gets weight 0.
pub(crate) fn solve(root: &[f64], projection: &[f64], n: usize, weights: &mut [f64]) {
    let outputs = weights.len() / n;
    for i in (0..n).rev() {
        let row = &root[i * n..][i..n];
        let (head, solved) = weights.split_at_mut((i + 1) * outputs);
        let w_row = &mut head[i * outputs..];
        if row[0] <= NEGLIGIBLE {
            w_row.fill(0.0);
            continue;
        }
        w_row.copy_from_slice(&projection[i * outputs..][..outputs]);
        for (&r, later) in row[1..].iter().zip(solved.chunks_exact(outputs)) {
            w_row.iter_mut().zip(later).for_each(|(w, &l)| *w -= r * l);
        }
        w_row.iter_mut().for_each(|w| *w /= row[0]);
    }
}

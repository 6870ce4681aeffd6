//! Output weights: least squares over all samples, by a QR decomposition or by recursion.
//!
//! The weights minimise Σ_t ‖y_t − Wᵀh_t‖² + ‖W‖²/δ. The [recursion](crate::rls) from covariance δ·I without forgetting
//! arrives at the same weights sample by sample. Taking many samples at once ([`Decomposed`]) changes the order of
//! rounding only.

use std::borrow::Cow;
use std::ops::Range;

use crate::parallel;
use crate::rls::{self, Rls};

mod exp;
mod gaussian;
mod triangle;

pub(crate) use exp::exponentiate_non_positive;
pub(crate) use gaussian::squared_distances;
pub use gaussian::{Gaussians, Regressors};
use triangle::{NewRows, ROWS_AT_ONCE, Triangle};

/// Regressors of a set of samples: the rows of the matrix that weights are fitted through.
pub trait Design: Sync {
    /// Number n of regressors of each sample.
    fn regressors(&self) -> usize;

    /// Writes the regressors of `samples` into `values` (`samples × n`, row-major).
    ///
    /// It is called once for every sample, on any thread, a few samples at a time. The squares of the
    /// values, and sums of these over all samples, must fit an f64.
    fn fill(&self, samples: Range<usize>, values: &mut [f64]);
}

/// Regressors of samples times a factor on each sample's error. Targets are multiplied [alike](weighed).
pub(crate) struct Weighed<'w> {
    pub design: &'w dyn Design,
    pub weights: &'w [f64],
}

impl Design for Weighed<'_> {
    fn regressors(&self) -> usize {
        self.design.regressors()
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let weights = &self.weights[samples.clone()];
        self.design.fill(samples, values);
        weigh(weights, values);
    }
}

/// Multiplies each line of `values` by its weight.
fn weigh(weights: &[f64], values: &mut [f64]) {
    let lines = values.chunks_exact_mut(values.len() / weights.len().max(1)).zip(weights);
    lines.for_each(|(line, weight)| line.iter_mut().for_each(|value| *value *= weight));
}

/// `targets` times the factors on the samples' errors, if these have any.
pub(crate) fn weighed<'t>(weights: Option<&[f64]>, targets: &'t [f64]) -> Cow<'t, [f64]> {
    let Some(weights) = weights else { return targets.into() };
    let mut targets = targets.to_vec();
    weigh(weights, &mut targets);
    targets.into()
}

/// Triangular factor of a fit: the weights W solve R·W = z, and RᵀR is the information matrix Σ h hᵀ +
/// I/δ.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// Triangle R, `regressors × regressors`, row-major, upper triangular, its diagonal not negative.
    pub root: Vec<f64>,
    /// Transformed targets z, `regressors × outputs`.
    pub projection: Vec<f64>,
    /// Number n of regressors.
    pub regressors: usize,
    /// Number of outputs.
    pub outputs: usize,
}

/// Samples decomposed piece by piece, before a penalty is chosen: fits with several penalties share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Decomposed {
    pieces: Vec<Triangle>,
    regressors: usize,
    outputs: usize,
}

impl Decomposed {
    /// Decomposes the samples of `design` with their `targets` (`samples × outputs`).
    ///
    /// Work: 2n² + 4n·outputs operations a sample. The result is the same on any number of threads:
    /// pieces, and the order in which they are put together, depend on the shapes alone.
    ///
    /// # Panics
    /// If `outputs` is 0.
    pub fn new(design: &(impl Design + ?Sized), targets: &[f64], outputs: usize) -> Self {
        let regressors = design.regressors();
        let samples = targets.len() / outputs;
        let piece = piece(samples, regressors);
        let pieces = parallel::map(samples.div_ceil(piece), &|index| {
            let start = index * piece;
            decompose(design, targets, outputs, start..samples.min(start + piece))
        });
        Self { pieces, regressors, outputs }
    }

    /// Factor of all samples, with a penalty of 1/`initial_covariance` on squared weights. It takes about an eighth
    /// of the decomposition's work, or less.
    ///
    /// # Panics
    /// If `initial_covariance` is not positive and finite.
    pub fn factor(&self, initial_covariance: f64) -> Factor {
        assert!(
            initial_covariance > 0.0 && initial_covariance.is_finite(),
            "the initial covariance must be positive and finite"
        );
        self.factor_with(|_| 1.0 / initial_covariance.sqrt())
    }

    /// Factor of all samples, with a penalty of its own on the squared weights of each regressor, of which `root` gives
    /// the root.
    pub(super) fn factor_with(&self, root: impl Fn(usize) -> f64) -> Factor {
        let (regressors, outputs) = (self.regressors, self.outputs);
        let mut whole = Triangle::new(regressors, outputs);
        whole.set_diagonal(root);
        self.pieces.iter().for_each(|piece| whole.merge(piece));
        let (root, projection) = whole.into_root_and_projection();
        Factor { root, projection, regressors, outputs }
    }
}

impl Factor {
    /// Decomposes the samples of `design` with their `targets` (`samples × outputs`), with a
    /// penalty of 1/`initial_covariance` on squared weights; see [`Decomposed`].
    ///
    /// # Panics
    /// If `initial_covariance` is not positive and finite, or `outputs` is 0.
    pub fn new(
        design: &(impl Design + ?Sized),
        targets: &[f64],
        outputs: usize,
        initial_covariance: f64,
    ) -> Self {
        Decomposed::new(design, targets, outputs).factor(initial_covariance)
    }

    /// Takes in the samples of `design` with their `targets` (`samples × outputs`) one after another, with a penalty of
    /// 1/`initial_covariance` on squared weights; see [`Rls`].
    ///
    /// # Panics
    /// If `initial_covariance` is not positive and finite, or a sample cannot be used.
    pub fn by_recursion(
        design: &(impl Design + ?Sized),
        targets: &[f64],
        outputs: usize,
        initial_covariance: f64,
    ) -> Self {
        let n = design.regressors();
        let mut rls = Rls::new([n, outputs], initial_covariance, 1.0).expect("a covariance");
        let mut values = vec![0.0; FILLED * n];
        for (piece, targets) in targets.chunks(FILLED * outputs).enumerate() {
            let (first, count) = (piece * FILLED, targets.len() / outputs);
            design.fill(first..first + count, &mut values[..count * n]);
            for (h, target) in values.chunks_exact_mut(n).zip(targets.chunks_exact(outputs)) {
                rls.update(h, &mut target.to_vec()).expect("numbers that f32 holds");
            }
        }
        let Rls { root, projection, .. } = rls;
        Self { root, projection, regressors: n, outputs }
    }

    /// Weights, `regressors × outputs`, by back substitution.
    pub fn weights(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.regressors * self.outputs];
        rls::solve(&self.root, &self.projection, self.regressors, &mut weights);
        weights
    }
}

/// Samples that a thread decomposes before its triangle is merged with others.
fn piece(samples: usize, regressors: usize) -> usize {
    // Merging costs as much as absorbing half as many samples as there are regressors.
    samples.div_ceil(8).max(1024).max(4 * regressors)
}

/// Samples whose regressors are computed at once: they stay in the first cache until they are laid out
/// in tiles.
const FILLED: usize = 8;

fn decompose(
    design: &(impl Design + ?Sized),
    targets: &[f64],
    outputs: usize,
    samples: Range<usize>,
) -> Triangle {
    let n = design.regressors();
    let (mut triangle, mut new_rows) = (Triangle::new(n, outputs), NewRows::new(n, outputs));
    let mut values = vec![0.0; FILLED * n];
    for first in samples.clone().step_by(ROWS_AT_ONCE) {
        let last = samples.end.min(first + ROWS_AT_ONCE);
        new_rows.clear();
        for start in (first..last).step_by(FILLED) {
            let run = start..last.min(start + FILLED);
            let values = &mut values[..run.len() * n];
            design.fill(run.clone(), values);
            let targets = targets[run.start * outputs..].chunks_exact(outputs);
            for (row, (values, targets)) in values.chunks_exact(n).zip(targets).enumerate() {
                new_rows.set(start - first + row, values, targets);
            }
        }
        triangle.absorb(&mut new_rows);
    }
    triangle
}

#[cfg(test)]
mod tests;

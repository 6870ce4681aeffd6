//! Output weights: least squares over all samples, by a QR decomposition or by recursion.
//!
//! The weights minimise Σ_t ‖y_t − Wᵀh_t‖² + ‖W‖²/δ. The [recursion](crate::rls) from covariance δ·I without forgetting
//! arrives at the same weights sample by sample. Taking many samples at once ([`Decomposed`]) changes the order of
//! rounding only.

use std::ops::Range;

use crate::parallel;
use crate::rls::{self, Rls};

mod exp;
mod gaussian;
mod triangle;

pub(crate) use exp::exponentiate_non_positive;
pub(crate) use gaussian::squared_distances;
pub use gaussian::{Gaussians, Regressors};
pub use triangle::ROWS_AT_ONCE;
use triangle::{NewRows, Triangle};

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

/// Targets of a set of samples: what weights are fitted to.
pub trait Targets: Sync {
    /// Number of values: samples times outputs.
    fn count(&self) -> usize;

    /// Writes the targets of `samples` into `values` (`samples × outputs`, row-major), as
    /// [`Design::fill`] writes regressors.
    fn fill(&self, samples: Range<usize>, values: &mut [f64]);
}

impl<T: AsRef<[f64]> + Sync + ?Sized> Targets for T {
    fn count(&self) -> usize {
        self.as_ref().len()
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let outputs = values.len() / samples.len().max(1);
        values.copy_from_slice(&self.as_ref()[samples.start * outputs..samples.end * outputs]);
    }
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
    pub fn new(
        design: &(impl Design + ?Sized),
        targets: &(impl Targets + ?Sized),
        outputs: usize,
    ) -> Self {
        let regressors = design.regressors();
        let samples = targets.count() / outputs;
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
        targets: &(impl Targets + ?Sized),
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
        targets: &(impl Targets + ?Sized),
        outputs: usize,
        initial_covariance: f64,
    ) -> Self {
        let n = design.regressors();
        let mut rls = Rls::new([n, outputs], initial_covariance, 1.0).expect("a covariance");
        let (mut values, mut wanted) = (vec![0.0; FILLED * n], vec![0.0; FILLED * outputs]);
        let samples = targets.count() / outputs;
        for first in (0..samples).step_by(FILLED) {
            let run = first..samples.min(first + FILLED);
            let (values, wanted) =
                (&mut values[..run.len() * n], &mut wanted[..run.len() * outputs]);
            design.fill(run.clone(), values);
            targets.fill(run, wanted);
            for (h, target) in values.chunks_exact_mut(n).zip(wanted.chunks_exact_mut(outputs)) {
                rls.update(h, target).expect("numbers that f32 holds");
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
    targets: &(impl Targets + ?Sized),
    outputs: usize,
    samples: Range<usize>,
) -> Triangle {
    let n = design.regressors();
    let (mut triangle, mut new_rows) = (Triangle::new(n, outputs), NewRows::new(n, outputs));
    let (mut values, mut wanted) = (vec![0.0; FILLED * n], vec![0.0; FILLED * outputs]);
    for first in samples.clone().step_by(ROWS_AT_ONCE) {
        let last = samples.end.min(first + ROWS_AT_ONCE);
        new_rows.clear();
        for start in (first..last).step_by(FILLED) {
            let run = start..last.min(start + FILLED);
            let (values, wanted) =
                (&mut values[..run.len() * n], &mut wanted[..run.len() * outputs]);
            design.fill(run.clone(), values);
            targets.fill(run, wanted);
            let rows = values.chunks_exact(n).zip(wanted.chunks_exact(outputs));
            for (row, (values, targets)) in rows.enumerate() {
                new_rows.set(start - first + row, values, targets);
            }
        }
        triangle.absorb(&mut new_rows);
    }
    triangle
}

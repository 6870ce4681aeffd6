//! Output weights: recursive least squares over the samples, and its batch oracle.

use model_core::rls;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::squared_distance;
use crate::dataset::Table;

/// What the output weights multiply: activations, then the scaled inputs if there is an affine
/// tail, then 1 for the bias.
#[derive(Debug, Clone, Copy)]
pub struct Regressors<'c> {
    /// Centres on scaled inputs, one after the other; none for a linear decoder.
    pub centres: &'c [f64],
    /// Inputs.
    pub inputs: usize,
    /// 1/(2σ²).
    pub decay: f64,
    /// Whether the scaled inputs take part.
    pub affine_tail: bool,
}

impl Regressors<'_> {
    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.centres.len() / self.inputs + if self.affine_tail { self.inputs } else { 0 } + 1
    }

    /// Their values for one sample's scaled inputs, into `values`.
    pub fn evaluate(&self, scaled: &[f64], values: &mut [f64]) {
        let activations = self
            .centres
            .chunks_exact(self.inputs)
            .map(|centre| libm::exp(-self.decay * squared_distance(scaled, centre)));
        let tail = if self.affine_tail { scaled } else { &[] };
        let all = activations.chain(tail.iter().copied()).chain([1.0]);
        values.iter_mut().zip(all).for_each(|(place, value)| *place = value);
    }
}

/// A recursive least-squares fit in progress ([`model_core::rls`] with sizes known at run time).
#[derive(Debug, Clone, PartialEq)]
pub struct Recursion {
    information_root: Vec<f64>,
    projection: Vec<f64>,
    regressors: usize,
    outputs: usize,
}

impl Recursion {
    /// No sample and no prior yet.
    #[must_use]
    pub fn blank(regressors: usize, outputs: usize) -> Self {
        Self {
            information_root: vec![0.0; regressors * regressors],
            projection: vec![0.0; regressors * outputs],
            regressors,
            outputs,
        }
    }

    /// No sample yet, weights 0 with covariance `initial_covariance`·I.
    ///
    /// # Panics
    /// If `initial_covariance` is not positive and finite.
    #[must_use]
    pub fn new(regressors: usize, outputs: usize, initial_covariance: f64) -> Self {
        let mut this = Self::blank(regressors, outputs);
        let started = rls::start(
            &mut this.information_root,
            &mut this.projection,
            regressors,
            initial_covariance,
        );
        started.expect("a positive finite initial covariance");
        this
    }

    /// Takes in one sample. Both slices are working space afterwards.
    pub fn update(&mut self, regressor: &mut [f64], target: &mut [f64]) {
        rls::update(&mut self.information_root, &mut self.projection, regressor, target, 1.0);
    }

    /// Takes in all that another recursion has seen.
    pub fn merge(&mut self, mut other: Self) {
        let rows = other.information_root.chunks_exact_mut(self.regressors);
        for (r, z) in rows.zip(other.projection.chunks_exact_mut(self.outputs)) {
            self.update(r, z);
        }
    }

    /// Weights so far: `regressors × outputs`.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.regressors * self.outputs];
        rls::solve(&self.information_root, &self.projection, self.regressors, &mut weights);
        weights
    }
}

/// Samples one recursion takes before its result is merged. Fixed by the number of samples, so
/// that the result is the same on any number of threads.
fn piece(samples: usize) -> usize {
    samples.div_ceil(8).max(1024)
}

/// Streams all samples through recursive least squares and returns `regressors × outputs` weights.
#[must_use]
pub fn fit(
    regressors: &Regressors<'_>,
    scaled: &[f64],
    outputs: &Table,
    initial_covariance: f64,
) -> Vec<f64> {
    let (n, o) = (regressors.count(), outputs.names.len());
    let piece = piece(outputs.len());
    let pieces =
        scaled.par_chunks(piece * regressors.inputs).zip(outputs.values.par_chunks(piece * o));
    let parts: Vec<Recursion> = pieces
        .map(|(inputs, targets)| {
            let mut recursion = Recursion::blank(n, o);
            let (mut regressor, mut target) = (vec![0.0; n], vec![0.0; o]);
            let samples = inputs.chunks_exact(regressors.inputs).zip(targets.chunks_exact(o));
            for (input, output) in samples {
                regressors.evaluate(input, &mut regressor);
                target.copy_from_slice(output);
                recursion.update(&mut regressor, &mut target);
            }
            recursion
        })
        .collect();
    let mut whole = Recursion::new(n, o, initial_covariance);
    parts.into_iter().for_each(|part| whole.merge(part));
    whole.weights()
}

/// The batch oracle: ridge regression with penalty 1/δ through a QR decomposition of all samples
/// at once. Needs memory for all of them; for tests and comparisons.
///
/// # Panics
/// If `initial_covariance` is so large that the ridge no longer keeps R regular.
#[must_use]
pub fn fit_batch(
    regressors: &Regressors<'_>,
    scaled: &[f64],
    outputs: &Table,
    initial_covariance: f64,
) -> Vec<f64> {
    let (n, o, samples) = (regressors.count(), outputs.names.len(), outputs.len());
    let mut h = DMatrix::zeros(samples + n, n);
    let mut row = vec![0.0; n];
    for (i, input) in scaled.chunks_exact(regressors.inputs).enumerate() {
        regressors.evaluate(input, &mut row);
        row.iter().enumerate().for_each(|(j, value)| h[(i, j)] = *value);
    }
    let root = 1.0 / initial_covariance.sqrt();
    (0..n).for_each(|i| h[(samples + i, i)] = root);
    let qr = h.qr();
    let r = qr.r();
    let mut weights = vec![0.0; n * o];
    for output in 0..o {
        let mut y = DVector::zeros(samples + n);
        outputs.lines().enumerate().for_each(|(i, line)| y[i] = line[output]);
        qr.q_tr_mul(&mut y);
        let solved = r.solve_upper_triangular(&y.rows(0, n)).expect("the ridge keeps R regular");
        solved.iter().enumerate().for_each(|(i, w)| weights[i * o + output] = *w);
    }
    weights
}

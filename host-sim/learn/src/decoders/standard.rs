//! Baseline: the paper's *standard* network, in which every training sample is a centre (K = N) and the
//! weights interpolate exactly. It is not meant for a device, so it stays in f64.

use nalgebra::DMatrix;
use taxel_data::Dataset;

use super::RowDecoder;
use crate::train::least_squares::Regressors;
use crate::train::{InputScale, Samples};

/// Name of the decoder in tables and results.
pub const NAME: &str = "standard";

/// Network that interpolates its training samples exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardNetwork {
    scale: InputScale,
    inputs: usize,
    centres: Vec<f64>,
    decay: [f64; 1],
    /// Weights, `centres × outputs`.
    weights: Vec<f64>,
    outputs: usize,
}

impl StandardNetwork {
    /// Interpolates all samples of `table` with width `spread` on scaled inputs.
    ///
    /// Returns `None` where the interpolation matrix is singular (duplicates), or so nearly singular
    /// that the solution misses the samples by more than a thousandth (a spread far above the
    /// distances).
    pub fn fit(table: &Dataset, spread: f64) -> Option<Self> {
        let samples = Samples::new(table);
        let (count, outputs) = (table.inputs.len(), table.outputs.names.len());
        let decay = [1.0 / (2.0 * spread * spread)];
        let this = Self {
            inputs: samples.inputs(),
            centres: samples.scaled(),
            scale: samples.scale,
            decay,
            weights: Vec::new(),
            outputs,
        };
        let mut interpolation = DMatrix::zeros(count, count);
        let mut row = vec![0.0; count + 1];
        for (i, sample) in this.centres.chunks_exact(table.inputs.names.len()).enumerate() {
            this.regressors(table.inputs.names.len()).evaluate(sample, &mut row);
            (0..count).for_each(|j| interpolation[(i, j)] = row[j]);
        }
        let targets = DMatrix::from_row_slice(count, outputs, &table.outputs.values);
        let solved = interpolation.clone().lu().solve(&targets)?;
        if !solved.iter().all(|w| w.is_finite()) {
            return None;
        }
        let residual = (&interpolation * &solved - &targets).norm();
        if residual > 1e-3 * targets.norm() {
            return None;
        }
        let weights = solved.transpose().as_slice().to_vec();
        Some(Self { weights, ..this })
    }

    fn regressors(&self, inputs: usize) -> Regressors<'_> {
        Regressors { centres: &self.centres, inputs, decays: &self.decay, affine_tail: false }
    }
}

impl RowDecoder for StandardNetwork {
    fn predict(&self, readings: &[f64]) -> Vec<f64> {
        let inputs = self.inputs;
        let regressors = self.regressors(inputs);
        let mut row = vec![0.0; self.centres.len() / inputs];
        let mut predicted = Vec::with_capacity(readings.len() / inputs * self.outputs);
        for line in self.scale.apply(readings).chunks_exact(inputs) {
            regressors.evaluate(line, &mut row); // the bias's 1 has no place in the row and is dropped
            let start = predicted.len();
            predicted.resize(start + self.outputs, 0.0);
            for (activation, weights) in row.iter().zip(self.weights.chunks_exact(self.outputs)) {
                predicted[start..].iter_mut().zip(weights).for_each(|(y, w)| *y += activation * w);
            }
        }
        predicted
    }
}

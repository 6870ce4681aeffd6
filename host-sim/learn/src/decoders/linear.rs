//! The best linear decoder of each row-wire: a baseline that a network must beat.

use taxel_data::dataset::{Block, Dataset};

use super::{RowDecoder, Rows};
use crate::train::least_squares::{self, Regressors};
use crate::train::{INITIAL_COVARIANCE, InputScale, Samples};

/// Name in tables and results.
pub const NAME: &str = "linear";

/// y = A·x + b on scaled inputs, by least squares.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearRow {
    scale: InputScale,
    inputs: usize,
    /// `inputs × outputs`.
    slope: Vec<f64>,
    bias: Vec<f64>,
}

/// The best linear decoder of every row of `training`.
#[must_use]
pub fn fit(training: &Dataset) -> Rows<LinearRow> {
    Rows::fit(NAME, training, LinearRow::fit)
}

impl LinearRow {
    /// The best linear decoder of `block` in the sense of least squares.
    #[must_use]
    pub fn fit(block: &Block) -> Self {
        let samples = Samples::new(block);
        let inputs = samples.inputs();
        let regressors = Regressors { centres: &[], inputs, decay: 1.0, affine_tail: true };
        let mut slope =
            least_squares::fit(&regressors, &samples.scaled, &block.outputs, INITIAL_COVARIANCE);
        let bias = slope.split_off(slope.len() - block.outputs.names.len());
        Self { scale: samples.scale, inputs, slope, bias }
    }
}

impl RowDecoder for LinearRow {
    fn predict(&self, readings: &[f64]) -> Vec<f64> {
        let outputs = self.bias.len();
        let scaled = self.scale.apply(readings);
        let mut predicted = Vec::with_capacity(readings.len() / self.inputs.max(1) * outputs);
        for line in scaled.chunks_exact(self.inputs) {
            let start = predicted.len();
            predicted.extend_from_slice(&self.bias);
            for (x, slope) in line.iter().zip(self.slope.chunks_exact(outputs)) {
                predicted[start..].iter_mut().zip(slope).for_each(|(y, a)| *y += a * x);
            }
        }
        predicted
    }
}

//! Baselines that a network must beat: the mean, and the best linear decoder.

use super::least_squares::{self, Regressors};
use super::{INITIAL_COVARIANCE, InputScale, Samples};
use crate::dataset::Block;

/// y = A·x + b on scaled inputs, by least squares; or y = b, the mean of the training outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearDecoder {
    scale: InputScale,
    /// `inputs × outputs`, or empty.
    slope: Vec<f64>,
    bias: Vec<f64>,
}

impl LinearDecoder {
    /// The best linear decoder of `block` in the sense of least squares.
    #[must_use]
    pub fn fit(block: &Block) -> Self {
        let samples = Samples::new(block);
        let regressors =
            Regressors { centres: &[], inputs: samples.inputs(), decay: 1.0, affine_tail: true };
        let mut slope =
            least_squares::fit(&regressors, &samples.scaled, &block.outputs, INITIAL_COVARIANCE);
        let bias = slope.split_off(slope.len() - block.outputs.names.len());
        Self { scale: samples.scale, slope, bias }
    }

    /// Always answers the mean of `block`'s outputs.
    #[must_use]
    pub fn mean(block: &Block) -> Self {
        Self { scale: InputScale::of(block), slope: Vec::new(), bias: block.outputs.means() }
    }

    /// Outputs for every line of `block`'s inputs.
    #[must_use]
    pub fn predict(&self, block: &Block) -> Vec<f64> {
        let outputs = self.bias.len();
        let scaled = self.scale.apply(block);
        let mut predicted = Vec::with_capacity(block.inputs.len() * outputs);
        for line in scaled.chunks_exact(block.inputs.names.len()) {
            let start = predicted.len();
            predicted.extend_from_slice(&self.bias);
            for (x, slope) in line.iter().zip(self.slope.chunks_exact(outputs)) {
                predicted[start..].iter_mut().zip(slope).for_each(|(y, a)| *y += a * x);
            }
        }
        predicted
    }
}

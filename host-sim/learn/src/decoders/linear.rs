//! Baseline: the best linear decoder of each row-wire, which a network must beat.

use taxel_data::Dataset;

use super::{RowDecoder, Rows};
use crate::train::least_squares::{Factor, Regressors};
use crate::train::tasks::{Factors, Task};
use crate::train::{INITIAL_COVARIANCE, InputScale};

/// Name of the decoder in tables and results.
pub const NAME: &str = "linear";

/// Linear decoder y = A·x + b on scaled inputs, fitted by least squares.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearRow {
    scale: InputScale,
    inputs: usize,
    /// Matrix A, `inputs × outputs`.
    slope: Vec<f64>,
    bias: Vec<f64>,
}

/// Fits the best linear decoder of every row of `training`.
pub fn fit(training: &Dataset) -> Rows<LinearRow> {
    Rows::fit(NAME, training, LinearRow::fit)
}

impl LinearRow {
    /// Fits the best linear decoder of `table` in the sense of least squares, each output on the lines that have it.
    pub fn fit(table: &Dataset) -> Self {
        let (scale, inputs) = (InputScale::new(table), table.inputs.names.len());
        let regressors = Regressors { centres: &[], inputs, decays: &[1.0], affine_tail: true };
        let factor = |task: Task<'_>| {
            let design = regressors.of(scale.apply(&task.table.inputs.values));
            let outputs = task.columns.len();
            (task.columns, Factor::new(&design, &task.targets, outputs, INITIAL_COVARIANCE))
        };
        let tasks = Task::all(table, &table.outputs);
        let mut slope = Factors(tasks.into_iter().map(factor).collect()).weights();
        let bias = slope.split_off(slope.len() - table.outputs.names.len());
        Self { scale, inputs, slope, bias }
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

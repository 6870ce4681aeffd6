//! Baseline: the best linear decoder of each row-wire, which a network must beat.

use taxel_data::Dataset;
use taxel_data::table::ranges;

use super::{RowDecoder, Rows};
use crate::train::least_squares::Factor;
use crate::train::tasks::{Factors, Task, Weighed};
use crate::train::{INITIAL_COVARIANCE, InputScale, Samples};

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

/// Fits the best linear decoder of every row to these `lines` of `training`.
pub fn fit(training: &Dataset, lines: &[usize]) -> Rows<LinearRow> {
    Rows::fit(NAME, training, |table| LinearRow::fit(table, lines))
}

impl LinearRow {
    /// Fits the best linear decoder of these `lines` of `table` in the sense of least squares, each output on the lines that
    /// have it.
    ///
    /// # Panics
    /// If there is no such line.
    pub fn fit(table: &Dataset, lines: &[usize]) -> Self {
        let (inputs, outputs) = (table.inputs.names.len(), table.outputs.names.len());
        let readings = lines.iter().map(|line| table.inputs.line(*line));
        let scale = InputScale::of_ranges(&ranges(readings, inputs));
        let (samples, means) = (Samples::new(table), vec![0.0; outputs]);
        let factor = |task: &Task| {
            let write = |readings: &[f64], values: &mut [f64]| {
                let scaled = scale.apply(readings);
                let lines = values.chunks_exact_mut(inputs + 1).zip(scaled.chunks_exact(inputs));
                for (values, scaled) in lines {
                    values[..inputs].copy_from_slice(scaled);
                    values[inputs] = 1.0;
                }
            };
            let (regressors, write) = (inputs + 1, Box::new(write));
            let (samples, means) = (&samples, &means[..]);
            let samples = Weighed { samples, means, task, regressors, write };
            let factor = Factor::new(&samples, &samples, task.columns.len(), INITIAL_COVARIANCE);
            (task.columns.clone(), factor)
        };
        let tasks = Task::all(&table.outputs, lines);
        let mut slope = Factors(tasks.iter().map(factor).collect()).weights();
        let bias = slope.split_off(slope.len() - outputs);
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

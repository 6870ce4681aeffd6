//! The paper's network in f64, on readings over their maximum, with a chosen penalty: what scene `paper-as-printed` takes
//! of what the paper leaves open. It is not meant for a device.

use std::sync::Arc;

use taxel_data::{Dataset, Random};

use super::RowDecoder;
use crate::train::kmeans;
use crate::train::least_squares::{Design as _, Factor, Regressors};

/// Gaussians of a row's network on scaled inputs, before widths and weights are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Textbook {
    /// Factor that scales each input.
    scale: Vec<f64>,
    /// Centres on scaled inputs, `centres × inputs`.
    pub centres: Vec<f64>,
}

impl Textbook {
    /// Divides the inputs of `table` by their maxima and places `centres` centres by K-means; with as many centres as
    /// lines, every line is one.
    pub fn new(table: &Dataset, centres: usize, random: &mut Random) -> Self {
        let ranges = table.inputs.ranges();
        let factor = |[_, high]: &[f64; 2]| if *high == 0.0 { 0.0 } else { 1.0 / high };
        let scale = ranges.iter().map(factor).collect();
        let mut this = Self { scale, centres: Vec::new() };
        let scaled = this.scaled(&table.inputs.values);
        this.centres = if centres < table.inputs.len() {
            let search = kmeans::Search { restarts: 1, ..kmeans::Search::default() };
            kmeans::fit(&scaled, this.inputs(), centres, &search, random).centres
        } else {
            scaled
        };
        this
    }

    fn inputs(&self) -> usize {
        self.scale.len()
    }

    fn scaled(&self, readings: &[f64]) -> Vec<f64> {
        let of_line = |line: &[f64]| -> Vec<f64> {
            line.iter().zip(&self.scale).map(|(r, f)| r * f).collect()
        };
        readings.chunks_exact(self.inputs()).flat_map(of_line).collect()
    }

    /// Fits the weights of a network with this `spread` to `table`. The penalty on squared weights is 1/δ, one over the
    /// `initial_covariance`.
    pub fn fit(
        self: &Arc<Self>,
        table: &Dataset,
        spread: f64,
        initial_covariance: f64,
    ) -> TextbookNetwork {
        let decay = 0.5 / (spread * spread);
        let (scaled, outputs) = (self.scaled(&table.inputs.values), table.outputs.names.len());
        let regressors = self.regressors(&decay);
        let gaussians = regressors.of(&scaled);
        let targets = &table.outputs.values[..];
        let factor = Factor::new(&gaussians, targets, outputs, initial_covariance);
        TextbookNetwork { hidden: Arc::clone(self), decay, weights: factor.weights(), outputs }
    }

    fn regressors<'s>(&'s self, decay: &'s f64) -> Regressors<'s> {
        let decays = std::slice::from_ref(decay);
        Regressors { centres: &self.centres, inputs: self.inputs(), decays, affine_tail: false }
    }
}

/// Network of a row-wire in f64.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookNetwork {
    hidden: Arc<Textbook>,
    decay: f64,
    /// Weights, `regressors × outputs`; the bias last.
    pub weights: Vec<f64>,
    outputs: usize,
}

impl RowDecoder for TextbookNetwork {
    fn predict(&self, readings: &[f64]) -> Vec<f64> {
        /// Lines whose activations stay in the first cache.
        const LINES: usize = 16;
        let scaled = self.hidden.scaled(readings);
        let regressors = self.hidden.regressors(&self.decay);
        let design = regressors.of(&scaled);
        let (lines, n) = (readings.len() / self.hidden.inputs(), design.regressors());
        let mut predicted = vec![0.0; lines * self.outputs];
        let mut activations = vec![0.0; LINES * n];
        for (block, outputs) in predicted.chunks_mut(LINES * self.outputs).enumerate() {
            let start = block * LINES;
            let run = start..lines.min(start + LINES);
            let activations = &mut activations[..run.len() * n];
            design.fill(run, activations);
            let outputs = outputs.chunks_exact_mut(self.outputs);
            for (line, outputs) in activations.chunks_exact(n).zip(outputs) {
                let weights = self.weights.chunks_exact(self.outputs);
                for (activation, weights) in line.iter().zip(weights) {
                    outputs.iter_mut().zip(weights).for_each(|(y, w)| *y += activation * w);
                }
            }
        }
        predicted
    }
}

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
    centres: Vec<f64>,
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
    weights: Vec<f64>,
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

#[cfg(test)]
mod tests {
    use taxel_data::Table;
    use taxel_data::random::{Purpose, Stream};

    use super::*;

    fn table() -> Dataset {
        let values =
            |of: fn(f64) -> [f64; 2]| (0..40).flat_map(|i| of(f64::from(i) / 40.0)).collect();
        let named =
            |names: [&str; 2], values| Table { names: names.map(String::from).to_vec(), values };
        Dataset {
            inputs: named(["a", "b"], values(|t| [50.0 + 10.0 * t, 80.0 - 20.0 * t * t])),
            outputs: named(["y", "z"], values(|t| [t.sin(), 1.0 - t])),
            ..Dataset::empty(vec![], vec![], 1, 0)
        }
    }

    #[test]
    fn each_output_has_the_weights_of_a_network_for_it_alone() {
        let both = table();
        let random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
        let fit = |table: &Dataset| {
            let hidden = Textbook::new(table, 7, &mut random.clone());
            Arc::new(hidden).fit(table, 0.1, 1e6)
        };
        let together = fit(&both);
        for output in 0..2 {
            let alone = fit(&Dataset { outputs: both.outputs.columns(output, 1), ..both.clone() });
            assert_eq!(alone.hidden.centres, together.hidden.centres, "outputs take no part");
            let of_both = together.weights.iter().skip(output).step_by(2);
            for (a, b) in alone.weights.iter().zip(of_both) {
                assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
            }
        }
    }

    #[test]
    fn centres_at_all_lines_interpolate_without_a_penalty() {
        let table = table();
        let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
        let hidden = Arc::new(Textbook::new(&table, 40, &mut random));
        let highest = hidden.centres.iter().copied().fold(0.0, f64::max);
        assert!((highest - 1.0).abs() < 1e-12, "{highest}");
        let fit = |covariance| hidden.fit(&table, 0.005, covariance);
        let [exact, nothing] = [1e12, 1e-12].map(|it| fit(it).predict(&table.inputs.values));
        let far = |predicted: &[f64]| {
            let pairs = predicted.iter().zip(table.outputs.values.iter());
            pairs.map(|(p, y)| (p - y).abs()).fold(0.0, f64::max)
        };
        assert!(far(&exact) < 1e-6, "{}", far(&exact));
        assert!(nothing.iter().all(|p| p.abs() < 1e-9));
    }
}

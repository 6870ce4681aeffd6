//! The paper's network in f64, with every choice that the paper leaves open: what inputs are scaled by, what *spread*
//! means, whether there is a bias, and how strong the penalty is. It is not meant for a device.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use taxel_data::{Random, RowTable, Table};

use super::RowDecoder;
use crate::train::kmeans;
use crate::train::least_squares::{Design, Factor, Regressors};

/// What each input is scaled by. All are idioms of the toolboxes of the paper's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scaling {
    /// Its minimum and maximum become 0 and 1.
    Range,
    /// Its minimum and maximum become −1 and 1.
    Symmetric,
    /// It is divided by its maximum.
    Maximum,
    /// Minimum and maximum of all inputs become 0 and 1.
    CommonRange,
    /// Its mean becomes 0, its standard deviation 1.
    Standard,
}

/// What a Gaussian's *spread* is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpreadMeaning {
    /// σ in exp(−d²/2σ²).
    Sigma,
    /// Distance at which the Gaussian has half its height: exp(−(0.8326·d/spread)²).
    HalfHeight,
}

impl SpreadMeaning {
    /// Decay a of exp(−a·d²) for this `spread`.
    pub fn decay(self, spread: f64) -> f64 {
        match self {
            Self::Sigma => 0.5 / (spread * spread),
            Self::HalfHeight => std::f64::consts::LN_2 / (spread * spread),
        }
    }
}

/// Gaussians of a row's network on scaled inputs, before widths and weights are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Textbook {
    /// Offset and factor that scale each input.
    scale: Vec<[f64; 2]>,
    /// Centres on scaled inputs, `centres × inputs`.
    centres: Vec<f64>,
}

impl Textbook {
    /// Scales the inputs of `table` and places `centres` centres by K-means; with as many centres as lines, every line
    /// is one.
    pub fn new(table: &RowTable, scaling: Scaling, centres: usize, random: &mut Random) -> Self {
        let scale = scale(&table.inputs, scaling);
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
            line.iter()
                .zip(&self.scale)
                .map(|(r, [offset, factor])| (r - offset) * factor)
                .collect()
        };
        readings.chunks_exact(self.inputs()).flat_map(of_line).collect()
    }

    /// Fits the weights of a network with this `decay` to `table`. The penalty on squared weights is 1/δ, one over the
    /// `initial_covariance`.
    pub fn fit(
        self: &Arc<Self>,
        table: &RowTable,
        decay: f64,
        bias: bool,
        initial_covariance: f64,
    ) -> TextbookNetwork {
        let (scaled, outputs) = (self.scaled(&table.inputs.values), table.outputs.names.len());
        let regressors = self.regressors(&decay);
        let gaussians = regressors.of(&scaled);
        let targets = &table.outputs.values;
        let factor = if bias {
            Factor::new(&gaussians, targets, outputs, initial_covariance)
        } else {
            Factor::new(&WithoutBias(&gaussians), targets, outputs, initial_covariance)
        };
        TextbookNetwork {
            hidden: Arc::clone(self),
            decay,
            bias,
            weights: factor.weights(),
            outputs,
        }
    }

    fn regressors<'s>(&'s self, decay: &'s f64) -> Regressors<'s> {
        let decays = std::slice::from_ref(decay);
        Regressors { centres: &self.centres, inputs: self.inputs(), decays, affine_tail: false }
    }
}

/// Offset and factor for each input of `inputs`; an input that never changes becomes 0.
fn scale(inputs: &Table, scaling: Scaling) -> Vec<[f64; 2]> {
    let per = |span: f64| if span == 0.0 { 0.0 } else { 1.0 / span };
    let ranges = inputs.ranges();
    let ranges = ranges.iter();
    match scaling {
        Scaling::Range => ranges.map(|[low, high]| [*low, per(high - low)]).collect(),
        Scaling::Symmetric => {
            ranges.map(|[low, high]| [0.5 * (low + high), 2.0 * per(high - low)]).collect()
        }
        Scaling::Maximum => ranges.map(|[_, high]| [0.0, per(*high)]).collect(),
        Scaling::CommonRange => {
            let (low, high) = ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), range| {
                (l.min(range[0]), h.max(range[1]))
            });
            vec![[low, per(high - low)]; inputs.names.len()]
        }
        Scaling::Standard => {
            let moments = inputs.means().into_iter().zip(inputs.deviations());
            moments.map(|(mean, deviation)| [mean, per(deviation)]).collect()
        }
    }
}

/// Regressors without their last, the bias.
struct WithoutBias<'d, D>(&'d D);

impl<D: Design> Design for WithoutBias<'_, D> {
    fn regressors(&self) -> usize {
        self.0.regressors() - 1
    }

    fn fill(&self, samples: std::ops::Range<usize>, values: &mut [f64]) {
        let n = self.regressors();
        let mut all = vec![0.0; samples.len() * (n + 1)];
        self.0.fill(samples, &mut all);
        let lines = values.chunks_exact_mut(n).zip(all.chunks_exact(n + 1));
        lines.for_each(|(line, all)| line.copy_from_slice(&all[..n]));
    }
}

/// Network of a row-wire in f64.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookNetwork {
    hidden: Arc<Textbook>,
    decay: f64,
    bias: bool,
    /// Weights, `regressors × outputs`; the bias last, if there is one.
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
        let used = if self.bias { n } else { n - 1 };
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
                for (activation, weights) in line[..used].iter().zip(weights) {
                    outputs.iter_mut().zip(weights).for_each(|(y, w)| *y += activation * w);
                }
            }
        }
        predicted
    }
}

#[cfg(test)]
mod tests {
    use taxel_data::random::{Purpose, Stream};

    use super::*;

    fn table() -> RowTable {
        let values =
            |of: fn(f64) -> [f64; 2]| (0..40).flat_map(|i| of(f64::from(i) / 40.0)).collect();
        let named =
            |names: [&str; 2], values| Table { names: names.map(String::from).to_vec(), values };
        RowTable {
            inputs: named(["a", "b"], values(|t| [50.0 + 10.0 * t, 80.0 - 20.0 * t * t])),
            outputs: named(["y", "z"], values(|t| [t.sin(), 1.0 - t])),
            common_span: false,
        }
    }

    #[test]
    fn every_scaling_does_what_its_name_says() {
        let (table, random) = (table(), Random::new(1, Stream::Training, Purpose::Centres, 0, 0));
        let ranges = |scaling| {
            let scaled = Textbook::new(&table, scaling, 40, &mut random.clone()).centres;
            Table { names: table.inputs.names.clone(), values: scaled }
        };
        let range = ranges(Scaling::Range).ranges();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(range.iter().all(|[low, high]| near(*low, 0.0) && near(*high, 1.0)), "{range:?}");
        let symmetric = ranges(Scaling::Symmetric).ranges();
        assert!(
            symmetric.as_flattened().iter().all(|v| (v.abs() - 1.0).abs() < 1e-12),
            "{symmetric:?}"
        );
        let maximum = ranges(Scaling::Maximum).ranges();
        assert!(maximum.iter().all(|[low, high]| *low > 0.7 && near(*high, 1.0)), "{maximum:?}");
        let common = ranges(Scaling::CommonRange).ranges();
        assert!(near(common[0][0], 0.0) && near(common[1][1], 1.0), "{common:?}");
        let standard = ranges(Scaling::Standard);
        assert!(standard.means().iter().all(|mean| mean.abs() < 1e-12));
        assert!(standard.deviations().iter().all(|deviation| (deviation - 1.0).abs() < 1e-12));
    }

    #[test]
    fn half_its_height_is_at_the_spread() {
        assert!(((-SpreadMeaning::HalfHeight.decay(0.3) * 0.09).exp() - 0.5).abs() < 1e-12);
        assert!(((-SpreadMeaning::Sigma.decay(0.3) * 0.09).exp() - (-0.5_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn each_output_has_the_weights_of_a_network_for_it_alone() {
        let both = table();
        let random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
        let fit = |table: &RowTable| {
            let hidden = Textbook::new(table, Scaling::Range, 7, &mut random.clone());
            Arc::new(hidden).fit(table, 40.0, true, 1e6)
        };
        let together = fit(&both);
        for output in 0..2 {
            let alone = fit(&RowTable { outputs: both.outputs.columns(output, 1), ..both.clone() });
            assert_eq!(alone.hidden.centres, together.hidden.centres, "outputs take no part");
            let of_both = together.weights.iter().skip(output).step_by(2);
            for (a, b) in alone.weights.iter().zip(of_both) {
                assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
            }
        }
    }

    #[test]
    fn as_many_centres_as_lines_interpolate_and_a_large_penalty_predicts_nothing() {
        let table = table();
        let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
        let hidden = Arc::new(Textbook::new(&table, Scaling::Range, 40, &mut random));
        let fit = |covariance| hidden.fit(&table, 5000.0, false, covariance);
        let [exact, nothing] = [1e12, 1e-12].map(|it| fit(it).predict(&table.inputs.values));
        let far = |predicted: &[f64]| {
            let pairs = predicted.iter().zip(&table.outputs.values);
            pairs.map(|(p, y)| (p - y).abs()).fold(0.0, f64::max)
        };
        assert!(far(&exact) < 1e-6, "{}", far(&exact));
        assert!(nothing.iter().all(|p| p.abs() < 1e-9));
        let with_bias = hidden.fit(&table, 5000.0, true, 1e12);
        assert!(far(&with_bias.predict(&table.inputs.values)) < 1e-6);
    }
}

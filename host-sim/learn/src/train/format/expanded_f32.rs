//! Fit of networks in f32 with expanded distances, where their rounding is proved harmless.

use taxel_core::rbf::expanded::{CENTRES_AT_ONCE, Parameters};
use taxel_core::rbf::{Format, Network, Shape};
use taxel_core::scale::{HALF_RANGE, UNITS};

use taxel_data::{RowTable, Table};

use super::super::least_squares::{Design, Regressors};
use super::super::samples::CentredScale;
use super::super::tasks::Factors;
use super::super::{Options, Samples};
use super::{FittedNetwork, Held, Targets, Weights};
use crate::error::Result;
use crate::infer::{Exponential, infer};

/// Largest share of an output's training RMSE that the rounding of exponents may reach.
pub(in crate::train) const HARMLESS: f64 = 0.1;

/// Step through the samples for a first, cheap fit: it sees one in so many.
const FEW: usize = 8;
/// Samples for each weight below which a first fit is skipped, since its weights could have another
/// magnitude.
const SAMPLES_A_WEIGHT: usize = 16;

/// Share of RMSE in a first fit beyond which a full fit is not tried. The two shares differ by less than
/// a factor of two (tested), so the full one could not be below [`HARMLESS`].
pub(super) const HOPELESS: f64 = 2.0 * HARMLESS;

/// One unit of inputs, in spans of the training range.
const UNIT: f64 = HALF_RANGE as f64 / UNITS as f64;

/// Gaussians as this format holds them.
pub(super) struct Expanded {
    inputs: usize,
    affine_tail: bool,
    scale: CentredScale,
    decay: f32,
    /// The decay of eˣ instead of 2ˣ, for inputs scaled to [0, 1].
    natural_decay: f64,
    /// Parameters b and a of every centre, K' of them.
    exponents: Vec<f32>,
    /// Centres that the rounded a stand for, on inputs scaled to [0, 1].
    centres: Vec<f64>,
}

impl Expanded {
    pub(super) fn new(samples: &Samples<'_>, centres: &[f64], options: &Options) -> Self {
        let inputs = samples.inputs();
        let count = centres.len() / inputs;
        let scale = CentredScale::new(samples.table);
        let decay = core::f64::consts::LOG2_E / (2.0 * options.spread.powi(2)) * UNIT * UNIT;
        let decay = decay as f32;
        let twice = 2.0 * f64::from(decay);
        let mut exponents = vec![0.0; count.next_multiple_of(CENTRES_AT_ONCE) * (1 + inputs)];
        let mut rounded = Vec::with_capacity(centres.len());
        let lines = exponents.chunks_exact_mut(1 + inputs);
        for (line, centre) in lines.zip(centres.chunks_exact(inputs)) {
            let mut square = 0.0;
            for ((place, c), still) in line[1..].iter_mut().zip(centre).zip(scale.never_changes()) {
                let c = if still { 0.0 } else { (c - 0.5) / UNIT };
                *place = (twice * c) as f32;
                let c = f64::from(*place) / twice;
                square += c * c;
                rounded.push(0.5 + c * UNIT);
            }
            line[0] = -(f64::from(decay) * square) as f32;
        }
        let affine_tail = options.affine_tail;
        let natural_decay = f64::from(decay) * core::f64::consts::LN_2 / (UNIT * UNIT);
        Self { inputs, affine_tail, scale, decay, natural_decay, exponents, centres: rounded }
    }

    fn regressors(&self) -> Regressors<'_> {
        Regressors {
            centres: &self.centres,
            inputs: self.inputs,
            decays: std::slice::from_ref(&self.natural_decay),
            affine_tail: self.affine_tail,
        }
    }

    /// One in [`FEW`] samples of `table`, for a first fit; `None` where samples are too few for that.
    pub(super) fn few(&self, table: &RowTable) -> Option<RowTable> {
        // A first fit finds most unsuitable networks in an eighth of the time.
        let first = table.outputs.len() >= FEW * SAMPLES_A_WEIGHT * self.regressors().count();
        let every = |table: &Table| Table {
            names: table.names.clone(),
            values: table.lines().step_by(FEW).flatten().copied().collect(),
        };
        first.then(|| RowTable {
            inputs: every(&table.inputs),
            outputs: every(&table.outputs),
            common_span: table.common_span,
        })
    }
}

impl Held for Expanded {
    fn design<'t>(&'t self, table: &'t RowTable) -> Box<dyn Design + 't> {
        Box::new(self.regressors().of(self.scale.apply(table)))
    }

    /// Network whose rounding is not proved harmless yet. It is refused if an exponent could leave its range.
    fn network(&self, factors: &Factors, targets: &Targets) -> Result<FittedNetwork> {
        let (inputs, outputs) = (self.inputs, targets.outputs());
        let count = self.centres.len() / inputs;
        let mut weights = Weights::split(factors.weights(), count, targets);
        // The tail acts on inputs about their middle.
        for row in weights.affine.chunks_exact_mut(outputs) {
            weights.bias.iter_mut().zip(&*row).for_each(|(bias, a)| *bias += 0.5 * a);
            row.iter_mut().for_each(|a| *a *= UNIT);
        }
        let round = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
        let mut output_weights = round(&weights.centres);
        output_weights.resize(count.next_multiple_of(CENTRES_AT_ONCE) * outputs, 0.0);
        let parameters = Parameters {
            input_midpoint: &self.scale.midpoint,
            input_per_unit: &self.scale.per_unit,
            decay: self.decay,
            bias: &round(&weights.bias),
            affine: &round(&weights.affine),
            exponents: &self.exponents,
            output_weights: &output_weights,
        };
        let shape = Shape { inputs, centres: count, outputs };
        let words = parameters.words().collect();
        FittedNetwork::try_new(shape, Format::F32, self.affine_tail, words)
    }
}

/// Largest share of any output's RMSE on `table` that rounding may reach.
pub(in crate::train) fn worst_share(fitted: &FittedNetwork, table: &RowTable) -> f64 {
    let predicted = infer(&fitted.network(), Exponential::default(), &table.inputs.values);
    let squares = table.outputs.squared_errors(&predicted);
    let bounds = rounding_bounds(&fitted.network());
    let shares = squares.iter().zip(table.outputs.counts()).zip(&bounds);
    let shares = shares.map(|((square, count), bound)| bound / (square / count as f64).sqrt());
    shares.fold(0.0, f64::max)
}

/// Bounds on the error of each output of `network` for any reading, in the output's unit.
///
/// They cover rounding in the exponents and the error of 2^u. Empty for networks of other formats.
///
/// With u = 2^−24, an exponent v = b + a·x − g‖x‖² that is summed up with at most d rounded operations a
/// term is off by |δv| ≤ γ_d·(|b| + Σ|aᵢxᵢ| + g‖x‖²), γ_d = d·u/(1 − d·u) (Higham, Accuracy and Stability of
/// Numerical Algorithms, ch. 3). At a distance t from the centre, whose length is c = ‖a‖/2g, no term exceeds
/// what ‖x‖ ≤ c + t leaves: the sum is at most |b| + 2gc(c + t) + g(c + t)², while the activation itself is
/// 2^−gt². Their product has its largest value at a moderate t; an output is off by the sum of these over
/// |ω|.
pub fn rounding_bounds(network: &Network<'_>) -> Vec<f64> {
    let Network::F32(network) = network else { return Vec::new() };
    let (p, Shape { inputs, outputs, .. }) = (network.parameters(), network.shape());
    let decay = f64::from(p.decay);
    // A term passes through a product, one of four partial sums (the first two start from b and the
    // shared term), and two more additions. The shared term passes through as many before, and is
    // negated and scaled.
    let chain = inputs.div_ceil(4) + 4;
    let mut bounds = vec![0.0; outputs];
    let lines = p.exponents.chunks_exact(1 + inputs);
    for (row, weights) in lines.zip(p.output_weights.chunks_exact(outputs)) {
        let length = row[1..].iter().map(|a| f64::from(*a).powi(2)).sum::<f64>().sqrt();
        let centre = length / (2.0 * decay);
        let off = activation_bound(decay, centre, f64::from(row[0].abs()), chain);
        let moved = weights.iter().map(|w| f64::from(w.abs()) * off);
        bounds.iter_mut().zip(moved).for_each(|(bound, moved)| *bound += moved);
    }
    bounds
}

/// Largest error of an activation over all distances from its centre. The centre is `centre` away from
/// the middle; its b is `opened`.
fn activation_bound(decay: f64, centre: f64, opened: f64, chain: usize) -> f64 {
    const U: f64 = 0.5 * f32::EPSILON as f64;
    /// Step between the distances tried, in widths. In between, the activation is taken at the nearer
    /// end and the sum at the farther.
    const STEP: f64 = 1.0 / 64.0;
    let gamma = |d: usize| d as f64 * U / (1.0 - d as f64 * U);
    let width = 1.0 / decay.sqrt();
    let at = |step: usize| {
        let [near, far] = [step as f64, (step + 1) as f64].map(|t| t * STEP * width);
        let reach = centre + far;
        let square = decay * reach * reach;
        let terms = opened + 2.0 * decay * centre * reach + square;
        let exponent = gamma(chain) * terms + gamma(chain + 2) * square;
        // 2^u itself is within 2 ulp, each at most 2u of the value.
        let relative = (core::f64::consts::LN_2 * exponent).exp_m1() + 4.0 * U;
        (-decay * near * near).exp2() * relative
    };
    // Beyond twelve widths an activation is below 2^−144, and exponents end at −125.
    (0..(12.0 / STEP) as usize).map(at).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use taxel_core::exp::Polynomial;
    use taxel_data::dataset::Dataset;
    use taxel_data::progress::Silent;
    use taxel_data::random::Stream;
    use taxel_simulate::{Synthesis, World};

    use super::super::super::least_squares::Factor;
    use super::*;
    use crate::train;

    fn press(noise: f64, frames: usize) -> (World, Dataset) {
        let world = World::press();
        let data = Synthesis::new(&world).noise_level(noise).frames(Stream::Training, frames);
        (world, data)
    }

    /// The bound holds on frames, and is at most some hundred times the actual error there.
    #[test]
    fn no_reading_moves_an_output_beyond_its_bound() {
        let (world, data) = press(0.05, 1500);
        let table = data.row_table(3);
        let samples = Samples::new(&table);
        let options = Options {
            format: Format::F32,
            ..Options { centres: 32, seed: world.seed, ..Options::default() }
        };
        let centres = samples.centres(&options, 3);
        let fitted = samples.fit(&centres, &options).unwrap();
        let Network::F32(network) = fitted.network() else { panic!("direct distances") };
        let p = network.parameters();
        let bounds = rounding_bounds(&network.into());
        let mut worst = vec![0.0_f64; bounds.len()];
        for line in table.inputs.lines() {
            let reading: Vec<f32> = line.iter().map(|r| *r as f32).collect();
            let (mut scaled, mut output) = (vec![0.0; reading.len()], vec![0.0; bounds.len()]);
            let network = Network::from(network);
            network.scale(&reading, &mut scaled).unwrap();
            let x: Vec<f64> =
                scaled.iter().map(|x| f64::from(taxel_core::scale::clamp_units(*x))).collect();
            network.infer_scaled_with::<Polynomial>(&mut scaled, &mut output).unwrap();
            // The same sum without rounding of the exponents; rounding in the outputs' sum stays, and is
            // small.
            let mut exact: Vec<f64> = p.bias.iter().map(|b| f64::from(*b)).collect();
            let mut add = |factor: f64, row: &[f32]| {
                exact.iter_mut().zip(row).for_each(|(y, w)| *y += factor * f64::from(*w));
            };
            for (x, row) in x.iter().zip(p.affine.chunks_exact(bounds.len())) {
                add(*x, row);
            }
            let square: f64 = x.iter().map(|x| x * x).sum();
            let lines = p.exponents.chunks_exact(1 + x.len());
            for (row, weights) in lines.zip(p.output_weights.chunks_exact(bounds.len())) {
                let products = row[1..].iter().zip(&x).map(|(a, x)| f64::from(*a) * x);
                let v = f64::from(row[0]) + products.sum::<f64>() - f64::from(p.decay) * square;
                add(v.exp2(), weights);
            }
            for ((worst, y), exact) in worst.iter_mut().zip(&output).zip(&exact) {
                *worst = worst.max((f64::from(*y) - exact).abs());
            }
        }
        for (worst, bound) in worst.iter().zip(&bounds) {
            assert!(worst <= bound && *bound < 300.0 * worst, "{worst:e} within {bound:e}");
        }
    }

    #[test]
    fn distances_are_expanded_only_where_that_is_proved_harmless() {
        let format = |noise: f64, spread: f64| {
            let (world, data) = press(noise, 1500);
            let options = Options { centres: 32, spread, seed: world.seed, ..Options::default() };
            let trained = train::train(&data, &options, &Silent).unwrap();
            let formats: Vec<_> = trained.networks.iter().map(|n| n.network().format()).collect();
            assert!(formats.iter().all(|format| *format == formats[0]), "{formats:?}");
            formats[0]
        };
        assert_eq!(format(0.05, 0.8), Format::F32);
        // Without noise, weights grow by orders of magnitude and errors shrink as much.
        assert_eq!(format(0.0, 0.8), Format::F32Direct);
        // A narrow Gaussian's exponents leave their range.
        assert_eq!(format(0.05, 0.2), Format::F32Direct);
    }

    #[test]
    fn few_samples_tell_what_all_would() {
        for noise in [0.0, 0.005, 0.05] {
            let (world, data) = press(noise, 4000);
            let table = data.row_table(3);
            let samples = Samples::new(&table);
            let options = Options { centres: 8, seed: world.seed, ..Options::default() };
            let centres = samples.centres(&options, 3);
            let targets = Targets::new(&table.outputs);
            let expanded = Expanded::new(&samples, &centres, &options);
            let share = |part: &RowTable| {
                let part_targets = targets.of_others(&part.outputs);
                let deviations = &part_targets.deviations.values;
                let factor =
                    Factor::new(&*expanded.design(part), deviations, targets.outputs(), 1e6);
                let factors = Factors(vec![((0..targets.outputs()).collect(), factor)]);
                worst_share(&expanded.network(&factors, &targets).unwrap(), &table)
            };
            let few = share(&expanded.few(&table).expect("samples enough"));
            let ratio = few / share(&table);
            // Measured: 0.67, 1.36, 1.77.
            assert!((0.5..2.0).contains(&ratio), "noise {noise}: {ratio}");
        }
    }

    #[test]
    fn a_narrow_width_is_refused_by_fixed16_with_the_fix() {
        let (world, data) = press(0.05, 600);
        let options = Options {
            format: Format::Fixed16,
            ..Options { centres: 16, spread: 0.2, seed: world.seed, ..Options::default() }
        };
        let message = train::train(&data, &options, &Silent).unwrap_err().to_string();
        assert!(message.contains("spread = 0.2") && message.contains("larger spread"), "{message}");
    }
}

//! Reading model of a trained model: fitting of what [`taxel_core::reading_model`] fills missing readings, and assesses
//! frames with.
//!
//! Factors and the density of frames are fitted to those of training. Deviations and the threshold of novelty are
//! calibrated on frames that training did not see.

use serde::{Deserialize, Serialize};
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_data::{Dataset, Table, require};

use crate::error::{Result, no_regression};
use crate::infer::assess_lines;
use crate::packing::ModelBlob;
use crate::parallel;

pub mod factors;
pub mod mixture;

use factors::Factors;
use mixture::Mixture;

/// Share of usual frames that are taken for novel, within what random frames allow.
pub const FALSE_ALARMS: f64 = 0.005;
/// Shares of errors within one deviation, and within as many as the ratio of an output says.
const SHARES: [f64; 2] = [0.6827, 0.95];
/// Least number of training frames for each reading, and for each feature of each component. With fewer, what is fitted is
/// chance: sound wires look as if they touched.
const FRAMES_A_READING: usize = 10;
/// Number of factors; half as many as there are readings where these are few.
const FACTORS: usize = 11;
/// Number of components of the mixture; fewer are used where there are few frames.
const COMPONENTS: usize = 16;

/// What a reading model tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Extent {
    /// Readings that are missing.
    Fill,
    /// Besides, novelty of frames and deviations of outputs.
    Full,
}

impl Extent {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Fill, Self::Full];

    /// Name, as options and scenes have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fill => "fill",
            Self::Full => "full",
        }
    }
}

/// Checks before long work that a reading model can be fitted to so many `frames` of so many `readings`.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for fewer than ten frames for each reading.
pub fn check(frames: usize, readings: usize) -> Result<()> {
    let least = FRAMES_A_READING * readings.max(2);
    let rule = || {
        format!(
            "a reading model needs at least {least}, ten for each reading: give more, or leave it out"
        )
    };
    Ok(require(frames >= least, "frames", frames, rule)?)
}

/// Statistics of a data set's inputs: their factors, and a mixture of Gaussians over the features of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    factors: Factors,
    /// `None` of a model that fills missing readings, and no more.
    mixture: Option<Mixture>,
}

impl Statistics {
    /// Fits the statistics of `readings`, whose mixture starts by random numbers of a `seed`.
    ///
    /// # Errors
    /// [`Error::Unfit`](crate::Error::Unfit) for readings that are no numbers.
    pub fn fit(readings: &Table, extent: Extent, seed: u64) -> Result<Self> {
        let factors = Factors::fit(readings, FACTORS.min(readings.names.len().div_ceil(2)))?;
        let features = factors.model().sizes().features();
        let most = (readings.len() / (FRAMES_A_READING * features)).clamp(1, COMPONENTS);
        let mixture = (extent == Extent::Full)
            .then(|| Mixture::fit(&factors.features(&readings.values), features, most, seed));
        Ok(Self { factors, mixture })
    }

    /// Probabilities of the components, and ln p, of every frame of `inputs`.
    fn assess(&self, mixture: &Mixture, inputs: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let points = self.factors.features(inputs);
        let of_point = |point: &[f64]| mixture.probabilities(&point.to_vec().into());
        parallel::pieces(&points, self.factors.model().sizes().features(), &of_point)
    }
}

/// Frames that neither a model nor statistics were fitted to: errors on the frames of training would be too small, and
/// their density too large.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOut {
    /// Inputs of the model: `frames × readings`.
    inputs: Vec<f64>,
    /// Errors of its outputs, in their units: `frames × outputs`. NaN for an output that is missing in the data.
    errors: Vec<f64>,
    /// −ln p of each frame.
    surprises: Vec<f64>,
}

impl HeldOut {
    /// Adds the frames of `dataset`, decoded by the model of `blob`, and seen by `statistics`, neither of which was
    /// fitted to them.
    ///
    /// # Panics
    /// If the data set has other columns than the model, or the statistics have no mixture.
    pub fn add(&mut self, blob: &ModelBlob, statistics: &Statistics, dataset: &Dataset) {
        let mixture = statistics.mixture.as_ref().expect("statistics with a mixture");
        let decoded = blob.prepare().of_inputs().decode_table(&dataset.inputs);
        let errors = decoded.values.iter().zip(dataset.outputs.values.iter());
        self.errors.extend(errors.map(|(estimate, truth)| estimate - truth));
        let assessed = statistics.assess(mixture, &dataset.inputs.values);
        self.surprises.extend(assessed.iter().map(|(_, log_density)| -log_density));
        self.inputs.extend(dataset.inputs.values.iter());
    }
}

/// Makes a blob of the model in `blob` with a reading model: the `statistics` of its training frames; those with a mixture
/// are calibrated on frames that were `held_out`.
///
/// # Errors
/// [`Error`](crate::Error) for inputs whose density is beyond f32, or for a model beyond what the format holds.
///
/// # Panics
/// If frames are not those of the model, or none was held out.
pub fn add(blob: &ModelBlob, statistics: &Statistics, held_out: &HeldOut) -> Result<ModelBlob> {
    let Statistics { factors, mixture } = statistics;
    let Some(mixture) = mixture else { return blob.with_reading_model(Some(factors.model())) };
    let readings = factors.model().sizes().readings;
    let frames = held_out.surprises.len();
    assert!(frames > 0 && held_out.inputs.len() == frames * readings, "frames of the model");
    let outputs = held_out.errors.len() / frames;
    let components = mixture.components.len();
    let sizes = Sizes { components, outputs, ..factors.model().sizes() };
    let made = |variances: &[f64], ratios_95: &[f64], threshold: f64| {
        let mut block = factors.block.clone();
        mixture.components.iter().for_each(|component| block.extend(component.numbers()));
        block.extend(variances.iter().chain(ratios_95).map(|value| *value as f32));
        block.push(threshold as f32);
        block
    };
    let variances = variances(&statistics.assess(mixture, &held_out.inputs), held_out, components);
    let uncalibrated = made(&variances, &vec![1.0; outputs], 0.0);
    let model = ReadingModel::new(sizes, &uncalibrated).map_err(|_| no_regression())?;
    let (deviations, _) = assess_lines(model, &held_out.inputs);
    let ratios = ratios(&deviations, &held_out.errors, outputs);
    let of_component = variances.chunks_exact(outputs).flat_map(|of| of.iter().zip(&ratios));
    let calibrated: Vec<f64> =
        of_component.map(|(variance, [one, _])| variance * one * one).collect();
    let ratios_95: Vec<f64> = ratios.iter().map(|[one, most]| most / one).collect();
    let threshold = quantile(&mut held_out.surprises.clone(), 1.0 - FALSE_ALARMS);
    let block = made(&calibrated, &ratios_95, threshold);
    blob.with_reading_model(Some(ReadingModel::new(sizes, &block).map_err(|_| no_regression())?))
}

/// Variances of every output by component, `components × outputs`: mean squares of errors, weighted by the component's
/// probability.
fn variances(assessed: &[(Vec<f64>, f64)], held_out: &HeldOut, components: usize) -> Vec<f64> {
    let outputs = held_out.errors.len() / assessed.len();
    let mean_squares = |output: usize| {
        let errors = || held_out.errors.iter().skip(output).step_by(outputs);
        let known = errors().filter(|error| !error.is_nan());
        let frames = known.clone().count() as f64;
        let of_all = known.map(|error| error * error / frames).sum::<f64>();
        // Every component counts one mean frame besides its own, so that it has a variance.
        let mut sums = vec![[1.0, of_all]; components];
        for (error, (probabilities, _)) in errors().zip(assessed).filter(|it| !it.0.is_nan()) {
            for ([weight, square], probability) in sums.iter_mut().zip(probabilities) {
                *weight += probability;
                *square += probability * error * error;
            }
        }
        sums.into_iter().map(|[weight, square]| square / weight).collect::<Vec<f64>>()
    };
    let of_outputs = parallel::map(outputs, &mean_squares);
    (0..components).flat_map(|k| of_outputs.iter().map(move |of_output| of_output[k])).collect()
}

/// Ratios of each output's errors to its deviations that the [`SHARES`] of them are within; 1 where deviations are 0.
fn ratios(deviations: &[f32], errors: &[f64], outputs: usize) -> Vec<[f64; 2]> {
    let of_output = |output: usize| {
        let pairs = deviations.iter().zip(errors).skip(output).step_by(outputs);
        let ratio = |(deviation, error): (&f32, &f64)| error.abs() / f64::from(*deviation);
        let mut ratios: Vec<f64> = pairs.map(ratio).filter(|ratio| ratio.is_finite()).collect();
        let found = SHARES.map(|share| quantile(&mut ratios, share));
        if found[0] > 0.0 { found } else { [1.0; 2] }
    };
    parallel::map(outputs, &of_output)
}

/// Quantile of `values`, which are sorted: the least that this share does not exceed; 0 of none.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let place = (values.len() as f64 * share).ceil() as usize;
    values.get(place.clamp(1, values.len().max(1)) - 1).copied().unwrap_or(0.0)
}

//! Confidence of a trained model: fitting of what [`taxel_core::confidence`] assesses frames with.
//!
//! The density of frames is fitted to those of training. Deviations and the threshold of novelty are calibrated on
//! frames that training did not see.

use taxel_core::confidence::{Confidence, Sizes};
use taxel_data::{Dataset, require};

use crate::error::{Result, no_regression};
use crate::infer::assess_lines;
use crate::packing::ModelBlob;
use crate::parallel;

mod features;
mod mixture;

use features::Features;
use mixture::Mixture;

/// Share of usual frames that are taken for novel, within what random frames allow.
pub const FALSE_ALARMS: f64 = 0.005;
/// Shares of errors within one deviation, and within as many as the ratio of an output says.
const SHARES: [f64; 2] = [0.6827, 0.95];
/// Least number of training frames for each feature of each component.
const FRAMES_A_FEATURE: usize = 10;

/// Settings of a confidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Number of directions that readings are projected to; fewer are used where there are fewer readings.
    pub directions: usize,
    /// Number of components of the mixture; fewer are used where there are few frames.
    pub components: usize,
    /// Seed of the mixture's start.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { directions: 10, components: 32, seed: 1 }
    }
}

impl Settings {
    /// Number of directions that so many readings are projected to.
    fn directions_of(&self, readings: usize) -> usize {
        self.directions.clamp(1, readings.max(1))
    }
}

/// Checks before long work that a confidence can be fitted to so many `frames` of so many `readings`.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for fewer than ten frames for each feature: intervals would cover anything.
pub fn check(frames: usize, readings: usize) -> Result<()> {
    let features = Settings::default().directions_of(readings) + 1;
    let least = FRAMES_A_FEATURE * features;
    let rule = || {
        format!(
            "a confidence takes at least {least}, ten for each of its {features} features: give more, or leave it out"
        )
    };
    Ok(require(frames >= least, "frames", frames, rule)?)
}

/// Density of a data set's inputs: a mixture of Gaussians over a few features of theirs.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    features: Features,
    mixture: Mixture,
}

impl Density {
    /// Fits the density of the inputs of `dataset`, which has frames.
    pub fn fit(dataset: &Dataset, settings: &Settings) -> Self {
        let readings = dataset.inputs.names.len();
        let features = Features::new(&dataset.inputs, settings.directions_of(readings));
        let most = dataset.frames() / (FRAMES_A_FEATURE * features.count());
        let mixture = Mixture::fit(
            &features.apply(&dataset.inputs.values),
            features.count(),
            settings.components.min(most).max(1),
            settings.seed,
        );
        Self { features, mixture }
    }

    /// −ln p of every frame of `inputs` (`frames × readings`).
    fn surprises(&self, inputs: &[f64]) -> Vec<f64> {
        let points = self.features.apply(inputs);
        let of_point = |point: &[f64]| -self.mixture.probabilities(&point.to_vec().into()).1;
        parallel::pieces(&points, self.features.count(), &of_point)
    }
}

/// Frames that neither a model nor a density was fitted to: errors on the frames of training would be too small, and
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
    /// Adds the frames of `dataset`, decoded by the model of `blob`, and seen by a `density`, neither of which was
    /// fitted to them.
    ///
    /// # Panics
    /// If the data set has other columns than the model.
    pub fn add(&mut self, blob: &ModelBlob, density: &Density, dataset: &Dataset) {
        let decoded = blob.prepare().of_inputs().decode_table(&dataset.inputs);
        let errors = decoded.values.iter().zip(&dataset.outputs.values);
        self.errors.extend(errors.map(|(estimate, truth)| estimate - truth));
        self.surprises.extend(density.surprises(&dataset.inputs.values));
        self.inputs.extend(&dataset.inputs.values);
    }
}

/// Makes a blob of the model in `blob` with a confidence: the `density` of its training frames, calibrated on frames that
/// were `held_out`.
///
/// # Errors
/// [`Error`](crate::Error) for inputs whose density is beyond f32, or for a model beyond what the
/// format holds.
///
/// # Panics
/// If frames are not those of the model, or none was held out.
pub fn add(blob: &ModelBlob, density: &Density, held_out: &HeldOut) -> Result<ModelBlob> {
    let Density { features, mixture } = density;
    let (frames, readings) = (held_out.surprises.len(), features.mean.len());
    assert!(frames > 0 && held_out.inputs.len() == frames * readings, "frames of the model");
    let outputs = held_out.errors.len() / frames;
    let variances = variances(features, mixture, held_out, outputs);
    let (directions, components) = (features.directions(), mixture.components.len());
    let sizes = Sizes { readings, directions, components, outputs };
    let uncalibrated = block(features, mixture, &variances, &vec![1.0; outputs], 0.0);
    let confidence = Confidence::new(sizes, &uncalibrated).map_err(|_| no_regression())?;
    let (deviations, _) = assess_lines(confidence, &held_out.inputs);
    let ratios = ratios(&deviations, &held_out.errors, outputs);
    let calibrated: Vec<f64> = variances
        .chunks_exact(outputs)
        .flat_map(|of_component| of_component.iter().zip(&ratios))
        .map(|(variance, [one, _])| variance * one * one)
        .collect();
    let ratios_95: Vec<f64> = ratios.iter().map(|[one, most]| most / one).collect();
    let threshold = quantile(&mut held_out.surprises.clone(), 1.0 - FALSE_ALARMS);
    let block = block(features, mixture, &calibrated, &ratios_95, threshold);
    let confidence = Confidence::new(sizes, &block).map_err(|_| no_regression())?;
    blob.with_confidence(confidence)
}

/// Variances of every output by component, `components × outputs`: mean squares of errors, weighted by the component's
/// probability.
fn variances(
    features: &Features,
    mixture: &Mixture,
    held_out: &HeldOut,
    outputs: usize,
) -> Vec<f64> {
    let points = features.apply(&held_out.inputs);
    let components = mixture.components.len();
    // Weights, and weighted squares, by component and output.
    let of_pieces: Vec<Vec<[f64; 2]>> =
        parallel::map(held_out.errors.len().div_ceil(512 * outputs), &|index| {
            let points = parallel::piece(&points, 512 * features.count(), index);
            let errors = parallel::piece(&held_out.errors, 512 * outputs, index);
            let mut sums = vec![[0.0; 2]; components * outputs];
            for (point, errors) in
                points.chunks_exact(features.count()).zip(errors.chunks_exact(outputs))
            {
                let (probabilities, _) = mixture.probabilities(&point.to_vec().into());
                for (sums, probability) in sums.chunks_exact_mut(outputs).zip(probabilities) {
                    let known = sums.iter_mut().zip(errors).filter(|(_, error)| !error.is_nan());
                    for ([weight, square], error) in known {
                        *weight += probability;
                        *square += probability * error * error;
                    }
                }
            }
            sums
        });
    // Every component counts one mean frame besides its own, so that it has a variance.
    let mean = |output: usize| {
        let errors = held_out.errors.iter().skip(output).step_by(outputs).filter(|e| !e.is_nan());
        let frames = errors.clone().count() as f64;
        [1.0, errors.map(|error| error * error / frames).sum()]
    };
    let mut sums = (0..outputs).map(mean).collect::<Vec<[f64; 2]>>().repeat(components);
    for of_piece in &of_pieces {
        for ([weight, square], [of_weight, of_square]) in sums.iter_mut().zip(of_piece) {
            (*weight, *square) = (*weight + of_weight, *square + of_square);
        }
    }
    sums.into_iter().map(|[weight, square]| square / weight).collect()
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
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let place = (values.len() as f64 * share).ceil() as usize;
    values.get(place.clamp(1, values.len().max(1)) - 1).copied().unwrap_or(0.0)
}

/// Numbers of a confidence, in the order of [`Confidence::new`].
fn block(
    features: &Features,
    mixture: &Mixture,
    variances: &[f64],
    ratios_95: &[f64],
    threshold: f64,
) -> Vec<f32> {
    let mut block = [&features.mean[..], &features.scale].concat();
    block.extend(vec![0.0; features.directions()]);
    block.extend(&features.parts);
    for component in &mixture.components {
        block.push(component.constant as f32);
        block.extend(component.offsets.iter().map(|offset| *offset as f32));
        for row in 0..features.count() {
            block.extend(component.whitening.row(row).iter().take(row + 1).map(|w| *w as f32));
        }
    }
    block.extend(variances.iter().chain(ratios_95).map(|value| *value as f32));
    block.push(threshold as f32);
    block
}

#[cfg(test)]
mod tests;

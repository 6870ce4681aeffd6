//! Samples of one network, scaled as the device scales them, and what is fitted to them.

use taxel_core::rbf::Network;
use taxel_core::scale::{CLAMP, HALF_RANGE, UNITS};
use taxel_data::{Dataset, Purpose, Random, Stream};

use super::{Options, kmeans};
use crate::infer::infer;

/// Frames that are decoded at once to measure their errors.
const FRAMES_AT_ONCE: usize = 8192;
/// Frames for each regressor below which they are few.
const FEW_FRAMES: usize = 50;
/// Least error of a reading over its range, whatever few frames say.
const LEAST_ERROR: f64 = 1e-3;
/// Most penalty on the squared weights of the affine tail, for each frame, where the Gaussians have one up to 1: a plane
/// fits little noise.
const MOST_OF_TAIL: f64 = 1e-7;
/// Share of a penalty above 1 that the affine tail has. Such a one leaves nothing of the Gaussians.
const SHARE_OF_TAIL: f64 = 1e-3;

/// Hidden layer of a network: its Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenLayer {
    /// Centres on inputs scaled to [0, 1], `centres × inputs`.
    pub centres: Vec<f64>,
    /// Width σ of all Gaussians, on that scale.
    pub spread: f64,
}

/// Minimum and span of every input, by which readings are scaled to [0, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct InputScale {
    pub(super) minimum: Vec<f64>,
    /// One over each input's span; 0 for an input that never changes.
    pub(super) per_span: Vec<f64>,
}

impl InputScale {
    /// Scale of a table's inputs, rounded to the numbers that the blob holds.
    pub fn new(table: &Dataset) -> Self {
        Self::of_ranges(&table.input_ranges())
    }

    /// Scale of inputs with these `ranges`, in their units.
    pub(crate) fn of_ranges(ranges: &[[f64; 2]]) -> Self {
        // Ranges of the readings in f32, as the device has them.
        let ranges: Vec<[f32; 2]> = ranges.iter().map(|range| range.map(|v| v as f32)).collect();
        let per_span = |[low, high]: &[f32; 2]| {
            let per_span = 1.0 / (high - low);
            if per_span.is_finite() { f64::from(per_span) } else { 0.0 }
        };
        Self {
            minimum: ranges.iter().map(|[low, _]| f64::from(*low)).collect(),
            per_span: ranges.iter().map(per_span).collect(),
        }
    }

    /// Whether each input never changes; it is scaled to 0.
    pub(super) fn never_changes(&self) -> impl Iterator<Item = bool> {
        self.per_span.iter().map(|per_span| *per_span == 0.0)
    }

    /// Scales `readings` (`samples × inputs`) to [0, 1], and clamps them like the device does.
    pub fn apply(&self, readings: &[f64]) -> Vec<f64> {
        let ranges = self.minimum.iter().zip(&self.per_span).cycle();
        let [low, high] = CLAMP.map(f64::from);
        let scale = |(value, (minimum, per_span)): (&f64, (&f64, &f64))| {
            ((f64::from(*value as f32) - minimum) * per_span).clamp(low, high)
        };
        readings.iter().zip(ranges).map(scale).collect()
    }
}

/// Middle of every input's range, and scale about it: the scaling of the format fixed16.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CentredScale {
    pub midpoint: Vec<f32>,
    /// Number of [`UNITS`] in one unit of the reading; 0 for an input that never changes.
    pub per_unit: Vec<f32>,
}

impl CentredScale {
    pub fn new(table: &Dataset) -> Self {
        let range = |range: [f64; 2]| range.map(|v| f64::from(v as f32));
        let ranges = || table.input_ranges().into_iter().map(range);
        let per_unit = |[low, high]: [f64; 2]| {
            let per_unit = (f64::from(UNITS) / (f64::from(HALF_RANGE) * (high - low))) as f32;
            if per_unit.is_finite() { per_unit } else { 0.0 }
        };
        Self {
            midpoint: ranges().map(|[low, high]| (0.5 * (low + high)) as f32).collect(),
            per_unit: ranges().map(per_unit).collect(),
        }
    }

    pub(super) fn never_changes(&self) -> impl Iterator<Item = bool> {
        self.per_unit.iter().map(|per_unit| *per_unit == 0.0)
    }

    /// Scales `readings` (`samples × inputs`) like the device does before its clamp.
    pub fn units(&self, readings: &[f64]) -> impl Iterator<Item = f32> {
        let ranges = self.midpoint.iter().zip(&self.per_unit).cycle();
        readings.iter().zip(ranges).map(|(r, (middle, per_unit))| (*r as f32 - middle) * per_unit)
    }
}

/// Penalties on the squared weights of a network, by the number of frames that it is fitted to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ridge {
    options: Options,
    /// Number of inputs.
    inputs: usize,
}

impl Ridge {
    /// Penalties that `options` ask for, of a network with so many `inputs`.
    pub fn new(inputs: usize, options: &Options) -> Self {
        Self { options: *options, inputs }
    }

    /// One over the penalty on every weight: the initial covariance δ of a recursion.
    pub fn initial_covariance(&self, frames: usize) -> f64 {
        self.options.initial_covariance(frames)
    }

    /// Root of the penalty on the weights of each regressor, of which there are so many: those of activations, of the
    /// inputs in the affine tail, and of 1. A recursion has one for all.
    ///
    /// Where none is chosen and frames are few, the affine tail is fitted as if every reading had an error of a
    /// thousandth of its range. Readings of neighbouring wires hardly differ in some directions; a few frames without
    /// noise are fitted best by large weights there, which ruin all others. With many frames, or noise, it makes no
    /// difference.
    pub fn root(&self, frames: usize, regressor: usize, regressors: usize) -> f64 {
        let root = 1.0 / self.initial_covariance(frames).sqrt();
        let last = regressors - 1;
        let inputs = if self.options.affine_tail { self.inputs } else { 0 };
        let is_few = frames < FEW_FRAMES * regressors;
        match self.options.penalty {
            Some(penalty) if penalty > 1.0 && (last - inputs..last).contains(&regressor) => {
                (SHARE_OF_TAIL * penalty * frames as f64).sqrt()
            }
            Some(penalty) if penalty > MOST_OF_TAIL && regressor >= last - inputs => {
                (MOST_OF_TAIL * frames as f64).sqrt()
            }
            None if is_few && (last - inputs..last).contains(&regressor) => {
                root.hypot((frames as f64 * LEAST_ERROR.powi(2)).sqrt())
            }
            _ => root,
        }
    }
}

/// Frames as networks see them.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// What networks are given, and the outputs.
    pub table: Dataset,
    /// Strength of each frame's touch, if networks tell the outputs as multiples of it.
    pub strengths: Option<Vec<f64>>,
}

impl From<Dataset> for Seen {
    fn from(table: Dataset) -> Self {
        Self { table, strengths: None }
    }
}

impl Seen {
    /// What the network of row number `row` (from 0) sees.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn row(&self, row: usize) -> Self {
        Self { table: self.table.row_table(row), strengths: self.strengths.clone() }
    }
}

/// Samples of one network, and the scale of their inputs.
#[derive(Debug, Clone)]
pub struct Samples<'b> {
    pub(crate) scale: InputScale,
    pub(crate) table: &'b Dataset,
    strengths: Option<&'b [f64]>,
}

impl<'b> Samples<'b> {
    /// Samples of `table`, whose inputs are scaled to [0, 1].
    pub fn new(table: &'b Dataset) -> Self {
        Self { scale: InputScale::new(table), table, strengths: None }
    }

    /// Samples that one network sees.
    pub fn of(seen: &'b Seen) -> Self {
        Self { strengths: seen.strengths.as_deref(), ..Self::new(&seen.table) }
    }

    /// What the network is to tell of output number `output` in line number `line`: NaN if it is missing.
    pub(crate) fn target(&self, line: usize, output: usize) -> f64 {
        let value = self.table.outputs.line(line)[output];
        self.strengths.map_or(value, |strengths| value / strengths[line])
    }

    /// Targets of all outputs in line number `line`.
    pub(super) fn targets(&self, line: usize) -> impl Iterator<Item = f64> {
        (0..self.table.outputs.names.len()).map(move |output| self.target(line, output))
    }

    /// Factor on the errors of line number `line`.
    pub(crate) fn weight(&self, line: usize) -> f64 {
        self.table.weights.as_ref().map_or(1.0, |weights| weights[line])
    }

    /// Sum of the squared errors of each output as `network` tells it, times the squares of the weights; a missing output
    /// is skipped.
    pub(super) fn squared_errors(&self, network: &Network<'_>) -> Vec<f64> {
        let outputs = self.table.outputs.names.len();
        let mut sums = vec![0.0; outputs];
        let pieces = self.table.inputs.values.chunks((FRAMES_AT_ONCE * self.inputs()).max(1));
        for (first, piece) in (0..).step_by(FRAMES_AT_ONCE).zip(pieces) {
            for (line, told) in (first..).zip(infer(network, piece).chunks_exact(outputs)) {
                let weight = self.weight(line);
                for ((sum, target), told) in sums.iter_mut().zip(self.targets(line)).zip(told) {
                    if !target.is_nan() {
                        let error = told * weight - target * weight;
                        *sum += error * error;
                    }
                }
            }
        }
        sums
    }

    /// Scaled inputs, `samples × inputs`.
    pub(crate) fn scaled(&self) -> Vec<f64> {
        self.scale.apply(&self.table.inputs.values)
    }

    pub(crate) fn inputs(&self) -> usize {
        self.table.inputs.names.len()
    }

    /// K-means centres of these samples (`centres × inputs`), rounded to the numbers that the blob
    /// holds.
    ///
    /// `part` numbers the network, so that each draws its own starting points.
    pub fn centres(&self, options: &Options, part: usize) -> Vec<f64> {
        let mut random =
            Random::new(options.seed, Stream::Training, Purpose::Centres, 0, part as u64);
        let (points, search) = (self.scaled(), &options.search);
        let found = kmeans::fit(&points, self.inputs(), options.centres, search, &mut random);
        found.centres.into_iter().map(|c| f64::from(c as f32)).collect()
    }

    /// Hidden layer of Gaussians at `centres` (`centres × inputs`, on scaled inputs), with the spread of `options`.
    pub fn layer(&self, centres: Vec<f64>, options: &Options) -> HiddenLayer {
        HiddenLayer { centres, spread: options.spread }
    }
}

//! Training of networks: K-means centres, least-squares output weights.
//!
//! All training is in f64 and gives the same result on any number of threads. The number of samples
//! alone decides how work is cut into pieces, whose results are merged in order. The network is rounded
//! once, to the numbers of its format, as a [`FittedNetwork`].

use model_core::projection::Projection;
use model_core::rbf::Format;
use model_core::scale::{CLAMP, HALF_RANGE, UNITS, clamp_units};
use rayon::prelude::*;
use taxel_data::BadValue;
use taxel_data::dataset::{Dataset, RowTable};
use taxel_data::error::require;
use taxel_data::progress::Progress;
use taxel_data::random::{Purpose, Random, Stream};

use crate::error::Result;

pub mod resolution;
mod solver;
pub mod kmeans;
pub mod hidden_layer;
pub mod least_squares;
pub(crate) mod principal;
pub mod format;
pub mod projection;
pub mod output_rank;
pub mod memory;
pub mod layers;
pub mod refine;
pub mod stream;

pub use format::FittedNetwork;
use format::Ridge;
pub use hidden_layer::{HiddenLayer, Widths};
pub use layers::Layers;
pub use refine::{Examples, FreshFrames, Refinement};
pub use solver::{Recursive, Solver};

/// Initial covariance δ of the recursive least squares where no penalty is chosen. The penalty on squared weights is
/// 1/δ for all frames together, too small to be felt.
pub const INITIAL_COVARIANCE: f64 = 1e6;

/// Frames for each regressor below which they are few.
const FEW_FRAMES: usize = 50;
/// Least error of a reading over its range, whatever few frames say.
const LEAST_ERROR: f64 = 1e-3;

/// Factor on the spread for networks of a whole array, relative to those of a row.
///
/// Features of a projection share the largest span of any. With this factor K = 64 is as good, and K =
/// 256 better (`docs/projection.md`).
pub const WHOLE_ARRAY_SPREAD: f64 = 0.5;

/// Options of training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Number of centres, K. Fewer are used where there are fewer distinct samples.
    pub centres: usize,
    /// Width σ of all Gaussians, on scaled inputs; their mean width if each has its own.
    pub spread: f64,
    /// Rule that gives the centres their widths.
    pub widths: Widths,
    /// Whether the network adds an affine tail A·x.
    pub affine_tail: bool,
    /// Ridge penalty on squared weights, for each training frame: at 1 it is as strong as an input that is always 1,
    /// and as strong as all activations that are fully on. `None` for the usual one: 1/[`INITIAL_COVARIANCE`] for all
    /// frames together, or [`Refinement::ridge`] if training is refined.
    pub penalty: Option<f64>,
    /// How output weights are computed.
    pub solver: Solver,
    /// Seed of the K-means starts.
    pub seed: u64,
    /// Effort of the search for centres.
    pub search: kmeans::Search,
    /// Number format of the network.
    pub format: Format,
    /// Whether one network serves all rows, behind a projection of all readings, instead of one network
    /// a row.
    pub whole_array: bool,
    /// Number of features that all readings are projected to; `None` for the usual one ([`projection::fit`]).
    pub features: Option<usize>,
    /// Number of components that the network for all rows computes, which are expanded to its outputs; `None` for a
    /// network that computes all outputs.
    pub output_rank: Option<usize>,
    /// Memory in bytes that training may take, about. More is refused before it is taken.
    pub most_memory_bytes: u64,
}

/// Memory in bytes that training may take unless a user says otherwise: 8 GB.
pub const USUAL_MEMORY_BYTES: u64 = 8_000_000_000;

impl Default for Options {
    fn default() -> Self {
        Self {
            centres: 64,
            spread: 0.8,
            widths: Widths::Common,
            affine_tail: true,
            penalty: None,
            solver: Solver::Qr,
            seed: 1,
            search: kmeans::Search::default(),
            format: Format::F32,
            whole_array: false,
            features: None,
            output_rank: None,
            most_memory_bytes: USUAL_MEMORY_BYTES,
        }
    }
}

impl Options {
    /// Checks the rank against the number of a network's `outputs`.
    fn check_rank(&self, outputs: usize) -> std::result::Result<(), BadValue> {
        match self.output_rank {
            Some(rank) if self.whole_array => output_rank::check(rank, outputs),
            _ => Ok(()),
        }
    }

    /// Initial covariance δ of the recursive least squares on so many `frames`: that of the solver, else one over the
    /// penalty on squared weights.
    pub fn initial_covariance(&self, frames: usize) -> f64 {
        if let Solver::Rls(Recursive { initial_covariance: Some(covariance), .. }) = self.solver {
            return covariance;
        }
        self.penalty.map_or(INITIAL_COVARIANCE, |penalty| 1.0 / (penalty * frames as f64))
    }

    /// Checks the options against the number of training `frames`.
    ///
    /// # Errors
    /// [`BadValue`] for the first option that cannot be used.
    pub fn check(&self, frames: usize) -> std::result::Result<(), BadValue> {
        let refused = |rule: String| Err(BadValue::new("centres", self.centres, rule));
        if self.centres == 0 || self.centres > 65_535 {
            return refused("give from 1 to 65535".into());
        }
        if self.centres >= frames {
            return refused(format!(
                "there must be fewer than the {frames} training frames; lower it or add data"
            ));
        }
        if let (Some(rank), false) = (self.output_rank, self.whole_array) {
            let rule = "only one network for the whole array has outputs enough: leave it out";
            return Err(BadValue::new("output_rank", rank, rule));
        }
        if let (Some(features), false) = (self.features, self.whole_array) {
            let rule =
                "only one network for the whole array has a projection to features: leave it out";
            return Err(BadValue::new("features", features, rule));
        }
        if self.widths != Widths::Common && self.format == Format::Fixed16 {
            return Err(hidden_layer::not_held(self.format));
        }
        self.penalty.map_or(Ok(()), check_penalty)?;
        if let Solver::Rls(settings) = self.solver {
            settings.check()?;
        }
        check_spread("spread", self.spread)
    }
}

/// Checks a penalty on squared weights for each frame.
///
/// # Errors
/// [`BadValue`] for a penalty beyond 1e-15 to 1.
pub fn check_penalty(penalty: f64) -> std::result::Result<(), BadValue> {
    require((1e-15..=1.0).contains(&penalty), "penalty", format!("{penalty:?}"), || {
        "give a number from 1e-15 to 1, such as 1e-7".into()
    })
}

/// Checks a width σ on scaled inputs; `field` names it in the message.
///
/// # Errors
/// [`BadValue`] for a width that is not positive, or whose 1/(2σ²) does not fit an f32.
pub fn check_spread(field: &str, spread: f64) -> std::result::Result<(), BadValue> {
    let decay = 1.0 / (2.0 * spread * spread);
    if spread > 0.0 && (decay as f32).is_normal() {
        return Ok(());
    }
    let rule = "give a positive number, so that 1/(2σ²) fits an f32 (1e-18 to 1e18)";
    Err(BadValue::new(field, format!("{spread:?}"), rule))
}

/// Minimum and span of every input, by which readings are scaled to [0, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct InputScale {
    minimum: Vec<f64>,
    /// One over each input's span; 0 for an input that never changes.
    per_span: Vec<f64>,
}

impl InputScale {
    /// Scale of a table's inputs, rounded to the numbers that the blob holds.
    pub fn new(table: &RowTable) -> Self {
        // Ranges of the readings in f32, as the device has them.
        let ranges: Vec<[f32; 2]> =
            table.input_ranges().iter().map(|range| range.map(|v| v as f32)).collect();
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
    fn never_changes(&self) -> impl Iterator<Item = bool> {
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

/// Middle of every input's range, and scale about it: the scaling of the formats with expanded
/// distances.
#[derive(Debug, Clone, PartialEq)]
struct CentredScale {
    midpoint: Vec<f32>,
    /// Number of [`UNITS`] in one unit of the reading; 0 for an input that never changes.
    per_unit: Vec<f32>,
}

impl CentredScale {
    fn new(table: &RowTable) -> Self {
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

    fn never_changes(&self) -> impl Iterator<Item = bool> {
        self.per_unit.iter().map(|per_unit| *per_unit == 0.0)
    }

    /// Scales all inputs of `table` like the device does before its clamp, line after line.
    fn units<'a>(&'a self, table: &'a RowTable) -> impl Iterator<Item = f32> + 'a {
        table.inputs.lines().flat_map(|line| {
            let ranges = self.midpoint.iter().zip(&self.per_unit);
            line.iter().zip(ranges).map(|(r, (middle, per_unit))| (*r as f32 - middle) * per_unit)
        })
    }

    /// Scales all inputs of `table` to [0, 1] and clamps them, line after line.
    fn apply(&self, table: &RowTable) -> Vec<f64> {
        let spans = f64::from(HALF_RANGE) / f64::from(UNITS);
        self.units(table).map(|x| 0.5 + f64::from(clamp_units(x)) * spans).collect()
    }
}

/// Samples of one network, with their inputs scaled to [0, 1].
#[derive(Debug, Clone)]
pub struct Samples<'b> {
    pub(crate) scale: InputScale,
    /// Scaled inputs, `samples × inputs`.
    pub(crate) scaled: Vec<f64>,
    pub(crate) table: &'b RowTable,
}

impl<'b> Samples<'b> {
    /// Scales the inputs of `table` to [0, 1].
    pub fn new(table: &'b RowTable) -> Self {
        let scale = InputScale::new(table);
        Self { scaled: scale.apply(&table.inputs.values), scale, table }
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
        let found =
            kmeans::fit(&self.scaled, self.inputs(), options.centres, &options.search, &mut random);
        found.centres.into_iter().map(|c| f64::from(c as f32)).collect()
    }

    /// Hidden layer of Gaussians at `centres` (`centres × inputs`, on scaled inputs), with the widths that `options` ask
    /// for.
    pub fn layer(&self, centres: Vec<f64>, options: &Options) -> HiddenLayer {
        let relative_widths = options.widths.relative(&centres, self.inputs());
        HiddenLayer { centres, spread: options.spread, relative_widths }
    }

    /// Fits output weights to the samples for given `centres` (`centres × inputs`, on scaled inputs), by
    /// least squares, with the widths, in the format and of the rank that `options` ask for.
    ///
    /// # Errors
    /// [`Error`](crate::Error) if the format does not hold the network.
    pub fn fit(&self, centres: &[f64], options: &Options) -> Result<FittedNetwork> {
        self.fit_layer(&self.layer(centres.to_vec(), options), options)
    }

    /// Fits output weights to the samples as [`fit`](Self::fit) does, for a given `layer` with its own widths.
    ///
    /// # Errors
    /// [`Error`](crate::Error) if the format does not hold the network.
    ///
    /// # Panics
    /// Never: one penalty gives one network.
    pub fn fit_layer(&self, layer: &HiddenLayer, options: &Options) -> Result<FittedNetwork> {
        let fitted = self.fit_each(layer, options, &[options.penalty])?;
        Ok(fitted.into_iter().next().expect("one network a penalty"))
    }

    /// Fits output weights as [`fit_layer`](Self::fit_layer) does, with each of `penalties` instead of the options' own.
    fn fit_each(
        &self,
        layer: &HiddenLayer,
        options: &Options,
        penalties: &[Option<f64>],
    ) -> Result<Vec<FittedNetwork>> {
        let with = |penalty: &Option<f64>| Options { penalty: *penalty, ..*options };
        if let Some(rank) = options.output_rank {
            let fit = |penalty| output_rank::fit(self, layer, rank, &with(penalty));
            return penalties.iter().map(fit).collect();
        }
        let ridge = |penalty| self.ridge(layer, &with(penalty));
        let ridges: Vec<Ridge> = penalties.iter().map(ridge).collect();
        format::fit(self, layer, options, &ridges)
    }

    /// Penalties on squared weights that `options` ask for.
    ///
    /// Where none is chosen and frames are few, the affine tail is fitted as if every reading had an error of a
    /// [thousandth of its range](LEAST_ERROR). Readings of neighbouring wires hardly differ in some directions; a few
    /// frames without noise are fitted best by large weights there, which ruin all others. With many frames, or noise,
    /// it makes no difference.
    fn ridge(&self, layer: &HiddenLayer, options: &Options) -> Ridge {
        let (frames, inputs) = (self.table.inputs.len(), self.inputs());
        let regressors = layer.centres.len() / inputs + inputs + 1;
        let is_few = frames < FEW_FRAMES * regressors;
        let is_usual = options.affine_tail && options.penalty.is_none();
        Ridge {
            initial_covariance: options.initial_covariance(frames),
            of_tail: if is_few && is_usual { frames as f64 * LEAST_ERROR.powi(2) } else { 0.0 },
        }
    }
}

/// Result of training on a data set.
#[derive(Debug, Clone)]
pub struct Trained {
    /// Parameters of the projection in front of the one network of all rows; see [`projection`].
    pub projection: Option<Vec<f32>>,
    /// Networks of the row-wires in order, or the one network behind the projection.
    pub networks: Vec<FittedNetwork>,
    /// Number of frames that their weights were fitted to.
    pub frames: usize,
}

/// Trains one network for each row-wire of `dataset`, or one for all of them.
///
/// All networks have one format. Direct distances replace [`Format::F32`] if the rounding of expanded
/// ones is not proved harmless for every row.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for options that do not fit the data,
/// [`Error::Unfit`](crate::Error::Unfit) for a column that f32 does not hold, and other
/// [`Error`](crate::Error)s for data that does not fit the format.
pub fn train(dataset: &Dataset, options: &Options, progress: &dyn Progress) -> Result<Trained> {
    check(dataset, options)?;
    fit(dataset, Layers::start(dataset, options)?, options, progress)
}

/// Trains as [`train`] does, and refines centres, widths and the projection before the weights are fitted.
///
/// # Errors
/// As [`train`] and [`refine`](refine::refine).
pub fn train_refined(
    dataset: &Dataset,
    options: &Options,
    settings: &Refinement,
    examples: Examples<'_>,
    progress: &dyn Progress,
) -> Result<Trained> {
    check(dataset, options)?;
    let start = Layers::start(dataset, options)?;
    let layers = refine::refine(dataset, &start, options, settings, examples, progress)?;
    fit(dataset, layers, &settings.options(options), progress)
}

/// Checks the options against the data, and the data against f32.
fn check(dataset: &Dataset, options: &Options) -> Result<()> {
    options.check(dataset.frames())?;
    options.check_rank(dataset.outputs.names.len())?;
    resolution::check(dataset)
}

/// Projection of `dataset`'s readings with the given `parameters`.
///
/// # Panics
/// If `parameters` are not as many as [`projection::fit`] makes for this data set.
pub fn view<'b>(parameters: &'b [f32], dataset: &Dataset) -> Projection<'b> {
    let readings = dataset.inputs.names.len();
    Projection::new(readings, parameters.len() / (readings + 1), parameters)
        .expect("a projection of these readings")
}

/// Fits the output weights of networks with these `layers` to `dataset`.
///
/// # Errors
/// [`Error`](crate::Error) for data or layers that the format does not hold.
///
/// # Panics
/// Never: one penalty gives one model.
pub fn fit(
    dataset: &Dataset,
    layers: Layers,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Trained> {
    let mut models = fit_each(dataset, &layers, options, &[options.penalty], progress)?;
    let networks = models.pop().expect("one model a penalty");
    Ok(Trained { projection: layers.projection, networks, frames: dataset.frames() })
}

/// Fits output weights as [`fit`] does, with each of `penalties` instead of the options' own: the networks of one model
/// for each. They share the decomposition of the samples.
pub(crate) fn fit_each(
    dataset: &Dataset,
    layers: &Layers,
    options: &Options,
    penalties: &[Option<f64>],
    progress: &dyn Progress,
) -> Result<Vec<Vec<FittedNetwork>>> {
    let seen = layers.seen(dataset);
    // One list of networks a row-wire, one network a penalty.
    let fit_rows = |options: &Options, penalties: &[Option<f64>]| {
        let rows = layers.hidden.par_iter().enumerate();
        let fitted = rows.map(|(row, layer)| {
            let table = seen.row_table(row);
            let fitted = Samples::new(&table).fit_each(layer, options, penalties);
            progress.step();
            fitted
        });
        fitted.collect::<Result<Vec<Vec<FittedNetwork>>>>()
    };
    progress.stage("fit weights", layers.hidden.len());
    let mut rows: Vec<_> = fit_rows(options, penalties)?.into_iter().map(Vec::into_iter).collect();
    let mut models = Vec::with_capacity(penalties.len());
    for penalty in penalties {
        let mut networks: Vec<FittedNetwork> = rows.iter_mut().filter_map(Iterator::next).collect();
        let formats = || networks.iter().map(FittedNetwork::format);
        if !formats().all(|format| Some(format) == formats().next()) {
            progress.stage("fit weights with direct distances", layers.hidden.len());
            let direct = Options { format: Format::F32Direct, ..*options };
            networks = fit_rows(&direct, &[*penalty])?.into_iter().flatten().collect();
        }
        models.push(networks);
    }
    Ok(models)
}

/// Squared distance ‖a − b‖².
#[inline(always)]
#[expect(clippy::inline_always, reason = "`simd::widest` runs it")]
pub(crate) fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    let ((a4, a_rest), (b4, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sum = [0.0; 4];
    for (a, b) in a4.iter().zip(b4) {
        for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
            *s += (a - b) * (a - b);
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b)).sum();
    (sum[0] + sum[1]) + (sum[2] + sum[3]) + rest
}

#[cfg(test)]
mod tests;

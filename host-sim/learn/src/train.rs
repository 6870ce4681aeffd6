//! Training of networks: K-means centres, least-squares output weights.
//!
//! All training is in f64 and gives the same result on any number of threads. The number of samples
//! alone decides how work is cut into pieces, whose results are merged in order. The network is rounded
//! once, to the numbers of its format, as a [`FittedNetwork`].

use serde::{Deserialize, Serialize};
use taxel_core::rbf::Format;
use taxel_data::{BadValue, Dataset, Progress, require};

use crate::error::Result;

pub mod resolution;
pub mod kmeans;
mod samples;
pub mod least_squares;
pub(crate) mod tasks;
pub(crate) mod principal;
pub mod format;
pub mod projection;
pub mod touch;
pub mod memory;
pub mod layers;
pub mod refine;
mod trained;
mod start;
mod found;

pub use format::FittedNetwork;
pub use found::Found;
pub use layers::Layers;
pub use refine::{Examples, FreshFrames, Refinement};
pub use samples::{HiddenLayer, InputScale, Ridge, Samples, Seen};
pub use start::Start;
pub use touch::{Features, FittedTouch, Group, Kinds, THRESHOLD};
pub use trained::{FittedFront, Trained};

/// How output weights are computed. Both ways give the same weights, but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solver {
    /// Blocked QR decomposition of all samples, which several penalties share.
    #[default]
    Qr,
    /// Recursive least squares: one sample after another, as the paper has it.
    Rls,
}

impl Solver {
    /// Both ways.
    pub const ALL: [Self; 2] = [Self::Qr, Self::Rls];

    /// Name, as options and scenes have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Qr => "qr",
            Self::Rls => "rls",
        }
    }

    /// What it does, in a few words.
    pub fn description(self) -> &'static str {
        match self {
            Self::Qr => "QR decomposition of all frames",
            Self::Rls => "Recursive least squares, one pass over the frames; slower",
        }
    }
}

/// Initial covariance δ of the recursive least squares where no penalty is chosen. The penalty on squared weights is
/// 1/δ for all frames together, too small to be felt.
pub const INITIAL_COVARIANCE: f64 = 1e6;

/// Factor on the spread for networks of a whole array, relative to those of a row.
///
/// Features of a projection share the largest span of any. With this factor K = 64 is as good, and K =
/// 256 better (`docs/training.md`).
pub const WHOLE_ARRAY_SPREAD: f64 = 0.5;

/// Usual spread of a network that is given the readings of a row.
pub const ROW_SPREAD: f64 = 0.8;

/// Options of training. The default is one network for all rows in fixed16.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Number of centres, K. Fewer are used where there are fewer distinct samples.
    pub centres: usize,
    /// Width σ of all Gaussians, on scaled inputs.
    pub spread: f64,
    /// Whether the network adds an affine tail A·x. Only the [paper's own way](Options::as_in_paper) has none.
    pub affine_tail: bool,
    /// Ridge penalty on squared weights, for each training frame: at 1 it is as strong as an input that is always 1,
    /// and as strong as all activations that are fully on; on the affine tail it is at most 1e-7, or a thousandth of one above 1. `None` for the usual one:
    /// 1/[`INITIAL_COVARIANCE`] for all frames together, or [`Refinement::ridge`] if training is refined. That of places
    /// behind normalised features is chosen ([`Start::penalty`]).
    pub penalty: Option<f64>,
    /// How output weights are computed.
    pub solver: Solver,
    /// Seed of the K-means starts.
    pub seed: u64,
    /// Effort of the search for centres.
    pub search: kmeans::Search,
    /// Number format of the network.
    pub format: Format,
    /// Whether f32 takes the place of a format that does not hold the network.
    pub or_f32: bool,
    /// Whether each row has a network of its own, instead of one network for all rows behind a projection of all
    /// readings.
    pub each_row: bool,
    /// Number of features that all readings are projected to; `None` for the usual one ([`projection::fit`]).
    pub features: Option<usize>,
    /// Features for outputs of either kind; `None` for those that training [chooses](crate::kinds::choose), or readings as they
    /// are where it does not.
    pub kinds: Option<Kinds>,
}

/// Memory in bytes that training may take, about: 8 GB. More is refused before it is taken.
pub const MOST_MEMORY_BYTES: u64 = 8_000_000_000;

impl Default for Options {
    fn default() -> Self {
        Self {
            centres: 64,
            spread: ROW_SPREAD * WHOLE_ARRAY_SPREAD,
            affine_tail: true,
            penalty: None,
            solver: Solver::Qr,
            seed: 1,
            search: kmeans::Search::default(),
            format: Format::Fixed16,
            or_f32: true,
            each_row: false,
            features: None,
            kinds: None,
        }
    }
}

impl Options {
    /// Options for a network for each row in f32.
    #[must_use]
    pub fn of_rows() -> Self {
        let usual = Self::default();
        Self { each_row: true, spread: ROW_SPREAD, format: Format::F32, or_f32: false, ..usual }
    }

    /// The usual options for frames of `dataset`.
    #[must_use]
    pub fn usual_for(dataset: &Dataset) -> Self {
        let usual = Self::default();
        usual.for_each_row(!usual.projects(dataset))
    }

    /// These options as the paper trains: a network for each row in f32, without an affine tail, with weights by
    /// recursion. The paper refines nothing, either.
    #[must_use]
    pub fn as_in_paper(self) -> Self {
        let (affine_tail, solver) = (false, Solver::Rls);
        Self { format: Format::F32, affine_tail, solver, ..self.for_each_row(true) }
    }

    /// These options with a network for each row, which no features stand before, or one for all. The spread is that of
    /// the other kind times [`WHOLE_ARRAY_SPREAD`], or over it.
    #[must_use]
    pub fn for_each_row(self, each_row: bool) -> Self {
        let spread = match (self.each_row, each_row) {
            (true, false) => self.spread * WHOLE_ARRAY_SPREAD,
            (false, true) => self.spread / WHOLE_ARRAY_SPREAD,
            _ => self.spread,
        };
        let (features, kinds) = if each_row { (None, None) } else { (self.features, self.kinds) };
        Self { spread, each_row, features, kinds, ..self }
    }

    /// Whether the network of `dataset` stands behind a projection of all readings. A single row needs more readings than
    /// the usual number of features, and outputs that give as many; else its network is given the readings themselves,
    /// unless a number of features is asked for.
    pub fn projects(&self, dataset: &Dataset) -> bool {
        !self.each_row
            && (dataset.rows > 1 || self.features.is_some() || projection::is_usual_for(dataset))
    }

    /// Whether networks of `dataset` see whole frames: a single row is one.
    pub fn sees_frames(&self, dataset: &Dataset) -> bool {
        !self.each_row || dataset.rows == 1
    }

    /// Checks the options against the frames of `dataset` and the outputs that these have.
    ///
    /// # Errors
    /// [`BadValue`] for the first option that cannot be used.
    pub fn check_for(&self, dataset: &Dataset) -> std::result::Result<(), BadValue> {
        self.check(dataset.frames())?;
        tasks::check(&dataset.outputs, self.centres)
    }

    /// Initial covariance δ of the recursive least squares on so many `frames`: one over the penalty on squared weights.
    pub fn initial_covariance(&self, frames: usize) -> f64 {
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
        if let (Some(features), false) = (self.features, !self.each_row) {
            let rule = "only one network for all rows has a projection to features: leave it out";
            return Err(BadValue::new("features", features, rule));
        }
        self.penalty.map_or(Ok(()), check_penalty)?;
        check_spread("spread", self.spread)
    }
}

/// Checks a penalty on squared weights for each frame.
///
/// # Errors
/// [`BadValue`] for a penalty beyond 1e-15 to 1000.
pub fn check_penalty(penalty: f64) -> std::result::Result<(), BadValue> {
    require((1e-15..=1e3).contains(&penalty), "penalty", format!("{penalty:?}"), || {
        "give a number from 1e-15 to 1000, such as 1e-7".into()
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

impl Samples<'_> {
    /// Fits output weights to the samples for given `centres` (`centres × inputs`, on scaled inputs), by
    /// least squares, with the width and in the format that `options` ask for.
    ///
    /// # Errors
    /// [`Error`](crate::Error) if the format does not hold the network.
    ///
    /// # Panics
    /// Never: one penalty gives one network.
    pub fn fit(&self, centres: &[f64], options: &Options) -> Result<FittedNetwork> {
        let layer = self.layer(centres.to_vec(), options);
        let mut fitted = self.fit_each(&layer, options, &[options.penalty]).into_iter();
        fitted.next().expect("one network a penalty")
    }

    /// Fits output weights as [`fit`](Self::fit) does to a given `layer`, with each of `penalties` instead of the options' own.
    fn fit_each(
        &self,
        layer: &HiddenLayer,
        options: &Options,
        penalties: &[Option<f64>],
    ) -> Vec<Result<FittedNetwork>> {
        let with = |penalty: &Option<f64>| Options { penalty: *penalty, ..*options };
        let ridge = |penalty| Ridge::new(self.inputs(), &with(penalty));
        let ridges: Vec<Ridge> = penalties.iter().map(ridge).collect();
        format::fit(self, layer, options, &ridges)
    }
}

/// Trains one network for each row-wire of `dataset`, or one for each kind of its outputs that sees whole frames.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for options that do not fit the data,
/// [`Error::Unfit`](crate::Error::Unfit) for a column that f32 does not hold, and other
/// [`Error`](crate::Error)s for data that does not fit the format.
pub fn train(dataset: &Dataset, options: &Options, progress: &dyn Progress) -> Result<Trained> {
    train_refined(dataset, options, None, progress)
}

/// Trains as [`train`] does. With a `refinement` on examples, centres, width and the projection are refined before the
/// weights are fitted.
///
/// # Errors
/// As [`train`] and [`refine`](refine::refine).
///
/// # Panics
/// Never: one penalty gives one model.
pub fn train_refined(
    dataset: &Dataset,
    options: &Options,
    refinement: Option<(&Refinement, Examples<'_>)>,
    progress: &dyn Progress,
) -> Result<Trained> {
    options.check_for(dataset)?;
    resolution::check(dataset)?;
    let starts = Start::all(dataset, options)?;
    let layers = starts.iter().map(|start| start.layers(options)).collect();
    let found = Found::new(&starts, layers, options, &[options.penalty], refinement, progress)?;
    let mut trained = found.fit(options.format, options.or_f32, progress).into_iter();
    trained.next().expect("one model a penalty")
}

/// Squared distance ‖a − b‖².
#[inline(always)]
pub fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
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

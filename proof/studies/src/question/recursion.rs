//! Where recursive least squares diverges: the covariance form as textbooks print it, beside the square-root form.
//!
//! Both take in the same regressors of one row-wire, in f32 and in f64, with every forgetting factor λ, initial
//! covariance δ and width of the Gaussians. Each is compared with the batch solution of the very problem that it solves,
//! by QR decomposition in f64. So rounding is told from covariance wind-up: with λ < 1 and no leakage, the exact solution
//! itself forgets what is not excited, and is wild when that is excited again.

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use taxel_data::error::require;
use taxel_data::progress::Progress;
use taxel_data::random::Stream;
use taxel_data::{BadValue, columns};
use taxel_learn::Options;
use taxel_learn::train::least_squares::Regressors;
use taxel_learn::train::{InputScale, Samples, check_spread};
use taxel_simulate::Synthesis;

use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::Experiment;

mod forms;

use forms::Regressed;

/// Forgetting factors λ that are tried.
pub const FORGETTING_FACTORS: [f64; 5] = [1.0, 0.9999, 0.999, 0.99, 0.95];
/// Initial covariances δ that are tried.
pub const INITIAL_COVARIANCES: [f64; 7] = [1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8];
/// Widths σ on scaled inputs that are tried: the paper's, and two beyond.
pub const WIDTHS: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0];
/// Errors of a prediction, in standard deviations of the output, beyond which a recursion has diverged.
pub const DIVERGED: f64 = 1000.0;
/// Difference from the batch solution, in standard deviations of the output, above which estimates are spoilt.
pub const SPOILT: f64 = 0.01;

/// Updates for each regressor before which large errors say nothing: few samples fit their own noise.
const SETTLED: usize = 10;
/// Updates from one look at the square-root form's weights to the next.
const LOOK_EVERY: usize = 50;
/// Most samples that predictions are compared on: the last ones.
const MOST_COMPARED: usize = 500;

/// Form of the recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Covariance form as textbooks print it: P ← (P − k·hᵀP)/λ.
    Covariance,
    /// Square-root information form of this project: R by rotations, with leakage.
    SquareRoot,
}

impl Form {
    pub fn name(self) -> &'static str {
        match self {
            Self::Covariance => "covariance form",
            Self::SquareRoot => "square-root form",
        }
    }
}

/// Forms and precisions, in the order of the tables.
pub const KINDS: [(Form, &str); 4] = [
    (Form::Covariance, "f32"),
    (Form::Covariance, "f64"),
    (Form::SquareRoot, "f32"),
    (Form::SquareRoot, "f64"),
];

#[derive(Debug, Clone, PartialEq, Serialize, Args)]
pub struct Plan {
    /// Centres K.
    #[arg(long, value_name = "K", default_value_t = 48)]
    pub centres: usize,
    /// Updates of each recursion.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 10_000)]
    pub updates: usize,
}

impl Plan {
    pub fn check(&self) -> std::result::Result<(), BadValue> {
        require((1..=128).contains(&self.centres), "centres", self.centres, || {
            "give from 1 to 128".into()
        })?;
        let least = 2 * self.settled_updates();
        require((least..=1_000_000).contains(&self.updates), "updates", self.updates, || {
            format!("give from {least}, 20 for each weight, to 1000000")
        })
    }

    /// Number of updates after which large errors count as divergence: ten for each weight.
    pub fn settled_updates(&self) -> usize {
        SETTLED * (self.centres + 1)
    }
}

/// Result of one recursion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Outcome {
    pub form: Form,
    pub precision: &'static str,
    /// Width σ of the Gaussians.
    pub width: f64,
    /// Forgetting factor λ.
    pub forgetting_factor: f64,
    pub initial_covariance: f64,
    /// Number of updates after which it had diverged: a number was not finite, or the next sample's prediction off by
    /// [`DIVERGED`] standard deviations, after more than ten updates for each weight. `None` if it did not.
    pub diverged_after: Option<usize>,
    /// Whether the exact solution's prediction of that sample was as far off: covariance wind-up, which no precision
    /// mends. Else it is rounding.
    pub wound_up: bool,
    /// Root mean square difference of its predictions from the batch solution's on the last samples, in standard
    /// deviations of the output; `None` if it diverged.
    pub difference: Option<f64>,
}

/// Gaussians of one width.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Width {
    /// Width σ on scaled inputs.
    pub width: f64,
    /// Condition of the regressors: largest over smallest singular value of the matrix of all samples.
    pub condition: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// Scene whose readings are the inputs.
    pub subject: String,
    pub seed: u64,
    /// Row-wire (from 1) whose readings are the inputs.
    pub row_wire: usize,
    #[serde(flatten)]
    pub plan: Plan,
    pub output: String,
    /// Widths, with the condition that they give.
    pub widths: Vec<Width>,
    pub outcomes: Vec<Outcome>,
}

impl Study {
    pub fn outcome(
        &self,
        (form, precision): (Form, &str),
        width: f64,
        forgetting_factor: f64,
        initial_covariance: f64,
    ) -> Option<&Outcome> {
        self.outcomes.iter().find(|it| {
            (it.form, it.precision) == (form, precision)
                && [it.width, it.forgetting_factor, it.initial_covariance]
                    == [width, forgetting_factor, initial_covariance]
        })
    }
}

/// Computes the study on readings of the `experiment`, whose scene reads one row-wire.
///
/// # Panics
/// If the scene reads several row-wires.
pub fn compute(experiment: &Experiment, plan: &Plan, progress: &dyn Progress) -> Result<Study> {
    plan.check()?;
    WIDTHS.iter().try_for_each(|width| check_spread("width", *width))?;
    let world = &experiment.world;
    assert_eq!(world.read_rows.len(), 1, "one row-wire");
    let table = Synthesis::new(world).frames(Stream::Training, plan.updates).row_table(0);
    let samples = Samples::new(&table);
    let options = Options { centres: plan.centres, seed: world.seed, ..Options::default() };
    let centres = samples.centres(&options, 0);
    let names = &table.outputs.names;
    // The last axis of an electrode in the middle: what a press moves most.
    let groups = columns::groups(names);
    let members = groups.last().map_or(&[][..], |(_, members)| members);
    let output = members[(members.len() - 1) / 2];
    let (mean, deviation) = (table.outputs.means()[output], table.outputs.deviations()[output]);
    require(deviation > 0.0, "output", &names[output], || {
        "it does not move, or is missing, in these frames: choose a row or a scene that moves it"
            .into()
    })?;
    let targets: Vec<f64> =
        table.outputs.lines().map(|line| (line[output] - mean) / deviation).collect();
    let scaled = InputScale::new(&table).apply(&table.inputs.values);
    progress
        .stage("recursions", WIDTHS.len() * FORGETTING_FACTORS.len() * INITIAL_COVARIANCES.len());
    let of_width = WIDTHS.par_iter().map(|&width| {
        let decay = 1.0 / (2.0 * width * width);
        let inputs = table.inputs.names.len();
        let regressors =
            Regressors { centres: &centres, inputs, decays: &[decay], affine_tail: false };
        let stream = Regressed::new(&regressors.of(&scaled), &targets);
        let condition = stream.condition();
        let pairs = FORGETTING_FACTORS.iter().flat_map(|l| INITIAL_COVARIANCES.map(|d| (*l, d)));
        let outcomes = pairs.flat_map(|(forgetting, covariance)| {
            progress.step();
            stream.outcomes(width, forgetting, covariance)
        });
        (Width { width, condition }, outcomes.collect::<Vec<_>>())
    });
    let (widths, outcomes): (Vec<_>, Vec<_>) = of_width.collect::<Vec<_>>().into_iter().unzip();
    Ok(Study {
        subject: experiment.name.clone(),
        seed: world.seed,
        row_wire: world.read_rows[0] + 1,
        plan: plan.clone(),
        output: names[output].clone(),
        widths,
        outcomes: outcomes.into_iter().flatten().collect(),
    })
}

#[cfg(test)]
mod tests;

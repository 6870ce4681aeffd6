//! What a width for each centre gains over one for all, at the same K and at the same cost.

use clap::Args;
use serde::Serialize;
use taxel_core::rbf::{Format, Network};
use taxel_data::dataset::Dataset;
use taxel_data::error::require;
use taxel_data::progress::{Progress, Silent};
use taxel_data::random::Stream;
use taxel_data::{BadValue, columns};
use taxel_learn::cost::{Design, Prices};
use taxel_learn::decoders::{BASELINES, mean};
use taxel_learn::train::{Widths, check_spread};
use taxel_learn::{Exponential, ModelBlob, Options};
use taxel_simulate::Synthesis;

use taxel_evaluate::error::Result;
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{self, Errors, LimitSummary, Measure};
use taxel_evaluate::training_set::TrainingSet;

/// Rules for widths, each in the formats that hold them.
const VARIANTS: [(Widths, Format); 3] = [
    (Widths::Common, Format::F32),
    (Widths::Common, Format::Fixed16),
    (Widths::Neighbours, Format::F32Direct),
];

#[derive(Debug, Clone, PartialEq, Args)]
pub struct Plan {
    /// Centres K to try.
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values_t = Self::default().centres)]
    pub centres: Vec<usize>,
    /// Spreads to choose among.
    #[arg(long = "spread", value_name = "S,…", value_delimiter = ',', default_values_t = Self::default().spreads, allow_negative_numbers = true)]
    pub spreads: Vec<f64>,
}

impl Default for Plan {
    fn default() -> Self {
        Self { centres: vec![16, 64], spreads: vec![0.3, 0.5, 0.8, 1.2, 2.0, 3.0] }
    }
}

impl Plan {
    fn check(&self) -> std::result::Result<(), BadValue> {
        let lists = [("centres", self.centres.is_empty()), ("spreads", self.spreads.is_empty())];
        for (field, empty) in lists {
            require(!empty, field, "none", || "list at least one".into())?;
        }
        self.spreads.iter().try_for_each(|spread| check_spread("spreads", *spread))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WidthsStudy {
    pub subject: String,
    pub seed: u64,
    /// Noise level, as a fraction.
    pub noise_level: f64,
    /// Row-wires that are read, from 1.
    pub row_wires: Vec<usize>,
    pub group: String,
    pub unit: String,
    pub training_frames: usize,
    pub test_frames: usize,
    /// RMSE of always predicting the mean.
    pub mean_rmse: f64,
    pub limit: LimitSummary,
    /// Models, by K; first those by K-means alone, then the refined ones.
    pub models: Vec<Model>,
    /// What a width for each centre gains.
    pub gains: Vec<Gain>,
}

/// Model with the best of the spreads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Model {
    pub centres: usize,
    /// Whether centres and widths were refined after K-means.
    pub refined: bool,
    pub widths: Widths,
    /// Number format that the networks have.
    pub format: &'static str,
    /// Spread that was chosen; refinement starts from it.
    pub spread: f64,
    /// Least and largest width in the model.
    pub width_range: [f64; 2],
    /// RMSE on the frames that choose.
    pub choice_rmse: f64,
    /// RMSE on the test frames.
    pub rmse: f64,
    pub ratio_to_limit: Option<f64>,
    pub blob_bytes: usize,
    /// Cycles of a frame on a Cortex-M4F, at zero wait.
    pub cycles: u64,
}

/// Comparison of a model with widths by neighbours with the best one of one common width, as other frames than those
/// that models are judged on choose it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    pub centres: usize,
    pub refined: bool,
    /// RMSE over that of one common width, with as many centres.
    pub at_equal_centres: f64,
    /// RMSE over that of one common width within the same bytes and cycles; `None` if there is no such model.
    pub at_equal_cost: Option<f64>,
}

/// Trains and judges all models of the scene of `experiment`, for `group` of its outputs.
pub fn compute(
    experiment: &Experiment,
    group: &str,
    plan: &Plan,
    progress: &dyn Progress,
) -> Result<WidthsStudy> {
    plan.check()?;
    for &centres in &plan.centres {
        Options { centres, ..experiment.options() }.check(experiment.training.frames)?;
    }
    let synthesis = Synthesis::new(&experiment.world);
    let frames = experiment.training.test_frames;
    let judging = Judging {
        choice: experiment.dataset(&synthesis, Stream::Calibration, frames),
        test: experiment.dataset(&synthesis, Stream::Test, frames),
        group,
        prices: Prices::accepted()?,
    };
    let level = experiment.world.noise.level;
    let own = experiment.measure();
    let (measure, limit) =
        experiment.measure_beside_limit(experiment.world.noise.with_level(level), frames, progress);
    let mut set = TrainingSet::of_scene(experiment, synthesis);
    (set.confidence, set.fill) = (false, false);
    let mut models = Vec::new();
    progress.stage("train", plan.centres.len() * VARIANTS.len() * 2);
    for &centres in &plan.centres {
        let mut starts = Vec::new();
        for (widths, format) in VARIANTS {
            let options = Options { centres, widths, format, ..experiment.options() };
            let (spread, blob) = judging.best(&mut set, &options, &plan.spreads, &own)?;
            models.push(judging.model(&blob, &options, (false, spread), &measure)?);
            starts.push(Options { spread, ..options });
            progress.step();
        }
        set.refine = true;
        for options in starts {
            let blob = set.blob(&options, &Silent)?;
            models.push(judging.model(&blob, &options, (true, options.spread), &measure)?);
            progress.step();
        }
    }
    let mean = BASELINES.iter().find(|baseline| baseline.name == mean::NAME);
    let mean = mean.map(|it| metrics::judge(it.fit(&set.frames).as_ref(), &judging.test, &measure));
    Ok(WidthsStudy {
        subject: experiment.name.clone(),
        seed: experiment.world.seed,
        noise_level: level,
        row_wires: experiment.world.read_rows.iter().map(|row| row + 1).collect(),
        group: group.into(),
        unit: columns::unit_of(group).into(),
        training_frames: set.frames.frames(),
        test_frames: frames,
        mean_rmse: mean.and_then(|mean| of_group(&mean.errors, group)).map_or(f64::NAN, |e| e.rmse),
        limit,
        gains: gains(&models),
        models,
    })
}

fn of_group(errors: &[Errors], group: &str) -> Option<Errors> {
    errors.iter().find(|errors| errors.group == group).cloned()
}

/// What models are judged by.
struct Judging<'g> {
    /// Frames that choose the spread, and the format of one common width.
    choice: Dataset,
    test: Dataset,
    group: &'g str,
    prices: Prices,
}

impl Judging<'_> {
    /// Best of the `spreads` by K-means alone, and its model. Spreads that the format does not hold are left out, unless
    /// it holds none.
    fn best(
        &self,
        set: &mut TrainingSet<'_>,
        options: &Options,
        spreads: &[f64],
        measure: &Measure,
    ) -> Result<(f64, ModelBlob)> {
        set.refine = false;
        let mut best: Result<(f64, ModelBlob)> =
            Err(BadValue::new("spreads", "none", "list at least one").into());
        let mut least = f64::INFINITY;
        for &spread in spreads {
            match set.blob(&Options { spread, ..*options }, &Silent) {
                Ok(blob) => {
                    let rmse = self.choice_rmse(&blob, measure);
                    if rmse < least {
                        (least, best) = (rmse, Ok((spread, blob)));
                    }
                }
                Err(cause) if best.is_err() => best = Err(cause),
                Err(_) => {}
            }
        }
        best
    }

    fn choice_rmse(&self, blob: &ModelBlob, measure: &Measure) -> f64 {
        self.errors(blob, &self.choice, measure).map_or(f64::NAN, |errors| errors.rmse)
    }

    fn errors(&self, blob: &ModelBlob, frames: &Dataset, measure: &Measure) -> Option<Errors> {
        let decoder = blob.prepare(Exponential::default()).of_inputs();
        of_group(&metrics::judge(&decoder, frames, measure).errors, self.group)
    }

    fn model(
        &self,
        blob: &ModelBlob,
        options: &Options,
        (refined, spread): (bool, f64),
        measure: &Measure,
    ) -> Result<Model> {
        let errors = self.errors(blob, &self.test, measure);
        let model = blob.parse();
        let of_network = |network: Network<'_>| network.widths().map(f64::from).collect::<Vec<_>>();
        let widths = model.networks().flat_map(of_network);
        let wider = |[low, high]: [f64; 2], width: f64| [low.min(width), high.max(width)];
        let cost = self.prices.frames(&Design::new(blob), Exponential::default())?;
        Ok(Model {
            centres: options.centres,
            refined,
            widths: options.widths,
            format: model.networks().next().map_or("", |network| network.format().name()),
            spread,
            width_range: widths.fold([f64::INFINITY, 0.0], wider),
            choice_rmse: self.choice_rmse(blob, measure),
            rmse: errors.as_ref().map_or(f64::NAN, |errors| errors.rmse),
            ratio_to_limit: errors.and_then(|errors| errors.ratio_to_limit),
            blob_bytes: blob.bytes().len(),
            cycles: cost.ungated.cycles,
        })
    }
}

/// Gains of all models with a width for each centre.
fn gains(models: &[Model]) -> Vec<Gain> {
    let own = models.iter().filter(|model| model.widths == Widths::Neighbours);
    let gain = |own: &Model| {
        let over_best = |like: &dyn Fn(&Model) -> bool| {
            let common = models.iter().filter(|model| model.refined == own.refined);
            let common = common.filter(|model| model.widths == Widths::Common && like(model));
            let best = common.min_by(|a, b| a.choice_rmse.total_cmp(&b.choice_rmse));
            best.map(|best| own.rmse / best.rmse)
        };
        Gain {
            centres: own.centres,
            refined: own.refined,
            at_equal_centres: over_best(&|model| model.centres == own.centres).unwrap_or(f64::NAN),
            at_equal_cost: over_best(&|model| {
                model.blob_bytes <= own.blob_bytes && model.cycles <= own.cycles
            }),
        }
    };
    own.map(gain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_compare_with_common_widths_of_as_many_centres_and_of_no_more_cost() {
        let model = |centres, widths, [choice_rmse, rmse]: [f64; 2], blob_bytes, cycles| Model {
            centres,
            refined: false,
            widths,
            format: "",
            spread: 0.8,
            width_range: [0.8; 2],
            choice_rmse,
            rmse,
            ratio_to_limit: None,
            blob_bytes,
            cycles,
        };
        let models = [
            model(16, Widths::Common, [0.051, 0.05], 400, 40),
            model(16, Widths::Common, [0.052, 0.04], 400, 40), // better by chance
            model(16, Widths::Neighbours, [0.05, 0.045], 900, 90),
            model(64, Widths::Common, [0.04, 0.041], 900, 80),
            model(64, Widths::Neighbours, [0.03, 0.03], 3000, 30),
        ];
        let [few, many] = gains(&models).try_into().unwrap();
        assert_eq!((few.at_equal_centres, few.at_equal_cost), (0.045 / 0.05, Some(0.045 / 0.041)));
        assert_eq!((many.at_equal_centres, many.at_equal_cost), (0.03 / 0.041, None));
    }
}

//! Selection of K, spread and ridge penalty by k-fold cross-validation: a [plan](crate::sweep) whose points differ in these
//! and in the fold that is held out.

use std::sync::Arc;

use serde::Serialize;
use taxel_data::{BadValue, Progress, Table};
use taxel_learn::decoders::{BASELINES, Baseline};
use taxel_learn::folds::{baseline_rmse, pooled_rmse, smallest_training_part};
use taxel_learn::train::refine::LEAST_FOLDS;
use toml::Value;

use crate::error::Result;
use crate::measurements::Measurements;
use crate::sweep::file::Wanted;
use crate::sweep::plan::{Base, FOLD, Plan};
use crate::sweep::{Record, work};

mod grid;

pub use grid::{Candidates, Edge};

/// Result of one candidate on the folds that it was not trained on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Number of centres, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Penalty on squared weights for each frame ([`Options::penalty`](taxel_learn::Options::penalty)); `None` for the usual one.
    pub penalty: Option<f64>,
    /// RMSE of each output over all held-out samples, in the output's unit.
    pub rmse: Vec<f64>,
    /// Mean over the outputs of RMSE/standard deviation: the quantity that selection minimises. Outputs
    /// that never change do not count.
    pub score: f64,
}

/// Results of every candidate, and the best one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Selection {
    /// All candidates, by K, then spread, then penalty; then those that the grid was extended by.
    pub scored: Vec<Scored>,
    /// Index in `scored` of the lowest score (the first among equals).
    pub chosen: usize,
    /// Settings whose best value is the smallest or largest tried, where a better one may lie beyond.
    pub edges: Vec<Edge>,
    /// Baselines on the same folds, for comparison.
    pub baselines: Vec<BaselineScore>,
}

/// Result of a baseline on the folds that it was not fitted to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineScore {
    /// Name of the baseline.
    pub decoder: &'static str,
    /// RMSE of each output over all held-out samples, in the output's unit.
    pub rmse: Vec<f64>,
    /// Mean over the outputs of RMSE/standard deviation, as of candidates.
    pub score: f64,
}

impl Selection {
    /// Candidate with the lowest score.
    pub fn best(&self) -> &Scored {
        &self.scored[self.chosen]
    }

    /// Baseline with the lowest score, if it is lower than that of every candidate.
    pub fn better_baseline(&self) -> Option<&BaselineScore> {
        let lowest = self.baselines.iter().min_by(|a, b| a.score.total_cmp(&b.score));
        lowest.filter(|baseline| baseline.score < self.best().score)
    }
}

/// Scores every combination of `candidates` on the frames of `data`, each fold judged by models that were trained on the
/// others. All other options are those of `data`. Where it refines, spreads are where that starts, and it takes the folds that
/// are not held out as its own.
///
/// A grid is extended one value at a time, at the best values of the other settings.
///
/// # Errors
/// [`BadValue`] for fewer than two folds (with a refinement, one more than it needs), no candidate, or a candidate that does
/// not fit the data; otherwise the errors of training.
pub fn cross_validate(
    data: &Arc<Measurements>,
    candidates: &Candidates,
    progress: &dyn Progress,
) -> Result<Selection> {
    let (how, outputs) = (&data.how, &data.training.outputs);
    let folds = data.folds();
    let least = if how.refine { LEAST_FOLDS + 1 } else { 2 };
    if folds < least {
        let of = if how.refine { " of refined training" } else { "" };
        let rule = format!("cross-validation{of} needs at least {least}");
        return Err(BadValue::new("folds", folds, rule).into());
    }
    let fewest = smallest_training_part(&data.fold_of, outputs);
    candidates.check(|options| options.check(fewest), &how.options)?;
    let subject = (vec![Base::measured("data")], Some(data.clone()));
    let plan = Plan::new("selection", subject, Wanted::default(), "")?;
    let scores = |candidates: &Candidates| scores(&plan, candidates, (folds, outputs), progress);
    let mut scored = scores(candidates)?;
    let mut best = lowest(&scored)
        .ok_or_else(|| BadValue::new("candidates", 0, "give at least one value of each setting"))?;
    let mut grown = candidates.clone();
    while let Some((spread, penalty)) = grown.grow(&scored[best]) {
        let centres = vec![scored[best].centres];
        let (spreads, penalties) = (vec![spread], vec![penalty]);
        scored.extend(scores(&Candidates { centres, spreads, penalties, ..*candidates })?);
        best = lowest(&scored).unwrap_or(best);
    }
    let edges = grown.edges(&scored[best]);
    Ok(Selection { edges, chosen: best, scored, baselines: baselines(data) })
}

/// Index of the lowest score, the first among equals.
fn lowest(scored: &[Scored]) -> Option<usize> {
    (0..scored.len()).min_by(|a, b| scored[*a].score.total_cmp(&scored[*b].score))
}

/// Scores of all combinations, by K, then spread, then penalty.
fn scores(
    plan: &Plan,
    candidates: &Candidates,
    (folds, outputs): (usize, &Table),
    progress: &dyn Progress,
) -> Result<Vec<Scored>> {
    let Candidates { centres, spreads, penalties, .. } = candidates;
    let mut tried = vec![];
    for centres in centres {
        for spread in spreads {
            tried.extend(penalties.iter().map(|penalty| (*centres, *spread, *penalty)));
        }
    }
    let whole = |number: usize| Value::Integer(i64::try_from(number).unwrap_or(i64::MAX));
    let mut points = Vec::with_capacity(tried.len() * folds);
    for (centres, spread, penalty) in &tried {
        for fold in 0..folds {
            let mut values = vec![
                (FOLD, whole(fold)),
                ("training.centres", whole(*centres)),
                ("training.spread", Value::Float(*spread)),
            ];
            values.extend(penalty.map(|penalty| ("training.penalty", Value::Float(penalty))));
            let values = values.into_iter().map(|(field, value)| (field.to_owned(), value));
            points.push(plan.point(values.collect())?);
        }
    }
    let accept = |_: usize, record: &Record| match &record.failed {
        None => Ok(()),
        Some(why) => Err(taxel_data::Error::unfit(format!("cross-validation: {why}")).into()),
    };
    let records = work::until(plan, &points, &accept, progress)?.into_iter().flatten();
    let squares: Vec<Vec<f64>> = records.map(|record| record.squares).collect();
    let deviations = outputs.deviations();
    let scored = tried.into_iter().zip(squares.chunks_exact(folds));
    let scored = scored.map(|((centres, spread, penalty), squares)| {
        let rmse = pooled_rmse(squares, outputs);
        let score = score(&rmse, &deviations);
        Scored { centres, spread, penalty, rmse, score }
    });
    Ok(scored.collect())
}

/// Baselines on the same folds.
fn baselines(data: &Measurements) -> Vec<BaselineScore> {
    let deviations = data.training.outputs.deviations();
    let score = |it: &Baseline| {
        let rmse = baseline_rmse(it, &data.training, &data.fold_of)?;
        Some(BaselineScore { decoder: it.name, score: score(&rmse, &deviations), rmse })
    };
    BASELINES.iter().filter_map(score).collect()
}

/// Mean over the outputs of RMSE/standard deviation. Outputs that never change do not count.
fn score(rmse: &[f64], deviations: &[f64]) -> f64 {
    let changing = rmse.iter().zip(deviations).filter(|(_, deviation)| **deviation > 0.0);
    let relative: Vec<f64> = changing.map(|(rmse, deviation)| rmse / deviation).collect();
    // The empty sum of floats is −0.
    (relative.iter().sum::<f64>() + 0.0) / relative.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::random::{Purpose, Random, Stream};
    use taxel_data::{AtRest, Dataset, Silent};
    use taxel_learn::Options;
    use taxel_learn::folds::{block_folds, random_folds};
    use taxel_learn::train::{Features, Kinds};

    use crate::training_options::Training;

    #[test]
    fn a_score_without_a_changing_output_is_positive_zero() {
        assert!(score(&[0.5], &[0.0]).is_sign_positive());
    }

    /// Data set whose output y follows two inputs, while `constant` never changes.
    fn dataset(outputs: &[&str]) -> Dataset {
        let mut random = Random::new(3, Stream::Training, Purpose::Noise, 0, 0);
        let (mut inputs, mut values) = (Vec::new(), Vec::new());
        for _ in 0..400 {
            let (a, b) = (random.unit(), random.unit());
            inputs.extend([a, b]);
            let of = |name: &&str| if *name == "y" { (9.0 * a).sin() * b } else { 5.0 };
            values.extend(outputs.iter().map(of));
        }
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect();
        Dataset {
            inputs: Table { names: names(&["a", "b"]), values: inputs.into() },
            outputs: Table { names: names(outputs), values: values.into() },
            ..Dataset::empty(vec![], vec![], 1, 0)
        }
    }

    fn selected(
        dataset: &Dataset,
        folds: &[usize],
        candidates: &Candidates,
        options: Options,
    ) -> Selection {
        let how = Training { options, refine: false, ..Training::default() };
        let data = Measurements::of_frames("data", dataset.clone(), folds.to_vec(), how);
        cross_validate(&Arc::new(data), candidates, &Silent).unwrap()
    }

    /// What is selected of one number of centres, where no spread is tried beyond those given.
    fn select(
        dataset: &Dataset,
        folds: &[usize],
        centres: usize,
        spreads: &[f64],
        penalties: &[Option<f64>],
        most_penalties: usize,
    ) -> Selection {
        let (spreads, penalties) = (spreads.to_vec(), penalties.to_vec());
        let candidates = Candidates {
            centres: vec![centres],
            spreads,
            penalties,
            most_spreads: 0,
            most_penalties,
        };
        let kinds = Some(Kinds::all(Features::AsTheyAre));
        let options = Options { centres: 1, spread: 1.0, kinds, ..Options::of_rows() };
        selected(dataset, folds, &candidates, options)
    }

    /// Noisy outputs of few frames: a penalty keeps many centres from fitting the noise.
    #[test]
    fn a_penalty_is_chosen_for_noisy_data_and_the_grid_reaches_it() {
        let mut dataset = dataset(&["y"]).subset(&(0..150).collect::<Vec<_>>());
        let mut random = Random::new(8, Stream::Training, Purpose::Noise, 0, 0);
        dataset.outputs.values.iter_mut().for_each(|y| *y += 0.3 * random.normal());
        let folds = block_folds(dataset.frames(), 4);
        let select = |penalties: &[f64], most: usize| {
            let penalties: Vec<Option<f64>> = penalties.iter().copied().map(Some).collect();
            select(&dataset, &folds, 60, &[0.2], &penalties, most)
        };
        let wide = select(&[1e-9, 1e-7, 1e-5, 1e-3, 1e-1], 0);
        assert!((0.3..0.4).contains(&wide.best().rmse[0]), "little more than the noise: {wide:?}");
        let chosen = wide.best().penalty.unwrap();
        assert!((1e-5..=1e-2).contains(&chosen) && wide.edges.is_empty(), "{wide:?}");
        assert!(wide.best().score < 0.8 * wide.scored[0].score, "{wide:?}");
        let narrow = select(&[1e-9, 1e-7], 0);
        let edge = Edge { setting: "penalty", value: 1e-7, largest: true };
        assert_eq!((narrow.scored.len(), narrow.edges.as_slice()), (2, &[edge][..]));
        let grown = select(&[1e-9, 1e-7], 6);
        assert!(grown.edges.is_empty(), "{grown:?}");
        let grown_to = grown.best().penalty.unwrap();
        assert!((grown_to / chosen - 1.0).abs() < 1e-9, "{grown_to} {chosen}");
    }

    #[test]
    fn settings_are_compared_with_the_features_of_the_model() {
        let mut random = Random::new(4, Stream::Training, Purpose::Noise, 0, 0);
        let mut data =
            Dataset::empty(["a", "b"].map(String::from).into(), vec!["x_mm".into()], 1, 0);
        data.at_rest = Some(AtRest { level: vec![0.0; 2], deviation: vec![0.0; 2] });
        for _ in 0..400 {
            let (x, strength) = (random.unit(), random.between([0.2, 5.0]));
            data.inputs.values.extend([strength * (1.0 - x), strength * x]);
            data.outputs.values.push(x);
        }
        let folds = block_folds(data.frames(), 4);
        let candidates = Candidates {
            centres: vec![10],
            spreads: vec![0.4],
            penalties: vec![None],
            most_spreads: 0,
            most_penalties: 0,
        };
        let rmse = |features: Features| {
            let options = Options { kinds: Some(Kinds::all(features)), ..Options::default() };
            selected(&data, &folds, &candidates, options).best().rmse[0]
        };
        let [plain, normalised] =
            [Features::AsTheyAre, Features::Normalised { threshold: 0.0 }].map(rmse);
        assert!(normalised < 0.5 * plain, "{normalised} {plain}");
    }

    fn best_spread(outputs: &[&str]) -> f64 {
        let dataset = dataset(outputs);
        let folds = random_folds(dataset.frames(), 4, 1);
        let selection = select(&dataset, &folds, 20, &[0.05, 0.2, 3.0], &[None], 0);
        assert_eq!(selection.scored.len(), 3);
        selection.best().spread
    }

    #[test]
    fn the_better_spread_is_chosen_whatever_stands_beside() {
        assert_eq!(best_spread(&["y"]), 0.2);
        assert_eq!(best_spread(&["y", "constant"]), 0.2);
    }

    #[test]
    fn an_output_is_judged_on_the_frames_that_have_it() {
        let mut both = dataset(&["y", "z"]);
        for (number, line) in both.outputs.values.chunks_exact_mut(2).enumerate() {
            line[0] += 1.0;
            line[1] = if number % 3 == 0 { f64::NAN } else { line[0] };
        }
        let folds = block_folds(both.frames(), 4);
        let select = |data: &Dataset| select(data, &folds, 20, &[0.5], &[None], 0);
        let alone = Dataset { outputs: both.outputs.columns(0, 1), ..both.clone() };
        let (of_both, of_one) = (select(&both), select(&alone));
        assert_eq!(of_both.scored[0].rmse[0].to_bits(), of_one.scored[0].rmse[0].to_bits());
        for (both, one) in of_both.baselines.iter().zip(&of_one.baselines) {
            assert_eq!(both.rmse[0].to_bits(), one.rmse[0].to_bits());
            // Two thirds of the same values have nearly the same error.
            assert!((0.8..1.25).contains(&(both.rmse[1] / both.rmse[0])), "{both:?}");
        }
        let ratio = of_both.scored[0].rmse[1] / of_both.scored[0].rmse[0];
        assert!((0.5..2.0).contains(&ratio), "{ratio}");
    }
}

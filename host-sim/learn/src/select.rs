//! Selection of K, spread and ridge penalty by k-fold cross-validation.

use serde::Serialize;
use taxel_data::{BadValue, Dataset, Progress, Silent};

use crate::decoders::{BASELINES, Baseline};
use crate::error::Result;
use crate::parallel;
use crate::train::refine::LEAST_FOLDS;
use crate::train::{Examples, Found, Layers, Options, Refinement, Start};

mod folds;
mod grid;

pub use folds::{block_folds, number_folds, random_folds, smallest_training_part};
pub use grid::{Candidates, Edge};

/// Frames that baselines decode at once.
const FRAMES_AT_ONCE: usize = 8192;

/// Result of one candidate on the folds that it was not trained on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Number of centres, K.
    pub centres: usize,
    /// Width σ on scaled inputs.
    pub spread: f64,
    /// Penalty on squared weights for each frame ([`Options::penalty`]); `None` for the usual one.
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

/// Scores every combination of `candidates` by cross-validation.
///
/// `fold_of` gives each frame's fold, numbered from 0; all other options come from `options`. With a `refinement`,
/// spreads are where it starts, and it takes the folds that are not held out as its own.
///
/// A grid is extended one value at a time, at the best values of the other settings.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for fewer than two folds (with a refinement, one more than
/// it needs), no candidate, or a candidate that
/// does not fit the data; otherwise the errors of [`train`](crate::train::train).
pub fn cross_validate(
    dataset: &Dataset,
    fold_of: &[usize],
    candidates: &Candidates,
    options: &Options,
    refinement: Option<&Refinement>,
    progress: &dyn Progress,
) -> Result<Selection> {
    let judge = Judge::new(dataset, fold_of, options, refinement)?;
    candidates.check(|options| options.check(judge.smallest_training_part()), options)?;
    let Candidates { centres, spreads, penalties, .. } = candidates;
    let mut scored = judge.scores(centres, spreads, penalties, progress)?;
    let mut best = lowest(&scored)
        .ok_or_else(|| BadValue::new("candidates", 0, "give at least one value of each setting"))?;
    let mut grown = candidates.clone();
    while let Some((spread, penalty)) = grown.grow(&scored[best]) {
        let more = judge.scores(&[scored[best].centres], &[spread], &[penalty], progress)?;
        scored.extend(more);
        best = lowest(&scored).unwrap_or(best);
    }
    let edges = grown.edges(&scored[best]);
    Ok(Selection { edges, chosen: best, scored, baselines: judge.baselines() })
}

/// Index of the lowest score, the first among equals.
fn lowest(scored: &[Scored]) -> Option<usize> {
    (0..scored.len()).min_by(|a, b| scored[*a].score.total_cmp(&scored[*b].score))
}

/// Frames in folds, on which candidates are judged.
struct Judge<'d> {
    dataset: &'d Dataset,
    fold_of: &'d [usize],
    folds: usize,
    options: &'d Options,
    refinement: Option<&'d Refinement>,
}

impl<'d> Judge<'d> {
    fn new(
        dataset: &'d Dataset,
        fold_of: &'d [usize],
        options: &'d Options,
        refinement: Option<&'d Refinement>,
    ) -> Result<Self> {
        let folds = fold_of.iter().max().map_or(0, |last| last + 1);
        let least = if refinement.is_some() { LEAST_FOLDS + 1 } else { 2 };
        if folds < least {
            let of = if refinement.is_some() { " of refined training" } else { "" };
            let rule = format!("cross-validation{of} needs at least {least}");
            return Err(BadValue::new("folds", folds, rule).into());
        }
        Ok(Self { dataset, fold_of, folds, options, refinement })
    }

    fn smallest_training_part(&self) -> usize {
        smallest_training_part(self.fold_of, &self.dataset.outputs)
    }

    /// Scores of all combinations, by K, then spread, then penalty.
    fn scores(
        &self,
        centres: &[usize],
        spreads: &[f64],
        penalties: &[Option<f64>],
        progress: &dyn Progress,
    ) -> Result<Vec<Scored>> {
        let of_k = |k: &usize| (0..self.folds).map(|fold| (*k, fold)).collect::<Vec<_>>();
        let tasks: Vec<(usize, usize)> = centres.iter().flat_map(of_k).collect();
        progress.stage("cross-validate", tasks.len());
        let squares = parallel::map(tasks.len(), &|task| {
            let (centres, fold) = tasks[task];
            let options = Options { centres, ..*self.options };
            let squares = self.held_out_squares(fold, spreads, penalties, &options);
            progress.step();
            squares
        });
        let squares: Vec<Vec<Vec<f64>>> = squares.into_iter().collect::<Result<_>>()?;
        let (deviations, counts) =
            (self.dataset.outputs.deviations(), self.dataset.outputs.counts());
        let mut scored = Vec::new();
        for (k, of_folds) in centres.iter().zip(squares.chunks_exact(self.folds)) {
            let pairs = spreads.iter().flat_map(|s| penalties.iter().map(move |p| (*s, *p)));
            for (place, (spread, penalty)) in pairs.enumerate() {
                let sum = |output: usize| of_folds.iter().map(|fold| fold[place][output]).sum();
                let outputs = counts.iter().enumerate();
                let rmse: Vec<f64> =
                    outputs.map(|(output, count)| root_mean(sum(output), *count)).collect();
                let score = score(&rmse, &deviations);
                scored.push(Scored { centres: *k, spread, penalty, rmse, score });
            }
        }
        Ok(scored)
    }

    /// Sums of squared errors on one fold, `[spread · penalty][output]`, after training on the others.
    fn held_out_squares(
        &self,
        fold: usize,
        spreads: &[f64],
        penalties: &[Option<f64>],
        options: &Options,
    ) -> Result<Vec<Vec<f64>>> {
        let (held, kept) = split(self.fold_of, fold);
        let [test, training] = [held, kept].map(|frames| self.dataset.subset(&frames));
        let inner = without(self.fold_of, fold);
        let refinement = self.refinement.map(|settings| (settings, Examples::Folds(&inner)));
        // Where centres move to depends on the penalty.
        let together = if refinement.is_some() { 1 } else { penalties.len().max(1) };
        let starts = Start::all(&training, options)?;
        let layers: Vec<Layers> = starts.iter().map(|start| start.layers(options)).collect();
        let mut squares = Vec::new();
        for spread in spreads {
            for penalties in penalties.chunks(together) {
                let options = Options { spread: *spread, penalty: penalties[0], ..*options };
                let layers = layers.clone();
                let found = Found::new(&starts, layers, &options, penalties, refinement, &Silent)?;
                for trained in found.fit(options.format, options.or_f32, &Silent) {
                    let decoded = trained?.decode(&test.inputs.values);
                    let decoded = test.outputs.with_places(decoded);
                    squares.push(test.outputs.squared_errors(&decoded));
                }
            }
        }
        Ok(squares)
    }

    /// Baselines on the same folds.
    fn baselines(&self) -> Vec<BaselineScore> {
        let deviations = self.dataset.outputs.deviations();
        let score = |it: &Baseline| {
            let rmse = baseline_rmse(it, self.dataset, self.fold_of)?;
            Some(BaselineScore { decoder: it.name, score: score(&rmse, &deviations), rmse })
        };
        BASELINES.iter().filter_map(score).collect()
    }
}

/// RMSE of a baseline on folds that it was not fitted to, for each output, in its unit. `fold_of` gives each frame's fold,
/// numbered from 0. It is NaN for an output without a value. `None` for a baseline that cannot be fitted.
pub fn baseline_rmse(
    baseline: &Baseline,
    dataset: &Dataset,
    fold_of: &[usize],
) -> Option<Vec<f64>> {
    let folds = fold_of.iter().max().map_or(0, |last| last + 1);
    let squares = parallel::map(folds, &|fold| baseline_squares(baseline, dataset, fold_of, fold));
    let squares: Vec<Vec<f64>> = squares.into_iter().collect::<Option<_>>()?;
    let rmse = |(output, count): (usize, usize)| {
        root_mean(squares.iter().map(|fold| fold[output]).sum(), count)
    };
    Some(dataset.outputs.counts().into_iter().enumerate().map(rmse).collect())
}

fn root_mean(squares: f64, count: usize) -> f64 {
    (squares / count as f64).sqrt()
}

/// Mean over the outputs of RMSE/standard deviation. Outputs that never change do not count.
fn score(rmse: &[f64], deviations: &[f64]) -> f64 {
    let changing = rmse.iter().zip(deviations).filter(|(_, deviation)| **deviation > 0.0);
    let relative: Vec<f64> = changing.map(|(rmse, deviation)| rmse / deviation).collect();
    // The empty sum of floats is −0.
    (relative.iter().sum::<f64>() + 0.0) / relative.len().max(1) as f64
}

/// Sums of squared errors of a baseline on one fold, `[output]`, after fitting it to the others.
fn baseline_squares(
    baseline: &Baseline,
    dataset: &Dataset,
    fold_of: &[usize],
    fold: usize,
) -> Option<Vec<f64>> {
    let (held, kept) = split(fold_of, fold);
    let decoder = baseline.fit_to(dataset, &kept)?;
    let mut sums = vec![0.0; dataset.outputs.names.len()];
    for lines in held.chunks(FRAMES_AT_ONCE) {
        let test = dataset.subset(lines);
        let predicted = decoder.decode_all(&test.inputs.values, 1);
        test.outputs.add_squared_errors(&predicted.values, &mut sums);
    }
    Some(sums)
}

/// Frames that are held out, and all others, for one fold.
fn split(fold_of: &[usize], fold: usize) -> (Vec<usize>, Vec<usize>) {
    (0..fold_of.len()).partition(|frame| fold_of[*frame] == fold)
}

/// Folds of the frames that are not in `fold`, numbered without a gap.
fn without(fold_of: &[usize], fold: usize) -> Vec<usize> {
    let others = fold_of.iter().filter(|f| **f != fold);
    others.map(|f| if *f > fold { f - 1 } else { *f }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_are_numbered_without_the_one_that_is_held_out() {
        assert_eq!(without(&[0, 1, 2, 3, 1, 0], 1), [0, 1, 2, 0]);
    }

    #[test]
    fn without_an_output_that_changes_the_score_is_0_and_not_minus_0() {
        assert!(score(&[0.5], &[0.0]).is_sign_positive());
    }
    use crate::train::{Features, Kinds};
    use taxel_data::AtRest;
    use taxel_data::random::{Purpose, Random, Stream};
    use taxel_data::table::Table;

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
        let options = Options { centres: 1, spread: 1.0, ..Options::of_rows() };
        cross_validate(dataset, folds, &candidates, &options, None, &Silent).unwrap()
    }

    /// Noisy outputs of few frames: a penalty keeps many centres from fitting the noise.
    #[test]
    fn a_penalty_is_chosen_where_data_are_noisy_and_the_grid_grows_to_it() {
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
            let selection = cross_validate(&data, &folds, &candidates, &options, None, &Silent);
            selection.unwrap().best().rmse[0]
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

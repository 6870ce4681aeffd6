//! Choice of features for either kind of outputs, by frames that are held out.

use std::fmt::{self, Display};

use serde::Serialize;
use taxel_core::rbf::Format;
use taxel_data::{Dataset, Progress, Silent, columns};

use crate::train::kmeans::Search;
use crate::train::{Features, Kinds, Options, Solver, THRESHOLD, train};

/// Most frames that are trained on, and most that are judged by, for each part that is held out.
const MOST_FRAMES: [usize; 2] = [4000, 2000];
/// Most centres of the networks that are tried.
const MOST_CENTRES: usize = 32;

/// Share of the score of features as they are that others must be below, if one network then serves all outputs, and if
/// places and amounts get a network each, which costs more.
const BETTER: [f64; 2] = [0.99, 0.95];

/// Features that were chosen, and what was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choice {
    /// What was chosen.
    #[serde(skip)]
    pub kinds: Kinds,
    /// What was tried, places before amounts.
    pub tried: Vec<Tried>,
}

impl Display for Choice {
    /// What was chosen, and the scores of all, in a sentence for each kind of outputs; empty if nothing was tried.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.tried.is_empty() {
            return Ok(());
        }
        for (index, of_kind) in self.tried.chunk_by(|a, b| a.outputs == b.outputs).enumerate() {
            let score = |it: &Tried| format!("{} {:.3}", it.features, it.score);
            let scores: Vec<String> = of_kind.iter().map(score).collect();
            let chosen = of_kind.iter().find(|it| it.chosen).map_or("", |it| &it.features);
            let (gap, outputs) = (if index > 0 { " " } else { "" }, of_kind[0].outputs);
            write!(f, "{gap}Features for {outputs}: {chosen} ({}).", scores.join(", "))?;
        }
        f.write_str(
            " (RMSE/standard deviation of small networks on frames held out; --features-kind)",
        )
    }
}

/// Features that were tried for outputs of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tried {
    /// `places` or `amounts`.
    pub outputs: &'static str,
    /// Features, in words.
    pub features: String,
    /// RMSE of a quantity over its largest standard deviation on frames that were held out, a mean over quantities.
    pub score: f64,
    /// Whether they were chosen.
    pub chosen: bool,
}

/// Chooses features for the outputs of `dataset`, whose frames are in folds: small networks are trained on all but the first,
/// and all but the last fold, and judged by that fold. `None` where there is nothing to choose: with a network for each
/// row, with a single fold, or where `options` say which.
///
/// Readings at rest tell the noise; without them no threshold is tried. Amounts of few readings, which a network is given
/// itself, are learnt from readings as they are: refinement makes more of these than small networks tell.
pub fn choose(
    dataset: &Dataset,
    fold_of: &[usize],
    options: &Options,
    progress: &dyn Progress,
) -> Option<Choice> {
    let last = fold_of.iter().max().copied().unwrap_or(0);
    if options.kinds.is_some() || !options.sees_frames(dataset) || last == 0 {
        return None;
    }
    let mut candidates = vec![Features::AsTheyAre, Features::Normalised { threshold: 0.0 }];
    if dataset.at_rest.is_some() {
        candidates.push(Features::Normalised { threshold: THRESHOLD });
    }
    progress.stage("choose features", 2 * candidates.len());
    // By candidate, kind of outputs and fold.
    let mut scores = vec![[[0.0; 2]; 2]; candidates.len()];
    for (part_held, fold) in [0, last].into_iter().enumerate() {
        let part = |is_held: bool, most: usize| {
            let frames: Vec<usize> =
                (0..fold_of.len()).filter(|frame| (fold_of[*frame] == fold) == is_held).collect();
            let step = frames.len().div_ceil(most).max(1);
            dataset.subset(&frames.into_iter().step_by(step).collect::<Vec<_>>())
        };
        let (training, held) = (part(false, MOST_FRAMES[0]), part(true, MOST_FRAMES[1]));
        for (features, scores) in candidates.iter().zip(&mut scores) {
            let found = judge(&training, &held, *features, options);
            scores.iter_mut().zip(found).for_each(|(of_kind, score)| of_kind[part_held] = score);
            progress.step();
        }
    }
    let mut tried = Vec::new();
    let places = dataset.outputs.names.iter().filter(|name| columns::is_place(name)).count();
    let are_both = places > 0 && places < dataset.outputs.names.len();
    let better = BETTER[usize::from(are_both)];
    let mean = |[a, b]: [f64; 2]| 0.5 * (a + b);
    let mut pick = |kind: usize, outputs: &'static str| {
        if kind == 1 && !options.projects(dataset) {
            return Features::AsTheyAre;
        }
        let plain = scores[0][kind];
        // Better on both parts, and by more than chance.
        let is_better = |of: [f64; 2]| {
            (0..2).all(|part| of[part] < plain[part]) && mean(of) < better * mean(plain)
        };
        let others = (1..candidates.len()).filter(|index| is_better(scores[*index][kind]));
        let score = |index: &usize| mean(scores[*index][kind]);
        let best = others.min_by(|a, b| score(a).total_cmp(&score(b))).unwrap_or(0);
        if mean(plain) > 0.0 {
            tried.extend(candidates.iter().zip(&scores).enumerate().map(
                |(index, (features, scores))| Tried {
                    outputs,
                    features: features.to_string(),
                    score: mean(scores[kind]),
                    chosen: index == best,
                },
            ));
        }
        candidates[best]
    };
    let kinds = Kinds { places: pick(0, "places"), amounts: pick(1, "amounts") };
    Some(Choice { kinds, tried })
}

/// Scores of places and of amounts on frames that are `held`, of a network with these features that is trained on the
/// others; 0 for a kind without outputs, and infinite where it cannot be trained. A place that is not told counts as the
/// mean.
fn judge(training: &Dataset, held: &Dataset, features: Features, options: &Options) -> [f64; 2] {
    let options = Options {
        centres: options.centres.min(MOST_CENTRES),
        format: Format::F32,
        // So that solvers differ in their weights alone.
        solver: Solver::Qr,
        search: Search { restarts: 1, ..options.search },
        kinds: Some(Kinds::all(features)),
        ..*options
    };
    let Ok(trained) = train(training, &options, &Silent) else { return [f64::INFINITY; 2] };
    let decoded = trained.decode(&held.inputs.values);
    let names = &held.outputs.names;
    let deviations = held.outputs.deviations();
    let error = |output: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        for frame in 0..held.frames() {
            let place = frame * names.len() + output;
            let truth = held.outputs.values[place];
            // A touch that is missed is as wrong as the mean is.
            let missed =
                if decoded[place].is_nan() { deviations[output] } else { decoded[place] - truth };
            if !truth.is_nan() {
                (sum, count) = (sum + missed.powi(2), count + 1.0);
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    };
    // Outputs of a quantity are compared as they are.
    let quantity = |output: &usize| {
        (columns::is_place(&names[*output]), columns::quantity_of(&names[*output]))
    };
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_key(quantity);
    let mut scores = [(0.0, 0.0); 2];
    for outputs in order.chunk_by(|a, b| quantity(a) == quantity(b)) {
        let largest = outputs.iter().map(|output| deviations[*output]).fold(0.0, f64::max);
        if largest > 0.0 {
            let mean = outputs.iter().map(|it| error(*it)).sum::<f64>() / outputs.len() as f64;
            let (score, count) = &mut scores[usize::from(!quantity(&outputs[0]).0)];
            (*score, *count) = (*score + mean.sqrt() / largest, *count + 1.0);
        }
    }
    scores.map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 })
}

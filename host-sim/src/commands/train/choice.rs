//! Centres, spread and penalty: as given, or chosen among candidates by cross-validation.

use std::sync::Arc;

use crate::Result;
use crate::measurements::Measurements;
use crate::select::{Candidates, Edge, Selection, cross_validate};
use crate::subject::Subject;
use crate::training_options::{Training, TrainingOptions};
use crate::training_set::TrainingSet;
use taxel_learn::Options;
use taxel_learn::folds::smallest_training_part;
use taxel_learn::kinds::Choice;

use super::Arguments;
use crate::commands::Common;
use crate::commands::arguments::blamed;
use crate::commands::progress::Terminal;

/// Spreads that are tried for centres of K-means. Refinement moves the width itself.
const SPREADS: [f64; 6] = [0.2, 0.3, 0.5, 0.8, 1.2, 2.0];
/// Penalties that are tried for centres of K-means, besides the usual one.
const PENALTIES: [f64; 6] = [1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5];
/// Most values beyond these grids that are tried.
const MOST_STEPS: usize = 4;

/// Sets `options` as the `arguments` say; with `--select` by cross-validation. Returns what was tried of features, and of
/// settings.
pub fn choose(
    arguments: &Arguments,
    subject: &Subject,
    set: &TrainingSet<'_>,
    options: &mut Options,
    common: &Common,
) -> Result<(Option<Choice>, Option<Selection>)> {
    let usual = Options::default().centres;
    if arguments.subject.training.centres.is_none()
        && subject.scene().is_none()
        && options.centres < usual
    {
        let (frames, centres) = (set.frames.fewest_values(), options.centres);
        common.remark(format_args!(
            "note: {frames} lines are few for {usual} centres, so the default is {centres}; \
             choose with --centres"
        ));
    }
    if !arguments.select {
        return Ok((set.choose(options, &Terminal::new(common)), None));
    }
    // Settings are compared with the features that the model will have.
    let features = set.choose(options, &Terminal::new(common));
    // No reading model changes an error.
    let (refine, relative_inputs) = (set.refine, set.frames.relative_inputs);
    let how =
        Training { options: *options, refine, relative_inputs, reading_model: None, track: false };
    let data = match subject {
        Subject::Measured(data) => Measurements { how, ..(**data).clone() },
        Subject::Scene(scene) => {
            let given = &arguments.subject.data;
            let fold_of = given.folds_of(&set.frames.outputs, options.seed);
            let fold_of = fold_of.map_err(|error| blamed(error, given))?;
            Measurements::of_frames(&scene.name, set.frames.as_ref().clone(), fold_of, how)
        }
    };
    let candidates = candidates(&arguments.subject.training, &data);
    let selection = cross_validate(&Arc::new(data), &candidates, &Terminal::new(common));
    let selection = selection.map_err(|error| {
        blamed(blamed(error, &arguments.subject.training), &arguments.subject.data)
    })?;
    let best = selection.best();
    (options.centres, options.spread) = (best.centres, best.spread);
    options.penalty = best.penalty;
    selection.edges.iter().for_each(|edge| common.remark(format_args!("note: {}", beyond(edge))));
    Ok((features, Some(selection)))
}

/// Candidates as given, and usual ones for the rest. Only grids of usual ones grow.
fn candidates(given: &TrainingOptions, data: &Measurements) -> Candidates {
    let Training { options, refine, .. } = &data.how;
    let centres = if let Some(centres) = &given.centres {
        centres.clone()
    } else {
        // K around the usual one, as far as the smallest training part allows.
        let fewest = smallest_training_part(&data.fold_of, &data.training.outputs);
        let largest = fewest.saturating_sub(1).max(1);
        let usual = [options.centres / 2, options.centres, options.centres * 2];
        let mut candidates = usual.map(|k| k.clamp(1, largest)).to_vec();
        candidates.dedup();
        candidates
    };
    let spreads = match (&given.spread, refine) {
        (Some(spreads), _) => spreads.clone(),
        (None, true) => vec![options.spread],
        (None, false) => SPREADS.to_vec(),
    };
    let penalties = match (&given.penalty, refine) {
        (Some(penalties), _) => penalties.iter().copied().map(Some).collect(),
        (None, true) => vec![options.penalty],
        (None, false) => {
            [options.penalty].into_iter().chain(PENALTIES.map(Some)).collect::<Vec<_>>()
        }
    };
    let most_steps = |usual: bool| if usual && !refine { MOST_STEPS } else { 0 };
    Candidates {
        centres,
        spreads,
        penalties,
        most_spreads: most_steps(given.spread.is_none()),
        most_penalties: most_steps(given.penalty.is_none()),
    }
}

/// A penalty with as many digits as matter.
pub fn short(penalty: f64) -> String {
    let text = format!("{penalty:.2e}");
    text.parse::<f64>().map_or(text, |rounded| format!("{rounded:e}"))
}

/// Note on a best value at an edge.
fn beyond(edge: &Edge) -> String {
    let Edge { setting, value, largest } = edge;
    let (which, more) = if *largest { ("largest", "larger") } else { ("smallest", "smaller") };
    let value = if *setting == "penalty" { short(*value) } else { value.to_string() };
    if *setting == "penalty" && !largest {
        return format!(
            "the best penalty, {value}, is the smallest that was tried: try smaller ones (--penalty); if the lines are \
             a log, give --fold-blocks, because random folds favour small penalties"
        );
    }
    format!(
        "the best {setting}, {value}, is the {which} that was tried: try {more} ones (--{setting})"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_named_with_its_option() {
        let edge = Edge { setting: "centres", value: 128.0, largest: true };
        let note =
            "the best centres, 128, is the largest that was tried: try larger ones (--centres)";
        assert_eq!(beyond(&edge), note);
        let edge = Edge { setting: "penalty", value: 1e-9, largest: false };
        assert!(beyond(&edge).contains("1e-9, is the smallest"));
        assert_eq!([short(1e-10 * 0.1), short(2.5e-7)], ["1e-11", "2.5e-7"]);
    }
}

//! Data that a model is trained on, and how.

use host_sim::experiment::{Experiment, MoreFrames};
use host_sim::{Error, Result};
use taxel_data::dataset::Dataset;
use taxel_data::progress::Progress;
use taxel_learn::confidence::{self, Density, HeldOut};
use taxel_learn::train::{Examples, Refinement, train, train_refined};
use taxel_learn::{ModelBlob, Options, Origin, Trained, pack};
use taxel_simulate::Synthesis;

/// Data that a model is trained on.
pub struct Source {
    pub dataset: Dataset,
    pub origin: Origin,
    pub defaults: Options,
    /// Fold of each frame of measured data, or the scene that has more frames.
    pub more: More,
    /// Whether refinement is asked for.
    pub refine: bool,
    /// Whether the model is to have a confidence.
    pub confidence: bool,
}

/// What refinement measures the error on.
pub enum More {
    Scene(Box<Experiment>),
    Folds(Vec<usize>),
}

impl Source {
    /// Trains on the data, refined if that is asked for.
    pub fn train(&self, options: &Options, progress: &dyn Progress) -> Result<Trained> {
        match &self.more {
            More::Scene(experiment) if self.refine => {
                let synthesis = Synthesis::of(&experiment.world);
                let more = MoreFrames { experiment, synthesis: &synthesis };
                train_on(&self.dataset, Some(Examples::Fresh(&more)), options, progress)
            }
            More::Folds(fold_of) if self.refine => {
                train_on(&self.dataset, Some(Examples::Folds(fold_of)), options, progress)
            }
            _ => train_on(&self.dataset, None, options, progress),
        }
    }

    /// Adds a confidence to the model in `blob`. Measured data is held out fold by fold.
    pub fn with_confidence(
        &self,
        blob: &ModelBlob,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<ModelBlob> {
        let fold_of = match &self.more {
            More::Scene(experiment) => {
                let synthesis = Synthesis::of(&experiment.world);
                return experiment.with_confidence(blob, &self.dataset, &synthesis, progress);
            }
            More::Folds(fold_of) => fold_of,
        };
        if fold_of.iter().all(|fold| *fold == 0) {
            let message = "--confidence holds out one fold after the other, and there is one alone: give more \
                           (--folds or --fold-column)";
            return Err(Error::Usage(message.into()));
        }
        let settings = confidence::Settings { seed: options.seed, ..Default::default() };
        let mut held_out = HeldOut::default();
        for fold in 0..fold_of.iter().max().map_or(0, |last| last + 1) {
            let frames_where = |held: bool| -> Vec<usize> {
                (0..fold_of.len()).filter(|frame| (fold_of[*frame] == fold) == held).collect()
            };
            let rest = frames_where(false);
            let (seen, folds) = (
                self.dataset.subset(&rest),
                rest.iter().map(|frame| fold_of[*frame]).collect::<Vec<_>>(),
            );
            let examples = self.refine.then_some(Examples::Folds(&folds));
            let trained = train_on(&seen, examples, options, progress)?;
            let of_rest = pack(&trained, &seen, &self.origin)?;
            let density = Density::fit(&seen, &settings);
            held_out.add(&of_rest, &density, &self.dataset.subset(&frames_where(true)));
        }
        Ok(confidence::add(blob, &Density::fit(&self.dataset, &settings), &held_out)?)
    }
}

/// Trains on `dataset`, refined if there are `examples`.
fn train_on(
    dataset: &Dataset,
    examples: Option<Examples<'_>>,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Trained> {
    Ok(match examples {
        None => train(dataset, options, progress)?,
        Some(examples) => {
            train_refined(dataset, options, &Refinement::default(), examples, progress)
                .map_err(of_folds)?
        }
    })
}

/// Error that names the options which choose folds.
pub fn of_folds(error: taxel_learn::Error) -> Error {
    match error {
        taxel_learn::Error::Setting(bad) if bad.field == "folds" => {
            Error::Usage(format!("{bad} (--folds or --fold-column, --no-refine)"))
        }
        other => other.into(),
    }
}

//! Training sets: frames to train on, more of them for refinement, and the model that comes of both.

use std::borrow::Cow;

use taxel_data::{BadValue, Dataset, Progress, Silent, Stream};
use taxel_learn::decoders::LINEAR;
use taxel_learn::folds;
use taxel_learn::kinds::{self, Choice};
use taxel_learn::packing::pack_to_judge;
use taxel_learn::reading_model::{self, Extent, HeldOut, Statistics};
use taxel_learn::train::{Examples, Found, Layers, Refinement, Start, resolution, train_refined};
use taxel_learn::{ModelBlob, Options, Origin, Trained, pack};
use taxel_simulate::Synthesis;

use crate::error::Result;
use crate::experiment::{Experiment, MoreFrames};
use crate::tracking;

/// Frames to train on, and what refinement measures the error on.
pub struct TrainingSet<'s> {
    pub frames: Cow<'s, Dataset>,
    /// Origin of the frames, for the model's metadata.
    pub origin: Origin,
    /// Whether centres, widths and the projection are refined after K-means.
    pub refine: bool,
    /// What the model's statistics of readings tell.
    pub reading_model: Option<Extent>,
    /// Whether the model gets a tracker, which only that of a scene can.
    pub track: bool,
    more: More<'s>,
}

/// Packs a model that was trained on frames of this origin.
type Pack = fn(&Trained, &Dataset, &Origin) -> taxel_learn::error::Result<ModelBlob>;

/// Frames that are looked at besides those that weights are fitted to.
enum More<'s> {
    /// New frames of a scene, where there is no end of them.
    Scene(Box<MoreFrames<'s>>),
    /// The fold of each training frame: one fold after the other is held out.
    Folds(&'s [usize]),
}

impl<'s> TrainingSet<'s> {
    /// Training frames of a scene, from `synthesis` of its world.
    pub fn of_scene(experiment: &'s Experiment, synthesis: Synthesis<'s>) -> Self {
        let t = &experiment.training;
        Self {
            frames: Cow::Owned(experiment.dataset(&synthesis, Stream::Training, experiment.frames)),
            origin: experiment.origin(),
            refine: t.refine,
            reading_model: t.reading_model,
            track: t.track,
            more: More::Scene(Box::new(MoreFrames { experiment, synthesis })),
        }
    }

    /// Measured `frames`, with the fold of each, numbered from 0. It neither refines, nor adds a reading
    /// model, unless the fields ask for it.
    pub fn of_folds(frames: &'s Dataset, fold_of: &'s [usize], origin: Origin) -> Self {
        let (frames, more) = (Cow::Borrowed(frames), More::Folds(fold_of));
        Self { frames, origin, refine: false, reading_model: None, track: false, more }
    }

    /// What refinement measures the error on; `None` if it is not asked for.
    pub fn examples(&self) -> Option<Examples<'_>> {
        self.refine.then(|| match &self.more {
            More::Scene(more) => Examples::Fresh(more.as_ref()),
            More::Folds(fold_of) => Examples::Folds(fold_of),
        })
    }

    /// Trains with `options`, refined if that is asked for.
    pub fn train(&self, options: &Options, progress: &dyn Progress) -> Result<Trained> {
        let settings = Refinement::default();
        let refinement = self.examples().map(|examples| (&settings, examples));
        Ok(train_refined(&self.frames, options, refinement, progress)?)
    }

    /// Chooses features for `options` that do not say which, and tells what was tried; `None` where there is no choice.
    pub fn choose(&self, options: &mut Options, progress: &dyn Progress) -> Option<Choice> {
        let choice = kinds::choose(&self.frames, &self.folds(), options, progress);
        options.kinds = choice.as_ref().map(|it| it.kinds).or(options.kinds);
        choice
    }

    /// Fold of each frame. Those of a scene are of successive ones, since frames of a moving touch resemble each other.
    fn folds(&self) -> Cow<'_, [usize]> {
        const FOLDS: usize = 5;
        match &self.more {
            More::Scene(_) => Cow::Owned(folds::block_folds(self.frames.frames(), FOLDS)),
            More::Folds(fold_of) => Cow::Borrowed(*fold_of),
        }
    }

    /// Trains with `options` and packs the model, with a reading model if one is asked for.
    pub fn blob(&self, options: &Options, progress: &dyn Progress) -> Result<ModelBlob> {
        self.check()?;
        let mut options = *options;
        let _ = self.choose(&mut options, progress);
        self.packed(&self.train(&options, progress)?, &options, progress)
    }

    /// Layers for `options`, refined if that is asked for, from each of `starts` and its own `layers` with K-means centres.
    /// Weights will be fitted with each of `penalties`.
    pub fn found<'a>(
        &self,
        starts: &'a [Start],
        layers: Vec<Layers>,
        options: &Options,
        penalties: &[Option<f64>],
        progress: &dyn Progress,
    ) -> Result<Found<'a>> {
        let settings = Refinement::default();
        let refinement = self.examples().map(|examples| (&settings, examples));
        Ok(Found::new(starts, layers, options, penalties, refinement, progress)?)
    }

    /// Blob of a trained model, with a reading model if one is asked for.
    pub fn packed(
        &self,
        trained: &Trained,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<ModelBlob> {
        self.packed_by(pack, self.linear_rmse(), (trained, options), progress)
    }

    /// Blob as [`packed`](Self::packed) makes it, but for errors on the training frames, which take many more fits and are all 0.
    pub fn packed_to_judge(&self, trained: &Trained, options: &Options) -> Result<ModelBlob> {
        let outputs = self.frames.outputs.names.len();
        let linear_rmse = vec![0.0; if self.has_folds() { outputs } else { 0 }];
        self.packed_by(pack_to_judge, linear_rmse, (trained, options), &Silent)
    }

    fn packed_by(
        &self,
        pack: Pack,
        linear_rmse: Vec<f64>,
        (trained, options): (&Trained, &Options),
        progress: &dyn Progress,
    ) -> Result<ModelBlob> {
        let origin = Origin { linear_rmse, ..self.origin.clone() };
        let blob = pack(trained, &self.frames, &origin)?;
        let blob = match self.reading_model {
            Some(extent) => self.with_reading_model(&blob, extent, options, progress)?,
            None => blob,
        };
        match &self.more {
            More::Scene(more) if self.track => tracking::add(&blob, &more.experiment.world),
            _ => Ok(blob),
        }
    }

    fn has_folds(&self) -> bool {
        self.folds().iter().any(|fold| *fold > 0)
    }

    /// Checks before long work that the model can have the reading model that is asked for.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for too few frames, outputs whose squared errors are beyond f32, or a scene that gives no
    /// tracker.
    pub fn check(&self) -> Result<()> {
        if let (More::Scene(more), true) = (&self.more, self.track) {
            tracking::check(&more.experiment.world)?;
        }
        if self.reading_model.is_some() {
            reading_model::check(self.frames.fewest_values(), self.frames.inputs.names.len())?;
        }
        if self.reading_model == Some(Extent::Full) {
            resolution::check_squares(&self.frames)?;
        }
        Ok(())
    }

    /// RMSE of the best linear decoder for each output, one fold after the other held out. Empty with a single fold, or if an
    /// output has no value.
    fn linear_rmse(&self) -> Vec<f64> {
        if !self.has_folds() {
            return vec![];
        }
        let rmse = folds::baseline_rmse(&LINEAR, &self.frames, &self.folds()).unwrap_or_default();
        if rmse.iter().all(|error| error.is_finite()) { rmse } else { vec![] }
    }

    /// Adds a reading model to the model in `blob`. One that tells deviations is calibrated on frames that the model was not
    /// trained on: as many other frames of a scene, or one fold after the other of measured data.
    fn with_reading_model(
        &self,
        blob: &ModelBlob,
        extent: Extent,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<ModelBlob> {
        let mut held_out = HeldOut::default();
        if let (More::Folds(fold_of), Extent::Full) = (&self.more, extent) {
            let folds = fold_of.iter().max().map_or(0, |last| last + 1);
            if folds < 2 {
                let rule = "a reading model holds out one fold after the other; give at least 2";
                return Err(BadValue::new("folds", folds, rule).into());
            }
            for fold in 0..folds {
                self.hold_out(fold, fold_of, options, &mut held_out, progress)?;
            }
        }
        progress.stage("fit reading model", 1);
        let statistics = Statistics::fit(&self.frames.inputs, extent, options.seed)?;
        if let (More::Scene(more), Extent::Full) = (&self.more, extent) {
            let (synthesis, frames) = (&more.synthesis, self.frames.frames());
            let others = more.experiment.dataset(synthesis, Stream::Calibration, frames);
            held_out.add(blob, &statistics, &others);
        }
        let blob = reading_model::add(blob, &statistics, &held_out)?;
        progress.step();
        Ok(blob)
    }

    /// Trains on all folds but `fold`, and adds what the model makes of that one to `held_out`.
    fn hold_out(
        &self,
        fold: usize,
        fold_of: &[usize],
        options: &Options,
        held_out: &mut HeldOut,
        progress: &dyn Progress,
    ) -> Result<()> {
        let (held, rest): (Vec<usize>, Vec<usize>) =
            (0..fold_of.len()).partition(|frame| fold_of[*frame] == fold);
        let seen = self.frames.subset(&rest);
        let folds: Vec<usize> = rest.iter().map(|frame| fold_of[*frame]).collect();
        let mut of_rest = TrainingSet::of_folds(&seen, &folds, self.origin.clone());
        of_rest.refine = self.refine;
        let blob = pack(&of_rest.train(options, progress)?, &seen, &self.origin)?;
        let statistics = Statistics::fit(&seen.inputs, Extent::Full, options.seed)?;
        held_out.add(&blob, &statistics, &self.frames.subset(&held));
        Ok(())
    }
}

impl Experiment {
    /// Trains the model that the scene describes, like the command `train`.
    pub fn train(&self, progress: &dyn Progress) -> Result<ModelBlob> {
        TrainingSet::of_scene(self, Synthesis::new(&self.world)).blob(&self.options(), progress)
    }
}

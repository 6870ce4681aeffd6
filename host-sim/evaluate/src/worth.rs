//! Worth of a model that was just trained: its errors beside those of the baselines, on the fairest frames there are.

use serde::Serialize;
use taxel_data::{Dataset, Stream, columns};
use taxel_learn::ModelBlob;
use taxel_learn::decoders::{BASELINES, mean};
use taxel_limit::Refusal;
use taxel_simulate::Synthesis;

use crate::metrics::{self, DecoderErrors, Errors, LimitSummary, Measure};
use crate::over_time::RestOverTime;
use crate::select::Selection;
use crate::subject::Subject;
use crate::training_set::TrainingSet;
use crate::verdict::{Verdict, Warning};

/// Most frames of a scene that are synthesised for it.
const FRESH_FRAMES: usize = 2000;

/// Most frames of a data set that are decoded for it: an even selection where there are more.
const MOST_FRAMES: usize = 32_768;

/// Frames that errors were measured on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum JudgedOn {
    /// Frames of the scene that nothing was trained on.
    FreshFrames,
    /// Folds of the training frames, one after the other held out.
    HeldOutFolds,
    /// The training frames themselves, which flatter a model.
    TrainingFrames,
}

impl JudgedOn {
    /// Frames in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::FreshFrames => "On fresh frames",
            Self::HeldOutFolds => "On folds that were held out",
            Self::TrainingFrames => {
                "On its own training frames, where errors look too small (`run` holds frames out)"
            }
        }
    }
}

/// Errors of a model and of the baselines, and what they mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Worth {
    /// Frames that errors were measured on.
    pub judged_on: JudgedOn,
    /// Errors of the network, then of the baselines, by group.
    pub decoders: Vec<DecoderErrors>,
    pub verdict: Verdict,
}

impl Worth {
    /// Worth of the model in `blob`, trained on `set` of `subject`. A `selection` of its options has errors on held-out
    /// folds.
    pub fn new(
        subject: &Subject,
        set: &TrainingSet<'_>,
        blob: &ModelBlob,
        selection: Option<&Selection>,
    ) -> Self {
        let (judged_on, decoders) = match (selection, subject) {
            (Some(selection), _) => (JudgedOn::HeldOutFolds, on_folds(selection, set)),
            (None, Subject::Scene(scene)) => {
                let frames = scene.test_frames.min(FRESH_FRAMES);
                let test = scene.dataset(&Synthesis::new(&scene.world), Stream::Test, frames);
                (JudgedOn::FreshFrames, on_frames(blob, set, &test, &scene.measure()))
            }
            (None, Subject::Measured(data)) => {
                let step = set.frames.frames().div_ceil(MOST_FRAMES).max(1);
                let some: Vec<usize> = (0..set.frames.frames()).step_by(step).collect();
                let frames = set.frames.subset(&some);
                (JudgedOn::TrainingFrames, on_frames(blob, set, &frames, &data.measure()))
            }
        };
        let no_limit = LimitSummary::new(&Err(Refusal::Measured));
        let verdict = Verdict::new(&decoders, &no_limit)
            .of_blob(blob, set.frames.frames())
            .of_frames(subject.measurements().map(|data| &data.outliers), set.frames.frames())
            .with(subject.scene().and_then(|_| Warning::not_positive(&set.frames.inputs)));
        let verdict = match subject {
            Subject::Measured(data) => {
                let at_rest =
                    (!data.training.relative_inputs).then(|| RestOverTime::of_data(data)).flatten();
                verdict.of_data(data, at_rest.as_ref())
            }
            Subject::Scene(_) => verdict,
        };
        Self { judged_on, decoders, verdict }
    }
}

fn on_frames(
    blob: &ModelBlob,
    set: &TrainingSet<'_>,
    frames: &Dataset,
    measure: &Measure,
) -> Vec<DecoderErrors> {
    let model = blob.prepare().of_inputs();
    let network = metrics::judge(&model, frames, measure);
    let baselines = BASELINES.iter().filter_map(|it| it.fit(&set.frames));
    let baselines = baselines.map(|it| metrics::judge(it.as_ref(), frames, measure));
    std::iter::once(network).chain(baselines).collect()
}

/// Errors of the best candidate and of the baselines on folds that were held out.
fn on_folds(selection: &Selection, set: &TrainingSet<'_>) -> Vec<DecoderErrors> {
    let (names, counts) = (&set.frames.outputs.names, set.frames.outputs.counts());
    let mean = selection.baselines.iter().find(|it| it.decoder == mean::NAME);
    let of = |decoder: &str, rmse: &[f64]| {
        let errors = columns::groups(names).into_iter().map(|(group, members)| {
            let squares_of =
                |rmse: &[f64]| members.iter().map(|column| rmse[*column].powi(2)).sum::<f64>();
            let squares = squares_of(rmse);
            // Against the mean of the frames that are not held out.
            let r_squared = mean.map(|mean| 1.0 - squares / squares_of(&mean.rmse));
            Errors {
                group: group.into(),
                unit: columns::unit_of(group).into(),
                count: members.iter().map(|column| counts[*column]).sum(),
                rmse: (squares / members.len() as f64).sqrt(),
                r_squared: r_squared.filter(|it| it.is_finite()),
                ..Errors::default()
            }
        });
        DecoderErrors::new(decoder, errors.collect())
    };
    let baselines = selection.baselines.iter().map(|it| of(it.decoder, &it.rmse));
    std::iter::once(of("network", &selection.best().rmse)).chain(baselines).collect()
}

//! Training by recursion (`--solver rls`): options, frames that come piece by piece, and what is taken from where.

use std::path::{Path, PathBuf};

use crate::evaluate::learning_curve::{LearnedOn, LearningCurve};
use crate::experiment::Experiment;
use crate::subject::Subject;
use crate::training_set::TrainingSet;
use crate::{Error, Result};
use clap::{Args, ValueEnum};
use taxel_data::{Progress, Stream};
use taxel_learn::outliers::Outliers;
use taxel_learn::train::stream::FIRST_FRAMES;
use taxel_learn::train::{Recursive, Solver};
use taxel_learn::{Options, Trained};
use taxel_simulate::Synthesis;

use super::Arguments;
use crate::commands::Common;
use crate::commands::arguments::{of_option, refuse_given};
use crate::commands::data_argument::HowToTrain;
use crate::commands::data_stream::DataStream;
use crate::commands::subject_argument::SubjectOptions;

/// Most test frames of a scene that a learning curve's errors are measured on.
const TEST_FRAMES: usize = 2000;

/// How output weights are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SolverName {
    /// QR decomposition of all frames, which are held in memory
    Qr,
    /// Recursive least squares: one pass over the frames, however many there are
    Rls,
}

/// How output weights are computed, and what goes with a recursion.
#[derive(Args)]
#[command(next_help_heading = "Output weights")]
pub struct RecursionArguments {
    /// How output weights are computed. Both ways give the same estimates; `rls` takes a scene's frames and the lines of
    /// a CSV file once and one after another, in memory that does not grow with them. Ranges, centres, refinement and
    /// number format are then those of the first frames alone.
    #[arg(long, value_name = "SOLVER", default_value = "qr")]
    solver: SolverName,
    /// Frames at the start that ranges, centres and refinement of `--solver rls` are taken from: they must show all that
    /// the others do [default: 20000].
    #[arg(long, value_name = "N")]
    first_frames: Option<usize>,
    /// Forgetting factor λ of the recursion, from 0.5 to 1: the weight of a frame, at each frame after it [default: 1,
    /// which forgets nothing].
    #[arg(long, value_name = "LAMBDA", allow_negative_numbers = true)]
    forgetting_factor: Option<f64>,
    /// Initial covariance δ of the recursion, instead of --penalty: the penalty on squared weights is 1/δ for all frames
    /// together [default: 1e6, or what the penalty of refined training makes it].
    #[arg(long, value_name = "DELTA", allow_negative_numbers = true, conflicts_with = "penalty")]
    initial_covariance: Option<f64>,
    /// SVG file of the recursion's learning curve: error by the number of frames.
    #[arg(long, value_name = "FILE")]
    curve: Option<PathBuf>,
}

/// Frames of a recursion.
enum Source {
    /// Scene, of which so many frames are synthesised.
    Scene(usize),
    /// CSV file, or standard input.
    Data(Box<DataStream>),
}

/// Training by recursion, as it was asked for.
pub struct Plan {
    settings: Recursive,
    first_frames: usize,
    source: Option<Source>,
}

impl RecursionArguments {
    /// File of the learning curve, if it was asked for.
    pub fn curve(&self) -> Option<&Path> {
        self.curve.as_deref()
    }

    /// Plan of the recursion, if weights are computed by one.
    pub fn plan(&self, arguments: &Arguments) -> Result<Option<Plan>> {
        if self.solver == SolverName::Qr {
            let of_recursion = [
                ("--first-frames", self.first_frames.is_some()),
                ("--forgetting-factor", self.forgetting_factor.is_some()),
                ("--initial-covariance", self.initial_covariance.is_some()),
                ("--curve", self.curve.is_some()),
            ];
            refuse_given(of_recursion, |option| {
                format!("{option} is for a recursion: add --solver rls, or leave it out")
            })?;
            if arguments.source == "-" {
                let message = "a CSV file on standard input is read once: add --solver rls, or give a file's path";
                return Err(Error::Usage(message.into()));
            }
            return Ok(None);
        }
        if arguments.select {
            let message = "--select looks at all frames again and again: choose with --solver qr, then give what it chose";
            return Err(Error::Usage(message.into()));
        }
        let settings = Recursive {
            forgetting_factor: self.forgetting_factor.unwrap_or(1.0),
            initial_covariance: self.initial_covariance,
        };
        let options = [
            ("forgetting_factor", "--forgetting-factor"),
            ("initial_covariance", "--initial-covariance"),
        ];
        settings.check().map_err(|bad| of_option(bad, &options))?;
        let first_frames = self.first_frames.unwrap_or(FIRST_FRAMES);
        if first_frames < 2 {
            return Err(Error::Usage(format!("--first-frames {first_frames}: give at least 2")));
        }
        Ok(Some(Plan { settings, first_frames, source: None }))
    }
}

impl Plan {
    /// Solver with the settings that were given.
    pub fn solver(&self) -> Solver {
        Solver::Rls(self.settings)
    }

    /// Scene or CSV file that is trained on, with its first frames.
    pub fn load(&mut self, arguments: &Arguments, common: &Common) -> Result<Subject> {
        let options = &arguments.subject;
        if !SubjectOptions::is_scene(&arguments.source) {
            let how = HowToTrain {
                seed: common.seed.unwrap_or(1),
                relative_inputs: options.relative_inputs.relative_inputs,
                refine: options.refine.over(true),
                confidence: arguments.confidence,
            };
            if arguments.frames.is_some() {
                return Err(Error::Usage(
                    "-n sets a scene's frames; a CSV file has its own".into(),
                ));
            }
            if options.noise.is_given() {
                let message = "--noise adds noise to a scene; a CSV file has its own";
                return Err(Error::Usage(message.into()));
            }
            let path = Path::new(&arguments.source);
            let (data, stream) = options.data.load_first(path, how, self.first_frames)?;
            self.source = Some(Source::Data(Box::new(stream)));
            return Ok(Subject::Measured(Box::new(data)));
        }
        let scene = Experiment::load_open(&arguments.source)?;
        let all = arguments.frames.unwrap_or(scene.training.frames);
        self.source = Some(Source::Scene(all));
        super::load(arguments, common, Some(all.min(self.first_frames)))
    }

    /// Trains on the first frames in `set`, and all that follow.
    pub fn train(
        &mut self,
        subject: &Subject,
        set: &TrainingSet<'_>,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<(Trained, LearningCurve)> {
        let first = set.frames.frames();
        let (judged_on, (trained, learned)) = match (&mut self.source, subject) {
            (Some(Source::Data(stream)), _) => {
                let trained = set.train_by_recursion(
                    Box::new(stream.by_ref()),
                    None,
                    None,
                    options,
                    progress,
                )?;
                stream.note();
                (LearnedOn::NextFrames, trained)
            }
            (Some(Source::Scene(count)), Subject::Scene(scene)) => {
                let synthesis = Synthesis::new(&scene.world);
                let frames = scene.training.test_frames.min(TEST_FRAMES);
                let test = scene.dataset(&synthesis, Stream::Test, frames);
                let rest = scene.pieces(synthesis, first, *count);
                let trained =
                    set.train_by_recursion(rest, Some(*count), Some(&test), options, progress)?;
                (LearnedOn::FreshFrames, trained)
            }
            _ => return Err(Error::failed("frames were not loaded")),
        };
        let outputs = &set.frames.outputs;
        let curve = LearningCurve::new(judged_on, &learned, &outputs.names, &outputs.deviations());
        Ok((trained, curve))
    }

    /// Digest of the CSV file, after it was read to its end.
    pub fn digest(&self) -> Option<u64> {
        match &self.source {
            Some(Source::Data(stream)) => Some(stream.digest()),
            _ => None,
        }
    }

    /// Outliers of the CSV file, after it was read to its end.
    pub fn outliers(self) -> Option<Outliers> {
        match self.source {
            Some(Source::Data(stream)) => Some(stream.outliers()),
            _ => None,
        }
    }
}

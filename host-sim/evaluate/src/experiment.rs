//! Experiments: a world, how a model is trained for it, and how Table 1 is computed, all from a scene's file.
//!
//! A scene is a TOML file; `docs/scenes.md` explains every field. [`Experiment::load`] reads and checks
//! it, and the result can be used without further checks.

use std::borrow::Cow;
use std::path::Path;

use serde::Deserialize;
use taxel_core::blob::NoiseKind as BlobNoiseKind;
use taxel_data::{AtRest, BadValue, Dataset, Stream, input, require};
use taxel_learn::train::{FreshFrames, Solver, check_penalty, check_spread};
use taxel_learn::{Options, Origin, relative};
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::synth::BASELINE_FRAMES;
use taxel_simulate::world::check_noise_level;
use taxel_simulate::{Synthesis, World};

use crate::error::{Error, Result};
use crate::metrics::Measure;
use crate::training_options::{Training, TrainingOptions};

mod others;
mod file;

pub use others::OtherContact;

/// Number of frames of the untouched sensor that tell what its inputs are at rest.
const FRAMES_AT_REST: usize = 400;

type Check = std::result::Result<(), BadValue>;

/// Whether `name_or_path` is a scene, or otherwise a data file: a built-in one, a file called .toml, or a name without an
/// extension and a file, which is a mistyped scene.
pub fn names_a_scene(name_or_path: &str) -> bool {
    let path = Path::new(name_or_path);
    crate::scenes::ALL.iter().any(|(name, _)| *name == name_or_path)
        || path.extension().map_or(!path.exists(), |end| end.eq_ignore_ascii_case("toml"))
}

/// Checks the name of a scene or a plan, which names a folder.
pub(crate) fn check_name(name: &str) -> Check {
    const LONGEST_NAME: usize = 100;
    let name_ok = (1..=LONGEST_NAME).contains(&name.len())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    require(name_ok, "name", format!("{name:?}"), || {
        format!("it names a folder; use letters, digits, - and _, at most {LONGEST_NAME} of them")
    })
}

/// Experiment of a scene, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the scene, which names the output folder and the model.
    pub name: String,
    /// The scene's text.
    pub text: String,
    /// CRC-64/XZ of the text.
    pub digest: u64,
    pub world: World,
    /// Number of frames to train on.
    pub frames: usize,
    /// Number of frames to judge by.
    pub test_frames: usize,
    pub training: Training,
    /// Settings of Table 1, if it is wanted.
    pub table1: Option<Table1>,
    /// Contacts that the model is not trained on, and judged by as well.
    pub others: Vec<OtherContact>,
}

/// Settings of the paper's Table 1.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table1 {
    /// Spreads, one a line of the table.
    pub spreads: Vec<f64>,
    /// Noise levels as fractions, one a column.
    pub noise_levels: Vec<f64>,
    /// Number of frames on which each cell is trained.
    pub frames: usize,
    /// Number of frames on which each cell is evaluated.
    pub test_frames: usize,
    /// Number of centres K of each row's network.
    pub centres: usize,
    /// Number of frames, and of centres, of the standard network (K = N).
    pub standard_frames: usize,
    /// How output weights are computed, if a scene says so.
    solver: Option<Solver>,
    /// Initial covariance δ for networks in f64 on readings over their maximum, as no device has them. They are computed
    /// by QR: with the penalty 1/δ it gives the weights of the recursion.
    pub textbook_covariance: Option<f64>,
}

impl Table1 {
    /// How output weights are computed; the paper's way is recursive least squares.
    pub fn solver(&self) -> Solver {
        let of_textbook = self.textbook_covariance.map(|_| Solver::Qr);
        self.solver.or(of_textbook).unwrap_or(Solver::Rls)
    }
}

impl Experiment {
    /// Reads a scene: the name of an embedded one, or a path.
    ///
    /// # Errors
    /// [`Error::Data`] for a file that cannot be read, and for its
    /// content.
    pub fn load(name_or_path: &str) -> Result<Self> {
        let scene = Self::load_open(name_or_path)?;
        scene.check_sizes().map_err(|cause| Error::of_scene(name_or_path, cause))?;
        Ok(scene)
    }

    /// Reads a scene as [`load`](Self::load) does, but for its numbers of frames and of centres to train with: options
    /// may replace them. [`check_sizes`](Self::check_sizes) checks what is in force then.
    pub fn load_open(name_or_path: &str) -> Result<Self> {
        Self::parse_open(name_or_path, &Self::text(name_or_path)?)
    }

    /// Text of a scene: the name of an embedded one, or a path.
    ///
    /// # Errors
    /// As [`load`](Self::load), for a file that cannot be read.
    pub fn text(name_or_path: &str) -> Result<Cow<'static, str>> {
        if let Some((_, text)) = crate::scenes::ALL.iter().find(|(name, _)| *name == name_or_path) {
            return Ok((*text).into());
        }
        if !names_a_scene(name_or_path) {
            let known = crate::scenes::ALL.map(|(name, _)| name).join(", ");
            return Err(Error::Usage(format!(
                "{name_or_path} has the name of a data file, but a scene is needed here: {known}, or a scene file (.toml). Measured data \
                 describes neither the sensor nor its contacts; `train`, `run` and `trade` accept it"
            )));
        }
        let text = input::read_text(Path::new(name_or_path)).map_err(|error| match error {
            taxel_data::Error::Read { path, cause } => {
                let names: Vec<_> = crate::scenes::ALL.iter().map(|(name, _)| *name).collect();
                let known = names.join(", ");
                let hint = format!("{cause}; built-in scenes are: {known}");
                taxel_data::Error::read(&path, std::io::Error::new(cause.kind(), hint))
            }
            other => other,
        })?;
        Ok(text.into())
    }

    /// Reads a scene from its text; `origin` names it in messages.
    ///
    /// # Errors
    /// [`Error::Data`] for text that is no scene, and for a setting that cannot be used.
    pub fn parse(origin: &str, text: &str) -> Result<Self> {
        let scene = Self::parse_open(origin, text)?;
        scene.check_sizes().map_err(|cause| Error::of_scene(origin, cause))?;
        Ok(scene)
    }

    /// Reads a scene from its text, but does not check its sizes.
    fn parse_open(origin: &str, text: &str) -> Result<Self> {
        let file: file::SceneFile = toml::from_str(text).map_err(|cause| {
            let is_list = cause.message().starts_with("invalid type: sequence");
            let advice = if is_list { "; `compare` takes a scene with lists" } else { "" };
            Error::of_scene(origin, shortened(cause.to_string().trim_end()) + advice)
        })?;
        let experiment = file.into_experiment(text);
        experiment
            .and_then(|experiment| experiment.check().map(|()| experiment))
            .map_err(|cause| Error::of_scene(origin, cause))
    }

    /// Checks that a scene's text has only fields that a scene may have, with values of their kinds.
    ///
    /// # Errors
    /// The reason, in serde's words, with the line that is wrong.
    pub fn check_fields(text: &str) -> std::result::Result<(), String> {
        let checked = toml::from_str::<file::SceneFile>(text).map(drop);
        checked.map_err(|cause| match cause.span().and_then(|span| text.get(..span.end)) {
            // serde names the field where it is unknown, and else only what is wrong with the value.
            Some(before) if !cause.message().starts_with("unknown field") => {
                let start = before.trim_end().rfind('\n').map_or(0, |end| end + 1);
                let line = text[start..].lines().next().unwrap_or_default();
                format!("`{line}`: {}", cause.message())
            }
            _ => cause.message().into(),
        })
    }

    /// Options for training the scene's model.
    pub fn options(&self) -> Options {
        Options { seed: self.world.seed, ..self.training.options }
    }

    /// This experiment, trained as `given` says. [`check_sizes`](Self::check_sizes) checks its numbers.
    ///
    /// # Errors
    /// As [`TrainingOptions::over`].
    pub fn trained_with(self, given: &TrainingOptions) -> std::result::Result<Self, BadValue> {
        let training = given.over(&self.training)?;
        let frames = given.frames.unwrap_or(self.frames);
        let test_frames = given.test_frames.unwrap_or(self.test_frames);
        Ok(Self { frames, test_frames, training, ..self })
    }

    /// Origin of the training data, for the model's metadata.
    pub fn origin(&self) -> Origin {
        let noise = &self.world.noise;
        let kind = match noise.kind {
            NoiseKind::Relative => BlobNoiseKind::Relative,
            NoiseKind::Span => BlobNoiseKind::Span,
            NoiseKind::Absolute => BlobNoiseKind::Absolute,
        };
        Origin {
            name: self.name.clone(),
            digest: self.digest,
            noise: (kind, noise.total_level()),
            seed: self.world.seed,
            thickness_mm: Some(self.world.sensor.size_mm[2]),
            full_scale: self.world.full_scales(),
            linear_rmse: vec![],
        }
    }

    /// Measure for errors of the scene's outputs.
    pub fn measure(&self) -> Measure {
        Measure {
            full_scale: self.world.full_scales(),
            thickness_mm: Some(self.world.sensor.size_mm[2]),
            limit: None,
            noise: None,
        }
    }

    /// Data set of so many `frames` of `stream`, for training and for decoders that see what it saw.
    ///
    /// Its inputs are readings, which may be relative to the baseline of each session: the mean of [`BASELINE_FRAMES`]
    /// frames of the untouched sensor. `synthesis` is one of the experiment's world.
    pub fn dataset(&self, synthesis: &Synthesis<'_>, stream: Stream, frames: usize) -> Dataset {
        let at_rest = synthesis.clone().untouched();
        let at_rest = self.inputs(&at_rest, Stream::Calibration, 0, FRAMES_AT_REST).inputs;
        let at_rest = Some(AtRest::of(&at_rest));
        Dataset { at_rest, ..self.inputs(synthesis, stream, 0, frames) }
    }

    /// Frames from trajectory number `first` of `stream` on, without what inputs are at rest.
    fn inputs(
        &self,
        synthesis: &Synthesis<'_>,
        stream: Stream,
        first: usize,
        frames: usize,
    ) -> Dataset {
        let readings = synthesis.frames_from(stream, first, frames);
        if !self.training.relative_inputs {
            return readings;
        }
        let baselines = synthesis.baselines_from(stream, first, frames, BASELINE_FRAMES);
        relative::dataset(readings, &baselines)
    }

    /// Checks what outputs of the contact, which belong to no row-wire, ask of training and of Table 1.
    fn check_outputs(&self) -> Check {
        let Outputs::Contact(_) = self.world.outputs else { return Ok(()) };
        require(self.table1.is_none(), "table1", "[table1]", || {
            "the table is for outputs of electrodes; leave it out, or ask for outputs.quantity and outputs.axes".into()
        })
    }

    fn check(&self) -> Check {
        check_name(&self.name)?;
        self.world.check()?;
        let options = &self.training.options;
        check_spread("training.spread", options.spread)?;
        let penalty = options.penalty.map_or(Ok(()), check_penalty);
        penalty.map_err(|bad| bad.named("training.penalty"))?;
        let noise_kind = self.world.noise.kind;
        self.table1.as_ref().map_or(Ok(()), |table| check_table1(table, noise_kind))?;
        self.check_outputs()?;
        let Some(t) = &self.table1 else { return Ok(()) };
        self.world.check_frames("table1.frames", t.frames)?;
        self.world.check_frames("table1.test_frames", t.test_frames)
    }

    /// Checks the numbers of frames and of centres to train with, which options may have replaced.
    pub fn check_sizes(&self) -> Check {
        let (frames, test_frames) = (self.frames, self.test_frames);
        check_sizes("training", frames, test_frames, self.training.options.centres)?;
        self.world.check_frames("training.frames", frames)?;
        self.world.check_frames("training.test_frames", test_frames)
    }
}

/// Frames of an experiment that only refinement sees.
#[derive(Debug, Clone)]
pub struct MoreFrames<'e> {
    /// Experiment whose data sets they are like.
    pub experiment: &'e Experiment,
    /// Synthesis of its world.
    pub synthesis: Synthesis<'e>,
}

impl FreshFrames for MoreFrames<'_> {
    fn frames(&self, step: usize, count: usize) -> Dataset {
        let trajectories = count.div_ceil(self.synthesis.steps());
        let first = step * trajectories;
        self.experiment.inputs(&self.synthesis, Stream::Refinement, first, count)
    }
}

/// A message that quotes lines of a file, each cut to a length that people read.
fn shortened(message: &str) -> String {
    const MOST_CHARS: usize = 160;
    let cut = |line: &str| match line.char_indices().nth(MOST_CHARS) {
        Some((end, _)) => format!("{} …", &line[..end]),
        None => line.to_owned(),
    };
    let plain = message
        .replace("expected usize", "expected a whole number, 0 or above")
        .replace("expected u64", "expected a whole number, 0 or above");
    plain.lines().map(cut).collect::<Vec<_>>().join("\n")
}

fn check_table1(t: &Table1, noise_kind: NoiseKind) -> Check {
    check_sizes("table1", t.frames, t.test_frames, t.centres)?;
    require(!t.spreads.is_empty(), "table1.spreads", "[]", || "list at least one".into())?;
    require(!t.noise_levels.is_empty(), "table1.noise_levels", "[]", || {
        "list at least one".into()
    })?;
    for spread in &t.spreads {
        check_spread("table1.spreads", *spread)?;
    }
    for level in &t.noise_levels {
        check_noise_level("table1.noise_levels", noise_kind, *level)?;
    }
    if let Some(delta) = t.textbook_covariance {
        let solver = t.solver.map_or("", Solver::name);
        require(t.solver.is_none(), "table1.solver", solver, || {
            "textbook networks are solved by QR decomposition; leave table1.solver out".into()
        })?;
        let field = "table1.textbook_covariance";
        require((1e-12..=1e12).contains(&delta), field, format!("{delta:?}"), || {
            "give a number from 1e-12 to 1e12; the penalty on squared weights is its reciprocal"
                .into()
        })?;
    }
    let holds = (2..=2000).contains(&t.standard_frames) && t.standard_frames <= t.frames;
    require(holds, "table1.standard_frames", t.standard_frames, || {
        format!(
            "it must be from 2 to 2000 (work grows with its cube) and at most table1.frames = {}",
            t.frames
        )
    })
}

fn check_sizes(section: &str, frames: usize, test_frames: usize, centres: usize) -> Check {
    require((1..=65_535).contains(&centres), format!("{section}.centres"), centres, || {
        "it must be from 1 to 65535".into()
    })?;
    require(frames >= 2, format!("{section}.frames"), frames, || "it must be at least 2".into())?;
    require(test_frames > 0, format!("{section}.test_frames"), 0, || {
        "it must be at least 1".into()
    })?;
    require(centres < frames, format!("{section}.centres"), centres, || {
        format!(
            "there must be fewer centres than training frames ({frames}); lower it or raise \
             {section}.frames"
        )
    })
}

#[cfg(test)]
mod tests;

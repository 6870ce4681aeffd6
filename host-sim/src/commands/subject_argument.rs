//! Scene or CSV file that a model is trained on, with what both leave open.

use std::path::{Path, PathBuf};

use crate::experiment::{Experiment, names_a_scene};
use crate::measurements::Measurements;
use crate::subject::Subject;
use crate::sweep::fields::require_known;
use crate::sweep::file::Wanted;
use crate::sweep::plan::SEED;
use crate::training_options::TrainingOptions;
use crate::{Error, Result};
use clap::{Arg, Args, Command};
use serde::{Deserialize, Serialize};
use toml::Table;

use super::Common;
use super::arguments::{blamed, named, of_option};
use super::data_argument::{DataOptions, JudgedBy};
use super::data_file::DATA_FILES;
use super::scene_argument::{DEFAULT_SCENE, NoiseArgument};

/// Scene or CSV file to train and to judge on.
#[derive(Args, Default)]
pub struct SubjectArgument {
    /// A built-in scene (paper, press, contact, moving, shear), a scene file (.toml) or a CSV file [default: press].
    source: Option<String>,
    #[command(flatten)]
    options: SubjectOptions,
    /// CSV file with test frames, in the same columns [default: the last fifth of the lines is held out, or the
    /// last fold of --fold-column].
    #[arg(long, value_name = "FILE", help_heading = DATA_FILES)]
    test: Option<PathBuf>,
}

/// Data file of a plan, beside it, and its options.
#[derive(Serialize, Deserialize)]
pub struct PlannedData {
    file: PathBuf,
    /// File with frames to judge by.
    test: Option<PathBuf>,
    #[serde(flatten)]
    options: DataOptions,
}

impl PlannedData {
    /// Data in the table `data` of the plan at `path`.
    ///
    /// # Errors
    /// [`Error::Data`] for fields that are not those of data files.
    pub fn read(data: &Table, path: &Path) -> Result<Self> {
        let of_plan = |cause: &str| {
            taxel_data::Error::unfit(format!("plan {}: data: {cause}", path.display()))
        };
        let mut command = DataOptions::augment_args(Command::new("data"));
        command.build();
        let fields = command.get_arguments().map(|option| option.get_id().as_str());
        let known: Vec<&str> = ["file", "test"].into_iter().chain(fields).collect();
        let fields = data.keys().try_for_each(|field| require_known("field", field, &known));
        fields.map_err(|bad| of_plan(&bad.to_string()))?;
        let is_given = |option: &&Arg| data.contains_key(option.get_id().as_str());
        for option in command.get_arguments().filter(is_given) {
            let other = command.get_arg_conflicts_with(option).into_iter().find(is_given);
            if let Some(other) = other {
                let (field, other) = (option.get_id(), other.get_id());
                return Err(of_plan(&format!("{field} and {other}: give one of them")).into());
            }
        }
        let read = data.clone().try_into();
        let mut read: Self = read.map_err(|cause: toml::de::Error| of_plan(cause.message()))?;
        let files = [Some(&mut read.file), read.test.as_mut(), read.options.baseline_mut()];
        for file in files.into_iter().flatten() {
            let beside = path.with_file_name(&file);
            if beside.is_file() {
                *file = beside;
            }
        }
        Ok(read)
    }

    /// Loads the measurements, for models trained as `training` says, with this `seed`.
    pub fn load(
        &self,
        training: &TrainingOptions,
        seed: u64,
        common: &Common,
    ) -> Result<Measurements> {
        let judged = self.test.as_deref().map_or(JudgedBy::HeldOut, JudgedBy::File);
        self.options.load(&self.file, (training, seed), judged, common)
    }
}

/// Options for scenes and CSV files.
#[derive(Args, Default)]
pub struct SubjectOptions {
    #[command(flatten)]
    noise: NoiseArgument,
    // Last, since options behind these would stand under their headings.
    #[command(flatten)]
    pub training: TrainingOptions,
    #[command(flatten)]
    pub data: DataOptions,
}

impl SubjectArgument {
    /// Loads the scene or the CSV file.
    pub fn load(&self, common: &Common) -> Result<Subject> {
        self.load_for(&self.options.training, common)
    }

    /// Loads the scene or the CSV file for a trade, whose points have their own centres: a scene has one here, whatever it
    /// says.
    pub fn load_to_trade(&self, common: &Common) -> Result<Subject> {
        self.options.data.refuse_time("trade")?;
        let centres = names_a_scene(self.source()).then(|| vec![1]);
        self.load_for(&TrainingOptions { centres, ..self.options.training.clone() }, common)
    }

    fn load_for(&self, training: &TrainingOptions, common: &Common) -> Result<Subject> {
        let judged = self.test.as_deref().map_or(JudgedBy::HeldOut, JudgedBy::File);
        let subject = self.options.load(self.source(), (training, false), common, judged)?;
        if subject.scene().is_some() && self.test.is_some() {
            let message =
                "--test is for a CSV file; a scene has test frames of its own: leave it out";
            return Err(Error::Usage(message.into()));
        }
        Ok(subject)
    }

    /// Scene or file that was named.
    pub fn source(&self) -> &str {
        self.source.as_deref().unwrap_or(DEFAULT_SCENE)
    }

    /// Options of training.
    pub fn training(&self) -> &TrainingOptions {
        &self.options.training
    }

    /// Centres that are given, or candidates for them.
    pub fn centres(&self) -> &[usize] {
        self.options.training.centres.as_deref().unwrap_or_default()
    }

    /// Fields that its options set in every point of a plan for the `subject`, but for centres.
    ///
    /// # Errors
    /// [`Error::Usage`] for a seed beyond those of a scene.
    pub fn set(&self, subject: &Subject, common: &Common) -> Result<Table> {
        let mut set = fields_of(&self.options.training)?;
        set.remove("training.centres");
        set.extend(common.seed_in_scene()?.map(|seed| (SEED.into(), seed)));
        if let (Some(scene), Some(level)) = (subject.scene(), self.options.noise.level()) {
            let field = format!("noise.level{}", scene.world.noise.kind.unit_of_fields());
            set.insert(field, level.into());
        }
        Ok(set)
    }

    /// Text of a plan for this scene or data file.
    pub fn plan_text(&self, name: &str, wanted: &Wanted) -> Result<String> {
        let text = |cause: String| Error::failed(format!("cannot write the plan: {cause}"));
        let mut plan = Table::new();
        plan.insert("name".into(), name.into());
        if names_a_scene(self.source()) {
            plan.insert("scene".into(), self.source().into());
        } else {
            let (file, test) = (self.source().into(), self.test.clone());
            let data = PlannedData { file, test, options: self.options.data.clone() };
            let data = Table::try_from(&data).map_err(|cause| text(cause.to_string()))?;
            plan.insert("data".into(), data.into());
        }
        let wanted = Table::try_from(wanted).map_err(|cause| text(cause.to_string()))?;
        plan.extend(wanted);
        toml::to_string(&plan).map_err(|cause| text(cause.to_string()))
    }

    /// Paths of all files that are read, which must not be replaced.
    pub fn paths(&self) -> Vec<&Path> {
        [Path::new(self.source())]
            .into_iter()
            .chain(self.test.as_deref())
            .chain(self.options.data.baseline())
            .collect()
    }
}

/// Fields of a plan that options of `training` set.
pub fn fields_of(training: &TrainingOptions) -> Result<Table> {
    let fields = Table::try_from(training)
        .map_err(|cause| Error::failed(format!("cannot write the plan: {cause}")))?;
    Ok(fields.into_iter().map(|(field, value)| (format!("training.{field}"), value)).collect())
}

impl SubjectOptions {
    /// Loads the scene or CSV file called `source`, for models trained as `training` says; or whose options a trial
    /// `selects`.
    pub fn load(
        &self,
        source: &str,
        (training, selects): (&TrainingOptions, bool),
        common: &Common,
        judged: JudgedBy<'_>,
    ) -> Result<Subject> {
        let subject = if names_a_scene(source) {
            let scene = Experiment::load_open(source)?;
            self.data.refuse_for_scene(selects)?;
            let given = scene.trained_with(training);
            let checked = given.and_then(|scene| scene.check_sizes().map(|()| scene));
            let mut scene = checked.map_err(|bad| match named(bad, training) {
                bad if bad.field.starts_with('-') => of_option(bad),
                bad => Error::of_scene(source, bad),
            })?;
            scene.world.seed = common.seed.unwrap_or(scene.world.seed);
            self.noise.apply(&mut scene)?;
            Subject::Scene(Box::new(scene))
        } else {
            if self.noise.is_given() {
                let message = "--noise adds noise to a scene; a CSV file has its own";
                return Err(Error::Usage(message.into()));
            }
            let how = (training, common.seed.unwrap_or(1));
            let data = self.data.load(Path::new(source), how, judged, common);
            let data = data.map_err(|error| blamed(blamed(error, training), &self.data))?;
            // A fold column may tell which frames to judge by.
            let judges = self.data.has_fold_column() && matches!(judged, JudgedBy::HeldOut);
            if !(selects || judges || data.how.takes_folds()) {
                self.data.refuse_folds()?;
            }
            Subject::Measured(Box::new(data))
        };
        let checked = subject.options().check(subject.training_frames());
        checked.map_err(|bad| of_option(named(bad, training)))?;
        Ok(subject)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::FromArgMatches;

    #[test]
    fn a_plan_holds_options_of_a_data_file_as_they_were_given() {
        for words in [
            "--inputs a* --outputs b* --grid 4x8 --fold-blocks 5 --keep-outliers --baseline rest.csv",
            "--grid none --fold-column day --rest b1 --time t --header --missing 99,-1 --separator tab",
            "--folds 3 --separator | --decimal comma --first-share 0.5",
            "",
        ] {
            let command = DataOptions::augment_args(Command::new("data").no_binary_name(true));
            let matches = command.get_matches_from(words.split_whitespace());
            let options = DataOptions::from_arg_matches(&matches).unwrap();
            let given = PlannedData { file: "d.csv".into(), test: None, options };
            let written = Table::try_from(&given).unwrap();
            let read = PlannedData::read(&written, Path::new("plan.toml")).unwrap();
            assert_eq!(Table::try_from(&read).unwrap(), written);
            assert_eq!(written.len(), 1 + words.matches("--").count(), "{written}");
        }
    }
}

//! Scene or CSV file that a model is trained on, with what both leave open.

use std::path::{Path, PathBuf};

use crate::experiment::{Experiment, names_a_scene};
use crate::subject::Subject;
use crate::sweep::file::Wanted;
use crate::sweep::plan::SEED;
use crate::{Error, Result};
use clap::{Args, Parser};
use taxel_learn::reading_model::Extent;
use toml::{Table, Value};

use super::data_argument::{DataArguments, HowToTrain, JudgedBy};
use super::data_file::DATA_FILES;
use super::scene_argument::{
    DEFAULT_SCENE, NoiseArgument, RefineArgument, RelativeInputsArgument, Sizes,
};
use super::{Common, command_line};

/// Scene or CSV file to train and to judge on.
#[derive(Args, Default)]
pub struct SubjectArgument {
    /// A built-in scene (paper, press, contact, moving), a scene file (.toml) or a CSV file [default: press].
    source: Option<String>,
    /// CSV file with frames to judge by, in the same columns [default: the last fifth of the lines is held out, or the
    /// last fold of --fold-column].
    #[arg(long, value_name = "FILE", help_heading = DATA_FILES)]
    test: Option<PathBuf>,
    #[command(flatten)]
    options: SubjectOptions,
}

/// Options of measurements, as a plan has them.
#[derive(Parser)]
#[command(name = "data", no_binary_name = true, disable_help_flag = true)]
pub struct DataOptions {
    #[command(flatten)]
    subject: SubjectArgument,
    /// Seed of every random draw.
    #[arg(long)]
    seed: Option<u64>,
}

impl DataOptions {
    /// Loads the measurements.
    pub fn load(&self) -> Result<Subject> {
        self.subject.load(&Common { seed: self.seed, ..Common::default() })
    }
}

/// Options for scenes and CSV files.
#[derive(Args, Default)]
pub struct SubjectOptions {
    #[command(flatten)]
    pub noise: NoiseArgument,
    #[command(flatten)]
    pub relative_inputs: RelativeInputsArgument,
    #[command(flatten)]
    pub refine: RefineArgument,
    // Last, since options behind it would stand under its heading.
    #[command(flatten)]
    pub data: DataArguments,
}

impl SubjectArgument {
    /// Loads the scene or the CSV file.
    pub fn load(&self, common: &Common) -> Result<Subject> {
        self.load_with(common, None)
    }

    /// Loads the scene or the CSV file; `centres` are instead of the scene's.
    pub fn load_with(&self, common: &Common, centres: Option<usize>) -> Result<Subject> {
        let source = self.source.as_deref().unwrap_or(DEFAULT_SCENE);
        let judged = self.test.as_deref().map_or(JudgedBy::HeldOut, JudgedBy::File);
        let sizes = Sizes { frames: None, centres };
        let subject = self.options.load(source, common, judged, None, sizes)?;
        match &subject {
            Subject::Scene(_) if self.test.is_some() => {
                let message =
                    "--test is for a CSV file; a scene has test frames of its own: leave it out";
                return Err(Error::Usage(message.into()));
            }
            // A fold column may tell which frames to judge by.
            Subject::Measured(data)
                if !(data.refine || self.options.data.has_fold_column() && self.test.is_none()) =>
            {
                self.options.data.refuse_folds()?;
            }
            Subject::Scene(_) | Subject::Measured(_) => {}
        }
        Ok(subject)
    }

    /// Scene or file that was named.
    pub fn source(&self) -> &str {
        self.source.as_deref().unwrap_or(DEFAULT_SCENE)
    }

    /// Fields of a scene that its options set, for a plan; measurements are loaded with theirs.
    ///
    /// # Errors
    /// [`Error::Usage`] for a seed beyond those of a scene.
    pub fn set(&self, common: &Common) -> Result<Table> {
        let mut set = Table::new();
        if !names_a_scene(self.source()) {
            return Ok(set);
        }
        set.extend(common.seed_in_scene()?.map(|seed| (SEED.into(), seed)));
        let options = &self.options;
        let level = options.noise.level().map(|level| ("noise.level", Value::from(level)));
        let refine = (!options.refine.over(true)).then_some(("training.refine", false.into()));
        let relative = options.relative_inputs.relative_inputs;
        let relative = relative.then_some(("training.relative_inputs", true.into()));
        let given = [level, refine, relative].into_iter().flatten();
        set.extend(given.map(|(field, value)| (field.to_owned(), value)));
        Ok(set)
    }

    /// Text of a plan for this scene or data file.
    pub fn plan_text(&self, name: &str, wanted: &Wanted) -> Result<String> {
        let mut plan = Table::new();
        plan.insert("name".into(), name.into());
        if names_a_scene(self.source()) {
            plan.insert("scene".into(), self.source().into());
        } else {
            plan.insert("data".into(), command_line::words_of::<DataOptions>().into());
        }
        let text = |cause: String| Error::failed(format!("cannot write the plan: {cause}"));
        let wanted = Table::try_from(wanted).map_err(|cause| text(cause.to_string()))?;
        plan.extend(wanted);
        toml::to_string(&plan).map_err(|cause| text(cause.to_string()))
    }

    /// Error if a column of times was named: `command` tells nothing over time.
    pub fn refuse_time(&self, command: &str) -> Result<()> {
        self.options.data.refuse_time(command)
    }

    /// Paths of all files that are read, which must not be replaced.
    pub fn paths(&self) -> Vec<&Path> {
        let source = Path::new(self.source.as_deref().unwrap_or(DEFAULT_SCENE));
        [source]
            .into_iter()
            .chain(self.test.as_deref())
            .chain(self.options.data.baseline())
            .collect()
    }
}

impl SubjectOptions {
    /// Loads the scene or CSV file called `source`. `reading_model` asks for one that tells at least that much, whatever a scene says; `sizes` are instead
    /// of the scene's.
    pub fn load(
        &self,
        source: &str,
        common: &Common,
        judged: JudgedBy<'_>,
        reading_model: Option<Extent>,
        sizes: Sizes,
    ) -> Result<Subject> {
        if names_a_scene(source) {
            let scene = Experiment::load_open(source)?;
            self.data.refuse_for_scene()?;
            let mut scene = sizes.apply(scene, source)?;
            scene.world.seed = common.seed.unwrap_or(scene.world.seed);
            self.relative_inputs.apply(&mut scene);
            self.noise.apply(&mut scene)?;
            scene.training.refine = self.refine.over(scene.training.refine);
            scene.training.reading_model = scene.training.reading_model.max(reading_model);
            return Ok(Subject::Scene(Box::new(scene)));
        }
        if self.noise.is_given() {
            let message = "--noise adds noise to a scene; a CSV file has its own";
            return Err(Error::Usage(message.into()));
        }
        let how = HowToTrain {
            seed: common.seed.unwrap_or(1),
            relative_inputs: self.relative_inputs.relative_inputs,
            refine: self.refine.over(true),
            reading_model,
        };
        let data = self.data.load(Path::new(source), how, judged)?;
        Ok(Subject::Measured(Box::new(data)))
    }
}

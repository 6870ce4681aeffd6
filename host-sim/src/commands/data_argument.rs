//! Options of measurements in a data file: its columns, its lines at rest, its folds.

use std::ops::Not;
use std::path::{Path, PathBuf};

use crate::measurements::far_from_zero;
use crate::{Error, Result};
use clap::Args;
use serde::{Deserialize, Serialize};
use taxel_data::clock::neighbours_alike;
use taxel_data::error::{Problem, Role};
use taxel_data::mat::Grid;
use taxel_data::{DataFile, Rest, Table, require};
use taxel_learn::folds;

use super::Common;
use super::arguments::{as_text, refuse};
use super::data_file::{DATA_FILES, DataFileArguments, TimeArgument, for_data};
use super::readings::{self, BaselineArgument};
use super::rest_argument::RestArgument;

mod load;

/// What a data file holds, and how it is read: of commands, and of the `[data]` of a plan.
#[derive(Clone, Args, Default, Serialize, Deserialize)]
#[command(next_help_heading = DATA_FILES)]
pub struct DataOptions {
    /// Columns of readings in a data file: names with * and ?, and ranges such as c2..c16, comma-separated; !NAME
    /// leaves columns out [default: r*c*_ohm].
    #[arg(long, value_name = "GLOB")]
    inputs: Option<String>,
    /// Columns of outputs in a data file, written in the same way [default: r*e*_d?_mm, r*e*_f?_n and contact_*].
    #[arg(long, value_name = "GLOB")]
    outputs: Option<String>,
    /// Rows and columns of a mat whose cells are the inputs, row by row, such as 16x16. The grid is found without this
    /// option if the names give it: r1c1 and so on, or numbers that fill a square of 8x8 or more, of which dead cells may
    /// be missing. `none`: the inputs are not a mat.
    #[arg(long, value_name = "ROWSxCOLUMNS|none")]
    #[serde(default, with = "as_text")]
    grid: Option<Grid>,
    /// Column of a CSV file that gives each line's fold (any numbers), instead of random folds.
    #[arg(long, value_name = "NAME", conflicts_with = "folds")]
    fold_column: Option<String>,
    /// Number of random folds for cross-validation and for refinement on a CSV file [default: 5 if neighbouring lines do
    /// not resemble each other].
    #[arg(long, value_name = "N")]
    folds: Option<usize>,
    /// Number of folds of successive lines of a CSV file, instead of random folds [default: 5 if neighbouring lines
    /// resemble each other, as in a log, where random folds would test a model on frames almost equal to its training
    /// frames].
    #[arg(long, value_name = "N", conflicts_with_all = ["folds", "fold_column"])]
    fold_blocks: Option<usize>,
    /// Also train on lines of a CSV file with an outlier: a value far from all others in its column.
    #[arg(long)]
    #[serde(default, skip_serializing_if = "Not::not")]
    keep_outliers: bool,
    #[command(flatten)]
    #[serde(flatten)]
    untouched: BaselineArgument,
    #[command(flatten)]
    #[serde(flatten)]
    rest: RestArgument,
    #[command(flatten)]
    #[serde(flatten)]
    clock: TimeArgument,
    #[command(flatten)]
    #[serde(flatten)]
    pub file: DataFileArguments,
}

/// Frames that a model is judged by.
#[derive(Clone, Copy)]
pub enum JudgedBy<'p> {
    /// None: all frames are trained on.
    None,
    /// Frames of the file that are held out.
    HeldOut,
    /// Another file.
    File(&'p Path),
}

impl DataOptions {
    /// Error if an option was given: a scene takes none. With `--select` it takes random folds.
    pub fn refuse_for_scene(&self, selects: bool) -> Result<()> {
        refuse(self, |field| !(selects && field == "folds"), for_data)
    }

    /// Whether a column gives the folds.
    pub fn has_fold_column(&self) -> bool {
        self.fold_column.is_some()
    }

    /// Error if a column of times was named: `command` tells nothing over time.
    pub fn refuse_time(&self, command: &str) -> Result<()> {
        let message = |option: &str| format!("{option} has no effect in {command}: leave it out");
        refuse(&self.clock, |_| true, message)
    }

    /// Error if folds were asked for: nothing uses them.
    pub fn refuse_folds(&self) -> Result<()> {
        refuse(
            self,
            |field| field.starts_with("fold"),
            |option| {
                format!(
                    "{option} has no effect: refinement, `train --select` and --reading-model full use folds, and none of \
                     these is given; leave it out, or add one of them"
                )
            },
        )
    }

    /// File with frames of the untouched sensor, if it was given.
    pub fn baseline(&self) -> Option<&Path> {
        self.untouched.baseline.as_deref()
    }

    /// File with frames of the untouched sensor, to change where it is.
    pub fn baseline_mut(&mut self) -> Option<&mut PathBuf> {
        self.untouched.baseline.as_mut()
    }

    /// Patterns of the input and output columns, as they were given.
    pub fn patterns(&self) -> [Option<&str>; 2] {
        [self.inputs.as_deref(), self.outputs.as_deref()]
    }

    /// Readings of the untouched sensor in the columns called `inputs`: from a file of their own, or lines of the log
    /// `file` by its `outputs`. Inputs relative to the baseline need them.
    fn rest(
        &self,
        file: &DataFile,
        [inputs, outputs]: &[Vec<String>; 2],
        relative: bool,
        common: &Common,
    ) -> Result<Option<Rest>> {
        if let Some(path) = self.untouched.baseline.as_deref() {
            let readings =
                readings::at_rest(&self.file.fields().read(path, common)?, inputs, common)?;
            return Ok(Some(Rest { readings, lines: None }));
        }
        let outputs = outputs.iter().map(String::as_str);
        let rest = self.rest.find(file, (inputs, true), outputs, common)?;
        if rest.is_none() && relative {
            let message = "--relative-inputs: no line is known to be at rest: name columns that are zero there (--rest), \
                           or give --baseline FILE, with frames of the untouched sensor";
            return Err(Error::Unfit { path: file.path.clone(), message: message.into() });
        }
        Ok(rest)
    }

    /// Folds of frames with these `outputs`, as many as were asked for: of successive frames, or drawn at random. Unless a
    /// user says which, they are of successive frames if neighbours resemble each other.
    pub fn folds_of(&self, outputs: &Table, seed: u64) -> Result<Vec<usize>> {
        const USUAL: usize = 5;
        let frames = outputs.len();
        let (field, folds) = match (self.fold_blocks, self.folds) {
            (Some(folds), _) => ("fold_blocks", folds),
            (None, Some(folds)) => ("folds", folds),
            (None, None) => ("folds", frames.min(USUAL)),
        };
        let is_possible = (2..=frames).contains(&folds);
        require(is_possible, field, folds, || format!("give from 2 to {frames}"))?;
        let in_blocks =
            self.fold_blocks.is_some() || self.folds.is_none() && neighbours_alike(outputs);
        Ok(if in_blocks {
            folds::block_folds(frames, folds)
        } else {
            folds::random_folds(frames, folds, seed)
        })
    }
}

/// Error if readings at `rest` are about zero, so that `inputs` over them mean nothing; `path` is the log's.
fn check_level(rest: &Table, inputs: &Table, path: &Path) -> Result<()> {
    if far_from_zero(&rest.means(), &inputs.deviations()) {
        return Ok(());
    }
    let message = "--relative-inputs: readings are about zero at rest, where R/R₀ has no meaning: leave it out, or give readings \
                   from which no baseline was subtracted";
    Err(Error::Unfit { path: path.into(), message: message.into() })
}

/// Error that names the options which choose columns.
fn with_options(error: taxel_data::Error) -> Error {
    let option = |role| match role {
        Role::Inputs => "--inputs",
        Role::Outputs => "--outputs",
    };
    match error {
        taxel_data::Error::File { path, problem } => match problem {
            Problem::NoMatch { role, .. }
            | Problem::NoUsualNames { role, .. }
            | Problem::AllLeftOut { role, .. } => {
                Error::Unfit { path, message: format!("{problem} ({})", option(role)) }
            }
            Problem::InputAndOutput { .. } => {
                Error::Unfit { path, message: format!("{problem} (--inputs, --outputs)") }
            }
            problem => taxel_data::Error::File { path, problem }.into(),
        },
        other => other.into(),
    }
}

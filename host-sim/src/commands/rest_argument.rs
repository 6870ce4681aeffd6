//! What the untouched sensor reads: in lines of a log, or in a file of its own.

use std::path::Path;

use crate::{Error, Result};
use clap::Args;
use serde::{Deserialize, Serialize};
use taxel_core::blob::Metadata;
use taxel_core::health::Limits;
use taxel_data::rest;
use taxel_data::{DataFile, Dataset, Rest, Table, columns};
use taxel_learn::health::judge;
use taxel_learn::outliers;

use super::Common;
use super::data_file::{DATA_FILES, FieldArguments};
use super::readings::BaselineArgument;

/// Which lines of a log are those of the untouched sensor.
#[derive(Clone, Args, Default, Serialize, Deserialize)]
#[command(next_help_heading = DATA_FILES)]
pub struct RestArgument {
    /// Columns of a log that are zero while nothing touches the sensor. Lines where all of them are zero give the
    /// baseline of the lines that follow. `none`: no line is at rest [default: outputs of force, weight, pressure and
    /// deformation].
    #[arg(long, value_name = "GLOB", conflicts_with = "baseline")]
    rest: Option<String>,
}

impl RestArgument {
    /// Whether the option was given.
    pub fn is_given(&self) -> bool {
        self.rest.is_some()
    }

    /// Columns of `file` that are zero while nothing touches: those that a user named, or those of the `outputs` that
    /// tell it; `None` if no line is to be taken for one at rest.
    fn columns<'n>(
        &self,
        file: &DataFile,
        outputs: impl Iterator<Item = &'n str>,
    ) -> Result<Option<Vec<usize>>> {
        match self.rest.as_deref() {
            Some("none") => Ok(None),
            Some(pattern) => {
                let columns = columns::select(&file.header, pattern);
                if let Some(part) = columns::unmatched(&file.header, pattern) {
                    let known = columns::known_names(&file.header, part);
                    let message =
                        format!("no column matches {part:?}; the file has: {known} (--rest)");
                    return Err(unfit(&file.path, message));
                }
                file.check_numbers(&columns)?;
                Ok(Some(columns))
            }
            None => {
                let tells =
                    |name: &&str| rest::is_zero_at_rest(name) && file.column_of_any(name).is_ok();
                Ok(Some(file.columns(outputs.filter(tells))?))
            }
        }
    }

    /// Makes places among the `outputs` of `file` missing on lines on which nothing touches, and says so, if most of these
    /// lines have one.
    pub fn forget_places<'n>(
        &self,
        file: &mut DataFile,
        outputs: impl Iterator<Item = &'n str>,
        common: &Common,
    ) -> Result<()> {
        let outputs: Vec<&str> = outputs.collect();
        let Some(columns) = self.columns(file, outputs.iter().copied())? else { return Ok(()) };
        let names: Vec<&str> = outputs.into_iter().filter(|it| columns::is_place(it)).collect();
        let places = file.columns(names.iter().copied())?;
        let lines = rest::lines_without_load(file, &columns);
        let has_place = |line: &&usize| places.iter().any(|it| !file.value(**line, *it).is_nan());
        let told = lines.iter().filter(has_place).count();
        if 2 * told > lines.len() {
            file.forget(&lines, &places);
            common.remark(format_args!(
                "note: nothing touches the sensor on {told} lines of {}: the position there ({}) counts as missing (--rest none keeps it)",
                file.path.display(),
                names.join(", "),
            ));
        }
        Ok(())
    }

    /// Readings of the untouched sensor in `file`, in the columns called `inputs`, if it was at rest in some lines. Unless
    /// a user named columns, those among the `outputs` tell it. Lines with an outlier do not count, nor, if `complete` says
    /// so, do those that lack a reading.
    pub fn find<'n>(
        &self,
        file: &DataFile,
        (inputs, complete): (&[String], bool),
        outputs: impl Iterator<Item = &'n str>,
        common: &Common,
    ) -> Result<Option<Rest>> {
        let Some(columns) = self.columns(file, outputs)? else { return Ok(None) };
        let of_readings = file.columns(inputs.iter().map(String::as_str))?;
        let mut lines = rest::lines_at_rest(file, &columns);
        let is_missing = |line: usize, column: &usize| file.value(line, *column).is_nan();
        lines.retain(|line| !complete || !of_readings.iter().any(|it| is_missing(*line, it)));
        let values = lines.iter().flat_map(|l| of_readings.iter().map(|c| file.value(*l, *c)));
        let readings = Table { names: inputs.to_vec(), values: values.collect() };
        let untouched = Dataset { inputs: readings, ..Dataset::empty(vec![], vec![], 1, 0) };
        let usual = outliers::find(&untouched, |_| 0).kept;
        let readings = untouched.subset(&usual).inputs;
        let lines: Vec<usize> = usual.into_iter().map(|index| lines[index]).collect();
        if lines.is_empty() {
            if self.is_given() {
                let message = "--rest: fewer than ten lines are within 1 % of zero there; name other columns, or leave it out";
                return Err(unfit(&file.path, message.into()));
            }
            return Ok(None);
        }
        let names: Vec<String> = columns.iter().map(|it| file.header[*it].clone()).collect();
        common.remark(format_args!(
            "note: {} of {} lines of {} are at rest ({} {} about 0)",
            lines.len(),
            file.lines(),
            file.path.display(),
            columns::some_names(&names),
            if names.len() == 1 { "is" } else { "are" },
        ));
        Ok(Some(Rest { readings, lines: Some(lines) }))
    }
}

/// What the untouched sensor reads, for a model that decodes a log.
#[derive(Args)]
pub struct UntouchedArguments {
    #[command(flatten)]
    pub baseline: BaselineArgument,
    #[command(flatten)]
    pub rest: RestArgument,
}

impl UntouchedArguments {
    /// File with frames of the untouched sensor, if it was given.
    pub fn path(&self) -> Option<&Path> {
        self.baseline.baseline.as_deref()
    }

    /// Readings of the untouched sensor as [`rest`](Self::rest) finds them, for nothing but relative inputs.
    pub fn rest_if_relative(
        &self,
        file: &DataFile,
        metadata: &Metadata<'_>,
        limits: Option<Limits>,
        common: &Common,
    ) -> Result<Option<Rest>> {
        if metadata.relative_inputs && self.path().is_none() {
            return self.rest(file, metadata, limits, common);
        }
        if !metadata.relative_inputs {
            self.refuse("the model takes readings as they are")?;
        }
        Ok(None)
    }

    /// Error if lines at rest were asked for, which nothing needs: it says `why`.
    pub fn refuse(&self, why: &str) -> Result<()> {
        if self.rest.is_given() {
            return Err(Error::Usage(format!("--rest has no effect: {why}; leave it out")));
        }
        Ok(())
    }

    /// Readings of the untouched sensor in the log `file`, in the columns of a model with this `metadata`. Those outside of
    /// the `limits` count as missing.
    pub fn rest(
        &self,
        file: &DataFile,
        metadata: &Metadata<'_>,
        limits: Option<Limits>,
        common: &Common,
    ) -> Result<Option<Rest>> {
        let inputs: Vec<String> = metadata.input_names.iter().map(String::from).collect();
        let outputs = metadata.output_names.iter();
        let mut rest = self.rest.find(file, (&inputs, false), outputs, common)?;
        if let Some(rest) = &mut rest {
            judge(&mut rest.readings, limits);
        }
        Ok(rest)
    }

    /// Baseline of each of so many `lines` of a log, or one for all of them, for the model with this `metadata`, which
    /// was read from `path`; `None` for a model that needs none. Unless a file was given for it, it is that of the log's
    /// own lines at `rest`.
    pub fn baselines(
        &self,
        metadata: &Metadata<'_>,
        path: &Path,
        (rest, lines): (Option<&Rest>, usize),
        fields: &FieldArguments,
        limits: Option<Limits>,
        common: &Common,
    ) -> Result<Option<Table>> {
        if let (Some(rest), true, None) = (rest, metadata.relative_inputs, self.path()) {
            return Ok(Some(rest.baselines(&(0..lines).collect::<Vec<_>>())));
        }
        let names = || metadata.input_names.iter().map(String::from).collect();
        let or = ", or a log with columns that are zero while nothing touches it (--rest)";
        let baseline = self.baseline.values(metadata, (path, or), (fields, limits), common)?;
        Ok(baseline.map(|values| Table { names: names(), values: values.into() }))
    }
}

fn unfit(path: &Path, message: String) -> Error {
    Error::Unfit { path: path.into(), message }
}

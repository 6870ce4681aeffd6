//! Readings and baselines from CSV files, for the models that decode them.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::Args;
use serde::{Deserialize, Serialize};
use taxel_core::blob::Metadata;
use taxel_core::health::Limits;
use taxel_data::rest::is_zero_at_rest;
use taxel_data::{DataFile, Dataset, Table, columns};
use taxel_learn::health::judge;
use taxel_learn::{PreparedModel, outliers, relative};

use super::{Common, data_notes};

use super::data_file::FieldArguments;

/// Baseline of the sensor that readings are from.
#[derive(Clone, Args, Default, Serialize, Deserialize)]
pub struct BaselineArgument {
    /// CSV file with frames of the untouched sensor, in columns with the same names as the readings. The mean of its
    /// lines is the baseline of a tracker, or of relative inputs instead of lines at rest.
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
}

impl BaselineArgument {
    /// Gives the baseline to `model`, which was read from `path`. `fields` says how the baseline's file is read, and
    /// readings outside the `limits` count as missing.
    pub fn apply<'b>(
        &self,
        model: PreparedModel<'b>,
        path: &Path,
        (fields, limits): (&FieldArguments, Option<Limits>),
        common: &Common,
    ) -> Result<PreparedModel<'b>> {
        Ok(match self.values(model.model().metadata(), (path, ""), (fields, limits), common)? {
            Some(baseline) => model.with_baseline(&baseline),
            None => model,
        })
    }

    /// Baseline in the readings' units, for the model with this `metadata`, which was read from `path`; `None` for a
    /// model that needs none. `or` says what else could tell it. `fields` says how its file is read, and readings outside
    /// the `limits` count as missing.
    pub fn values(
        &self,
        metadata: &Metadata<'_>,
        (path, or): (&Path, &str),
        (fields, limits): (&FieldArguments, Option<Limits>),
        common: &Common,
    ) -> Result<Option<Vec<f64>>> {
        let unfit =
            |message: &str| Err(Error::Unfit { path: path.into(), message: message.into() });
        match (&self.baseline, metadata.relative_inputs) {
            (None, true) => unfit(&format!(
                "its inputs are readings relative to the baseline: give --baseline FILE, with frames of the \
                 untouched sensor{or}"
            )),
            (Some(_), false) => unfit(
                "its inputs are readings as they are: leave --baseline out, or train with --relative-inputs",
            ),
            (Some(_), true) | (None, false) => self.read(metadata, (fields, limits), common),
        }
    }

    /// Baseline in the readings' units, if a file was given for it.
    pub fn read(
        &self,
        metadata: &Metadata<'_>,
        (fields, limits): (&FieldArguments, Option<Limits>),
        common: &Common,
    ) -> Result<Option<Vec<f64>>> {
        let Some(file) = &self.baseline else { return Ok(None) };
        let names = metadata.input_names.iter();
        let untouched = fields.read(file, common)?;
        warn_of_touches(&untouched, metadata, common);
        let baseline = baseline(&untouched, names, limits, common)?;
        let missing = unusable(&baseline);
        if !missing.is_empty() {
            common.remark(format_args!(
                "note: {} has no baseline for {}: a mean that is missing, zero or negative, or no reading within the limits; \
                 these readings count as missing",
                file.display(),
                columns::some_names(&missing)
            ));
        }
        Ok(Some(baseline.values.into_vec()))
    }
}

/// Readings of the untouched sensor in `file`, in the columns called `inputs`, of which every one has a mean to divide by.
pub fn at_rest(file: &DataFile, inputs: &[String], common: &Common) -> Result<Table> {
    let rest = usual_lines(file, inputs.iter().map(String::as_str), common)?;
    check_baseline(&rest, &file.path)?;
    Ok(rest)
}

/// Error unless every column of the readings at `rest`, from the file at `path`, has a mean to divide by.
pub fn check_baseline(rest: &Table, path: &Path) -> Result<()> {
    let missing = unusable(&rest.mean_line());
    if missing.is_empty() {
        return Ok(());
    }
    let names = columns::some_names(&missing);
    let message = format!(
        "no baseline for {names}: a mean that is missing, zero or negative; give frames in which every input has a reading, \
         choose others with --inputs, or leave --relative-inputs out"
    );
    Err(Error::Unfit { path: path.into(), message })
}

/// One line: the mean of each of the columns called `names` in `file`, of readings within the `limits`.
fn baseline<'n>(
    file: &DataFile,
    names: impl Iterator<Item = &'n str>,
    limits: Option<Limits>,
    common: &Common,
) -> Result<Table> {
    let mut frames = usual_lines(file, names, common)?;
    judge(&mut frames, limits);
    Ok(Table { values: frames.means().into(), names: frames.names })
}

/// Columns called `names` of the lines of `file` that hold no outlier, which would move the mean.
fn usual_lines<'n>(
    file: &DataFile,
    names: impl Iterator<Item = &'n str>,
    common: &Common,
) -> Result<Table> {
    let inputs = table_of(file, names)?;
    let empty = Dataset::empty(vec![], vec![], 1, 0);
    let frames = Dataset { inputs, ..empty };
    let outliers = outliers::find(&frames, |line| file.line_number(line));
    data_notes::print_outliers(&outliers, &file.path, frames.frames(), "the baseline", common);
    Ok(frames.subset(&outliers.kept).inputs)
}

/// Warns of lines that are no baseline: `file` has outputs of a model with this `metadata`, and they are not zero there.
fn warn_of_touches(file: &DataFile, metadata: &Metadata<'_>, common: &Common) {
    /// Share of an output's full scale from which on the sensor is touched.
    const TOUCHED: f64 = 0.05;
    let mut touched = vec![false; file.lines()];
    for (name, full_scale) in metadata.output_names.iter().zip(metadata.full_scale.iter()) {
        let Ok(column) = file.column_of_any(name) else { continue };
        if !is_zero_at_rest(name) {
            continue;
        }
        for (line, touched) in touched.iter_mut().enumerate() {
            *touched |= file.value(line, column).abs() > TOUCHED * f64::from(full_scale);
        }
    }
    let count = touched.iter().filter(|touched| **touched).count();
    if count > 0 {
        common.remark(format_args!(
            "warning: the sensor is touched in {count} of {} lines of {}, by its outputs: errors will be large. Leave those \
             lines out of a baseline",
            file.lines(),
            file.path.display()
        ));
    }
}

/// Names of the columns of `baseline` that no reading can be divided by.
fn unusable(baseline: &Table) -> Vec<String> {
    let ratios = relative::inputs(baseline, baseline);
    let columns = ratios.values.iter().zip(&baseline.names);
    columns.filter(|(ratio, _)| ratio.is_nan()).map(|(_, name)| name.clone()).collect()
}

/// Model and what it is given of `readings`: their ratios to the `baselines`, if it has any. A frame is faulty, too, if one
/// of its readings has no baseline.
pub fn related<'b>(
    model: PreparedModel<'b>,
    readings: Table,
    baselines: Option<&Table>,
    is_faulty: &mut [bool],
    common: &Common,
) -> (PreparedModel<'b>, Table) {
    let Some(baselines) = baselines else { return (model, readings) };
    let inputs = relative::inputs(&readings, baselines);
    let mut lost = vec![0; inputs.names.len()];
    for ((line, readings), is_faulty) in inputs.lines().zip(readings.lines()).zip(is_faulty) {
        for ((input, reading), lost) in line.iter().zip(readings).zip(&mut lost) {
            if input.is_nan() && !reading.is_nan() {
                (*is_faulty, *lost) = (true, *lost + 1);
            }
        }
    }
    // A baseline of its own file was judged when it was read.
    let of_log = baselines.len() > 1;
    if let Some(most) = lost.iter().max().filter(|count| of_log && **count > 0) {
        let columns = inputs.names.iter().zip(&lost).filter(|(_, count)| **count > 0);
        let names: Vec<String> = columns.map(|(name, _)| name.clone()).collect();
        common.remark(format_args!(
            "warning: {} cannot be divided by its baseline in {most} of {} lines: at rest it is zero, negative or missing, as for \
             a dead cell. Outputs that need it are not decoded there; train a model without it (--inputs)",
            columns::some_names(&names),
            inputs.len()
        ));
    }
    (model.of_inputs(), inputs)
}

/// Columns of `file` with the model's readings.
pub fn model_inputs(model: &PreparedModel<'_>, file: &DataFile) -> Result<Table> {
    table_of(file, model.model().metadata().input_names.iter())
}

/// Columns of `file` called `names`.
pub fn table_of<'n>(file: &DataFile, names: impl Iterator<Item = &'n str>) -> Result<Table> {
    let names: Vec<&str> = names.collect();
    let columns = file.columns(names.iter().copied())?;
    let lines = 0..file.lines();
    let values = lines.flat_map(|line| columns.iter().map(move |c| file.value(line, *c)));
    Ok(Table { values: values.collect(), names: names.into_iter().map(String::from).collect() })
}

//! Readings and baselines from CSV files, for the models that decode them.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::Args;
use taxel_core::blob::Metadata;
use taxel_core::health::Limits;
use taxel_data::{DataFile, Dataset, Table, columns};
use taxel_learn::health::judge;
use taxel_learn::{PreparedModel, outliers, relative};

use super::data_notes;
use super::stderr;

use super::data_file::FieldArguments;

/// Baseline of the sensor that readings are from.
#[derive(Args)]
pub struct BaselineArgument {
    /// CSV file with frames of the untouched sensor, in columns of the same names as the readings. A model with
    /// relative inputs takes the mean of its lines for the baseline.
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
        fields: &FieldArguments,
        limits: Option<Limits>,
    ) -> Result<PreparedModel<'b>> {
        Ok(match self.values(model.model().metadata(), (path, ""), fields, limits)? {
            Some(baseline) => model.with_baseline(&baseline),
            None => model,
        })
    }

    /// Baseline in the readings' units, for the model with this `metadata`, which was read from `path`; `None` for a
    /// model that needs none. `or` says what else could tell it. `fields` says how its file is read, and readings outside the `limits` count as missing.
    pub fn values(
        &self,
        metadata: &Metadata<'_>,
        (path, or): (&Path, &str),
        fields: &FieldArguments,
        limits: Option<Limits>,
    ) -> Result<Option<Vec<f64>>> {
        let unfit =
            |message: &str| Err(Error::Unfit { path: path.into(), message: message.into() });
        match (&self.baseline, metadata.relative_inputs) {
            (None, false) => Ok(None),
            (None, true) => unfit(&format!(
                "its inputs are readings relative to the baseline: give --baseline FILE, with frames of the \
                 untouched sensor{or}"
            )),
            (Some(_), false) => unfit(
                "its inputs are readings as they are: leave --baseline out, or train with --relative-inputs",
            ),
            (Some(file), true) => {
                let names = metadata.input_names.iter();
                let baseline = baseline(&fields.read(file)?, names, limits)?;
                let missing = unusable(&baseline);
                if !missing.is_empty() {
                    stderr::remark(format_args!(
                        "note: {} has no baseline for {}: a mean that is missing, zero or negative, or no reading within the \
                         limits; these readings count as missing",
                        file.display(),
                        columns::some_names(&missing)
                    ));
                }
                Ok(Some(baseline.values))
            }
        }
    }
}

/// Readings of the untouched sensor in `file`, in the columns of `inputs`, of which every one has a mean to divide by.
pub fn at_rest(file: &DataFile, inputs: &Table) -> Result<Table> {
    let rest = usual_lines(file, inputs.names.iter().map(String::as_str))?;
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
) -> Result<Table> {
    let mut frames = usual_lines(file, names)?;
    judge(&mut frames, limits);
    Ok(Table { values: frames.means(), names: frames.names })
}

/// Columns called `names` of the lines of `file` that hold no outlier, which would move the mean.
fn usual_lines<'n>(file: &DataFile, names: impl Iterator<Item = &'n str>) -> Result<Table> {
    let inputs = table_of(file, names)?;
    let empty = Dataset::empty(vec![], vec![], 1, 0);
    let frames = Dataset { inputs, ..empty };
    let outliers = outliers::find(&frames, |line| file.line_number(line));
    data_notes::print_outliers(&outliers, &file.path, frames.frames(), "the baseline");
    Ok(frames.subset(&outliers.kept).inputs)
}

/// Names of the columns of `baseline` that no reading can be divided by.
fn unusable(baseline: &Table) -> Vec<String> {
    let ratios = relative::inputs(baseline, baseline);
    let columns = ratios.values.iter().zip(&baseline.names);
    columns.filter(|(ratio, _)| ratio.is_nan()).map(|(_, name)| name.clone()).collect()
}

/// Model and what it is given of `readings`: their ratios to the `baselines`, if it has any.
pub fn related<'b>(
    model: PreparedModel<'b>,
    readings: Table,
    baselines: Option<&Table>,
) -> (PreparedModel<'b>, Table) {
    match baselines {
        Some(baselines) => (model.of_inputs(), relative::inputs(&readings, baselines)),
        None => (model, readings),
    }
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

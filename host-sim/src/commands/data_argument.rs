//! Measurements from a CSV file: which columns are used, and which frames are held out.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::measurements::{Frames, Judged, Log, Measurements, Split};
use crate::verdict::Warning;
use crate::{Error, Result};
use clap::Args;
use taxel_data::clock::{Clock, neighbours_alike};
use taxel_data::columns;
use taxel_data::data_file::{DataFile, is_array};
use taxel_data::dataset::{Dataset, LeftOut, USUAL_INPUTS, UnusedInputs};
use taxel_data::error::{Problem, Role};
use taxel_data::mat::{self, Mat};
use taxel_data::rest::Rest;
use taxel_data::table::Table;
use taxel_learn::outliers::{self, Outliers};
use taxel_learn::train::refine::LEAST_FOLDS;
use taxel_learn::train::resolution;
use taxel_learn::{Options, relative, select};

use super::data_file::{DATA_FILES, DataFileArguments};
use super::rest_argument::RestArgument;
use super::{data_notes, readings, refused_readings, stderr};

/// What a CSV file's columns are.
#[derive(Args, Default)]
#[command(next_help_heading = DATA_FILES)]
pub struct DataArguments {
    /// Reading columns of a data file: names with * and ?, and ranges such as c2..c16, comma-separated; !NAME leaves
    /// columns out [default: r*c*_ohm].
    #[arg(long, value_name = "GLOB")]
    inputs: Option<String>,
    /// Output columns of a data file, in the same way [default: r*e*_d?_mm, r*e*_f?_n and contact_*].
    #[arg(long, value_name = "GLOB")]
    outputs: Option<String>,
    /// Rows and columns of a mat whose cells are the inputs, row by row, such as 16x16. It is found without this option where
    /// names say so: r1c1 and so on, or numbers that fill a square of 8x8 or more, from which dead cells may be missing.
    #[arg(long, value_name = "ROWSxCOLUMNS")]
    grid: Option<Mat>,
    /// Column of a CSV file that gives each line's fold (any numbers), instead of random folds.
    #[arg(long, value_name = "NAME", conflicts_with = "folds")]
    fold_column: Option<String>,
    /// Folds, drawn at random, for cross-validation and for refinement on a CSV file [default: 5 where neighbouring lines
    /// do not resemble each other].
    #[arg(long, value_name = "N")]
    folds: Option<usize>,
    /// Folds of successive lines of a CSV file, instead of random ones [default: 5 where neighbouring lines resemble each
    /// other, as in a log: random folds would judge a model by frames that it nearly knows].
    #[arg(long, value_name = "N", conflicts_with_all = ["folds", "fold_column"])]
    fold_blocks: Option<usize>,
    /// Train on the lines of a CSV file that hold an outlier, too: a value far from all others in its column.
    #[arg(long)]
    keep_outliers: bool,
    /// CSV file with frames of the untouched sensor, whose mean is the baseline, instead of lines at rest.
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    #[command(flatten)]
    rest: RestArgument,
    /// Column of a log with the time of each line [default: one called time, t, timestamp, …; without one lines are
    /// counted].
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    #[command(flatten)]
    pub file: DataFileArguments,
}

/// How a model is trained on a CSV file, besides its columns.
#[derive(Clone, Copy)]
pub struct HowToTrain {
    /// Seed of every random draw.
    pub seed: u64,
    /// Whether inputs are relative to the baseline.
    pub relative_inputs: bool,
    /// Whether training is refined.
    pub refine: bool,
    /// Whether the model is to have a confidence.
    pub confidence: bool,
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

impl DataArguments {
    /// Error if an option was given that is for CSV files alone.
    pub fn refuse_for_scene(&self) -> Result<()> {
        for (option, picked, given) in [
            ("--inputs", "columns", self.inputs.is_some()),
            ("--outputs", "columns", self.outputs.is_some()),
            ("--grid", "columns", self.grid.is_some()),
            ("--fold-column", "columns", self.fold_column.is_some()),
            ("--fold-blocks", "lines", self.fold_blocks.is_some()),
            ("--keep-outliers", "lines", self.keep_outliers),
            ("--rest", "lines", self.rest.is_given()),
            ("--time", "columns", self.time.is_some()),
        ] {
            if given {
                let message = format!("{option} picks {picked} of a CSV file; a scene has its own");
                return Err(Error::Usage(message));
            }
        }
        if self.baseline.is_some() {
            let message = "--baseline is for a CSV file; a scene synthesises its own: leave it out";
            return Err(Error::Usage(message.into()));
        }
        self.file.refuse_for_scene()
    }

    /// Mat whose cells the inputs are, if it was given.
    pub fn grid(&self) -> Option<Mat> {
        self.grid
    }

    /// Number of random folds, if it was given.
    pub fn folds(&self) -> Option<usize> {
        self.folds
    }

    /// Whether a column gives the folds.
    pub fn has_fold_column(&self) -> bool {
        self.fold_column.is_some()
    }

    /// Error if a column of times was named: `command` tells nothing over time.
    pub fn refuse_time(&self, command: &str) -> Result<()> {
        if self.time.is_some() {
            let message = format!("--time has no effect in {command}: leave it out");
            return Err(Error::Usage(message));
        }
        Ok(())
    }

    /// Error if folds were asked for: nothing uses them.
    pub fn refuse_folds(&self) -> Result<()> {
        for (option, given) in [
            ("--folds", self.folds.is_some()),
            ("--fold-blocks", self.fold_blocks.is_some()),
            ("--fold-column", self.fold_column.is_some()),
        ] {
            if given {
                let message = format!(
                    "{option} has no effect without refinement, --select or --confidence: leave it out, or \
                     leave out --no-refine"
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(())
    }

    /// File with frames of the untouched sensor, if it was given.
    pub fn baseline(&self) -> Option<&Path> {
        self.baseline.as_deref()
    }

    /// Patterns of the input and output columns, as they were given.
    pub fn patterns(&self) -> [Option<&str>; 2] {
        [self.inputs.as_deref(), self.outputs.as_deref()]
    }

    /// Whether lines with an outlier are trained on, too.
    pub fn keeps_outliers(&self) -> bool {
        self.keep_outliers
    }

    /// Readings of the untouched sensor in the columns of `inputs`, if a file with them was given.
    pub fn rest_of_file(&self, inputs: &Table) -> Result<Option<Rest>> {
        let read = |path| readings::at_rest(&self.file.fields().read(path)?, inputs);
        let of_file = self.baseline.as_deref().map(read).transpose()?;
        Ok(of_file.map(|readings| Rest { readings, lines: None }))
    }

    /// Readings of the untouched sensor in the columns of `frames`: from a file of their own, or lines of the log `file`.
    /// Inputs relative to the baseline need them.
    fn rest(&self, file: &DataFile, frames: &Dataset, how: HowToTrain) -> Result<Option<Rest>> {
        if let Some(rest) = self.rest_of_file(&frames.inputs)? {
            return Ok(Some(rest));
        }
        let outputs = frames.outputs.names.iter().map(String::as_str);
        let rest = self.rest.find(file, &frames.inputs.names, outputs)?;
        if how.relative_inputs {
            let Some(rest) = &rest else {
                let message = "--relative-inputs: no line is known to be at rest: name columns that are zero there (--rest), \
                               or give --baseline FILE, with frames of the untouched sensor";
                return Err(Error::Unfit { path: file.path.clone(), message: message.into() });
            };
            readings::check_baseline(&rest.readings, &file.path)?;
        }
        Ok(rest)
    }

    /// Error if an option was given that needs all lines of the file at `path` at once.
    pub fn refuse_for_stream(&self, path: &Path, how: HowToTrain) -> Result<()> {
        if how.relative_inputs && self.baseline.is_none() {
            return Err(Error::Usage(
                "--relative-inputs: a recursion reads lines once; give --baseline FILE, with frames of the untouched sensor"
                    .into(),
            ));
        }
        for (option, given) in [
            ("--fold-column", self.fold_column.is_some()),
            ("--rest", self.rest.is_given()),
            ("--time", self.time.is_some()),
            ("--first-share and --last-share", self.file.takes_a_share()),
            ("--confidence", how.confidence),
            ("an array of numpy's", is_array(path)),
        ] {
            if given {
                let message = format!(
                    "{option}: a recursion reads the lines of a CSV file once, and this needs all of them at once: \
                     leave it out, or give --solver qr"
                );
                return Err(Error::Usage(message));
            }
        }
        Ok(())
    }

    /// Folds of frames with these `outputs`, as many as were asked for: of successive frames, or drawn at random. Unless a
    /// user says which, they are of successive frames if neighbours resemble each other.
    pub fn folds_of(&self, outputs: &Table, seed: u64) -> Result<Vec<usize>> {
        const USUAL: usize = 5;
        let frames = outputs.len();
        let (option, folds) = match (self.fold_blocks, self.folds) {
            (Some(folds), _) => ("--fold-blocks", folds),
            (None, Some(folds)) => ("--folds", folds),
            (None, None) => ("--folds", frames.min(USUAL)),
        };
        if !(2..=frames).contains(&folds) {
            return Err(Error::Usage(format!("{option} {folds}: give from 2 to {frames}")));
        }
        let in_blocks =
            self.fold_blocks.is_some() || self.folds.is_none() && neighbours_alike(outputs);
        Ok(if in_blocks {
            select::block_folds(frames, folds)
        } else {
            select::random_folds(frames, folds, seed)
        })
    }

    /// Measurements in the CSV file at `path`.
    pub fn load(&self, path: &Path, how: HowToTrain, judged: JudgedBy<'_>) -> Result<Measurements> {
        let file = self.file.read(path)?;
        let [inputs, outputs] = self.patterns();
        let unused = UnusedInputs::find(&file, inputs, outputs).map_err(with_options)?;
        data_notes::print_unused(&unused, path);
        for wire in silent_wires(&file, inputs, self.grid, &unused.names())? {
            stderr::remark(format_args!("note: {wire}: none of its readings tells anything"));
        }
        let (all, outliers, left_out) = self.usual_frames(&file, &unused, how)?;
        data_notes::print_classes(&all.frames.outputs);
        let given_folds = self
            .fold_column
            .as_ref()
            .map(|name| folds_from(&file, name, &all.log.lines))
            .transpose()?;
        let digest = file.digest(&all.frames.names())?;
        let judged_by = self.judged(judged, &all.frames, &unused, digest, how)?;
        let Split { training: kept, test, choice } =
            Split::new(&all, given_folds.as_deref(), judged_by);
        if kept.is_empty() {
            let message = "holding out frames leaves none to train on: give more, or --test FILE";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        if test.frames.frames() == 0 && !matches!(judged, JudgedBy::None) {
            let message = "there is no frame to judge by: give five lines or more, or --test FILE";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        let training = all.subset(&kept);
        let count = kept.len();
        let fold_of = match &given_folds {
            Some(folds) => {
                let rest: Vec<usize> = kept.iter().map(|frame| folds[*frame]).collect();
                let held_out = !matches!(judged, JudgedBy::None);
                check_folds(&rest, held_out && how.refine)?;
                rest
            }
            None if count < 2 && self.folds.is_none() => vec![0; count],
            None => self.folds_of(&training.frames.outputs, how.seed)?,
        };
        // Readings themselves, even if the model is given their ratios to the baseline.
        resolution::check(&training.frames)
            .map_err(|refusal| Error::Unfit { path: path.into(), message: refusal.to_string() })?;
        let test_readings = test.frames.inputs.clone();
        let test_baselines = test.baselines();
        let given = |frames: Dataset, baselines: Option<Table>| match baselines {
            Some(baselines) if how.relative_inputs => relative::dataset(frames, &baselines),
            _ => frames,
        };
        let baselines = training.baselines();
        let (log, rest) = (training.log, training.rest);
        let training = given(training.frames, baselines);
        let name = path.file_stem().map_or("data".into(), |stem| stem.to_string_lossy());
        let inputs = training.inputs.names.len() / training.rows;
        let centres = Warning::enough_frames_for(training.fewest_values(), inputs);
        let centres = Options::default().centres.min(centres);
        let measurements = Measurements {
            name: name.into_owned(),
            digest,
            log,
            folds_flatter: self.folds.is_some() && neighbours_alike(&training.outputs),
            training,
            fold_of,
            test: given(test.frames, test_baselines.clone()),
            test_log: test.log,
            test_readings,
            test_baselines,
            test_choice: choice,
            outliers,
            left_out,
            unused,
            rest,
            options: Options { seed: how.seed, centres, ..Options::default() },
            refine: how.refine,
            confidence: how.confidence,
        };
        let constant = measurements.constant_inputs();
        data_notes::print_constant(&constant, path);
        Ok(measurements)
    }

    /// Outliers of `frames`, which are left out unless they are to be kept.
    fn outliers(&self, frames: &Dataset, line_number: impl Fn(usize) -> u64) -> Outliers {
        let outliers = outliers::find(frames, line_number);
        if !self.keep_outliers {
            return outliers;
        }
        Outliers { left_out: false, kept: (0..frames.frames()).collect(), ..outliers }
    }

    /// Frames of `file` without outliers and without the `unused` inputs, the outliers, and the lines that lack a value.
    fn usual_frames(
        &self,
        file: &DataFile,
        unused: &UnusedInputs,
        how: HowToTrain,
    ) -> Result<(Frames, Outliers, LeftOut)> {
        let (frames, lines, missing) = self.frames(file, unused)?;
        let outliers = self.outliers(&frames, |frame| file.line_number(lines[frame]));
        let left_out = "training and judging (--keep-outliers keeps them)";
        data_notes::print_outliers(&outliers, &file.path, frames.frames(), left_out);
        let lines = outliers.kept.iter().map(|frame| lines[*frame]).collect();
        let frames = frames.subset(&outliers.kept);
        refused_readings::note(&frames.inputs, &file.path.display().to_string());
        let log = Log { clock: Clock::of(file, self.time.as_deref())?, lines };
        let rest = self.rest(file, &frames, how)?;
        Ok((Frames { frames, log, rest }, outliers, missing))
    }

    /// Frames of `file` without the `unused` inputs, the indices of their lines, and the lines that lack a value.
    fn frames(
        &self,
        file: &DataFile,
        unused: &UnusedInputs,
    ) -> Result<(Dataset, Vec<usize>, LeftOut)> {
        let [inputs, outputs] = self.patterns();
        let (mut frames, kept) =
            Dataset::from_file(file, inputs, outputs, &unused.names()).map_err(with_options)?;
        name_cells(&mut frames.inputs, file, inputs, self.grid)?;
        data_notes::print_left_out(&kept.left_out, &file.path, kept.of);
        Ok((frames, kept.lines, kept.left_out))
    }

    /// Frames that the model trained on some of `frames` is judged by. `digest` is that of their columns.
    fn judged(
        &self,
        judged: JudgedBy<'_>,
        frames: &Dataset,
        unused: &UnusedInputs,
        digest: u64,
        how: HowToTrain,
    ) -> Result<Judged> {
        let path = match judged {
            JudgedBy::None => return Ok(Judged::None),
            JudgedBy::HeldOut => return Ok(Judged::HeldOut),
            JudgedBy::File(path) => path,
        };
        let file = self.file.fields().read(path)?;
        if file.digest(&frames.names()).is_ok_and(|of_file| of_file == digest) {
            let message = "it is the file that is trained on, which would flatter the model: give other frames (--test)";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        let (own, ..) = self.usual_frames(&file, unused, how)?;
        if own.frames.names() != frames.names() {
            let message = "its columns are not those of the frames to train on: give a file with the same columns, \
                           in the same order (--test)";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        Ok(Judged::File { frames: Box::new(own), name: path.display().to_string() })
    }
}

/// Names `inputs` after the cells of a mat, if that is what the columns of `file` that a `pattern` chose are.
pub fn name_cells(
    inputs: &mut Table,
    file: &DataFile,
    pattern: Option<&str>,
    grid: Option<Mat>,
) -> taxel_data::Result<()> {
    let cell_of: HashMap<String, String> = cells_of(file, pattern, grid)?.into_iter().collect();
    for name in &mut inputs.names {
        if let Some(cell) = cell_of.get(name) {
            name.clone_from(cell);
        }
    }
    Ok(())
}

/// Columns of `file` that match the `pattern`, each with its name in a model.
fn cells_of(
    file: &DataFile,
    pattern: Option<&str>,
    grid: Option<Mat>,
) -> taxel_data::Result<Vec<(String, String)>> {
    let chosen = columns::select(&file.header, pattern.unwrap_or(USUAL_INPUTS));
    let cells = mat::cell_names(&file.header, &chosen, grid).map_err(taxel_data::Error::unfit)?;
    let own = chosen.iter().map(|column| file.header[*column].clone());
    Ok(own.zip(cells).collect())
}

/// Wires of a mat of which every reading is among the `unused` columns.
fn silent_wires(
    file: &DataFile,
    pattern: Option<&str>,
    grid: Option<Mat>,
    unused: &[String],
) -> taxel_data::Result<Vec<String>> {
    let (own, cells): (Vec<String>, Vec<String>) =
        cells_of(file, pattern, grid)?.into_iter().unzip();
    let silent = own.iter().zip(&cells).filter(|(own, _)| unused.contains(own));
    let silent: Vec<String> = silent.map(|(_, cell)| cell.clone()).collect();
    Ok(mat::whole_wires(&cells, &silent))
}

/// Error that names the options which choose columns.
pub fn with_options(error: taxel_data::Error) -> Error {
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

/// Checks the folds that are left for refinement, `if_refined` after one of them was held out to judge by.
fn check_folds(folds: &[usize], if_refined: bool) -> Result<()> {
    let count = folds.iter().max().map_or(0, |last| last + 1);
    if !if_refined || count >= LEAST_FOLDS {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "--fold-column: the last fold is held out to judge by, which leaves {count}, and refinement needs {LEAST_FOLDS}: \
         give --test FILE, a column with more folds, or --no-refine"
    )))
}

/// Folds from column `name`, numbered from 0.
fn folds_from(file: &DataFile, name: &str, lines: &[usize]) -> Result<Vec<usize>> {
    let column = file.column(name)?;
    let values: Vec<f64> = lines.iter().map(|line| file.value(*line, column)).collect();
    if let Some(place) = values.iter().position(|value| value.is_nan()) {
        let rule = format!("column {name:?}: every line needs a fold; fill it in");
        let problem = Problem::MissingValue { line: file.line_number(lines[place]), rule };
        return Err(taxel_data::Error::file(&file.path, problem).into());
    }
    Ok(select::number_folds(&values))
}

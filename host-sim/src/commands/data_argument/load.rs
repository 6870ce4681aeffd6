//! Measurements out of a data file: its usable lines, split into those to train on and those to judge by.

use std::path::Path;
use std::sync::Arc;

use super::{DataOptions, JudgedBy, check_level, with_options};
use crate::commands::mat_cells::MatCells;
use crate::commands::{Common, data_notes, readings, refused_readings};
use crate::measurements::{Frames, Judged, Log, Measurements, Split, Spread};
use crate::over_time::is_log;
use crate::training_options::{Training, TrainingOptions};
use crate::verdict::Warning;
use crate::{Error, Result};
use taxel_data::clock::neighbours_alike;
use taxel_data::dataset::{Chosen, LeftOut, UnusedInputs};
use taxel_data::error::Problem;
use taxel_data::{Clock, DataFile, Dataset};
use taxel_learn::outliers::{self, Outliers};
use taxel_learn::train::refine::LEAST_FOLDS;
use taxel_learn::train::{projection, resolution};
use taxel_learn::{Options, folds};

impl DataOptions {
    /// Measurements in the CSV file at `path`, for models trained as `given` says, with this `seed`. Errors name bad values
    /// by their fields, whether options or a plan gave them.
    pub fn load(
        &self,
        path: &Path,
        (given, seed): (&TrainingOptions, u64),
        judged: JudgedBy<'_>,
        common: &Common,
    ) -> Result<Measurements> {
        let how = given.over(&Training::default())?;
        let file = self.file.read(path, common)?;
        let [inputs, outputs] = self.patterns();
        let unused = UnusedInputs::find(&file, inputs, outputs).map_err(with_options)?;
        data_notes::print_unused(&unused, path, common);
        let cells = MatCells::of(&file, inputs, self.grid)?;
        if let Some(mat) = cells.found.filter(|_| self.grid.is_none()) {
            common.remark(format_args!(
                "note: inputs are read as a mat of {mat} wires, row by row (--grid none if they are not)"
            ));
        }
        for wire in cells.silent_wires(&unused.names()) {
            common.remark(format_args!("note: {wire}: none of its readings can be used"));
        }
        let Usual { all, outliers, left_out, digest, folds: given_folds } = self.usual_frames(
            file,
            (&unused, &cells),
            self.fold_column.as_deref(),
            how.relative_inputs,
            common,
        )?;
        let judged_by =
            self.judged(judged, &all.frames, &unused, digest, how.relative_inputs, common)?;
        let Split { training: kept, test, choice } =
            Split::new(&all, given_folds.as_deref(), judged_by);
        if kept.is_empty() {
            let message = "holding out frames leaves none to train on: give more, or --test FILE";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        if test.frames.frames() == 0 && !matches!(judged, JudgedBy::None) {
            let message = "there are no test frames: give five lines or more, or --test FILE";
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
            None => self.folds_of(&training.frames.outputs, seed)?,
        };
        // Readings themselves, even if the model is given their ratios to the baseline.
        resolution::check(&training.frames)
            .map_err(|refusal| Error::Unfit { path: path.into(), message: refusal.to_string() })?;
        let spread = Spread::of(&all.frames.inputs);
        let [(log, rest), (test_log, test_rest)] =
            [&training, &test].map(|it| (it.log.clone(), it.rest.clone()));
        let training = training.given(how.relative_inputs);
        let name = path.file_stem().map_or("data".into(), |stem| stem.to_string_lossy());
        let usual = Options::usual_for(&training);
        let readings = training.inputs.names.len();
        let inputs = if usual.each_row {
            readings / training.rows
        } else {
            projection::features_at_most(
                &training,
                projection::usual_features(training.rows, readings),
            )
        };
        let centres =
            usual.centres.min(Warning::enough_frames_for(training.fewest_values(), inputs));
        let options = Options { seed, centres, ..usual };
        let mut measurements = Measurements {
            name: name.into_owned(),
            digest,
            log,
            folds_flatter: self.folds.is_some() && neighbours_alike(&training.outputs),
            training,
            fold_of,
            test: test.given(how.relative_inputs),
            test_log,
            test_rest,
            is_one_log: matches!(judged, JudgedBy::HeldOut),
            spread,
            test_choice: choice,
            outliers,
            left_out,
            unused,
            rest,
            how: Training { options, relative_inputs: how.relative_inputs, ..Training::default() },
        };
        measurements.train_with(given)?;
        let constant = measurements.constant_inputs();
        data_notes::print_constant(&constant, path, common);
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

    /// Frames of `file` without outliers and without the `unused` inputs, which are named after their `cells`, with the
    /// folds that a column tells. The file's memory becomes theirs.
    fn usual_frames(
        &self,
        mut file: DataFile,
        (unused, cells): (&UnusedInputs, &MatCells),
        fold_column: Option<&str>,
        relative_inputs: bool,
        common: &Common,
    ) -> Result<Usual> {
        let [inputs, outputs] = self.patterns();
        let mut chosen =
            Chosen::new(&file, inputs, outputs, &unused.names()).map_err(with_options)?;
        cells.name(&mut chosen.names[0]);
        let names: Vec<&str> = chosen.names.iter().flatten().map(String::as_str).collect();
        let digest = file.digest(&names)?;
        let clock = Clock::of(&file, self.clock.time.as_deref())?;
        let why_counted = clock.why_counted(&file);
        let rest = self.rest(&file, &chosen.names, relative_inputs, common)?.map(Arc::new);
        self.rest.forget_places(&mut file, chosen.names[1].iter().map(String::as_str), common)?;
        let column = fold_column.map(|name| file.column(name)).transpose()?;
        let fold_values: Option<Vec<f64>> =
            column.map(|column| (0..file.lines()).map(|line| file.value(line, column)).collect());
        let path = file.path.clone();

        let (mut frames, kept) = Dataset::from_file(file, chosen).map_err(with_options)?;
        data_notes::print_left_out(&kept.left_out, &path, kept.of, common);
        let outliers = self.outliers(&frames, |frame| kept.numbers[frame]);
        let left_out = "training and evaluation (--keep-outliers keeps them)";
        data_notes::print_outliers(&outliers, &path, frames.frames(), left_out, common);
        frames.keep(&outliers.kept);
        refused_readings::note(&frames.inputs, &path.display().to_string(), common);
        if let Some(why) = why_counted {
            common.remark(format_args!("note: {why}; lines are counted instead (--time)"));
        }
        let log = Log { clock, lines: outliers.kept.iter().map(|it| kept.lines[*it]).collect() };
        let of_log = rest.as_ref().filter(|rest| relative_inputs && rest.lines.is_some());
        if let Some(rest) = of_log {
            check_level(&rest.readings, &frames.inputs, &path)?;
            readings::check_baseline(&rest.readings, &path)?;
        }
        if rest.is_none() && !self.rest.is_given() && is_log(&log, &frames.outputs) {
            data_notes::print_no_rest(&frames.outputs, &path, common);
        }
        let folds = fold_values.map(|values| {
            let values: Vec<f64> = log.lines.iter().map(|line| values[*line]).collect();
            if let Some(place) = values.iter().position(|value| value.is_nan()) {
                let name = fold_column.unwrap_or_default();
                let rule = format!("column {name:?}: every line needs a fold; fill it in");
                let line = kept.numbers[outliers.kept[place]];
                let problem = Problem::MissingValue { line, rule };
                return Err(taxel_data::Error::file(&path, problem));
            }
            Ok(folds::number_folds(&values))
        });
        let all = Frames { frames, log, rest };
        Ok(Usual { all, outliers, left_out: kept.left_out, digest, folds: folds.transpose()? })
    }

    /// Frames that the model trained on some of `frames` is judged by. `digest` is that of their columns.
    fn judged(
        &self,
        judged: JudgedBy<'_>,
        frames: &Dataset,
        unused: &UnusedInputs,
        digest: u64,
        relative_inputs: bool,
        common: &Common,
    ) -> Result<Judged> {
        let path = match judged {
            JudgedBy::None => return Ok(Judged::None),
            JudgedBy::HeldOut => return Ok(Judged::HeldOut),
            JudgedBy::File(path) => path,
        };
        let file = self.file.fields().read(path, common)?;
        let cells = MatCells::of(&file, self.inputs.as_deref(), self.grid)?;
        let own = self.usual_frames(file, (unused, &cells), None, relative_inputs, common)?;
        if own.digest == digest {
            let message = "it is the training file, so errors would look too small: give other frames (--test)";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        let own = own.all;
        if own.frames.names() != frames.names() {
            let message = "its columns are not those of the frames to train on: give a file with the same columns, \
                           in the same order (--test)";
            return Err(Error::Unfit { path: path.into(), message: message.into() });
        }
        Ok(Judged::File { frames: Box::new(own), name: path.display().to_string() })
    }
}

/// Frames of a file that are used, and what is known of them.
struct Usual {
    all: Frames,
    outliers: Outliers,
    /// Lines that lack a value.
    left_out: LeftOut,
    /// Digest of the columns, of all lines.
    digest: u64,
    /// Fold of each frame, if a column tells it.
    folds: Option<Vec<usize>>,
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

//! Frames of a CSV file, or of standard input, that are read once and piece by piece.

use std::path::Path;
use std::sync::Arc;

use crate::measurements::{Log, Measurements, Spread};
use crate::verdict::Warning;
use crate::{Error, Result};
use taxel_data::clock::neighbours_alike;
use taxel_data::data_file::pieces::Pieces;
use taxel_data::dataset::{LeftOut, UnusedInputs};
use taxel_data::digest::TableDigest;
use taxel_data::error::Problem;
use taxel_data::mat::Grid;
use taxel_data::{Clock, Dataset, Rest};
use taxel_learn::outliers::{self, Outliers};
use taxel_learn::train::resolution;
use taxel_learn::{Options, relative};

use super::data_argument::{DataArguments, HowToTrain, with_options};
use super::mat_cells::MatCells;
use super::{data_file, data_notes, refused_readings, stderr};

/// Most values far from all others that are kept to be told.
const MOST_OUTLIERS: usize = 1000;

/// What is done to each piece.
struct Selection {
    inputs: Option<String>,
    outputs: Option<String>,
    grid: Option<Grid>,
    missing: Vec<f64>,
    keep_outliers: bool,
}

/// Frames of a CSV file that are still to be read, and what was found in those that were.
pub struct DataStream {
    pieces: Pieces,
    selection: Selection,
    /// Readings of the untouched sensor, if inputs are relative to their mean.
    rest: Option<Rest>,
    /// Frames that were read after the first ones.
    held: Option<Dataset>,
    /// Lines that were read, and those with a missing value.
    lines: usize,
    incomplete: usize,
    outliers: Outliers,
    /// Digest of the columns that are used, once there was a line of them.
    digest: Option<TableDigest>,
}

impl DataStream {
    /// Frames of the next lines that have any; `None` after the last one. Inputs are as they are.
    fn next_frames(&mut self) -> taxel_data::Result<Option<Dataset>> {
        while let Some(mut file) = self.pieces.next_piece()? {
            self.selection.missing.iter().for_each(|code| _ = file.mark_missing(*code));
            data_file::note_found(&file);
            self.lines += file.lines();
            let Selection { inputs, outputs, keep_outliers, .. } = &self.selection;
            let found = Dataset::from_file(&file, inputs.as_deref(), outputs.as_deref(), &[]);
            let (mut frames, kept) = match found {
                Err(taxel_data::Error::File { problem: Problem::NoCompleteLine, .. }) => {
                    self.incomplete += file.lines();
                    continue;
                }
                found => found?,
            };
            MatCells::of(&file, inputs.as_deref(), self.selection.grid)?.name(&mut frames.inputs);
            let names = frames.names();
            let new = || TableDigest::new(names.iter().copied());
            file.add_to(self.digest.get_or_insert_with(new), &names)?;
            self.incomplete += kept.of - kept.lines.len();
            let found = outliers::find(&frames, |frame| file.line_number(kept.lines[frame]));
            let leave_out = found.left_out && !keep_outliers;
            self.outliers.lines += found.lines;
            self.outliers.left_out |= leave_out;
            let room = MOST_OUTLIERS.saturating_sub(self.outliers.found.len());
            self.outliers.found.extend(found.found.into_iter().take(room));
            return Ok(Some(if leave_out { frames.subset(&found.kept) } else { frames }));
        }
        Ok(None)
    }

    /// Frames as a network is given them.
    fn given(&self, frames: Dataset) -> Dataset {
        match &self.rest {
            Some(rest) => relative::dataset(frames, &rest.baselines(&[])),
            None => frames,
        }
    }

    /// Digest of the columns that are used, as far as they were read.
    pub fn digest(&self) -> u64 {
        self.digest.as_ref().map_or(0, TableDigest::sum)
    }

    /// Values far from all others of their piece.
    pub fn outliers(self) -> Outliers {
        self.outliers
    }

    /// Says on stderr what was left out.
    pub fn note(&self) {
        let name = self.pieces.path().display();
        if self.incomplete > 0 {
            let (left_out, lines) = (self.incomplete, self.lines);
            stderr::remark(format_args!(
                "note: {left_out} of {lines} lines of {name} have a missing value and are skipped"
            ));
        }
        let lines = self.lines - self.incomplete;
        let left_out = "training (--keep-outliers keeps them)";
        data_notes::print_outliers(&self.outliers, self.pieces.path(), lines, left_out);
    }
}

impl Iterator for DataStream {
    type Item = taxel_data::Result<Dataset>;

    fn next(&mut self) -> Option<Self::Item> {
        let frames = match self.held.take() {
            Some(frames) => Ok(Some(frames)),
            None => self.next_frames(),
        };
        frames.transpose().map(|frames| frames.map(|frames| self.given(frames)))
    }
}

impl DataArguments {
    /// Measurements that hold the first frames of the CSV file at `path` (`-` is standard input), so many of them if
    /// there are as many; and the frames after these.
    pub fn load_first(
        &self,
        path: &Path,
        how: HowToTrain,
        first_frames: usize,
    ) -> Result<(Measurements, DataStream)> {
        self.refuse_for_stream(path, how)?;
        let fields = self.file.fields();
        let [inputs, outputs] = self.patterns().map(|pattern| pattern.map(str::to_owned));
        let no_outliers = Outliers { found: vec![], lines: 0, left_out: false, kept: vec![] };
        let mut stream = DataStream {
            pieces: Pieces::open(path, fields.reading())?,
            selection: Selection {
                inputs,
                outputs,
                grid: self.grid(),
                missing: fields.missing().to_vec(),
                keep_outliers: self.keeps_outliers(),
            },
            rest: None,
            held: None,
            lines: 0,
            incomplete: 0,
            outliers: no_outliers.clone(),
            digest: None,
        };
        let next = |stream: &mut DataStream| stream.next_frames().map_err(with_options);
        let path = stream.pieces.path().to_path_buf();
        let none = || Error::Data(taxel_data::Error::file(&path, Problem::NoCompleteLine));
        let mut first = next(&mut stream)?.ok_or_else(none)?;
        while first.frames() < first_frames
            && let Some(more) = next(&mut stream)?
        {
            first.inputs.values.extend(more.inputs.values);
            first.outputs.values.extend(more.outputs.values);
        }
        if first.frames() > first_frames {
            let cut = |values: &mut Vec<f64>, names: &[String]| {
                values.split_off(first_frames * names.len())
            };
            let mut held = first.subset(&[]);
            held.inputs.values = cut(&mut first.inputs.values, &first.inputs.names);
            held.outputs.values = cut(&mut first.outputs.values, &first.outputs.names);
            stream.held = Some(held);
        }
        refused_readings::note(&first.inputs, &path.display().to_string());
        resolution::check(&first)
            .map_err(|refusal| Error::Unfit { path: path.clone(), message: refusal.to_string() })?;
        let rest = self.rest_of_file(&first.inputs)?;
        stream.rest = rest.clone().filter(|_| how.relative_inputs);
        let training = stream.given(first);
        let frames = training.frames();
        let inputs = training.inputs.names.len() / training.rows;
        let enough = Warning::enough_frames_for(training.fewest_values(), inputs);
        let centres = Options::default().centres.min(enough);
        let name = path.file_stem().map_or("data".into(), |stem| stem.to_string_lossy());
        // Lines are not kept, so their times are not known.
        let log = Log { clock: Clock { column: None, unit: "", at: vec![] }, lines: vec![] };
        let measurements = Measurements {
            name: if path.as_os_str() == "standard input" { "data".into() } else { name.into() },
            digest: 0,
            fold_of: if how.refine {
                self.folds_of(&training.outputs, how.seed)?
            } else {
                vec![0; frames]
            },
            folds_flatter: self.folds().is_some() && neighbours_alike(&training.outputs),
            log: log.clone(),
            test_log: log,
            test_rest: None,
            is_one_log: false,
            spread: Spread { deviations: vec![], ranges: vec![] },
            test: training.subset(&[]),
            test_choice: "none".into(),
            outliers: no_outliers,
            left_out: LeftOut::default(),
            unused: UnusedInputs::default(),
            rest: rest.map(Arc::new),
            options: Options { seed: how.seed, centres, ..Options::default() },
            refine: how.refine,
            confidence: false,
            training,
        };
        data_notes::print_constant(&measurements.constant_inputs(), &path);
        Ok((measurements, stream))
    }
}

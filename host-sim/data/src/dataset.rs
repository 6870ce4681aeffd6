//! Data sets: tables of readings and of the outputs that belong to them.

use crate::columns;
use crate::csv_file::CsvFile;
use crate::error::{Error, Problem, Result, Role};
use crate::table::Table;

/// Largest magnitude that is trained on: its square, and sums of it, stay far inside f64, and
/// spans stay inside f32.
const LARGEST: f64 = 1e30;

/// Readings and outputs, in blocks: one a row-wire where every column belongs to one, else one.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// What a decoder is given.
    pub inputs: Table,
    /// What it should answer.
    pub outputs: Table,
    /// Equal blocks of consecutive columns, each with a network of its own.
    pub rows: usize,
    /// See [`Block::common_span`].
    pub common_span: bool,
}

impl Dataset {
    /// Room for `frames`, filled with zeros.
    #[must_use]
    pub fn empty(
        input_names: Vec<String>,
        output_names: Vec<String>,
        rows: usize,
        frames: usize,
    ) -> Self {
        let table = |names: Vec<String>| Table { values: vec![0.0; names.len() * frames], names };
        Self { inputs: table(input_names), outputs: table(output_names), rows, common_span: false }
    }

    /// Frames in the set.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.inputs.len()
    }

    /// The columns of one row-wire's block.
    #[must_use]
    pub fn block(&self, row: usize) -> Block {
        let cut = |table: &Table| {
            let count = table.names.len() / self.rows;
            table.columns(row * count, count)
        };
        let (inputs, outputs) = (cut(&self.inputs), cut(&self.outputs));
        Block { inputs, outputs, common_span: self.common_span }
    }

    /// Reads the columns chosen by `inputs` and `outputs` (see [`columns::select`]); by default the
    /// project's own names. Frames with a missing value are left out and counted.
    ///
    /// # Errors
    /// [`Error::File`]: no such column, an unreadable line, or nothing left to use.
    pub fn from_file(
        file: &CsvFile,
        inputs: Option<&str>,
        outputs: Option<&str>,
    ) -> Result<(Self, Kept)> {
        let input_columns = chosen(file, inputs, Role::Inputs)?;
        let output_columns = chosen(file, outputs, Role::Outputs)?;
        if let Some(both) = input_columns.iter().find(|c| output_columns.contains(c)) {
            let name = file.header[*both].clone();
            return Err(Error::file(&file.path, Problem::InputAndOutput { name }));
        }
        let (input_columns, output_columns, rows) =
            by_rows(&file.header, input_columns, output_columns);
        for &column in input_columns.iter().chain(&output_columns) {
            if let Some(line) = (0..file.lines()).find(|l| file.value(*l, column).abs() > LARGEST) {
                let problem = Problem::TooLarge {
                    line: file.line_number(line),
                    column: file.header[column].clone(),
                    value: file.value(line, column),
                    bound: LARGEST,
                };
                return Err(Error::file(&file.path, problem));
            }
        }
        let kept: Vec<usize> = (0..file.lines())
            .filter(|line| {
                let complete = |c: &usize| !file.value(*line, *c).is_nan();
                input_columns.iter().chain(&output_columns).all(complete)
            })
            .collect();
        if kept.is_empty() {
            return Err(Error::file(&file.path, Problem::NoCompleteLine));
        }
        let take = |columns: &[usize]| Table {
            names: columns.iter().map(|c| file.header[*c].clone()).collect(),
            values: kept.iter().flat_map(|l| columns.iter().map(|c| file.value(*l, *c))).collect(),
        };
        let (inputs, outputs) = (take(&input_columns), take(&output_columns));
        let dataset = Self { inputs, outputs, rows, common_span: false };
        Ok((dataset, Kept { lines: kept, of: file.lines() }))
    }

    /// The frames at `indices`, in that order.
    #[must_use]
    pub fn subset(&self, indices: &[usize]) -> Self {
        let pick = |table: &Table| {
            let n = table.names.len();
            let line = |i: &usize| table.values[i * n..(i + 1) * n].to_vec();
            Table { names: table.names.clone(), values: indices.iter().flat_map(line).collect() }
        };
        Self { inputs: pick(&self.inputs), outputs: pick(&self.outputs), ..*self }
    }
}

/// Which lines of a file a data set uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Indices of the lines used.
    pub lines: Vec<usize>,
    /// Lines in the file.
    pub of: usize,
}

/// Inputs and outputs of one network.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// What the network is given.
    pub inputs: Table,
    /// What it should answer.
    pub outputs: Table,
    /// Whether all inputs are scaled by the largest span of any, each about its own middle: they are in one
    /// unit, and the farther one reaches, the more it tells.
    pub common_span: bool,
}

impl Block {
    /// The range that each input is scaled by.
    #[must_use]
    pub fn input_ranges(&self) -> Vec<[f64; 2]> {
        let mut ranges = self.inputs.ranges();
        if self.common_span {
            let half = ranges.iter().map(|[low, high]| 0.5 * (high - low)).fold(0.0, f64::max);
            for [low, high] in &mut ranges {
                let middle = 0.5 * (*low + *high);
                (*low, *high) = (middle - half, middle + half);
            }
        }
        ranges
    }

    /// The first `frames` of the block.
    #[must_use]
    pub fn first(&self, frames: usize) -> Self {
        let cut = |table: &Table| Table {
            names: table.names.clone(),
            values: table.values[..frames * table.names.len()].to_vec(),
        };
        Self { inputs: cut(&self.inputs), outputs: cut(&self.outputs), ..*self }
    }
}

/// Columns of `file` that `pattern` chooses, or those with the project's own names.
fn chosen(file: &CsvFile, pattern: Option<&str>, role: Role) -> Result<Vec<usize>> {
    let usual = match role {
        Role::Inputs => "r*c*_ohm",
        Role::Outputs => "r*e*_d?_mm,r*e*_f?_n",
    };
    let known = || columns::some_names(&file.header);
    let selected = columns::select(&file.header, pattern.unwrap_or(usual));
    let unmatched = pattern.and_then(|pattern| columns::unmatched(&file.header, pattern));
    if let (Some(glob), Some(pattern)) = (unmatched, pattern) {
        let (glob, pattern) = (glob.into(), pattern.into());
        let problem = Problem::NoMatch { role, glob, pattern, known: known() };
        return Err(Error::file(&file.path, problem));
    }
    if selected.is_empty() {
        let problem = Problem::NoUsualNames { role, pattern: usual.into(), known: known() };
        return Err(Error::file(&file.path, problem));
    }
    Ok(selected)
}

/// Orders columns by row-wire and counts the rows, if every column names one and the rows are
/// equal; otherwise one block of everything, as it stands.
fn by_rows(
    header: &[String],
    inputs: Vec<usize>,
    outputs: Vec<usize>,
) -> (Vec<usize>, Vec<usize>, usize) {
    let rows_of = |columns: &[usize]| -> Option<Vec<usize>> {
        columns.iter().map(|c| columns::row_of(&header[*c])).collect()
    };
    let (Some(input_rows), Some(output_rows)) = (rows_of(&inputs), rows_of(&outputs)) else {
        return (inputs, outputs, 1);
    };
    let distinct = |rows: &[usize]| {
        let mut rows = rows.to_vec();
        rows.sort_unstable();
        rows.dedup();
        rows
    };
    let rows = distinct(&input_rows);
    let even = |all: &[usize]| {
        let count = |row: &usize| all.iter().filter(|r| *r == row).count();
        rows.iter().all(|row| count(row) == count(&rows[0]))
    };
    if rows != distinct(&output_rows) || !even(&input_rows) || !even(&output_rows) {
        return (inputs, outputs, 1);
    }
    let ordered = |columns: Vec<usize>, of: &[usize]| {
        let mut pairs: Vec<_> = of.iter().copied().zip(columns).collect();
        pairs.sort_by_key(|(row, _)| *row); // stable: the file's order within a row
        pairs.into_iter().map(|(_, column)| column).collect()
    };
    (ordered(inputs, &input_rows), ordered(outputs, &output_rows), rows.len())
}

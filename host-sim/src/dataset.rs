//! Data sets: tables of readings and of the outputs that belong to them.

use crate::columns;
use crate::data_file::DataFile;
use crate::error::{Error, Result};

/// Largest magnitude that is trained on: its square, and sums of it, stay far inside f64, and
/// spans stay inside f32.
const LARGEST: f64 = 1e30;

/// Named columns of numbers, one line a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Column names.
    pub names: Vec<String>,
    /// Values, line after line; NaN is missing.
    pub values: Vec<f64>,
}

impl Table {
    /// Lines in the table.
    #[must_use]
    pub fn len(&self) -> usize {
        if self.names.is_empty() { 0 } else { self.values.len() / self.names.len() }
    }

    /// Whether there is no line.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The lines.
    pub fn lines(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.names.len().max(1))
    }

    /// Smallest and largest value of every column.
    #[must_use]
    pub fn ranges(&self) -> Vec<[f64; 2]> {
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.names.len()];
        for line in self.lines() {
            for ([low, high], value) in ranges.iter_mut().zip(line) {
                (*low, *high) = (low.min(*value), high.max(*value));
            }
        }
        ranges
    }

    /// Mean of every column, NaN left out.
    #[must_use]
    pub fn means(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.names.len()];
        for line in self.lines() {
            for ((sum, count), value) in sums.iter_mut().zip(line).filter(|(_, v)| !v.is_nan()) {
                (*sum, *count) = (*sum + value, *count + 1.0);
            }
        }
        sums.iter().map(|(sum, count)| sum / count).collect()
    }

    /// Σ(estimate − value)² of every column, for `estimates` laid out as the values are.
    #[must_use]
    pub fn squared_errors(&self, estimates: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.names.len()];
        for (line, estimates) in self.lines().zip(estimates.chunks_exact(sums.len().max(1))) {
            for (sum, (value, estimate)) in sums.iter_mut().zip(line.iter().zip(estimates)) {
                *sum += (estimate - value) * (estimate - value);
            }
        }
        sums
    }

    /// The `count` columns from the one at `from` on.
    ///
    /// # Panics
    /// If there are not so many.
    #[must_use]
    pub fn columns(&self, from: usize, count: usize) -> Self {
        let names = self.names[from..from + count].to_vec();
        let values = self.lines().flat_map(|line| line[from..from + count].to_vec()).collect();
        Self { names, values }
    }
}

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
    /// [`Error::Data`]: no such column, an unreadable line, or nothing left to use.
    pub fn from_file(
        file: &DataFile,
        inputs: Option<&str>,
        outputs: Option<&str>,
    ) -> Result<(Self, Kept)> {
        let input_columns = chosen(file, inputs, "--inputs", "r*c*_ohm")?;
        let output_columns = chosen(file, outputs, "--outputs", "r*e*_d?_mm,r*e*_f?_n")?;
        if let Some(both) = input_columns.iter().find(|c| output_columns.contains(c)) {
            let name = &file.header[*both];
            let message = format!("column {name:?} is chosen by --inputs and by --outputs");
            return Err(Error::data(&file.path, message));
        }
        let (input_columns, output_columns, rows) =
            by_rows(&file.header, input_columns, output_columns);
        for &column in input_columns.iter().chain(&output_columns) {
            if let Some(line) = (0..file.lines()).find(|l| file.value(*l, column).abs() > LARGEST) {
                let message = format!(
                    "line {}, column {:?}: {} is beyond {LARGEST:e}, the largest number that a \
                     decoder in f32 is trained on; give the column another unit",
                    file.line_number(line),
                    file.header[column],
                    file.value(line, column)
                );
                return Err(Error::data(&file.path, message));
            }
        }
        let kept: Vec<usize> = (0..file.lines())
            .filter(|line| {
                let complete = |c: &usize| !file.value(*line, *c).is_nan();
                input_columns.iter().chain(&output_columns).all(complete)
            })
            .collect();
        if kept.is_empty() {
            let message = "no line has a value in every chosen column; check the columns";
            return Err(Error::data(&file.path, message));
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

fn chosen(
    file: &DataFile,
    pattern: Option<&str>,
    option: &str,
    default: &str,
) -> Result<Vec<usize>> {
    let selected = columns::select(&file.header, pattern.unwrap_or(default));
    let missing = pattern.and_then(|pattern| columns::unmatched(&file.header, pattern));
    if let (Some(glob), Some(pattern)) = (missing, pattern) {
        let message = format!(
            "no column matches {glob:?} of {option} {pattern:?}; the file has: {}",
            columns::some_names(&file.header)
        );
        return Err(Error::data(&file.path, message));
    }
    if selected.is_empty() {
        let message = format!(
            "no column is named like {default}; choose columns with {option}; the file has: {}",
            columns::some_names(&file.header)
        );
        return Err(Error::data(&file.path, message));
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

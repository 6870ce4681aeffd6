//! Data sets: tables of readings and of the outputs that a decoder should predict from them.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher};

use serde::Serialize;

use crate::columns;
use crate::data_file::{DataFile, Unreadable};
use crate::error::{Error, Problem, Result, Role};
use crate::table::Table;

/// Largest magnitude that training accepts: its square, and sums of squares, stay far inside f64, and
/// spans stay inside f32.
const LARGEST: f64 = 1e30;

/// Pattern of the project's own names of readings.
pub const USUAL_INPUTS: &str = "r*c*_ohm";

/// Readings and outputs for training or evaluation, one frame a line.
///
/// Columns are ordered by row-wire if each names one, so that every row-wire has its own [table](Self::row_table);
/// otherwise there is a single row table.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Readings that a decoder is given, `frames × inputs`, in the columns' own units (Ω for simulated
    /// ones).
    pub inputs: Table,
    /// Outputs that it should predict, `frames × outputs`, in the columns' own units (mm or N for
    /// simulated ones). NaN is missing.
    pub outputs: Table,
    /// Number of row tables: equal groups of consecutive columns, each with a network of its own.
    pub rows: usize,
    /// Whether every input is scaled by the largest span of any, about its own middle. Features of a projection share one
    /// unit: the wider one's range, the more it tells about the outputs.
    pub common_span: bool,
    /// Whether inputs are readings relative to the baseline (R/R₀), without a unit, and not readings as they are.
    pub relative_inputs: bool,
    /// What the inputs are while nothing touches the sensor, if it is known.
    pub at_rest: Option<AtRest>,
    /// Factor on the error of each frame in least squares; `None` where all frames count alike.
    pub weights: Option<Vec<f64>>,
}

/// Inputs while nothing touches the sensor, in their units.
#[derive(Debug, Clone, PartialEq)]
pub struct AtRest {
    /// Mean of each input.
    pub level: Vec<f64>,
    /// Standard deviation of each input.
    pub deviation: Vec<f64>,
}

impl AtRest {
    /// Level and deviation of `inputs` (`frames × inputs`) at rest.
    pub fn of(inputs: &Table) -> Self {
        Self { level: inputs.means(), deviation: inputs.deviations() }
    }
}

impl Dataset {
    /// Data set of `frames` lines of zeros, with the given columns in `rows` row tables.
    pub fn empty(
        input_names: Vec<String>,
        output_names: Vec<String>,
        rows: usize,
        frames: usize,
    ) -> Self {
        let table =
            |names: Vec<String>| Table { values: vec![0.0; names.len() * frames].into(), names };
        let (inputs, outputs) = (table(input_names), table(output_names));
        let (at_rest, weights) = (None, None);
        Self { inputs, outputs, rows, common_span: false, relative_inputs: false, at_rest, weights }
    }

    /// Number of frames in the set.
    pub fn frames(&self) -> usize {
        self.inputs.len()
    }

    /// Number of values of the output that is missing most often.
    pub fn fewest_values(&self) -> usize {
        self.outputs.counts().into_iter().min().unwrap_or(0)
    }

    /// Names of all columns: the inputs', then the outputs'.
    pub fn names(&self) -> Vec<&str> {
        self.inputs.names.iter().chain(&self.outputs.names).map(String::as_str).collect()
    }

    /// Inputs and outputs of the network of row number `row` (from 0), as a set of one row.
    ///
    /// # Panics
    /// If the set has no such row table.
    #[must_use]
    pub fn row_table(&self, row: usize) -> Self {
        let cut = |table: &Table| {
            let count = table.names.len() / self.rows;
            table.columns(row * count, count)
        };
        let (inputs, outputs) = (cut(&self.inputs), cut(&self.outputs));
        Self { inputs, outputs, rows: 1, at_rest: None, weights: self.weights.clone(), ..*self }
    }

    /// Range `[low, high]` by which each input is scaled, in the input's unit.
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

    /// Frames of `file` in the `chosen` columns. Frames with a missing input, or without any output, are skipped; [`Kept`]
    /// counts them.
    ///
    /// # Errors
    /// [`Error::File`] for a value that is too large, or a file without a complete frame.
    pub fn from_file(file: DataFile, chosen: Chosen) -> Result<(Self, Kept)> {
        let Chosen { inputs, outputs, names: [input_names, output_names], rows } = chosen;
        for &column in inputs.iter().chain(&outputs) {
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
        let is_missing = |line: usize, column: &usize| file.value(line, *column).is_nan();
        let (without_reading, rest): (Vec<usize>, Vec<usize>) = (0..file.lines())
            .partition(|line| inputs.iter().any(|column| is_missing(*line, column)));
        let (without_output, lines): (Vec<usize>, Vec<usize>) = rest
            .into_iter()
            .partition(|line| outputs.iter().all(|column| is_missing(*line, column)));
        if lines.is_empty() {
            return Err(Error::file(&file.path, Problem::NoCompleteLine));
        }
        let left_out = LeftOut {
            without_reading: without_reading.len(),
            without_output: without_output.len(),
            missing_most: missing_most(&file, &inputs, &outputs),
            unreadable: file.unreadable.clone(),
        };
        let numbers = lines.iter().map(|line| file.line_number(*line)).collect();
        let kept = Kept { numbers, of: file.lines(), left_out, lines };
        let [input_values, output_values] = file.into_tables(&kept.lines, [&inputs, &outputs]);
        let frames = Self {
            inputs: Table { names: input_names, values: input_values.into() },
            outputs: Table { names: output_names, values: output_values.into() },
            ..Self::empty(vec![], vec![], rows, 0)
        };
        Ok((frames, kept))
    }

    /// Keeps the frames at these ascending `indices` (from 0) alone, without a copy of them.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn keep(&mut self, indices: &[usize]) {
        for table in [&mut self.inputs, &mut self.outputs] {
            let columns = table.names.len();
            for (to, from) in indices.iter().enumerate().filter(|(to, from)| to != *from) {
                table.values.copy_within(from * columns..(from + 1) * columns, to * columns);
            }
            table.values.truncate(indices.len() * columns);
        }
    }

    /// Frames at `indices` (from 0), in that order.
    ///
    /// # Panics
    /// If there is no such frame.
    #[must_use]
    pub fn subset(&self, indices: &[usize]) -> Self {
        let weights = self.weights.as_ref().map(|it| indices.iter().map(|i| it[*i]).collect());
        let [inputs, outputs] = [&self.inputs, &self.outputs].map(|table| table.pick(indices));
        Self { inputs, outputs, weights, at_rest: self.at_rest.clone(), ..*self }
    }
}

/// Columns of a file that a data set is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    inputs: Vec<usize>,
    outputs: Vec<usize>,
    /// Names of the inputs, and of the outputs, in the data set.
    pub names: [Vec<String>; 2],
    /// Number of row tables.
    rows: usize,
}

impl Chosen {
    /// Selects the columns that match the patterns `inputs` and `outputs` (see [`columns::select`]), by
    /// default those with the project's own names, but for the inputs called `unused`.
    ///
    /// # Errors
    /// [`Error::File`] for a pattern without a column, or a column that is input and output.
    pub fn new(
        file: &DataFile,
        inputs: Option<&str>,
        outputs: Option<&str>,
        unused: &[String],
    ) -> Result<Self> {
        let mut inputs = chosen(file, inputs, Role::Inputs)?;
        inputs.retain(|column| !unused.contains(&file.header[*column]));
        let outputs = chosen(file, outputs, Role::Outputs)?;
        if let Some(both) = inputs.iter().find(|column| outputs.contains(column)) {
            let name = file.header[*both].clone();
            return Err(Error::file(&file.path, Problem::InputAndOutput { name }));
        }
        let (inputs, outputs, rows) = by_rows(&file.header, inputs, outputs);
        let names = [&inputs, &outputs]
            .map(|columns| columns.iter().map(|column| file.header[*column].clone()).collect());
        Ok(Self { inputs, outputs, names, rows })
    }
}

/// Lines of a file that a data set uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Indices (from 0) of the lines used, and their numbers in the file (from 1).
    pub lines: Vec<usize>,
    pub numbers: Vec<u64>,
    /// Number of lines in the file.
    pub of: usize,
    /// Lines that are not used.
    pub left_out: LeftOut,
}

/// Lines of a file that cannot be used, by reason.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct LeftOut {
    /// Number of lines that lack a reading.
    pub without_reading: usize,
    /// Number of lines that have all readings and no output.
    pub without_output: usize,
    /// The three columns that lack the most values, with how many they lack.
    pub missing_most: Vec<(String, usize)>,
    /// Lines of the file that are cut or garbled.
    pub unreadable: Option<Unreadable>,
}

impl LeftOut {
    /// Number of all lines that are left out for a missing value.
    pub fn lines(&self) -> usize {
        self.without_reading + self.without_output
    }
}

/// Inputs that can tell nothing, and are left out of a model.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct UnusedInputs {
    /// Columns without a value in more than half of the lines.
    pub dead: Vec<String>,
    /// Columns that never change.
    pub constant: Vec<String>,
    /// Columns that change between two values, whatever the outputs and the other inputs are.
    pub flickering: Vec<String>,
    /// Columns whose every value is that of another one, with the name of that one.
    pub duplicated: Vec<(String, String)>,
}

impl UnusedInputs {
    /// Inputs of `file` that can tell nothing, among those that match the pattern. There are none if no other input
    /// would be left, or if there is a network for each row-wire: rows have equally many readings.
    ///
    /// # Errors
    /// As [`Dataset::from_file`].
    pub fn find(file: &DataFile, inputs: Option<&str>, outputs: Option<&str>) -> Result<Self> {
        let columns = chosen(file, inputs, Role::Inputs)?;
        let (columns, outputs, rows) =
            by_rows(&file.header, columns, chosen(file, outputs, Role::Outputs)?);
        if rows > 1 {
            return Ok(Self::default());
        }
        let mut unused = Self::among(file, columns.iter().copied());
        let named = unused.names();
        let mut used = columns;
        used.retain(|it| !named.contains(&file.header[*it]));
        let others = [&used[..], &outputs].concat();
        let flickering = used.iter().filter(|column| flickers(file, **column, &others));
        let flickering: Vec<String> = flickering.map(|it| file.header[*it].clone()).collect();
        if flickering.len() < used.len() {
            unused.flickering = flickering;
        }
        Ok(unused)
    }

    /// Columns of `file`, among these, that can tell nothing. There are none if no other would be left.
    pub fn among(file: &DataFile, columns: impl IntoIterator<Item = usize>) -> Self {
        let mut unused = Self::default();
        // Columns by a hash of their values, so that equal ones are found by looking each one up.
        let mut known: HashMap<u64, Vec<usize>> = HashMap::new();
        let bits = |column| (0..file.lines()).map(move |line| file.value(line, column).to_bits());
        for column in columns {
            let name = &file.header[column];
            let values = bits(column).map(f64::from_bits);
            let mut told = values.clone().filter(|value| !value.is_nan());
            let first = told.next();
            if 2 * values.filter(|value| value.is_nan()).count() > file.lines() {
                unused.dead.push(name.clone());
            } else if told.all(|value| first.is_none_or(|first| value.total_cmp(&first).is_eq())) {
                unused.constant.push(name.clone());
            } else {
                let mut hasher = DefaultHasher::new();
                bits(column).for_each(|value| hasher.write_u64(value));
                let alike = known.entry(hasher.finish()).or_default();
                match alike.iter().find(|other| bits(**other).eq(bits(column))) {
                    Some(other) => {
                        unused.duplicated.push((name.clone(), file.header[*other].clone()));
                    }
                    None => alike.push(column),
                }
            }
        }
        if known.is_empty() { Self::default() } else { unused }
    }

    /// Names of all of them.
    pub fn names(&self) -> Vec<String> {
        let duplicated = self.duplicated.iter().map(|(name, _)| name);
        let others = self.constant.iter().chain(&self.flickering);
        self.dead.iter().chain(others).chain(duplicated).cloned().collect()
    }
}

/// Whether a column of `file` has two values, and none of the `others` is correlated with it by more than five standard
/// errors.
fn flickers(file: &DataFile, column: usize, others: &[usize]) -> bool {
    const FEWEST_LINES: usize = 100;
    const STANDARD_ERRORS: f64 = 5.0;
    let values = |column| (0..file.lines()).map(move |line| file.value(line, column));
    let mut found: Vec<f64> = vec![];
    for value in values(column).filter(|value| !value.is_nan()) {
        if !found.contains(&value) {
            found.push(value);
        }
        if found.len() > 2 {
            return false;
        }
    }
    let is_related = |other: &usize| {
        let pairs = values(column).zip(values(*other));
        let pairs: Vec<_> = pairs.filter(|(a, b)| !(a * b).is_nan()).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| {
            pairs.iter().map(of).sum::<f64>() / pairs.len() as f64
        };
        let (a, b) = (mean(&|it| it.0), mean(&|it| it.1));
        let covariance = mean(&|it| (it.0 - a) * (it.1 - b));
        let variances = mean(&|it| (it.0 - a).powi(2)) * mean(&|it| (it.1 - b).powi(2));
        let bound = STANDARD_ERRORS * STANDARD_ERRORS / pairs.len() as f64;
        *other != column && covariance * covariance > bound * variances
    };
    file.lines() >= FEWEST_LINES && found.len() == 2 && !others.iter().any(is_related)
}

/// Indices of the columns of `file` that match `pattern`, or that have the project's own names.
fn chosen(file: &DataFile, pattern: Option<&str>, role: Role) -> Result<Vec<usize>> {
    let usual = match role {
        Role::Inputs => USUAL_INPUTS,
        Role::Outputs => "r*e*_d?_mm,r*e*_f?_n,contact_*",
    };
    let selected = columns::select(&file.header, pattern.unwrap_or(usual));
    let unmatched = pattern.and_then(|pattern| columns::unmatched(&file.header, pattern));
    if let (Some(glob), Some(pattern)) = (unmatched, pattern) {
        let known = columns::known_names(&file.header, glob);
        let (glob, pattern) = (glob.into(), pattern.into());
        let problem = Problem::NoMatch { role, glob, pattern, known };
        return Err(Error::file(&file.path, problem));
    }
    if selected.is_empty() {
        let known = columns::some_names(&file.header);
        let problem = match pattern {
            Some(pattern) => Problem::AllLeftOut { role, pattern: pattern.into() },
            None => Problem::NoUsualNames { role, pattern: usual.into(), known },
        };
        return Err(Error::file(&file.path, problem));
    }
    file.check_numbers(&selected)?;
    Ok(selected)
}

/// The three columns of `file` that lack the most values, of inputs and outputs.
fn missing_most(file: &DataFile, inputs: &[usize], outputs: &[usize]) -> Vec<(String, usize)> {
    let count = |column: &usize| {
        let missing = (0..file.lines()).filter(|line| file.value(*line, *column).is_nan()).count();
        (file.header[*column].clone(), missing)
    };
    let mut counts: Vec<_> = inputs.iter().chain(outputs).map(count).collect();
    counts.retain(|(_, missing)| *missing > 0);
    counts.sort_by_key(|(_, missing)| std::cmp::Reverse(*missing));
    counts.truncate(3);
    counts
}

/// Orders columns by row-wire and counts the rows, if every column names one and all rows have equally
/// many. Otherwise leaves the order as it is, as one row.
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

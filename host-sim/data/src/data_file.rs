//! Data files: text of any dialect, packed by gzip or not.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::columns;
use crate::digest;
use crate::error::{Error, Problem, Result};
use crate::input::{MOST_DATA_BYTES, Source};

pub mod time;
pub mod csv;
mod blocks;
mod dialect;

pub use blocks::BLOCK;
pub use dialect::{Separator, Stated};

/// Data file that was read: named columns of numbers, one frame a line.
///
/// Missing values are held as NaN: empty fields, words such as N/A, and NaN. Time stamps by ISO 8601 are seconds since 1970. Other text is NaN too, and an error once its column is asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DataFile {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// Column names: the file's own, or `c1`, `c2`, … for a file that names none.
    pub header: Vec<String>,
    pub names_columns: bool,
    /// Whether it is a CSV file without an end of its last line, which may be cut off in a number.
    pub lacks_last_line_end: bool,
    /// Lines that are cut or garbled, and are skipped.
    pub unreadable: Option<Unreadable>,
    /// What is not plain CSV in it, in words, such as "semicolons, decimal commas"; "" for a plain file.
    pub found: String,
    /// Lines of data (from 0) that are kept.
    pub(crate) kept: Range<usize>,
    /// Values of all lines, those that are not kept included, one line after the other.
    pub values: Vec<f64>,
    /// Line number in the file (from 1) of each line of data, of all.
    pub(crate) line_numbers: Vec<u64>,
    /// Fields of a CSV file, if they are wanted as they are written.
    pub(crate) texts: Option<Texts>,
    /// Columns of a text file that hold other text than numbers.
    pub(crate) not_numbers: Vec<NotNumbers>,
}

/// Field of a column that is no number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NotNumbers {
    column: usize,
    /// Number of the first line with one, and that field.
    line: u64,
    field: String,
}

impl NotNumbers {
    /// The problem that it is in a file with this `header`.
    fn problem(&self, header: &[String]) -> Problem {
        let (column, field) = (header[self.column].clone(), self.field.clone());
        Problem::NotANumber { line: self.line, column, field }
    }
}

/// Lines of a file that are cut or garbled: they have fewer or more fields than the others, or text in a column of numbers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unreadable {
    pub lines: usize,
    /// Where the first one is, and what is wrong with it.
    pub first: String,
}

/// Fields as they are written, line after line, without spaces around.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Texts {
    text: String,
    /// Where each field ends in the text.
    ends: Vec<usize>,
}

/// One column's fields, as text.
#[derive(Debug, Clone, Copy)]
pub struct FieldTexts<'f> {
    file: &'f DataFile,
    column: usize,
}

impl<'f> FieldTexts<'f> {
    /// Field at `line` (from 0, header not counted); "" if the value is missing.
    ///
    /// # Panics
    /// If the file has no such line.
    pub fn at(&self, line: usize) -> Cow<'f, str> {
        let value = self.file.value(line, self.column);
        let is_text = || self.file.not_numbers.iter().any(|it| it.column == self.column);
        match &self.file.texts {
            _ if value.is_nan() && !is_text() => Cow::Borrowed(""),
            Some(Texts { text, ends }) => {
                let field = (self.file.kept.start + line) * self.file.header.len() + self.column;
                let start = field.checked_sub(1).map_or(0, |before| ends[before]);
                Cow::Borrowed(&text[start..ends[field]])
            }
            None => Cow::Owned(value.to_string()),
        }
    }
}

/// How a data file is read.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// Whether the first line of a CSV file is a header even if it holds numbers alone.
    pub has_header: bool,
    /// Whether [`DataFile::texts`] gives the fields of a CSV file as they are written. This takes the memory of the file,
    /// and 8 bytes a field.
    pub keeps_text: bool,
    /// Whether a line that is cut or garbled is an error. Otherwise it is skipped, if no more than 5 % of lines are.
    pub is_strict: bool,
    /// What is stated of a text file, in place of what is found.
    pub stated: Stated,
}

impl DataFile {
    /// Reads the text file at `path`.
    ///
    /// Separator, decimal sign, encoding, comments and a line of units are found. The first line of a text file is a
    /// header, unless it holds numbers alone: it is data then, and columns are called `c1`, `c2`, …
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read. [`Error::File`] for a file beyond
    /// [`MOST_DATA_BYTES`], packed or not, an empty file, a repeated column name, or if more than 5 % of lines are
    /// [unreadable](Unreadable); for text that can be read in two ways, and for files that hold no text.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_as(path, &Reading::default())
    }

    /// Reads the file at `path` as [`read`](Self::read) does, but for what `reading` says.
    pub fn read_as(path: &Path, reading: &Reading) -> Result<Self> {
        csv::parse(Source::open(path, MOST_DATA_BYTES)?, reading)
    }

    /// Parses `bytes` as [`read_as`](Self::read_as) does those of the file at `path`.
    pub fn parse(path: &Path, bytes: &[u8], reading: &Reading) -> Result<Self> {
        csv::parse(Source::of_bytes(path, bytes), reading)
    }

    /// A table that was read otherwise, from the file at `path`: columns called `header`, and their `values` line after line.
    ///
    /// # Errors
    /// [`Error::File`] if there is no value, one that is infinite, or a name with a control character.
    ///
    /// # Panics
    /// If `header` is empty.
    pub fn of_table(path: &Path, header: Vec<String>, values: Vec<f64>) -> Result<Self> {
        if values.is_empty() {
            return Err(Error::file(path, Problem::NoLines));
        }
        if let Some(place) = header.iter().position(|name| name.contains(char::is_control)) {
            let problem = Problem::UnusableName { column: place + 1, name: header[place].clone() };
            return Err(Error::file(path, problem));
        }
        if let Some(place) = values.iter().position(|value| value.is_infinite()) {
            let (line, column) = (place / header.len(), place % header.len());
            let problem =
                Problem::Infinite { line: line as u64 + 1, column: header[column].clone() };
            return Err(Error::file(path, problem));
        }
        let kept = 0..values.len() / header.len();
        let (path, line_numbers) = (path.into(), (1..=kept.len() as u64).collect());
        Ok(Self {
            path,
            header,
            names_columns: true,
            kept,
            values,
            line_numbers,
            ..Self::default()
        })
    }

    /// Puts `what` is not plain before what was found.
    fn add_found(&mut self, what: &str) {
        let words = [what, &self.found].into_iter().filter(|words| !words.is_empty());
        self.found = words.collect::<Vec<_>>().join(", ");
    }

    /// Turns every value equal to `code` into a missing one; returns how many there were.
    pub fn mark_missing(&mut self, code: f64) -> usize {
        let mut marked = 0;
        for value in self.values.iter_mut().filter(|value| **value == code) {
            *value = f64::NAN;
            marked += 1;
        }
        marked
    }

    /// Turns the values in these `lines` (from 0) and `columns` into missing ones.
    ///
    /// # Panics
    /// If the file has no such line.
    pub fn forget(&mut self, lines: &[usize], columns: &[usize]) {
        for line in lines {
            let first = (self.kept.start + line) * self.header.len();
            columns.iter().for_each(|column| self.values[first + column] = f64::NAN);
        }
    }

    /// Keeps the lines of data in `range` (from 0) alone.
    ///
    /// # Panics
    /// If there are no such lines.
    pub fn keep_lines(&mut self, range: Range<usize>) {
        assert!(range.start <= range.end && range.end <= self.lines(), "{range:?}");
        self.kept = self.kept.start + range.start..self.kept.start + range.end;
    }

    /// Values of these `lines` (from 0, ascending) in each of the lists of `columns`, as tables of `lines × columns`. The
    /// file's memory is given back step by step, so that it never takes that of the tables besides its own.
    ///
    /// # Panics
    /// If the file has no such line or column.
    pub(crate) fn into_tables(mut self, lines: &[usize], columns: [&[usize]; 2]) -> [Vec<f64>; 2] {
        const STEPS: usize = 16;
        let mut tables = columns.map(|it| vec![0.0; lines.len() * it.len()]);
        let mut first = lines.len();
        for some in lines.rchunks(lines.len().div_ceil(STEPS).max(1)) {
            first -= some.len();
            for (table, columns) in tables.iter_mut().zip(columns) {
                let values = some.iter().flat_map(|l| columns.iter().map(|c| self.value(*l, *c)));
                let places = table[first * columns.len()..].iter_mut();
                places.zip(values).for_each(|(place, value)| *place = value);
            }
            self.values.truncate((self.kept.start + some[0]) * self.header.len());
            self.values.shrink_to_fit();
        }
        tables
    }

    /// Lines of data that are not kept, each a slice of one value a column.
    pub fn lines_left_out(&self) -> impl Iterator<Item = &[f64]> {
        let lines = self.values.chunks_exact(self.header.len()).enumerate();
        lines.filter(|(line, _)| !self.kept.contains(line)).map(|(_, values)| values)
    }

    /// Number of lines of data.
    pub fn lines(&self) -> usize {
        self.kept.len()
    }

    /// Value at `line` (from 0, header not counted) and `column` (from 0); NaN if missing.
    ///
    /// # Panics
    /// If the file has no such line.
    pub fn value(&self, line: usize, column: usize) -> f64 {
        self.values[(self.kept.start + line) * self.header.len() + column]
    }

    /// Fields of this `column` (from 0): as they are written, without spaces around, in a CSV file that was read with its
    /// text; otherwise the shortest digits of their numbers.
    pub fn texts(&self, column: usize) -> FieldTexts<'_> {
        FieldTexts { file: self, column }
    }

    /// Number in the file (from 1, header included) of the line of data `line` (from 0), for messages.
    pub fn line_number(&self, line: usize) -> u64 {
        self.line_numbers[self.kept.start + line]
    }

    /// Index (from 0) of the column of numbers called `name`, or so but for a unit in brackets. A cell of a
    /// [mat](crate::mat), `r2c1_adc_16`, is also found by the file's own name for it, `adc_16`.
    pub fn column(&self, name: &str) -> Result<usize> {
        let column = self.column_of_any(name)?;
        self.check_numbers(&[column])?;
        Ok(column)
    }

    /// Index (from 0) of the column called `name`, which may hold text.
    pub fn column_of_any(&self, name: &str) -> Result<usize> {
        let place = |name: &str| columns::place(&self.header, name);
        let own = || columns::cell_of(name).filter(|(_, own)| *own != "ohm");
        place(name).or_else(|| place(own()?.1)).ok_or_else(|| {
            let known = columns::known_names(&self.header, name);
            Error::file(&self.path, Problem::MissingColumn { name: name.into(), known })
        })
    }

    /// Digest of the numbers in the columns called `names`, of all lines of the file.
    pub fn digest(&self, names: &[&str]) -> Result<u64> {
        let columns = self.columns(names.iter().copied())?;
        let lines = self.values.chunks_exact(self.header.len());
        let values = lines.flat_map(|line| columns.iter().map(|column| line[*column]));
        Ok(digest::of_table(names, values))
    }

    /// Checks that these columns (from 0) hold nothing but numbers.
    pub fn check_numbers(&self, columns: &[usize]) -> Result<()> {
        let Some(found) = self.not_numbers.iter().find(|it| columns.contains(&it.column)) else {
            return Ok(());
        };
        Err(Error::file(&self.path, found.problem(&self.header)))
    }

    /// Indices (from 0) of the columns called `names`.
    pub fn columns<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Result<Vec<usize>> {
        names.into_iter().map(|name| self.column(name)).collect()
    }
}

/// Names `c1`, `c2`, … of columns without names.
fn numbered(columns: usize) -> Vec<String> {
    (1..=columns).map(|column| format!("c{column}")).collect()
}

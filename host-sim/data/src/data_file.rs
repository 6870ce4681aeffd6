//! Data files, read whole: CSV, `.npy` and `.npz`.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::columns;
use crate::error::{Error, Problem, Result};
use crate::input;

mod csv;
mod npy;
pub mod pieces;

/// Largest magnitude up to which f64 holds every whole number: 2^53.
pub(crate) const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Data file that was read whole: named columns of numbers, one frame a line.
///
/// Missing values are held as NaN: empty fields and NaN of a CSV file, NaN of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct DataFile {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// Column names: the file's own, or `c1`, `c2`, … for a file that names none.
    pub header: Vec<String>,
    pub names_columns: bool,
    /// Whether it is a CSV file without an end of its last line, which may be cut off in a number.
    pub lacks_last_line_end: bool,
    /// CRC-64/XZ of the file's bytes.
    pub digest: u64,
    pub(crate) values: Vec<f64>,
    /// Line number in the file (from 1) of each line of data.
    pub(crate) line_numbers: Vec<u64>,
    /// Fields of a CSV file, if they are wanted as they are written.
    pub(crate) texts: Option<Texts>,
    /// Columns of integer arrays with numbers from 2^53 on, of which f64 does not hold every digit.
    pub(crate) rounded: Vec<usize>,
}

/// Fields as they are written, line after line, without spaces around.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Texts {
    text: String,
    /// Where the first field begins in the text, and where each ends.
    places: Vec<usize>,
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
        match &self.file.texts {
            _ if value.is_nan() => Cow::Borrowed(""),
            Some(Texts { text, places }) => {
                let field = line * self.file.header.len() + self.column;
                Cow::Borrowed(&text[places[field]..places[field + 1]])
            }
            None => Cow::Owned(value.to_string()),
        }
    }
}

/// How a data file is read.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// Whether the first line of a CSV file is a header even if it holds numbers alone.
    pub has_header: bool,
    /// Whether [`DataFile::texts`] gives the fields of a CSV file as they are written. This takes the memory of the file,
    /// and 8 bytes a field.
    pub keeps_text: bool,
}

impl DataFile {
    /// Reads the file at `path`: an array for the extension `.npy`, arrays side by side for `.npz`, else CSV.
    ///
    /// The first line of a CSV file is a header, unless it holds numbers alone: it is data then, and columns are called
    /// `c1`, `c2`, …
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read. [`Error::File`] for a file beyond
    /// [`input::MOST_DATA_BYTES`], an empty file, a missing or
    /// repeated column name, a line with too few or too many fields, or a field that is not a number. Also for arrays
    /// of more than two dimensions, of other elements than numbers, or of different lengths.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_as(path, Reading::default())
    }

    /// Reads the file at `path` as [`read`](Self::read) does, but for what `reading` says.
    pub fn read_as(path: &Path, reading: Reading) -> Result<Self> {
        let bytes = input::read(path, input::MOST_DATA_BYTES)?;
        let mut file = Self::parse(path, &bytes, reading.has_header)?;
        let is_array = ["npy", "npz"].into_iter().any(|kind| has_extension(path, kind));
        if reading.keeps_text && !is_array {
            file.texts = Some(csv::texts(&file, &bytes));
        }
        Ok(file)
    }

    /// Parses `bytes` as [`read`](Self::read) does those of the file at `path`, whose extension tells what they are. The
    /// first line of a CSV file is a header even if it holds numbers alone, if it `has_header`.
    pub fn parse(path: &Path, bytes: &[u8], has_header: bool) -> Result<Self> {
        if has_extension(path, "npy") {
            npy::parse_array(path, bytes)
        } else if has_extension(path, "npz") {
            npy::parse_archive(path, bytes)
        } else {
            csv::parse(path, bytes, has_header, 0)
        }
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

    /// Keeps the lines of data in `range` (from 0) alone.
    ///
    /// # Panics
    /// If there are no such lines.
    pub fn keep_lines(&mut self, range: Range<usize>) {
        let columns = self.header.len();
        let fields = range.start * columns..range.end * columns;
        if let Some(texts) = &mut self.texts {
            texts.places = texts.places[fields.start..=fields.end].to_vec();
        }
        self.values = self.values[fields].to_vec();
        self.line_numbers = self.line_numbers[range].to_vec();
    }

    /// Lines of data in turn, each a slice of one value a column.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.header.len())
    }

    /// Values at `line` (from 0, header not counted), one a column.
    ///
    /// # Panics
    /// If the file has no such line.
    pub fn row(&self, line: usize) -> &[f64] {
        let columns = self.header.len();
        &self.values[line * columns..(line + 1) * columns]
    }

    /// Number of lines of data.
    pub fn lines(&self) -> usize {
        self.values.len() / self.header.len()
    }

    /// Value at `line` (from 0, header not counted) and `column` (from 0); NaN if missing.
    ///
    /// # Panics
    /// If the file has no such line.
    pub fn value(&self, line: usize, column: usize) -> f64 {
        self.values[line * self.header.len() + column]
    }

    /// Fields of this `column` (from 0): as they are written, without spaces around, in a CSV file that was read with its
    /// text; otherwise the shortest digits of their numbers.
    ///
    /// # Errors
    /// [`Error::File`] for whole numbers of an array that are too large for f64: it lost some of their digits.
    pub fn texts(&self, column: usize) -> Result<FieldTexts<'_>> {
        if self.rounded.contains(&column) {
            let column = self.header[column].clone();
            return Err(Error::file(&self.path, Problem::RoundedIntegers { column }));
        }
        Ok(FieldTexts { file: self, column })
    }

    /// Number in the file (from 1, header included) of the line of data `line` (from 0), for messages.
    pub fn line_number(&self, line: usize) -> u64 {
        self.line_numbers[line]
    }

    /// Index (from 0) of the column called `name`. A cell of a [mat](crate::mat), `r2c1_adc_16`, is also found by the
    /// file's own name for it, `adc_16`.
    pub fn column(&self, name: &str) -> Result<usize> {
        let place = |name: &str| self.header.iter().position(|n| n == name);
        let own = || columns::cell_of(name).filter(|(_, own)| *own != "ohm");
        place(name).or_else(|| place(own()?.1)).ok_or_else(|| {
            let known = columns::some_names(&self.header);
            Error::file(&self.path, Problem::MissingColumn { name: name.into(), known })
        })
    }

    /// Indices (from 0) of the columns called `names`.
    pub fn columns<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Result<Vec<usize>> {
        names.into_iter().map(|name| self.column(name)).collect()
    }
}

fn has_extension(path: &Path, kind: &str) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case(kind))
}

/// Names `c1`, `c2`, … of columns without names.
fn numbered(columns: usize) -> Vec<String> {
    (1..=columns).map(|column| format!("c{column}")).collect()
}

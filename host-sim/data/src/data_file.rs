//! Data files, read whole: CSV, `.npy` and `.npz`.

use std::path::{Path, PathBuf};

use crate::columns;
use crate::error::{Error, Problem, Result};
use crate::input;

mod csv;
mod npy;
pub mod pieces;

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
        Self::parse(path, &input::read(path, input::MOST_DATA_BYTES)?, false)
    }

    /// Reads the file at `path` as [`read`](Self::read) does, but for the first line of a CSV file: it is a header even
    /// if it holds numbers alone.
    pub fn read_with_header(path: &Path) -> Result<Self> {
        Self::parse(path, &input::read(path, input::MOST_DATA_BYTES)?, true)
    }

    /// Parses `bytes` as [`read`](Self::read) does those of the file at `path`, whose extension tells what they are. The
    /// first line of a CSV file is a header even if it holds numbers alone, if it `has_header`.
    pub fn parse(path: &Path, bytes: &[u8], has_header: bool) -> Result<Self> {
        let ends_in =
            |kind: &str| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(kind));
        if ends_in("npy") {
            npy::parse_array(path, bytes)
        } else if ends_in("npz") {
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
    pub fn keep_lines(&mut self, range: std::ops::Range<usize>) {
        let columns = self.header.len();
        self.values = self.values[range.start * columns..range.end * columns].to_vec();
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

    /// Number in the file (from 1, header included) of the line of data `line` (from 0), for messages.
    pub fn line_number(&self, line: usize) -> u64 {
        self.line_numbers[line]
    }

    /// Index (from 0) of the column called `name`.
    pub fn column(&self, name: &str) -> Result<usize> {
        self.header.iter().position(|n| n == name).ok_or_else(|| {
            let known = columns::some_names(&self.header);
            Error::file(&self.path, Problem::MissingColumn { name: name.into(), known })
        })
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

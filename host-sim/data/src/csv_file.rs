//! CSV files: a header of names, then one frame a line.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::columns;
use crate::error::{Error, Problem, Result};

mod body;
mod write;

pub use write::write;

/// CSV file that was read whole. Empty fields and NaN are missing values, held as NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct CsvFile {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// Column names.
    pub header: Vec<String>,
    /// CRC-64/XZ of the file's bytes.
    pub digest: u64,
    values: Vec<f64>,
    /// Line number in the file (from 1) of each line of data.
    line_numbers: Vec<u64>,
}

impl CsvFile {
    /// Reads the CSV file at `path`.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read. [`Error::File`] for an empty file, a missing or
    /// repeated column name, a line with too few or too many fields, or a field that is not a number.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|cause| Error::read(path, cause))?;
        Self::parse(path, &bytes)
    }

    /// Parses the bytes of a CSV file; `path` names it in messages.
    ///
    /// # Errors
    /// [`Error::File`] for content that [`read`](Self::read) rejects.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let error = |problem| Error::file(path, problem);
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
        let header =
            reader.headers().map_err(|e| error(Problem::Header { cause: e.to_string() }))?;
        let header: Vec<String> = header.iter().map(|name| name.trim().to_owned()).collect();
        if header.is_empty() {
            return Err(error(Problem::Empty));
        }
        if header.len() == 1
            && let Some(line) = blank_line(bytes)
        {
            return Err(error(Problem::BlankLine { line }));
        }
        let mut seen = HashSet::new();
        for (index, name) in header.iter().enumerate() {
            let column = index + 1;
            if name.is_empty() || name.contains(char::is_control) {
                return Err(error(Problem::UnusableName { column, name: name.clone() }));
            }
            if !seen.insert(name) {
                return Err(error(Problem::RepeatedName { name: name.clone() }));
            }
        }
        let lines = lines_of_data(bytes, reader.position());
        let (digest, values) = rayon::join(
            || crate::digest::digest(bytes),
            || lines.and_then(|(_, lines)| body::read(lines, header.len())),
        );
        if let (Some((first, _)), Some(values)) = (lines, values)
            && !values.is_empty()
        {
            let line_numbers = (first..).take(values.len() / header.len()).collect();
            return Ok(Self { path: path.into(), header, digest, values, line_numbers });
        }
        let (values, line_numbers) = Self::read_carefully(path, bytes, &mut reader, &header)?;
        Ok(Self { path: path.into(), header, digest, values, line_numbers })
    }

    /// Reads the lines after the header one by one, quotes and blank lines included.
    fn read_carefully(
        path: &Path,
        bytes: &[u8],
        reader: &mut csv::Reader<&[u8]>,
        header: &[String],
    ) -> Result<(Vec<f64>, Vec<u64>)> {
        let error = |problem| Error::file(path, problem);
        let mut values = Vec::new();
        let mut line_numbers = Vec::new();
        let mut lines = LineCount { bytes, at: 0, line: 1 };
        let mut record = csv::ByteRecord::new();
        let read_error = |e: csv::Error| error(Problem::Line { cause: e.to_string() });
        while reader.read_byte_record(&mut record).map_err(read_error)? {
            let line = lines.of_record_at(record.position().map_or(0, csv::Position::byte));
            if record.len() != header.len() {
                let (fields, columns) = (record.len(), header.len());
                return Err(error(Problem::FieldCount { line, fields, columns }));
            }
            for (field, name) in record.iter().zip(header) {
                let value = number(field).ok_or_else(|| {
                    let field = String::from_utf8_lossy(field).into_owned();
                    error(Problem::NotANumber { line, column: name.clone(), field })
                })?;
                values.push(value);
            }
            line_numbers.push(line);
        }
        if values.is_empty() {
            return Err(error(Problem::NoLines));
        }
        Ok((values, line_numbers))
    }

    /// Number of lines of data.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.values.len() / self.header.len()
    }

    /// Value at `line` (from 0, header not counted) and `column` (from 0); NaN if missing.
    ///
    /// # Panics
    /// If the file has no such line.
    #[must_use]
    pub fn value(&self, line: usize, column: usize) -> f64 {
        self.values[line * self.header.len() + column]
    }

    /// Number in the file (from 1, header included) of the line of data `line` (from 0), for messages.
    #[must_use]
    pub fn line_number(&self, line: usize) -> u64 {
        self.line_numbers[line]
    }

    /// Index (from 0) of the column called `name`.
    ///
    /// # Errors
    /// [`Error::File`] if there is no such column.
    pub fn column(&self, name: &str) -> Result<usize> {
        self.header.iter().position(|n| n == name).ok_or_else(|| {
            let known = columns::some_names(&self.header);
            Error::file(&self.path, Problem::MissingColumn { name: name.into(), known })
        })
    }

    /// Indices (from 0) of the columns called `names`.
    ///
    /// # Errors
    /// [`Error::File`] for the first name without a column.
    pub fn columns<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Result<Vec<usize>> {
        names.into_iter().map(|name| self.column(name)).collect()
    }
}

/// Count of lines; the CSV reader's own count is one short where lines end in CR LF.
struct LineCount<'b> {
    bytes: &'b [u8],
    at: usize,
    line: u64,
}

impl LineCount<'_> {
    /// Number (from 1) of the line on which the record after byte `position` begins. `position` never
    /// decreases.
    fn of_record_at(&mut self, position: u64) -> u64 {
        let is_end = |byte: u8| matches!(byte, b'\r' | b'\n');
        while let Some(&byte) = self.bytes.get(self.at)
            && ((self.at as u64) < position || is_end(byte))
        {
            self.at += 1;
            let ends = byte == b'\n' || byte == b'\r' && self.bytes.get(self.at) != Some(&b'\n');
            self.line += u64::from(ends);
        }
        self.line
    }
}

/// Number (from 1) of the first line after the header, and those lines; `None` where the header's end is
/// not certain.
fn lines_of_data<'b>(bytes: &'b [u8], position: &csv::Position) -> Option<(u64, &'b [u8])> {
    let (header, lines) = bytes.split_at_checked(usize::try_from(position.byte()).ok()?)?;
    let (end, lines) = match (header.last()?, lines.strip_prefix(b"\n")) {
        (b'\n', _) => (0, lines),
        (b'\r', Some(lines)) => (1, lines),
        _ => return None,
    };
    let ended = memchr::memchr_iter(b'\n', header).count() + end;
    Some((ended as u64 + 1, lines))
}

/// Number (from 1) of the first blank line that a line of text follows.
fn blank_line(bytes: &[u8]) -> Option<usize> {
    let is_blank = |line: &[u8]| line.iter().all(u8::is_ascii_whitespace);
    let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    let last = lines.iter().rposition(|line| !is_blank(line))?;
    lines[..last].iter().position(|line| is_blank(line)).map(|index| index + 1)
}

/// Number in a field; NaN if it is empty or NaN. `None` for text and infinities.
fn number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.trim();
    if text.is_empty() {
        return Some(f64::NAN);
    }
    text.parse::<f64>().ok().filter(|value| !value.is_infinite())
}

#[cfg(test)]
mod tests;

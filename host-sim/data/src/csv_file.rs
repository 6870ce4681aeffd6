//! CSV files: a header of names, then one frame a line.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::columns;
use crate::error::{Error, Problem, Result};

mod body;
mod write;

pub use write::write;

/// A CSV file, read whole. Empty fields and NaN are missing values, held as NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct CsvFile {
    /// Where it came from.
    pub path: PathBuf,
    /// Column names.
    pub header: Vec<String>,
    /// CRC-64/XZ of the file.
    pub digest: u64,
    values: Vec<f64>,
    /// Where each line of data stands in the file, from 1.
    line_numbers: Vec<u64>,
}

impl CsvFile {
    /// Reads `path`.
    ///
    /// # Errors
    /// [`Error::Read`], or [`Error::File`] for an empty file, a name that is missing or stands
    /// twice, a line with too few or too many fields, or a field that is no number.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|cause| Error::read(path, cause))?;
        Self::parse(path, &bytes)
    }

    /// Reads the file's content; `path` names it in messages.
    ///
    /// # Errors
    /// [`Error::File`], as [`read`](Self::read).
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

    /// Reads the lines after the header one by one, whatever they hold.
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

    /// Lines of data.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.values.len() / self.header.len()
    }

    /// The value at `line` (from 0, header not counted) and `column`; NaN if missing.
    #[must_use]
    pub fn value(&self, line: usize, column: usize) -> f64 {
        self.values[line * self.header.len() + column]
    }

    /// Where `line` (from 0) stands in the file, from 1 and with the header, for messages.
    #[must_use]
    pub fn line_number(&self, line: usize) -> u64 {
        self.line_numbers[line]
    }

    /// The place of the column called `name`.
    ///
    /// # Errors
    /// [`Error::File`] if there is none.
    pub fn column(&self, name: &str) -> Result<usize> {
        self.header.iter().position(|n| n == name).ok_or_else(|| {
            let known = columns::some_names(&self.header);
            Error::file(&self.path, Problem::MissingColumn { name: name.into(), known })
        })
    }

    /// The places of the columns called `names`.
    ///
    /// # Errors
    /// [`Error::File`] for the first that is missing.
    pub fn columns<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Result<Vec<usize>> {
        names.into_iter().map(|name| self.column(name)).collect()
    }
}

/// Counts lines; the CSV reader's own count is one short where lines end in CR LF.
struct LineCount<'b> {
    bytes: &'b [u8],
    at: usize,
    line: u64,
}

impl LineCount<'_> {
    /// The line (from 1) of the record that follows byte `position`, which never decreases.
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

/// The number (from 1) of the first line after the header, and the lines; nothing where they cannot be
/// told from the header.
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

/// The first blank line (from 1) that is followed by another that is not.
fn blank_line(bytes: &[u8]) -> Option<usize> {
    let is_blank = |line: &[u8]| line.iter().all(u8::is_ascii_whitespace);
    let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    let last = lines.iter().rposition(|line| !is_blank(line))?;
    lines[..last].iter().position(|line| is_blank(line)).map(|index| index + 1)
}

/// A field's number: infinities and text are none; empty and NaN are missing.
fn number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.trim();
    if text.is_empty() {
        return Some(f64::NAN);
    }
    text.parse::<f64>().ok().filter(|value| !value.is_infinite())
}

#[cfg(test)]
mod tests;

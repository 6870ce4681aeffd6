//! CSV files: a header of names, then one frame a line. Files without a header are recognised.

use std::collections::HashSet;
use std::path::Path;

use super::{DataFile, Texts, numbered};
use crate::error::{Error, Problem, Result};

mod body;

/// Parses the bytes of a CSV file; `path` names it in messages. The first line is a header even if it holds numbers
/// alone, if it `has_header`. Lines are numbered as if so many came `before`.
pub(super) fn parse(path: &Path, bytes: &[u8], has_header: bool, before: u64) -> Result<DataFile> {
    let error = |problem| Error::file(path, problem);
    let text = without_mark(bytes);
    let mut reader = reader(text, true);
    let header = reader.headers().map_err(|e| error(Problem::Header { cause: cause_of(&e) }))?;
    let header: Vec<String> = header.iter().map(|name| name.trim().to_owned()).collect();
    if header.is_empty() {
        return Err(error(Problem::Empty));
    }
    if let [only] = &header[..]
        && let Some(separator) = only.chars().find(|c| matches!(c, ';' | '\t'))
    {
        return Err(error(Problem::Separator { separator }));
    }
    if header.len() == 1
        && let Some(line) = blank_line(text)
    {
        return Err(error(Problem::BlankLine { line: line + before as usize }));
    }
    let names_columns = has_header || !holds_numbers(&header);
    let (header, lines) = if names_columns {
        check_names(&header).map_err(error)?;
        let lines = lines_of_data(text, reader.position());
        (header, lines)
    } else {
        reader = self::reader(text, false);
        (numbered(header.len()), Some((1, text)))
    };
    let (digest, values) = rayon::join(
        || crate::digest::digest(bytes),
        || lines.and_then(|(_, lines)| body::read(lines, header.len())),
    );
    let (values, line_numbers) = match (lines, values) {
        (Some((first, _)), Some(values)) if !values.is_empty() => {
            let line_numbers = (before + first..).take(values.len() / header.len()).collect();
            (values, line_numbers)
        }
        _ => read_carefully(path, text, &mut reader, &header, before)?,
    };
    let lacks_last_line_end = !matches!(text, [.., b'\n' | b'\r']);
    let path = path.into();
    Ok(DataFile {
        path,
        header,
        names_columns,
        lacks_last_line_end,
        digest,
        values,
        line_numbers,
        texts: None,
        rounded: vec![],
    })
}

/// `bytes` without a byte order mark.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Fields of `file`, which was parsed from `bytes`, as they are written.
pub(super) fn texts(file: &DataFile, bytes: &[u8]) -> Texts {
    let mut reader = reader(without_mark(bytes), file.names_columns);
    let (mut text, mut record) = (String::new(), csv::StringRecord::new());
    let mut places = Vec::with_capacity(file.values.len() + 1);
    places.push(0);
    // What was parsed has no error.
    while reader.read_record(&mut record).unwrap_or(false) {
        for field in &record {
            text += field.trim();
            places.push(text.len());
        }
    }
    Texts { text, places }
}

fn reader(text: &[u8], has_header: bool) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().flexible(true).has_headers(has_header).from_reader(text)
}

/// What is wrong, in short.
fn cause_of(error: &::csv::Error) -> String {
    match error.kind() {
        ::csv::ErrorKind::Utf8 { .. } => "it is no UTF-8 text".into(),
        _ => error.to_string(),
    }
}

/// Whether the fields of a first line are numbers, or empty, with a number among them: no header.
fn holds_numbers(fields: &[String]) -> bool {
    let numbers = || fields.iter().map(|field| number(field.as_bytes()));
    numbers().all(|number| number.is_some())
        && numbers().any(|number| number.is_some_and(|number| !number.is_nan()))
}

fn check_names(header: &[String]) -> std::result::Result<(), Problem> {
    let mut seen = HashSet::new();
    for (index, name) in header.iter().enumerate() {
        let column = index + 1;
        if name.is_empty() || name.contains(char::is_control) {
            return Err(Problem::UnusableName { column, name: name.clone() });
        }
        if !seen.insert(name) {
            return Err(Problem::RepeatedName { name: name.clone() });
        }
    }
    Ok(())
}

/// Reads the lines of data one by one, quotes and blank lines included.
fn read_carefully(
    path: &Path,
    bytes: &[u8],
    reader: &mut csv::Reader<&[u8]>,
    header: &[String],
    before: u64,
) -> Result<(Vec<f64>, Vec<u64>)> {
    let error = |problem| Error::file(path, problem);
    let mut values = Vec::new();
    let mut line_numbers = Vec::new();
    let mut lines = LineCount { bytes, at: 0, line: 1 };
    let mut record = csv::ByteRecord::new();
    let read_error = |e: csv::Error| error(Problem::Line { cause: cause_of(&e) });
    while reader.read_byte_record(&mut record).map_err(read_error)? {
        let line = before + lines.of_record_at(record.position().map_or(0, csv::Position::byte));
        if record.len() != header.len() {
            let (fields, columns) = (record.len(), header.len());
            return Err(error(if reader.has_headers() {
                Problem::FieldCount { line, fields, columns }
            } else {
                Problem::UnevenLine { line, fields, columns }
            }));
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
    let lines = match (header.last()?, lines.strip_prefix(b"\n")) {
        (b'\n', _) => lines,
        (b'\r', Some(lines)) => lines,
        _ => return None,
    };
    Some((LineCount { bytes, at: 0, line: 1 }.of_record_at(position.byte()), lines))
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

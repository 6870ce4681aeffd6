//! Text files: a header of names, then one frame a line. Files without a header are recognised.

use std::collections::HashSet;
use std::path::Path;

use super::dialect::Dialect;
use super::{DataFile, NotNumbers, Reading, Texts, numbered, time};
use crate::columns::some_names;
use crate::error::{Error, Problem, Result};

mod body;

/// Parses the bytes of a text file of any dialect; `path` names it in messages.
pub(super) fn parse(path: &Path, bytes: &[u8], reading: &Reading) -> Result<DataFile> {
    let error = |problem| Error::file(path, problem);
    let found = Dialect::find(bytes, reading.stated, reading.has_header);
    let (dialect, text) = found.map_err(error)?;
    let plain = dialect.to_plain(&text).map_err(error)?;
    let mut file = parse_plain(path, &plain, reading.has_header || dialect.has_names())?;
    file.add_found(&dialect.found);
    if reading.keeps_text {
        file.texts = Some(texts(&file, &plain));
    }
    Ok(file)
}

/// Parses plain CSV `text`. The first line is a header even if it holds numbers alone, if it `has_header`.
fn parse_plain(path: &Path, text: &[u8], has_header: bool) -> Result<DataFile> {
    let error = |problem| Error::file(path, problem);
    let mut reader = reader(text, true);
    let header = reader.headers().map_err(|e| error(Problem::Header { cause: cause_of(&e) }))?;
    let mut header: Vec<String> = header.iter().map(|name| name.trim().to_owned()).collect();
    if header.is_empty() {
        return Err(error(Problem::Empty));
    }
    if header.len() == 1
        && let Some(line) = blank_line(text)
    {
        return Err(error(Problem::BlankLine { line }));
    }
    let names_columns = has_header || !holds_numbers(&header);
    let mut found = String::new();
    let (header, lines) = if names_columns {
        let nameless = name_columns(&mut header).map_err(error)?;
        if !nameless.is_empty() {
            found = format!("columns without a name are called {}", some_names(&nameless));
        }
        let lines = lines_of_data(text, reader.position());
        (header, lines)
    } else {
        reader = self::reader(text, false);
        (numbered(header.len()), Some((1, text)))
    };
    let values = lines.and_then(|(_, lines)| body::read(lines, header.len()));
    let (values, line_numbers, not_numbers) = match (lines, values) {
        (Some((first, _)), Some(values)) if !values.is_empty() => {
            let line_numbers = (first..).take(values.len() / header.len()).collect();
            (values, line_numbers, vec![])
        }
        _ => read_carefully(path, text, &mut reader, &header)?,
    };
    let lacks_last_line_end = !matches!(text, [.., b'\n' | b'\r']);
    Ok(DataFile {
        kept: 0..line_numbers.len(),
        path: path.into(),
        header,
        names_columns,
        lacks_last_line_end,
        found,
        values,
        line_numbers,
        not_numbers,
        ..DataFile::default()
    })
}

/// Fields of `file`, which was parsed from plain `text`, as they are written there.
fn texts(file: &DataFile, plain: &[u8]) -> Texts {
    let mut reader = reader(plain, file.names_columns);
    let (mut text, mut record) = (String::new(), csv::ByteRecord::new());
    let mut places = Vec::with_capacity(file.values.len() + 1);
    places.push(0);
    // What was parsed has no error.
    while reader.read_byte_record(&mut record).unwrap_or(false) {
        for field in &record {
            text += String::from_utf8_lossy(field).trim();
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

/// Whether the fields of a first line are numbers, times, or missing, with a number among them: no header.
fn holds_numbers(fields: &[String]) -> bool {
    let numbers = || fields.iter().map(|field| is_number(field));
    numbers().all(|number| number.is_some()) && numbers().any(|number| number == Some(true))
}

/// Whether a field is a number or a time, and not a missing value; `None` for other text.
pub(super) fn is_number(field: &str) -> Option<bool> {
    match number(field.as_bytes()) {
        Some(value) => Some(!value.is_nan()),
        None => time::seconds(field.trim()).map(|_| true),
    }
}

/// Names columns without a name by their place, as in files without a header, and checks the others. Returns the new
/// names.
fn name_columns(header: &mut [String]) -> std::result::Result<Vec<String>, Problem> {
    let mut nameless = vec![];
    for (index, name) in header.iter_mut().enumerate() {
        if name.is_empty() {
            *name = format!("c{}", index + 1);
            nameless.push(name.clone());
        }
    }
    let mut seen = HashSet::new();
    for (index, name) in header.iter().enumerate() {
        let column = index + 1;
        if name.contains(char::is_control) {
            return Err(Problem::UnusableName { column, name: name.clone() });
        }
        if !seen.insert(name) {
            return Err(Problem::RepeatedName { name: name.clone() });
        }
    }
    Ok(nameless)
}

/// What the fields of one column were so far.
#[derive(Default)]
struct Seen {
    number: bool,
    time: bool,
    not_numbers: Option<NotNumbers>,
}

impl Seen {
    /// Value of a field of this column (from 0) on a line of this number: NaN for what is no number. Times count in
    /// seconds, if there is nothing else in the column.
    fn value(&mut self, field: &[u8], line: u64, column: usize) -> f64 {
        let found = number(field);
        let text = || String::from_utf8_lossy(field).trim().to_owned();
        let time = if found.is_none() { time::seconds(&text()) } else { None };
        self.number |= found.is_some_and(|value| !value.is_nan());
        self.time |= time.is_some();
        if found.is_none() && time.is_none() || self.number && self.time {
            let first = || NotNumbers { column, line, field: text() };
            self.not_numbers.get_or_insert_with(first);
        }
        found.or(time).unwrap_or(f64::NAN)
    }
}

/// Reads the lines of data one by one, quotes, blank lines, text and times included.
fn read_carefully(
    path: &Path,
    bytes: &[u8],
    reader: &mut csv::Reader<&[u8]>,
    header: &[String],
) -> Result<(Vec<f64>, Vec<u64>, Vec<NotNumbers>)> {
    let error = |problem| Error::file(path, problem);
    let mut values = Vec::new();
    let mut line_numbers = Vec::new();
    let mut lines = LineCount { bytes, at: 0, line: 1 };
    let mut record = csv::ByteRecord::new();
    let mut seen: Vec<Seen> = header.iter().map(|_| Seen::default()).collect();
    let read_error = |e: csv::Error| error(Problem::Line { cause: cause_of(&e) });
    while reader.read_byte_record(&mut record).map_err(read_error)? {
        let line = lines.of_record_at(record.position().map_or(0, csv::Position::byte));
        if record.len() != header.len() {
            let (fields, columns) = (record.len(), header.len());
            return Err(error(if reader.has_headers() {
                Problem::FieldCount { line, fields, columns }
            } else {
                Problem::UnevenLine { line, fields, columns }
            }));
        }
        for (column, (field, seen)) in record.iter().zip(&mut seen).enumerate() {
            values.push(seen.value(field, line, column));
        }
        line_numbers.push(line);
    }
    if values.is_empty() {
        return Err(error(Problem::NoLines));
    }
    Ok((values, line_numbers, seen.into_iter().filter_map(|it| it.not_numbers).collect()))
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
    // Lines that were no lines of the table are blank.
    let blank = lines.iter().position(|byte| !matches!(byte, b'\n' | b'\r')).unwrap_or(0);
    let lines = &lines[blank..];
    Some((LineCount { bytes, at: 0, line: 1 }.of_record_at(position.byte()), lines))
}

/// Number (from 1) of the first blank line that a line of text follows.
fn blank_line(bytes: &[u8]) -> Option<usize> {
    let is_blank = |line: &[u8]| line.iter().all(u8::is_ascii_whitespace);
    let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    let last = lines.iter().rposition(|line| !is_blank(line))?;
    lines[..last].iter().position(|line| is_blank(line)).map(|index| index + 1)
}

/// Words for a missing value, but for NaN and an empty field. Letters may be upper or lower case.
const MISSING: [&str; 16] = [
    "NA", "N/A", "n.a.", "null", "none", "missing", "<NA>", "NaT", "#N/A", "#NV", "#DIV/0!",
    "#VALUE!", "-", "--", "?", ".",
];

/// Number in a field; NaN if it is empty, NaN or a word for a missing value. `None` for text and infinities.
pub(super) fn number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.trim();
    if text.is_empty() {
        return Some(f64::NAN);
    }
    match text.parse::<f64>() {
        Ok(value) => Some(value).filter(|value| !value.is_infinite()),
        Err(_) => MISSING.iter().any(|word| word.eq_ignore_ascii_case(text)).then_some(f64::NAN),
    }
}

#[cfg(test)]
mod tests;

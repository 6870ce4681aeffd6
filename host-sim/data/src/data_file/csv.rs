//! Text files: a header of names, then one frame a line. Files without a header are recognised.

use std::collections::HashSet;

use super::blocks::{BLOCK, Blocks};
use super::{DataFile, NotNumbers, Reading, Texts, numbered, time};
use crate::columns::some_names;
use crate::error::{Error, Problem, Result};
use crate::input::Source;

mod body;

/// Bytes that end lines.
const ENDS: [u8; 2] = *b"\n\r";

/// Reads the text file of `source`, of any dialect.
pub(super) fn parse(source: Source<'_>, reading: &Reading) -> Result<DataFile> {
    let source = source.unpacked()?;
    let (path, is_packed) = (source.path, source.is_packed);
    let mut blocks = Blocks::new(source, reading)?;
    let mut block = blocks.next()?.unwrap_or_default();
    let mut file = DataFile { path: path.into(), ..DataFile::default() };
    file.texts = reading.keeps_text.then(Texts::default);
    let has_names = reading.has_header || blocks.dialect.has_names();
    let start = read_header(&mut file, &block, has_names)?;
    let seen = file.header.iter().map(|_| Seen::default()).collect();
    let mut body = Body { file, seen, line: 1 + line_ends(&block[..start]) };
    block.drain(..start);
    loop {
        let next = blocks.next()?;
        let used = body.add(&block, next.is_none())?;
        let Some(mut next) = next else { break };
        next.splice(..0, block.drain(used..));
        block = next;
    }
    let Body { mut file, seen, .. } = body;
    if file.values.is_empty() {
        return Err(Error::file(path, Problem::NoLines));
    }
    file.values.shrink_to_fit();
    file.kept = 0..file.line_numbers.len();
    file.not_numbers = seen.into_iter().filter_map(|it| it.not_numbers).collect();
    file.lacks_last_line_end = !matches!(block[..], [.., b'\n' | b'\r']);
    file.add_found(&blocks.dialect.found);
    file.add_found(if is_packed { "gzip" } else { "" });
    Ok(file)
}

/// Reads the names of columns from the beginning of a plain `text`; returns where the lines of data begin. The first line is
/// a header even if it holds numbers alone, if it `has_names`.
fn read_header(file: &mut DataFile, text: &[u8], has_names: bool) -> Result<usize> {
    let error = |problem| Error::file(&file.path, problem);
    let mut reader = reader(text, true);
    let header = reader.headers().map_err(|e| error(Problem::Header { cause: cause_of(&e) }))?;
    let mut header: Vec<String> = header.iter().map(|name| name.trim().to_owned()).collect();
    if header.is_empty() {
        return Err(error(Problem::Empty));
    }
    let mut start = 0;
    file.names_columns = has_names || !holds_numbers(&header);
    if file.names_columns {
        let nameless = name_columns(&mut header).map_err(error)?;
        if !nameless.is_empty() {
            file.found = format!("columns without a name are called {}", some_names(&nameless));
        }
        start = reader.position().byte() as usize;
        start += usize::from(text[..start].ends_with(b"\r") && text[start..].starts_with(b"\n"));
    } else {
        header = numbered(header.len());
    }
    file.header = header;
    Ok(start)
}

impl Texts {
    /// Adds the fields of these `lines` of plain text, in which no error was found.
    fn add(&mut self, lines: &[u8]) {
        let (mut reader, mut record) = (reader(lines, false), csv::ByteRecord::new());
        while reader.read_byte_record(&mut record).unwrap_or(false) {
            for field in &record {
                self.text += String::from_utf8_lossy(field).trim();
                self.ends.push(self.text.len());
            }
        }
    }
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

/// Lines of data that are read block by block.
struct Body {
    file: DataFile,
    seen: Vec<Seen>,
    /// Number of the next line.
    line: u64,
}

impl Body {
    /// Adds `lines` of plain text, up to an unfinished one unless they are the last; returns the bytes of what was added.
    fn add(&mut self, lines: &[u8], are_last: bool) -> Result<usize> {
        // Lines that were no lines of the table are blank.
        let start = lines.iter().position(|byte| !ENDS.contains(byte)).unwrap_or(lines.len());
        self.line += line_ends(&lines[..start]);
        let used = match self.add_plain(&lines[start..]) {
            Some(()) => lines.len(),
            None => start + self.add_carefully(&lines[start..], are_last)?,
        };
        if let Some(texts) = &mut self.file.texts {
            texts.add(&lines[..used]);
        }
        Ok(used)
    }

    /// Adds `lines` on all cores, if they hold nothing but numbers.
    fn add_plain(&mut self, lines: &[u8]) -> Option<()> {
        let (columns, before) = (self.file.header.len(), self.file.values.len());
        if self.seen.iter().any(|seen| seen.time) {
            return None;
        }
        body::read(lines, columns, &mut self.file.values)?;
        let added = &self.file.values[before..];
        for (column, seen) in self.seen.iter_mut().enumerate().filter(|(_, seen)| !seen.number) {
            seen.number = added.iter().skip(column).step_by(columns).any(|value| !value.is_nan());
        }
        let next = self.line + (added.len() / columns) as u64;
        self.file.line_numbers.extend(self.line..next);
        self.line = next;
        Some(())
    }

    /// Adds `lines` one by one, quotes, blank lines, text and times included; returns the bytes of what was added.
    fn add_carefully(&mut self, lines: &[u8], are_last: bool) -> Result<usize> {
        let Self { file, seen, line } = self;
        let path = file.path.clone();
        let error = |problem| Error::file(&path, problem);
        let columns = file.header.len();
        let (mut reader, mut record) = (reader(lines, false), csv::ByteRecord::new());
        let mut at = 0;
        let read_error = |e: csv::Error| error(Problem::Line { cause: cause_of(&e) });
        while reader.read_byte_record(&mut record).map_err(read_error)? {
            let mut start = record.position().map_or(0, |position| position.byte() as usize);
            start += lines[start..].iter().take_while(|byte| ENDS.contains(byte)).count();
            *line += line_ends(&lines[at..start]);
            at = start;
            // A quoted field that goes on in the next block has taken the last line end.
            let ends_block = !are_last && reader.position().byte() == lines.len() as u64;
            if ends_block
                && record
                    .iter()
                    .next_back()
                    .and_then(<[u8]>::last)
                    .is_some_and(|byte| ENDS.contains(byte))
            {
                if lines.len() - at > BLOCK {
                    let cause = format!("line {line}: a quoted field does not end");
                    return Err(error(Problem::Line { cause }));
                }
                return Ok(at);
            }
            let (line, fields) = (*line, record.len());
            if fields != columns {
                return Err(error(if file.names_columns {
                    Problem::FieldCount { line, fields, columns }
                } else {
                    Problem::UnevenLine { line, fields, columns }
                }));
            }
            file.line_numbers.push(line);
            let fields = record.iter().zip(&mut *seen).enumerate();
            let values = fields.map(|(column, (field, seen))| seen.value(field, line, column));
            file.values.extend(values);
        }
        *line += line_ends(&lines[at..]);
        Ok(lines.len())
    }
}

/// Number of line ends in a text: LF, CR or both. The CSV reader's own count is one short where lines end in CR LF.
fn line_ends(text: &[u8]) -> u64 {
    let is_end = |at: &usize| text[*at] == b'\n' || text.get(at + 1) != Some(&b'\n');
    memchr::memchr2_iter(b'\n', b'\r', text).filter(is_end).count() as u64
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

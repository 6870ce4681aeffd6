//! Text files: a header of names, then one frame a line. Files without a header are recognised.

use std::collections::HashSet;

use super::blocks::{BLOCK, Blocks};
use super::{DataFile, NotNumbers, Reading, Texts, Unreadable, numbered, time};
use crate::columns::some_names;
use crate::error::{Error, Problem, Result};
use crate::input::Source;

pub mod plain;

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
    let line = 1 + line_ends(&block[..start]);
    let mut body = Body { file, seen, line, is_strict: reading.is_strict, cut: 0, first: None };
    block.drain(..start);
    loop {
        let next = blocks.next()?;
        let used = body.add(&block, next.is_none())?;
        let Some(mut next) = next else { break };
        next.splice(..0, block.drain(used..));
        block = next;
    }
    let mut file = body.without_unreadable()?;
    if file.values.is_empty() {
        return Err(Error::file(path, Problem::NoLines));
    }
    file.values.shrink_to_fit();
    file.kept = 0..file.line_numbers.len();
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
                self.push(field);
            }
        }
    }

    fn push(&mut self, field: &[u8]) {
        self.text += String::from_utf8_lossy(field).trim();
        self.ends.push(self.text.len());
    }

    /// These texts of so many `columns` without those of `lines` (ascending).
    fn without(&self, lines: &[usize], columns: usize) -> Self {
        let (mut kept, mut start) = (Self::default(), 0);
        for (field, end) in self.ends.iter().enumerate() {
            if lines.binary_search(&(field / columns)).is_err() {
                kept.push(&self.text.as_bytes()[start..*end]);
            }
            start = *end;
        }
        kept
    }
}

fn reader(text: &[u8], has_header: bool) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().flexible(true).has_headers(has_header).from_reader(text)
}

/// What is wrong, in short.
fn cause_of(error: &::csv::Error) -> String {
    match error.kind() {
        ::csv::ErrorKind::Utf8 { .. } => "it is not UTF-8 text".into(),
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
    /// Lines of data (from 0) with a field that is no number, or no time among times.
    others: Vec<usize>,
}

impl Seen {
    /// Value of a field of this column (from 0) on a line of data (from 0) and of this number: NaN for what is no number.
    /// Times count in seconds, if there is nothing else in the column.
    fn value(&mut self, field: &[u8], (at, line): (usize, u64), column: usize) -> f64 {
        let found = number(field);
        let text = || String::from_utf8_lossy(field).trim().to_owned();
        let time = if found.is_none() { time::seconds(&text()) } else { None };
        let is_value = found.is_some_and(|value| !value.is_nan());
        if found.is_none() && time.is_none()
            || is_value && self.time
            || time.is_some() && self.number
        {
            let first = || NotNumbers { column, line, field: text() };
            self.not_numbers.get_or_insert_with(first);
            self.others.push(at);
            return f64::NAN;
        }
        self.number |= is_value;
        self.time |= time.is_some();
        found.or(time).unwrap_or(f64::NAN)
    }
}

/// Lines of data that are read block by block.
struct Body {
    file: DataFile,
    seen: Vec<Seen>,
    /// Number of the next line.
    line: u64,
    /// Whether a line that cannot be read is an error.
    is_strict: bool,
    /// Number of lines that are not in the file, as they have no fields like the others'.
    cut: usize,
    /// The first one: its number, and what is wrong with it.
    first: Option<(u64, Problem)>,
}

impl Body {
    /// Adds `lines` of plain text, up to an unfinished one unless they are the last; returns the bytes of what was added.
    fn add(&mut self, lines: &[u8], are_last: bool) -> Result<usize> {
        // Lines that were no lines of the table are blank.
        let start = lines.iter().position(|byte| !ENDS.contains(byte)).unwrap_or(lines.len());
        self.line += line_ends(&lines[..start]);
        let used = match self.add_plain(&lines[start..]) {
            Some(()) => lines.len(),
            None => return Ok(start + self.add_carefully(&lines[start..], are_last)?),
        };
        if let Some(texts) = &mut self.file.texts {
            texts.add(lines);
        }
        Ok(used)
    }

    /// Adds `lines` on all cores, if they hold nothing but numbers.
    fn add_plain(&mut self, lines: &[u8]) -> Option<()> {
        let (columns, before) = (self.file.header.len(), self.file.values.len());
        if self.seen.iter().any(|seen| seen.time) {
            return None;
        }
        plain::read(lines, columns, &mut self.file.values)?;
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
        let Self { file, seen, line, is_strict, cut, first } = self;
        let path = file.path.clone();
        let error = |problem| Error::file(&path, problem);
        let columns = file.header.len();
        let (mut csv, mut record) = (reader(lines, false), csv::ByteRecord::new());
        let (mut at, mut begin) = (0, 0);
        let read_error = |e: csv::Error| error(Problem::Line { cause: cause_of(&e) });
        while csv.read_byte_record(&mut record).map_err(read_error)? {
            let mut start = begin + record.position().map_or(0, |it| it.byte() as usize);
            start += lines[start..].iter().take_while(|byte| ENDS.contains(byte)).count();
            *line += line_ends(&lines[at..start]);
            at = start;
            // A quoted field that goes on in the next block has taken the last line end.
            let ends_block = !are_last && begin + csv.position().byte() as usize == lines.len();
            let goes_on = ends_block
                && record
                    .iter()
                    .next_back()
                    .and_then(<[u8]>::last)
                    .is_some_and(|byte| ENDS.contains(byte));
            if goes_on && lines.len() - at <= BLOCK {
                return Ok(at);
            }
            let (line, fields) = (*line, record.len());
            let holds_lines = |field: &[u8]| field.iter().any(|byte| ENDS.contains(byte));
            let problem = if goes_on
                || record.iter().zip(&*seen).any(|(it, seen)| seen.number && holds_lines(it))
            {
                let cause = format!("line {line}: a quoted field does not end");
                Some(Problem::Line { cause })
            } else if fields == columns {
                None
            } else if file.names_columns {
                Some(Problem::FieldCount { line, fields, columns })
            } else {
                Some(Problem::UnevenLine { line, fields, columns })
            };
            if let Some(problem) = problem {
                if *is_strict {
                    return Err(error(problem));
                }
                *cut += 1;
                first.get_or_insert((line, problem));
                if record.iter().any(holds_lines) {
                    // A stray quote took the lines below, too.
                    let end = lines[at..].iter().position(|byte| ENDS.contains(byte));
                    begin = end.map_or(lines.len(), |end| at + end);
                    csv = reader(&lines[begin..], false);
                }
                continue;
            }
            let place = (file.line_numbers.len(), line);
            file.line_numbers.push(line);
            let fields = record.iter().zip(&mut *seen).enumerate();
            let values = fields.map(|(column, (field, seen))| seen.value(field, place, column));
            file.values.extend(values);
            if let Some(texts) = &mut file.texts {
                record.iter().for_each(|field| texts.push(field));
            }
        }
        *line += line_ends(&lines[at..]);
        Ok(lines.len())
    }

    /// The file without lines that hold text in a column of numbers, if they are few.
    fn without_unreadable(self) -> Result<DataFile> {
        let Self { mut file, seen, is_strict, cut, first, .. } = self;
        let columns = file.header.len();
        let (mut garbled, mut problems) = (vec![], Vec::from_iter(first));
        for (column, seen) in seen.into_iter().enumerate() {
            let Some(text) = seen.not_numbers else { continue };
            let values = file.values.iter().skip(column).step_by(columns);
            let values = values.filter(|value| !value.is_nan()).count();
            if is_strict || !are_few(seen.others.len(), values) {
                file.not_numbers.push(text);
                continue;
            }
            problems.push((text.line, text.problem(&file.header)));
            garbled.extend(seen.others);
        }
        garbled.sort_unstable();
        garbled.dedup();
        let first = problems.into_iter().min_by_key(|(line, _)| *line);
        let Some((_, problem)) = first else { return Ok(file) };
        let (lines, of) = (cut + garbled.len(), cut + file.line_numbers.len());
        if !are_few(lines, of - lines) {
            let many = || Problem::Unreadable { lines, of, first: Box::new(problem.clone()) };
            return Err(Error::file(&file.path, if lines == 1 { problem } else { many() }));
        }
        let keep = |item: usize, each: usize| garbled.binary_search(&(item / each)).is_err();
        let mut item = 0..;
        file.values.retain(|_| item.next().is_some_and(|item| keep(item, columns)));
        let mut item = 0..;
        file.line_numbers.retain(|_| item.next().is_some_and(|item| keep(item, 1)));
        file.texts = file.texts.map(|texts| texts.without(&garbled, columns));
        let first = problem.to_string();
        let first = first.rsplit_once("; ").map_or(&*first, |(reason, _)| reason).to_owned();
        file.unreadable = Some(Unreadable { lines, first });
        Ok(file)
    }
}

/// Whether so many lines that cannot be read are no sign of a wrong file beside those that can: 5 % of all or fewer.
fn are_few(unreadable: usize, others: usize) -> bool {
    19 * unreadable <= others
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

//! How a text file writes its table: encoding, separator, decimal sign, comments, units. It is found from the file's
//! beginning, or stated; a file that is not plain is rewritten once, line by line, as plain CSV text.

use std::borrow::Cow;
use std::collections::HashSet;

use super::csv::{is_number, number};
use crate::columns;
use crate::error::Problem;

mod split;

pub use split::Separator;
use split::{lines, push_field, split};

/// Beginning of a file in bytes that its dialect is found from, up to the end of a line.
const SAMPLE: usize = 64_000;
/// Lines that it has at least, however long they are.
const SAMPLE_LINES: usize = 4;
/// Lines by which separators are compared.
const COMPARED: usize = 30;
/// What comment lines begin with.
const COMMENTS: [&str; 3] = ["#", "%", "//"];
/// Separators that are found, the usual one first.
const SEPARATORS: [Separator; 5] = [
    Separator::Char(','),
    Separator::Char(';'),
    Separator::Char('\t'),
    Separator::Char('|'),
    Separator::Spaces,
];

/// What a user states of a text file, in place of what is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stated {
    pub separator: Option<Separator>,
    pub decimal_comma: Option<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Utf8,
    Utf16 { is_big_endian: bool },
    Latin1,
}

/// How a text file writes its table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dialect {
    encoding: Encoding,
    separator: Separator,
    decimal_comma: bool,
    /// What comment lines begin with, if there are any.
    comments: Vec<String>,
    /// Line (from 0) that is written as these names, where it does not hold them as they are.
    header: Option<(usize, Vec<String>)>,
    /// Lines (from 0) of `sep=;` and of units, which are no lines of the table.
    left_out: Vec<usize>,
    /// Number of columns, without one that a separator at the end of each line makes.
    columns: usize,
    has_one_column: bool,
    ends_in_separator: bool,
    /// What is not plain, in words.
    pub(super) found: String,
    /// Number of lines that were made plain so far.
    lines: usize,
    /// Number (from 1) of the first blank one among them.
    blank: Option<usize>,
}

/// Fields of a line of the table, and its number (from 0) in the file.
type Line<'t> = (usize, Vec<Cow<'t, str>>);

impl Dialect {
    /// Finds the dialect of a text that begins with these `bytes`, in UTF-8 unless the `encoding` is Latin-1. The first line
    /// holds names, if it `has_header`.
    pub(super) fn find(
        encoding: Encoding,
        bytes: &[u8],
        stated: Stated,
        has_header: bool,
    ) -> Result<Self, Problem> {
        let sample = String::from_utf8_lossy(sample(bytes)).into_owned();
        let with_zero = sample.lines().filter(|line| line.contains('\0')).count();
        if with_zero * 20 > sample.lines().count() {
            return Err(Problem::NoText);
        }
        Self::of_sample(encoding, &sample, stated, has_header)
    }

    fn of_sample(
        encoding: Encoding,
        sample: &str,
        stated: Stated,
        has_header: bool,
    ) -> Result<Self, Problem> {
        let mark_of = |line: &str| COMMENTS.into_iter().find(|mark| is_comment(line, mark));
        let lines = lines(sample).map(|(line, _)| line).enumerate();
        let (mut comments, mut body, mut left_out) = (vec![], vec![], vec![]);
        let mut separator = None;
        for (place, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            if let Some(mark) = mark_of(line) {
                comments.push((place, mark, line));
            } else if let (Some(stated), true) = (separator_line(line), body.is_empty()) {
                separator = Some(stated);
                left_out.push(place);
            } else {
                body.push((place, line));
            }
        }
        let separator = stated.separator.or(separator);
        let separator = separator.unwrap_or_else(|| found_separator(&body, stated.decimal_comma));
        let mut table: Vec<Line<'_>> = body
            .iter()
            .map(|(place, line)| {
                (*place, split(line, separator).unwrap_or_else(|| vec![(*line).into()]))
            })
            .collect();
        let decimal_comma = match stated.decimal_comma {
            Some(stated) => stated,
            None => found_decimal_comma(&table, separator, sample)?,
        };
        let ends_in_separator = ends_in_separator(&table, separator);
        if ends_in_separator {
            let columns = table[1].1.len() - 1;
            table.iter_mut().for_each(|(_, fields)| fields.truncate(columns));
        }
        let value = |field: &str| match decimal_number(field, decimal_comma) {
            Some(number) => is_number(&number),
            None => is_number(field),
        };
        let values = |fields: &[Cow<'_, str>]| -> Vec<Option<bool>> {
            fields.iter().map(|field| value(field)).collect()
        };
        let is_data = |of: &[Option<bool>]| !of.contains(&None) && of.contains(&Some(true));
        let first = table.first().map_or(0, |line| line.0);
        let starts_with_data =
            !has_header && table.first().is_some_and(|(_, fields)| is_data(&values(fields)));
        let (mut header, mut found_lines) = (None, vec![]);
        if starts_with_data
            && let Some((place, mark, line)) = comments.iter().rfind(|it| it.0 < first)
            && let Some(names) = split(without_mark(line, mark), separator)
            && are_names(&names, table[0].1.len())
        {
            header = Some((*place, names.iter().map(ToString::to_string).collect()));
            found_lines.push(format!("names in line {}", place + 1));
        } else if !starts_with_data && let [(_, names), (place, units), below @ ..] = &table[..] {
            // What stands above numbers, and is none, is no value.
            let are_units = below.first().is_some_and(|(_, below)| {
                let (units, below) = (values(units), values(below));
                let mut pairs = units.iter().zip(&below);
                [units.len(), below.len()] == [names.len(); 2]
                    && !units.contains(&Some(true))
                    && units.contains(&None)
                    && below.contains(&Some(true))
                    && pairs.all(|(unit, below)| unit.is_some() || below.is_some())
            });
            if are_units {
                let names = names.iter().enumerate();
                let with_unit = |(column, name): (usize, &Cow<'_, str>)| {
                    with_unit(name, units.get(column).map_or("", |unit| unit))
                };
                header = Some((first, names.map(with_unit).collect()));
                left_out.push(*place);
                found_lines.push(format!("units in line {}", place + 1));
            }
        }
        let mut marks: Vec<String> = comments.iter().map(|it| it.1.to_owned()).collect();
        marks.sort_unstable();
        marks.dedup();
        let words = [
            (encoding == Encoding::Latin1, "latin-1"),
            (matches!(encoding, Encoding::Utf16 { .. }), "UTF-16"),
            (separator != Separator::Char(','), &separator.in_words()),
            (decimal_comma, "decimal commas"),
            (ends_in_separator, "a separator at the end of each line"),
            (!found_lines.is_empty(), &found_lines.concat()),
            (!comments.is_empty(), "comments"),
        ];
        let words = words.iter().filter(|(is_so, _)| *is_so).map(|(_, word)| *word);
        Ok(Self {
            encoding,
            separator,
            decimal_comma,
            comments: marks,
            header,
            left_out,
            columns: table.last().map_or(0, |(_, fields)| fields.len()),
            has_one_column: table.first().is_some_and(|(_, fields)| fields.len() == 1),
            ends_in_separator,
            found: words.collect::<Vec<_>>().join(", "),
            lines: 0,
            blank: None,
        })
    }

    /// Whether a first line of the plain text is names whatever it holds.
    pub(super) fn has_names(&self) -> bool {
        self.header.is_some()
    }

    /// Whether the text is plain CSV already.
    fn is_plain(&self) -> bool {
        self.separator == Separator::Char(',')
            && !self.decimal_comma
            && self.comments.is_empty()
            && self.header.is_none()
            && self.left_out.is_empty()
            && !self.ends_in_separator
    }

    /// Plain CSV text of the next lines of the table: commas, points in numbers. Lines keep their numbers: what is no line of
    /// the table becomes a blank one.
    pub(super) fn rewrite(&mut self, text: Vec<u8>) -> Result<Vec<u8>, Problem> {
        if self.is_plain() && !self.has_one_column {
            return Ok(text);
        }
        let text = String::from_utf8_lossy(&text);
        let mut plain = String::with_capacity(text.len() + 64);
        for (line, end) in lines(&text) {
            let (index, number) = (self.lines, self.lines as u64 + 1);
            self.lines += 1;
            if line.trim().is_empty() {
                self.blank = self.blank.or(Some(index + 1));
            } else if let (Some(line), true) = (self.blank, self.has_one_column) {
                return Err(Problem::BlankLine { line });
            }
            let is_left_out = line.trim().is_empty() || self.left_out.contains(&index);
            match &self.header {
                Some((place, names)) if *place == index => {
                    names.iter().enumerate().for_each(|(column, name)| {
                        plain.push_str(if column > 0 { "," } else { "" });
                        push_field(&mut plain, name);
                    });
                }
                _ if is_left_out || self.comments.iter().any(|mark| is_comment(line, mark)) => {}
                _ => self.push_line(&mut plain, line, number)?,
            }
            plain.push_str(end);
        }
        Ok(plain.into_bytes())
    }

    /// Appends a line of the table, of this number.
    fn push_line(&self, plain: &mut String, line: &str, number: u64) -> Result<(), Problem> {
        let mut fields = split(line, self.separator).ok_or_else(|| Problem::Line {
            cause: format!(
                "line {number}: a quoted field does not end before a separator, or in its line"
            ),
        })?;
        if self.ends_in_separator && fields.len() > self.columns {
            fields.pop_if(|field| field.is_empty());
        }
        for (column, field) in fields.iter().enumerate() {
            plain.push_str(if column > 0 { "," } else { "" });
            match decimal_number(field, self.decimal_comma) {
                Some(number) => plain.push_str(&number),
                None if self.decimal_comma && field.contains('.') && is_a_number(field) => {
                    let (line, field) = (number, field.to_string());
                    return Err(Problem::PointAmongCommas { line, field });
                }
                None => push_field(plain, field),
            }
        }
        Ok(())
    }
}

impl Encoding {
    pub(super) fn of(bytes: &[u8]) -> Self {
        let zeros = |from: usize| {
            bytes.iter().take(64).skip(from).step_by(2).filter(|byte| **byte == 0).count()
        };
        let most = bytes.len().min(64) / 4;
        match bytes {
            [0xff, 0xfe, ..] => Self::Utf16 { is_big_endian: false },
            [0xfe, 0xff, ..] => Self::Utf16 { is_big_endian: true },
            [0x01..=0x7f, 0, 0x01..=0x7f, 0, ..] if zeros(0) == 0 && zeros(1) > most => {
                Self::Utf16 { is_big_endian: false }
            }
            [0, 0x01..=0x7f, 0, 0x01..=0x7f, ..] if zeros(1) == 0 && zeros(0) > most => {
                Self::Utf16 { is_big_endian: true }
            }
            _ => {
                // A few bytes that are broken do not make Latin-1 of UTF-8.
                let text = String::from_utf8_lossy(sample(bytes));
                let mut special = text.chars().filter(|char| !char.is_ascii());
                let is_utf8 = |char| char != char::REPLACEMENT_CHARACTER;
                if special.clone().any(is_utf8) || special.next().is_none() {
                    Self::Utf8
                } else {
                    Self::Latin1
                }
            }
        }
    }

    /// `bytes` in UTF-8, without a byte order mark. UTF-16 is decoded as a whole.
    pub(super) fn decode(self, bytes: Vec<u8>) -> Vec<u8> {
        let text: String = match self {
            Self::Utf8 => return bytes,
            Self::Latin1 => bytes.iter().map(|byte| char::from(*byte)).collect(),
            Self::Utf16 { is_big_endian } => {
                let unit = if is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
                let units = bytes.as_chunks::<2>().0.iter().map(|bytes| unit(*bytes));
                let text = char::decode_utf16(units)
                    .map(|char| char.unwrap_or(char::REPLACEMENT_CHARACTER));
                text.collect()
            }
        };
        text.into_bytes()
    }
}

/// Beginning of a text, of whole lines.
fn sample(text: &[u8]) -> &[u8] {
    let mut ends = memchr::memchr2_iter(b'\n', b'\r', text).map(|at| at + 1);
    let few = ends.by_ref().nth(2 * SAMPLE_LINES - 1).unwrap_or(text.len());
    let end = if few >= SAMPLE { few } else { ends.find(|at| *at >= SAMPLE).unwrap_or(text.len()) };
    &text[..end]
}

/// Separator that Excel's first line `sep=;` states.
fn separator_line(line: &str) -> Option<Separator> {
    let line = line.trim_matches(['\r', '\n', '"']);
    let mut chars = line.strip_prefix("sep=").or_else(|| line.strip_prefix("SEP="))?.chars();
    let (separator, none) = (chars.next()?, chars.next());
    none.is_none().then_some(Separator::Char(separator))
}

/// Whether a line is a comment, and not a missing value such as `#N/A` in front.
fn is_comment(line: &str, mark: &str) -> bool {
    let line = line.trim_start();
    let end = line.find([',', ';', '\t', ' ', '|']).unwrap_or(line.len());
    line.starts_with(mark) && number(&line.as_bytes()[..end]).is_none()
}

fn without_mark<'l>(line: &'l str, mark: &str) -> &'l str {
    line.trim_start().strip_prefix(mark).unwrap_or(line).trim_start_matches(mark).trim()
}

/// Whether these are `count` different names. The first may lack its own, as that of an index.
fn are_names(names: &[Cow<'_, str>], count: usize) -> bool {
    let distinct: HashSet<&str> = names.iter().map(AsRef::as_ref).collect();
    let is_name = |name: &Cow<'_, str>| !name.is_empty() && number(name.as_bytes()).is_none();
    names.len() == count
        && distinct.len() == count
        && names
            .iter()
            .enumerate()
            .all(|(place, name)| place == 0 && name.is_empty() || is_name(name))
}

/// Separator of the fields of these lines: the one that makes most of them numbers.
fn found_separator(lines: &[(usize, &str)], decimal_comma: Option<bool>) -> Separator {
    let compared = &lines[..lines.len().min(COMPARED)];
    let header = compared.first().filter(|_| compared.len() > 1).map(|(_, line)| *line);
    let compared = &compared[usize::from(header.is_some())..];
    let share = |separator: Separator| {
        let fields: Vec<_> =
            compared.iter().filter_map(|(_, line)| split(line, separator)).collect();
        let columns = fields.last().map_or(0, Vec::len);
        let even = fields.iter().filter(|line| line.len() == columns).count();
        if columns < 2 && separator != Separator::Char(',') || 10 * even < 8 * compared.len() {
            return None;
        }
        let is_value = |field: &Cow<'_, str>| {
            is_number(field).is_some() || decimal_number(field, true).is_some()
        };
        let values = fields.iter().flatten().filter(|field| is_value(field)).count();
        let share = values as f64 / fields.iter().map(Vec::len).sum::<usize>() as f64;
        let names = header.and_then(|line| split(line, separator)).map_or(columns, |it| it.len());
        if names == columns || names + 1 == columns && separator != Separator::Spaces {
            return Some(share);
        }
        (share == 1.0).then_some(0.5) // names with spaces in them, or of too few columns
    };
    let possible = &SEPARATORS[usize::from(decimal_comma == Some(true))..];
    let mut best = (possible[0], -1.0);
    for &separator in possible {
        if let Some(share) = share(separator)
            && share > best.1
        {
            best = (separator, share);
        }
        if best.1 == 1.0 {
            break;
        }
    }
    best.0
}

/// Whether a separator at the end of each line makes a column without a name or a value.
fn ends_in_separator(table: &[Line<'_>], separator: Separator) -> bool {
    let [(_, header), lines @ ..] = table else { return false };
    let columns = lines.first().map_or(0, |(_, fields)| fields.len());
    let ends = |fields: &[Cow<'_, str>]| fields.last().is_some_and(|field| field.is_empty());
    separator != Separator::Spaces
        && columns > 1
        && 19 * lines.iter().filter(|(_, fields)| fields.len() != columns || !ends(fields)).count()
            <= lines.len()
        && (header.len() + 1 == columns || header.len() == columns && ends(header))
}

/// Whether numbers have a decimal comma.
///
/// # Errors
/// [`Problem`] where commas may be decimal ones or not.
fn found_decimal_comma(
    table: &[Line<'_>],
    separator: Separator,
    sample: &str,
) -> Result<bool, Problem> {
    let is_comma = separator == Separator::Char(',');
    if let (true, [(_, header), (place, data), ..]) = (is_comma, table)
        && data.len() == 2 * header.len()
        && header.iter().all(|name| is_number(name).is_none())
        && data.iter().all(|field| is_number(field) == Some(true))
    {
        let (line, fields, columns) = (*place as u64 + 1, data.len(), header.len());
        return Err(Problem::CommasForBoth { line, fields, columns });
    }
    if is_comma && !sample.contains('"') {
        return Ok(false);
    }
    let mut unclear = None;
    for (place, fields) in table {
        for field in fields.iter().filter(|field| decimal_number(field, true).is_some()) {
            let (whole, decimals) =
                field.trim_start_matches(['+', '-']).split_once(',').unwrap_or_default();
            let may_be_thousands =
                decimals.len() == 3 && (1..=3).contains(&whole.len()) && !whole.starts_with('0');
            if !may_be_thousands {
                return Ok(true);
            }
            unclear = unclear.or_else(|| Some((*place as u64 + 1, field.to_string())));
        }
    }
    unclear.map_or(Ok(false), |(line, field)| Err(Problem::ThousandsOrDecimals { line, field }))
}

/// A number with a decimal comma, as one with a point; `None` for other text, or if there are no decimal commas.
fn decimal_number(field: &str, decimal_comma: bool) -> Option<String> {
    let (whole, rest) = field.split_once(',').filter(|_| decimal_comma)?;
    let digits = whole.trim_start_matches(['+', '-']);
    let is_decimal = rest.starts_with(|c: char| c.is_ascii_digit())
        && digits.bytes().all(|it| it.is_ascii_digit());
    let number = format!("{whole}.{rest}");
    (is_decimal && !rest.contains('.') && is_a_number(&number)).then_some(number)
}

fn is_a_number(field: &str) -> bool {
    number(field.as_bytes()).is_some_and(|value| !value.is_nan())
}

/// A column's name with the unit that a units line states, if it is known and the name has none.
fn with_unit(name: &str, unit: &str) -> String {
    let unit = unit.trim_matches(['[', ']', '(', ')', ' ']);
    match columns::unit(unit) {
        Some(unit) if columns::unit_of(name).is_empty() && !name.is_empty() => {
            format!("{name} ({unit})")
        }
        _ => name.to_owned(),
    }
}

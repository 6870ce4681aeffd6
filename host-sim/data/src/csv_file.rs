//! CSV files that are written: a header of names, then one frame a line.
//!
//! Numbers are formatted on all cores, in pieces that are written in turn.

use std::io::Write;
use std::path::Path;

use rayon::prelude::*;

use crate::data_file::FieldTexts;
use crate::error::{Error, Result};
use crate::output;

/// Numbers formatted as one piece, and pieces formatted at a time.
const PIECE: usize = 16 * 1024;
const PIECES: usize = 64;
/// Numbers that are formatted at a time, on all cores.
pub const NUMBERS_AT_A_TIME: usize = PIECE * PIECES;

/// Column of a CSV file that is written: its name, and what its fields are.
#[derive(Debug, Clone, Copy)]
pub struct Column<'n> {
    name: &'n str,
    fields: Fields<'n>,
}

#[derive(Debug, Clone, Copy)]
enum Fields<'n> {
    /// Numbers that a line has.
    F64,
    F32,
    /// Fields of another file.
    Texts(FieldTexts<'n>),
}

impl<'n> Column<'n> {
    /// Column called `name`, whose numbers read back as the same f64.
    pub fn f64(name: &'n str) -> Self {
        Self { name, fields: Fields::F64 }
    }

    /// Column called `name` whose numbers were computed in f32: they get the digits that read back as the same f32.
    pub fn f32(name: &'n str) -> Self {
        Self { name, fields: Fields::F32 }
    }

    /// Column called `name` of these `texts`, which are written as they are.
    pub fn texts(name: &'n str, texts: FieldTexts<'n>) -> Self {
        Self { name, fields: Fields::Texts(texts) }
    }
}

/// Writes a CSV file: a header of `names`, then `lines`. Every number reads back as the same f64; NaN
/// becomes an empty field.
pub fn write<'n, L: IntoIterator<Item = f64>>(
    path: &Path,
    names: impl IntoIterator<Item = &'n str>,
    lines: impl IntoIterator<Item = L>,
) -> Result<()> {
    write_columns(path, names.into_iter().map(Column::f64), lines)
}

/// Writes a CSV file as [`write()`] does, but with fewer digits where a column needs no more. `lines` hold the numbers of
/// the columns that are no texts.
pub fn write_columns<'n, L: IntoIterator<Item = f64>>(
    path: &Path,
    columns: impl IntoIterator<Item = Column<'n>>,
    lines: impl IntoIterator<Item = L>,
) -> Result<()> {
    let columns: Vec<Column<'n>> = columns.into_iter().collect();
    let error = |cause| Error::write(path, cause);
    output::write_whole(path, |file| {
        let mut header = csv::Writer::from_writer(Vec::new());
        let header_written = header.write_record(columns.iter().map(|column| column.name));
        header_written.map_err(|cause| error(cause.into()))?;
        let header = header.into_inner().map_err(|cause| error(cause.into_error()))?;
        file.write_all(&header).map_err(error)?;
        let mut lines = lines.into_iter();
        let mut pieces = vec![Piece::default(); PIECES];
        let mut written = 0;
        loop {
            let mut filled = 0;
            while filled < PIECES && pieces[filled].fill(written, &mut lines) {
                written += pieces[filled].line_ends.len();
                filled += 1;
            }
            pieces[..filled].par_iter_mut().for_each(|piece| piece.write_text(&columns));
            for piece in &pieces[..filled] {
                file.write_all(&piece.text).map_err(error)?;
            }
            if filled < PIECES {
                return Ok(());
            }
        }
    })
}

/// Lines to be written together, as numbers and as text.
#[derive(Clone, Default)]
struct Piece {
    /// Index of the first line in the file.
    first: usize,
    values: Vec<f64>,
    /// Index in the values at which each line ends.
    line_ends: Vec<usize>,
    text: Vec<u8>,
}

impl Piece {
    /// Takes the next lines, behind so many others; returns false if none are left.
    fn fill<L: IntoIterator<Item = f64>>(
        &mut self,
        first: usize,
        lines: &mut impl Iterator<Item = L>,
    ) -> bool {
        self.first = first;
        self.values.clear();
        self.line_ends.clear();
        while self.values.len().max(self.line_ends.len()) < PIECE
            && let Some(line) = lines.next()
        {
            self.values.extend(line);
            self.line_ends.push(self.values.len());
        }
        !self.line_ends.is_empty()
    }

    fn write_text(&mut self, columns: &[Column<'_>]) {
        self.text.clear();
        let mut from = 0;
        for (line, end) in (self.first..).zip(&self.line_ends) {
            let mut values = self.values[from..*end].iter();
            from = *end;
            let start = self.text.len();
            for (place, column) in columns.iter().enumerate() {
                if place > 0 {
                    self.text.push(b',');
                }
                let mut value = || values.next().copied().unwrap_or(f64::NAN);
                match column.fields {
                    Fields::F64 => write_number(&mut self.text, value()),
                    Fields::F32 => write_f32(&mut self.text, value()),
                    Fields::Texts(texts) => {
                        let field = texts.at(line);
                        let needs_quotes = field.contains([',', '"', '\n', '\r']);
                        let field = if needs_quotes {
                            format!("\"{}\"", field.replace('"', "\"\"")).into()
                        } else {
                            field
                        };
                        self.text.extend_from_slice(field.as_bytes());
                    }
                }
            }
            if self.text.len() == start {
                self.text.extend_from_slice(b"NaN"); // a blank line would be no line
            }
            self.text.push(b'\n');
        }
    }
}

/// Appends the shortest digits that read back as the same number, as `Display` writes them.
fn write_number(text: &mut Vec<u8>, value: f64) {
    if value.is_nan() {
        return;
    }
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(value);
    if digits.contains('e') || lies_in_the_middle(value, digits) {
        let _ = write!(text, "{value}"); // a vector takes anything
    } else {
        text.extend_from_slice(digits.strip_suffix(".0").unwrap_or(digits).as_bytes());
    }
}

/// Appends the shortest digits that read back as the same f32; those of the f64 if it is none.
fn write_f32(text: &mut Vec<u8>, value: f64) {
    let single = value as f32;
    if f64::from(single) != value {
        return write_number(text, value);
    }
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(single);
    if digits.contains('e') {
        let _ = write!(text, "{single}"); // a vector takes anything
    } else {
        text.extend_from_slice(digits.strip_suffix(".0").unwrap_or(digits).as_bytes());
    }
}

/// Whether a number may lie exactly between `digits` and the next number of as many digits. `Display`
/// then rounds up, and zmij to even. Such a number is a multiple of 2^-(decimals + 1).
fn lies_in_the_middle(value: f64, digits: &str) -> bool {
    const UNAMBIGUOUS: usize = 15; // digits of which no two numbers are the same f64
    let decimals = digits.find('.').map_or(0, |point| digits.len() - point - 1);
    let multiple = value * f64::from_bits((1023 + 1 + decimals as u64) << 52);
    digits.len() > UNAMBIGUOUS + 1 && multiple == multiple.trunc()
}

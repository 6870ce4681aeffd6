//! Fast reader for the lines of data of a plain CSV file, on all cores.
//!
//! A file is plain if it has no quotes and no blank line, and every field is a number or empty. The
//! careful reader takes all other files, and writes the messages.

use rayon::prelude::*;

/// Bytes read at a time: many enough to be worth a thread's start, few enough for a core's cache.
const PIECE: usize = 256 * 1024;

/// Appends the values of CSV `lines` of so many `columns`, NaN where one is missing; `None`, and nothing is appended, if
/// the lines are not plain.
pub fn read(lines: &[u8], columns: usize, values: &mut Vec<f64>) -> Option<()> {
    let read = pieces(lines).into_par_iter().map(|piece| read_piece(piece, columns));
    let read: Option<Vec<Vec<f64>>> = read.collect();
    read?.iter().for_each(|piece| values.extend_from_slice(piece));
    Some(())
}

/// Pieces of about [`PIECE`] bytes, each cut after a line end.
fn pieces(mut lines: &[u8]) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(lines.len() / PIECE + 1);
    while lines.len() > PIECE {
        let end = memchr::memchr(b'\n', &lines[PIECE..]).map_or(lines.len(), |at| PIECE + at + 1);
        let (piece, rest) = lines.split_at(end);
        pieces.push(piece);
        lines = rest;
    }
    if !lines.is_empty() {
        pieces.push(lines);
    }
    pieces
}

fn read_piece(mut piece: &[u8], columns: usize) -> Option<Vec<f64>> {
    let mut values = Vec::with_capacity(piece.len() / 4);
    while !piece.is_empty() {
        for column in 0..columns {
            piece = if column == 0 { piece } else { piece.strip_prefix(b",")? };
            let (value, length) = field(piece)?;
            if length == 0 && columns == 1 {
                return None; // a blank line is no line
            }
            values.push(value);
            piece = &piece[length..];
        }
        if !piece.is_empty() {
            piece = piece.strip_prefix(b"\r").unwrap_or(piece).strip_prefix(b"\n")?;
        }
    }
    Some(values)
}

/// Number at the start of `text`, and its length in bytes.
#[inline]
fn field(text: &[u8]) -> Option<(f64, usize)> {
    if let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(text) {
        let ends = matches!(text.get(length), None | Some(b',' | b'\n' | b'\r'));
        if ends && value.is_finite() {
            return Some((value, length));
        }
    }
    let is_end = |byte: &u8| matches!(byte, b',' | b'\n' | b'\r');
    let length = text.iter().position(is_end).unwrap_or(text.len());
    Some((super::number(&text[..length])?, length))
}

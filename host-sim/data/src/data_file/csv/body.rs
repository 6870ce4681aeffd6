//! Fast reader for the lines of data of a plain CSV file, on all cores.
//!
//! A file is plain if it has no quotes and no blank line, and every field is a number or empty. The
//! careful reader takes all other files, and writes the messages.

use rayon::prelude::*;

/// Bytes read at a time: many enough to be worth a thread's start, few enough for a core's cache.
const PIECE: usize = 256 * 1024;

/// Values of CSV `lines` of so many `columns`, NaN where one is missing; `None` if the lines are not
/// plain.
pub(super) fn read(lines: &[u8], columns: usize) -> Option<Vec<f64>> {
    let pieces = pieces(lines);
    let counts: Option<Vec<usize>> = pieces.par_iter().map(|piece| count_lines(piece)).collect();
    let counts = counts?;
    let total = counts.iter().sum::<usize>().checked_mul(columns)?;
    if total > lines.len() + 1 {
        return None; // a field takes a byte at least: lines are short
    }
    let mut values = vec![0.0; total];
    let mut rest = &mut values[..];
    let mut places = Vec::with_capacity(pieces.len());
    for count in counts {
        let (place, others) = rest.split_at_mut(count * columns);
        places.push(place);
        rest = others;
    }
    let read = pieces.into_par_iter().zip(places);
    read.map(|(piece, place)| read_piece(piece, columns, place)).collect::<Option<()>>()?;
    Some(values)
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

/// Number of lines in a piece, the last perhaps without an end; `None` if there are quotes.
fn count_lines(piece: &[u8]) -> Option<usize> {
    if memchr::memchr(b'"', piece).is_some() {
        return None;
    }
    let unended = usize::from(piece.last().is_some_and(|byte| *byte != b'\n'));
    Some(memchr::memchr_iter(b'\n', piece).count() + unended)
}

fn read_piece(mut piece: &[u8], columns: usize, values: &mut [f64]) -> Option<()> {
    for line in values.chunks_exact_mut(columns) {
        let (last, others) = line.split_last_mut()?;
        for place in others {
            let (value, length) = field(piece)?;
            *place = value;
            piece = piece[length..].strip_prefix(b",")?;
        }
        let is_blank = columns == 1 && matches!(piece.first(), None | Some(b'\n' | b'\r'));
        if is_blank {
            return None;
        }
        let (value, length) = field(piece)?;
        *last = value;
        piece = &piece[length..];
        if !piece.is_empty() {
            let end = piece.strip_prefix(b"\r").unwrap_or(piece);
            piece = end.strip_prefix(b"\n")?;
        }
    }
    piece.is_empty().then_some(())
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

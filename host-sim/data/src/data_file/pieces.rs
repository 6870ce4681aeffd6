//! Text files of any length, read once and piece by piece: also what never was a file, such as standard input.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::dialect::Dialect;
use super::{DataFile, Reading, csv, foreign};
use crate::error::{Error, Problem, Result};
use crate::input;

/// Bytes that are read at a time, and then to the end of a line.
const PIECE: usize = 4_000_000;
/// Longest line in bytes, with the blank lines before it.
const LONGEST_LINE: usize = 64_000_000;

/// Text file that is read piece by piece. Each piece has whole lines, and is the same however its bytes arrive.
pub struct Pieces {
    path: PathBuf,
    source: Box<dyn Read + Send>,
    reading: Reading,
    /// How the lines behind the first piece are written.
    dialect: Option<Dialect>,
    /// Line of column names that all pieces but the first one lack.
    header: Vec<u8>,
    /// Bytes that were read, and belong to no piece yet.
    bytes: Vec<u8>,
    /// Number of lines of the pieces so far.
    lines: u64,
    /// Bytes that are read at a time.
    at_once: usize,
}

impl Pieces {
    /// Opens the file at `path`, which is read as `reading` says; `-` is standard input.
    pub fn open(path: &Path, reading: Reading) -> Result<Self> {
        let (path, source): (PathBuf, Box<dyn Read + Send>) = if path.as_os_str() == "-" {
            ("standard input".into(), Box::new(std::io::stdin()))
        } else {
            (path.into(), Box::new(input::open(path)?))
        };
        Ok(Self::new(path, source, reading))
    }

    /// Reads from `source`; `path` names it in messages.
    pub fn new(path: PathBuf, source: Box<dyn Read + Send>, reading: Reading) -> Self {
        let (dialect, header, bytes) = (None, vec![], vec![]);
        Self { path, source, reading, dialect, header, bytes, lines: 0, at_once: PIECE }
    }

    /// Path of the file, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Next lines; `None` after the last one.
    ///
    /// # Errors
    /// [`Error::Read`] if they cannot be read, [`Error::File`] for content that [`DataFile::read`] rejects.
    pub fn next_piece(&mut self) -> Result<Option<DataFile>> {
        if self.dialect.is_none() {
            let source = std::mem::replace(&mut self.source, Box::new(std::io::empty()));
            self.source = input::unpacking(&self.path, source)?;
        }
        let end = loop {
            let mut source = self.source.by_ref().take(self.at_once as u64);
            let read = source.read_to_end(&mut self.bytes);
            let read = read.map_err(|cause| Error::read(&self.path, cause))?;
            if read < self.at_once {
                break self.bytes.len();
            }
            let lines = memchr::memrchr(b'\n', &self.bytes).unwrap_or(0);
            let text = self.bytes[..lines].iter().rposition(|byte| !byte.is_ascii_whitespace());
            // Blank lines go with the text after them, without which they would look like the end of the file.
            if let Some(text) = text {
                break memchr::memchr(b'\n', &self.bytes[text..]).map_or(lines, |at| text + at) + 1;
            }
            if self.bytes.len() > LONGEST_LINE {
                let problem =
                    Problem::LineTooLong { after: self.lines, most_bytes: LONGEST_LINE as u64 };
                return Err(Error::file(&self.path, problem));
            }
        };
        let rest = self.bytes.split_off(end);
        let body = std::mem::replace(&mut self.bytes, rest);
        let lines_before = self.lines;
        self.lines += memchr::memchr_iter(b'\n', &body).count() as u64;
        let error = |problem| Error::file(&self.path, problem);
        let Some(dialect) = &self.dialect else {
            foreign::check(&self.path, &body)?;
            let Reading { has_header, stated, .. } = &self.reading;
            let (dialect, text) = Dialect::find(&body, stated, *has_header).map_err(error)?;
            dialect.decode(&[]).ok_or_else(|| error(Problem::Utf16InPieces))?;
            let plain = dialect.to_plain(&text, 0).map_err(error)?;
            let has_header = *has_header || dialect.has_names();
            let mut piece = csv::parse_plain(&self.path, &plain, has_header, 0)?;
            piece.add_found(&dialect.found);
            let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
            let names: Vec<String> = piece.header.iter().map(quoted).collect();
            self.header = (names.join(",") + "\n").into_bytes();
            self.lines = self.lines.max(1);
            self.dialect = Some(dialect.of_later_lines());
            return Ok(Some(piece));
        };
        if body.iter().all(u8::is_ascii_whitespace) {
            return Ok(None);
        }
        let body = dialect.decode(&body).unwrap_or_default();
        let body = dialect.to_plain(&body, lines_before).map_err(error)?;
        let text = [&self.header[..], &body].concat();
        // The header stands before them once more.
        csv::parse_plain(&self.path, &text, true, lines_before - 1).map(Some)
    }
}

#[cfg(test)]
mod tests;

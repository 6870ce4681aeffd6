//! CSV files of any length, read once and piece by piece: also what never was a file, such as standard input.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::{DataFile, csv};
use crate::error::{Error, Problem, Result};
use crate::input;

/// Bytes that are read at a time, and then to the end of a line.
const PIECE: usize = 4_000_000;
/// Longest line in bytes, with the blank lines before it.
const LONGEST_LINE: usize = 64_000_000;

/// CSV file that is read piece by piece. Each piece has whole lines, and is the same however its bytes arrive.
pub struct Pieces {
    path: PathBuf,
    source: Box<dyn Read + Send>,
    has_header: bool,
    /// Line of column names that all pieces but the first one lack.
    header: Vec<u8>,
    /// Bytes that were read, and belong to no piece yet.
    bytes: Vec<u8>,
    /// Number of lines of the pieces so far.
    lines: u64,
    digest: crc64fast::Digest,
    /// Bytes that are read at a time.
    at_once: usize,
}

impl Pieces {
    /// Opens the file at `path`; `-` is standard input. Its first line is a header even if it holds numbers alone, if
    /// it `has_header`.
    pub fn open(path: &Path, has_header: bool) -> Result<Self> {
        let (path, source): (PathBuf, Box<dyn Read + Send>) = if path.as_os_str() == "-" {
            ("standard input".into(), Box::new(std::io::stdin()))
        } else {
            (path.into(), Box::new(input::open(path)?))
        };
        Ok(Self::new(path, source, has_header))
    }

    /// Reads from `source`; `path` names it in messages.
    pub fn new(path: PathBuf, source: Box<dyn Read + Send>, has_header: bool) -> Self {
        let (header, bytes, digest) = (vec![], vec![], crc64fast::Digest::new());
        Self { path, source, has_header, header, bytes, lines: 0, digest, at_once: PIECE }
    }

    /// Path of the file, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// CRC-64/XZ of all bytes that were read.
    pub fn digest(&self) -> u64 {
        self.digest.sum64()
    }

    /// Next lines; `None` after the last one.
    ///
    /// # Errors
    /// [`Error::Read`] if they cannot be read, [`Error::File`] for content that [`DataFile::read`] rejects.
    pub fn next_piece(&mut self) -> Result<Option<DataFile>> {
        let end = loop {
            let had = self.bytes.len();
            let mut source = self.source.by_ref().take(self.at_once as u64);
            let read = source.read_to_end(&mut self.bytes);
            let read = read.map_err(|cause| Error::read(&self.path, cause))?;
            self.digest.write(&self.bytes[had..]);
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
        let is_first = self.lines == 0;
        let lines_before = self.lines;
        self.lines += memchr::memchr_iter(b'\n', &body).count() as u64;
        if is_first {
            let piece = csv::parse(&self.path, &body, self.has_header, 0)?;
            let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
            let names: Vec<String> = piece.header.iter().map(quoted).collect();
            self.header = (names.join(",") + "\n").into_bytes();
            self.lines = self.lines.max(1);
            return Ok(Some(piece));
        }
        if body.iter().all(u8::is_ascii_whitespace) {
            return Ok(None);
        }
        let text = [&self.header[..], &body].concat();
        // The header stands before them once more.
        csv::parse(&self.path, &text, true, lines_before - 1).map(Some)
    }
}

#[cfg(test)]
mod tests;

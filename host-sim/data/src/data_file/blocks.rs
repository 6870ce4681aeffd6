//! Text of a data file as plain CSV, in blocks of whole lines: a long file is never in memory as a whole.

use super::Reading;
use super::dialect::{Dialect, Encoding};
use crate::error::{Error, Result};
use crate::input::Source;

/// Bytes of a text file that are read at a time.
pub const BLOCK: usize = 4 * 1024 * 1024;

/// UTF-8's byte order mark.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Blocks of a text, of any dialect.
pub(super) struct Blocks<'s> {
    source: Source<'s>,
    /// Bytes that were read, and are in no block yet.
    ahead: Vec<u8>,
    encoding: Encoding,
    pub dialect: Dialect,
}

impl<'s> Blocks<'s> {
    /// Blocks of the text from `source`, whose dialect is found from the first one.
    pub fn new(mut source: Source<'s>, reading: &Reading) -> Result<Self> {
        let mut ahead = vec![];
        while source.read(&mut ahead, BLOCK)? && end_of_lines(&ahead).is_none() {}
        let mut encoding = Encoding::of(&ahead);
        let found = encoding;
        if let Encoding::Utf16 { .. } = encoding {
            while source.read(&mut ahead, BLOCK)? {}
            ahead = encoding.decode(ahead);
            encoding = Encoding::Utf8;
        }
        ahead.drain(..if ahead.starts_with(MARK) { MARK.len() } else { 0 });
        let sample = encoding.decode(ahead[..end_of_lines(&ahead).unwrap_or(ahead.len())].to_vec());
        let dialect = Dialect::find(found, &sample, reading.stated, reading.has_header);
        let dialect = dialect.map_err(|problem| Error::file(source.path, problem))?;
        Ok(Self { source, ahead, encoding, dialect })
    }

    /// Next block, which ends with a line unless it is the last one; `None` at the end.
    pub fn next(&mut self) -> Result<Option<Vec<u8>>> {
        let end = loop {
            if let Some(end) = end_of_lines(&self.ahead) {
                break end;
            }
            self.ahead.reserve(BLOCK);
            if !self.source.read(&mut self.ahead, BLOCK)? {
                break self.ahead.len();
            }
        };
        let rest = self.ahead.split_off(end);
        let block = self.encoding.decode(std::mem::replace(&mut self.ahead, rest));
        if block.is_empty() {
            return Ok(None);
        }
        let plain = self.dialect.rewrite(block);
        plain.map(Some).map_err(|problem| Error::file(self.source.path, problem))
    }
}

/// End of the last line that certainly ends in this text: a CR at its end may be followed by an LF.
fn end_of_lines(text: &[u8]) -> Option<usize> {
    let text = text.strip_suffix(b"\r").unwrap_or(text);
    memchr::memrchr2(b'\n', b'\r', text).map(|at| at + 1)
}

//! Errors of a recording, as values that a program can match.

use std::io;
use std::path::PathBuf;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure to write, read or mend a recording.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// File that cannot be read.
    #[error("the recording cannot be read: {0}")]
    Read(io::Error),
    /// File that cannot be written.
    #[error("the recording cannot be written: {0}")]
    Write(io::Error),
    /// Existing file that is no recording, and was not to be replaced.
    #[error("{} exists, and is not a recording of Taxel: choose another name, or remove it first", .0.display())]
    NotReplaced(PathBuf),
    /// Recording that somebody is writing.
    #[error("{} is being recorded: end that recording first", .0.display())]
    InUse(PathBuf),
    /// Layout or extras that cannot be recorded, and the rule that they break.
    #[error("the recording's layout: {0}")]
    Layout(String),
    /// Frame that does not fit the layout.
    #[error("frame {number}: {field} {rule}")]
    Frame {
        /// Number of the frame.
        number: u32,
        /// Field of [`Frame`](crate::Frame).
        field: &'static str,
        /// Rule that it breaks.
        rule: String,
    },
    /// File that is no recording of Taxel's.
    #[error("the file is not a recording of Taxel: it lacks {0}")]
    Foreign(String),
    /// Recording of another version of the format.
    #[error(
        "the recording has format {found:?}, and this program reads {known}: use the program that wrote it"
    )]
    OtherFormat {
        /// Version that the file states.
        found: String,
        /// Version that this crate reads.
        known: &'static str,
    },
    /// Recording whose chunks another tool compressed.
    #[error("the recording is compressed ({0}): unpack it with `mcap decompress`")]
    Compressed(String),
    /// Bytes of a file that are not what they should be.
    #[error("the recording is damaged at byte {at}: {what}")]
    Damaged {
        /// Place in the file.
        at: u64,
        /// What is wrong there.
        what: String,
    },
    /// Part of a recording that is larger than allowed.
    #[error("{what}: {found} are too many; at most {most} are allowed")]
    TooMany {
        /// Part, and what is counted.
        what: &'static str,
        /// Number that was found.
        found: u64,
        /// Largest number that is allowed.
        most: u64,
    },
    /// Failure to put a mended file in place.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
}

impl Error {
    /// Error for bytes at `at` that are not what they should be.
    pub(crate) fn damaged(at: u64, what: impl Into<String>) -> Self {
        Self::Damaged { at, what: what.into() }
    }

    /// Error for a `layout` or extras that break a rule.
    pub(crate) fn layout(rule: impl Into<String>) -> Self {
        Self::Layout(rule.into())
    }
}

/// Refuses what is larger than allowed.
pub(crate) fn at_most(most: u64, found: u64, what: &'static str) -> Result<()> {
    if found > most { Err(Error::TooMany { what, found, most }) } else { Ok(()) }
}

//! Input files, read up to a size that is told when it is exceeded: not every path names a file that ends.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use flate2::read::MultiGzDecoder;

use crate::error::{Error, Problem, Result};

/// Largest data file in bytes: 2 GB.
pub const MOST_DATA_BYTES: u64 = 2_000_000_000;
/// Most bytes that are read of what is no file and may have no end, such as a device or a pipe: 256 MB.
pub const MOST_STREAM_BYTES: u64 = 256_000_000;
/// Most numbers that a data set of a scene may hold: 4 GB.
pub const MOST_VALUES: usize = 500_000_000;
/// Largest text file with settings in bytes, such as a scene's: 16 MB.
pub const MOST_TEXT_BYTES: u64 = 16_000_000;

/// Time for another program to open a named pipe.
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens the file at `path` for reading.
///
/// # Errors
/// [`Error::Read`] if it cannot be read, or is a named pipe that nobody writes to. [`Error::File`] for a folder.
pub fn open(path: &Path) -> Result<File> {
    if path.is_dir() {
        return Err(Error::file(path, Problem::Folder));
    }
    let opened =
        open_in_time(path, OpenOptions::new().read(true), "no program writes to this pipe");
    opened.map_err(|cause| Error::read(path, cause))
}

/// Opens a file. The system opens a named pipe once there is somebody at its other end; if that takes too long, it is
/// an error that tells `who_is_missing`.
pub(crate) fn open_in_time(
    path: &Path,
    options: &OpenOptions,
    who_is_missing: &str,
) -> io::Result<File> {
    if !is_pipe(path) {
        return options.open(path);
    }
    let (opened, result) = mpsc::channel();
    let (path, options) = (path.to_path_buf(), options.clone());
    // If nobody comes, this thread waits until the program ends.
    thread::spawn(move || opened.send(options.open(path)));
    result.recv_timeout(PATIENCE).unwrap_or_else(|_| {
        let message = format!("{who_is_missing}; waited for {} s", PATIENCE.as_secs());
        Err(io::Error::new(ErrorKind::TimedOut, message))
    })
}

#[cfg(unix)]
fn is_pipe(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    std::fs::metadata(path).is_ok_and(|found| found.file_type().is_fifo())
}

#[cfg(not(unix))]
fn is_pipe(_: &Path) -> bool {
    false
}

/// Reads the file at `path` whole, if it has at most `most_bytes`.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read, [`Error::File`] if it is larger.
pub fn read(path: &Path, most_bytes: u64) -> Result<Vec<u8>> {
    let mut bytes = vec![];
    Source::open(path, most_bytes)?.read(&mut bytes, usize::MAX)?;
    Ok(bytes)
}

/// First bytes of what gzip packed.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Most bytes that a small file may unpack to, and most of a larger one for each of its bytes. Readings have noise: as
/// text they pack tenfold.
const FEW_UNPACKED_BYTES: u64 = 64_000_000;
const MOST_UNPACKED_A_BYTE: u64 = 100;

/// Bytes of a file as they are read.
pub(crate) struct Source<'s> {
    pub path: &'s Path,
    pub is_packed: bool,
    /// Length of the file in bytes; of a device or a pipe what it may have.
    length: u64,
    reader: Box<dyn Read + 's>,
    most_bytes: u64,
    /// Bytes that may still come.
    left: u64,
}

impl<'s> Source<'s> {
    /// Source of the bytes in the file at `path`, if it has at most `most_bytes`.
    pub fn open(path: &'s Path, most_bytes: u64) -> Result<Self> {
        let file = open(path)?;
        let metadata = file.metadata().map_err(|cause| Error::read(path, cause))?;
        let most = most_bytes.min(MOST_STREAM_BYTES);
        let (length, most_bytes) =
            if metadata.is_file() { (metadata.len(), most_bytes) } else { (most, most) };
        if length > most_bytes {
            return Err(Error::file(path, Problem::FileTooLarge { most_bytes }));
        }
        Ok(Self::new(path, file, length, most_bytes))
    }

    /// Source of `bytes`, as if they were in the file at `path`.
    pub fn of_bytes(path: &'s Path, bytes: &'s [u8]) -> Self {
        Self::new(path, bytes, bytes.len() as u64, MOST_DATA_BYTES)
    }

    fn new(path: &'s Path, reader: impl Read + 's, length: u64, most_bytes: u64) -> Self {
        let reader = Box::new(reader);
        Self { path, is_packed: false, length, reader, most_bytes, left: most_bytes }
    }

    /// Source of what gzip packed, if it did.
    pub fn unpacked(mut self) -> Result<Self> {
        let mut first = vec![];
        self.read(&mut first, GZIP.len())?;
        self.is_packed = first == GZIP;
        let whole = io::Cursor::new(first).chain(self.reader);
        if !self.is_packed {
            return Ok(Self { reader: Box::new(whole), left: self.most_bytes, ..self });
        }
        let most_bytes = self.length.saturating_mul(MOST_UNPACKED_A_BYTE);
        let most_bytes = most_bytes.clamp(FEW_UNPACKED_BYTES, MOST_DATA_BYTES);
        let reader = Box::new(MultiGzDecoder::new(whole));
        Ok(Self { reader, most_bytes, left: most_bytes, ..self })
    }

    /// Appends up to `most` bytes to `bytes`; returns false if there are no more.
    ///
    /// # Errors
    /// [`Error::Read`] if they cannot be read, [`Error::File`] if they are too many.
    pub fn read(&mut self, bytes: &mut Vec<u8>, most: usize) -> Result<bool> {
        let (path, most_bytes) = (self.path, self.most_bytes);
        let most = (most as u64).min(self.left + 1); // one more tells that they are too many
        let read = self.reader.by_ref().take(most).read_to_end(bytes);
        let (is_packed, packed) = (self.is_packed, |cause| Problem::Packed { cause });
        let count = read.map_err(|cause| {
            if is_packed {
                Error::file(path, packed(cause.to_string()))
            } else {
                Error::read(path, cause)
            }
        })?;
        let too_large = if is_packed {
            Problem::UnpackedTooLarge { most_bytes }
        } else {
            Problem::FileTooLarge { most_bytes }
        };
        let left = self.left.checked_sub(count as u64);
        self.left = left.ok_or_else(|| Error::file(path, too_large))?;
        Ok(count > 0)
    }
}

/// Reads the text file at `path` whole, if it has at most [`MOST_TEXT_BYTES`].
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path, MOST_TEXT_BYTES)?).map_err(|cause| {
        Error::read(path, io::Error::new(ErrorKind::InvalidData, cause.utf8_error()))
    })
}

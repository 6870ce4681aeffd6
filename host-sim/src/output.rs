//! Files that are either whole or not there.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Writes `path` through a temporary file beside it, renamed only once all is written. On failure
/// the temporary goes and whatever stood at `path` stays.
///
/// # Errors
/// [`Error::Write`], or what `write` returns.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    if path.is_dir() {
        let cause = std::io::Error::from(std::io::ErrorKind::IsADirectory);
        return Err(Error::write(path, cause));
    }
    let temporary = Temporary::beside(path);
    let file = File::create(&temporary.0).map_err(|cause| Error::write(path, cause))?;
    let mut writer = BufWriter::new(file);
    write(&mut writer)?;
    let file = writer.into_inner().map_err(|e| Error::write(path, e.into_error()))?;
    file.sync_all().map_err(|cause| Error::write(path, cause))?;
    drop(file);
    fs::rename(&temporary.0, path).map_err(|cause| Error::write(path, cause))
}

/// As [`write_whole`], for content at hand.
///
/// # Errors
/// [`Error::Write`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |file| file.write_all(bytes).map_err(|cause| Error::write(path, cause)))
}

/// Fails early, before long work, where [`write_whole`] could not write later.
///
/// # Errors
/// [`Error::Write`].
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        let cause = std::io::Error::from(std::io::ErrorKind::IsADirectory);
        return Err(Error::write(path, cause));
    }
    let temporary = Temporary::beside(path);
    File::create(&temporary.0).map(drop).map_err(|cause| Error::write(path, cause))
}

/// A temporary file's name; the file is removed when this goes (after a rename: no longer there).
struct Temporary(PathBuf);

impl Temporary {
    fn beside(path: &Path) -> Self {
        let mut name = std::ffi::OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(format!(".{}.tmp", std::process::id()));
        Self(path.with_file_name(name))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // Nothing to remove is the good case.
        let _ = fs::remove_file(&self.0);
    }
}

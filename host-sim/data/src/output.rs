//! Output files that appear whole or not at all.
//!
//! Whatever ends the work, an error, a full disk or a signal, leaves the old file as it was and no temporary file. Only
//! a program that is killed outright leaves one, `.<name>.<digits>.tmp`; the next run with the same output removes it.

use std::fs;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::Path;

use crate::error::{Error, Result};

mod disk;
mod pending;
mod place;
mod temporary;
mod set;

pub use disk::{Disk, System};
pub use pending::abandon;
pub use set::FileSet;
pub use temporary::Scratch;

use disk::Sink;
use place::Place;
use temporary::Temporary;

/// Writes `path` through a temporary file beside it, renamed once all is written.
///
/// If writing fails, the temporary file is removed and whatever stood at `path` stays. A symbolic link is followed, and
/// an existing file's permissions are kept. `-` and `/dev/stdout` are the program's own stdout. That, a device or a pipe
/// is written to directly; a reader who has seen enough (`| head`) is no failure.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or whatever error `write` returns.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    write_whole_on(&System, path, write)
}

/// Writes `path` as [`write_whole`] does, by the calls of a `disk`.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or whatever error `write` returns.
pub fn write_whole_on(
    disk: &dyn Disk,
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let error = |cause| Error::write(path, cause);
    match Place::of(path).map_err(error)? {
        Place::Stdout => stream(path, place::stdout(), write),
        Place::Stream { path: real, is_fifo } => {
            stream(path, place::open(&real, is_fifo).map_err(error)?, write)
        }
        Place::File { real, permissions } => {
            temporary::remove_leftovers(disk, &real);
            let temporary = Temporary::beside(disk, &real).map_err(error)?;
            if let Some(permissions) = permissions {
                disk.set_permissions(temporary.file(), permissions).map_err(error)?;
            }
            let mut writer = BufWriter::new(Sink::new(disk, temporary.file()));
            write(&mut writer)?;
            writer.flush().map_err(error)?;
            drop(writer);
            disk.sync(temporary.file()).map_err(error)?;
            temporary.rename(&real).map_err(error)
        }
    }
}

/// Writes to a stream, as long as somebody reads it.
fn stream(
    path: &Path,
    mut stream: Box<dyn Write>,
    write: impl FnOnce(&mut dyn Write) -> Result<()>,
) -> Result<()> {
    let written = write(&mut stream);
    let written = written.and_then(|()| stream.flush().map_err(|cause| Error::write(path, cause)));
    match written {
        Err(Error::Write { cause, .. }) if cause.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// Writes `bytes` to `path`, whole or not at all, like [`write_whole`].
///
/// # Errors
/// [`Error::Write`] if the file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |file| file.write_all(bytes).map_err(|cause| Error::write(path, cause)))
}

/// Checks before long work that [`write_whole`] can write to `path` and would not replace one of the
/// command's own `inputs`.
///
/// # Errors
/// [`Error::Write`] if `path` cannot be written, or [`Error::WrittenOverInput`] if it is an input.
pub fn check_writable(path: &Path, inputs: &[&Path]) -> Result<()> {
    let error = |cause| Error::write(path, cause);
    let real = match Place::of(path).map_err(error)? {
        Place::File { real, .. } => real,
        Place::Stdout => return check_not_behind(Path::new("/dev/stdout"), path, inputs),
        Place::Stream { path: stream, .. } => return check_not_behind(&stream, path, inputs),
    };
    check_no_input(path, inputs)?;
    temporary::remove_leftovers(&System, &real);
    Temporary::beside(&System, &real).map(drop).map_err(error)
}

/// Whether [`write_whole`] writes to the program's own stdout: `-`, `/dev/stdout`, or a link to it.
#[must_use]
pub fn is_stdout(path: &Path) -> bool {
    matches!(Place::of(path), Ok(Place::Stdout))
}

/// Checks that the file `output` is none of the `inputs`.
fn check_no_input(output: &Path, inputs: &[&Path]) -> Result<()> {
    let Ok(real) = fs::canonicalize(output) else { return Ok(()) };
    let same = |input: &&&Path| fs::canonicalize(input).is_ok_and(|input| input == real);
    match inputs.iter().find(same) {
        Some(input) => {
            Err(Error::WrittenOverInput { output: output.into(), input: (*input).into() })
        }
        None => Ok(()),
    }
}

/// Checks that the `stream` which `output` leads to is no regular file among the `inputs`, under whatever name.
#[cfg(unix)]
fn check_not_behind(stream: &Path, output: &Path, inputs: &[&Path]) -> Result<()> {
    use std::os::unix::fs::MetadataExt;
    let file = |path: &Path| {
        let found = fs::metadata(path).ok().filter(fs::Metadata::is_file);
        found.map(|found| (found.dev(), found.ino()))
    };
    let Some(behind) = file(stream) else { return Ok(()) };
    match inputs.iter().find(|input| file(input) == Some(behind)) {
        Some(input) => {
            Err(Error::WrittenOverInput { output: output.into(), input: (*input).into() })
        }
        None => Ok(()),
    }
}

#[cfg(not(unix))]
fn check_not_behind(_: &Path, _: &Path, _: &[&Path]) -> Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests;

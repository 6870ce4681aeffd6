//! Where an output's path leads: to a file, or into a stream.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;

/// Links that are followed one after the other, as Linux does.
const MOST_LINKS: usize = 40;

/// Kind of place that a path names.
#[derive(Debug)]
pub enum Place {
    /// A file, or nothing yet.
    File(Target),
    /// The program's own stdout.
    Stdout,
    /// A device, a pipe, or another open file of this program.
    Stream(PathBuf),
}

/// File that is made or replaced.
#[derive(Debug)]
pub struct Target {
    /// Path that the user gave, for messages.
    pub named: PathBuf,
    /// Path behind all links.
    pub real: PathBuf,
    pub permissions: Option<Permissions>,
}

impl Place {
    /// Place of `path`. A link is followed, even to where nothing is yet.
    pub fn new(path: &Path) -> io::Result<Self> {
        let refused = |why| Err(io::Error::new(ErrorKind::PermissionDenied, why));
        let mut real = path.to_path_buf();
        for _ in 0..MOST_LINKS {
            match real.to_str().unwrap_or_default() {
                "-" | "/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1" => return Ok(Self::Stdout),
                "/dev/stdin" | "/dev/fd/0" | "/proc/self/fd/0" => {
                    return refused("stdin cannot be written to");
                }
                // What a shell has open must not be replaced, even if it is a file.
                "/dev/stderr" => return Ok(Self::Stream(real)),
                open if open.starts_with("/dev/fd/") || open.starts_with("/proc/self/fd/") => {
                    return Ok(Self::Stream(real));
                }
                _ => {}
            }
            let permissions = match fs::symlink_metadata(&real) {
                Ok(found) if found.is_symlink() => {
                    let target = fs::read_link(&real)?;
                    real = real.parent().unwrap_or(Path::new("")).join(target);
                    continue;
                }
                Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
                Ok(found) if !found.is_file() => return Ok(Self::Stream(real)),
                Ok(found) if found.permissions().readonly() => {
                    return refused("the file is read-only");
                }
                Ok(found) => {
                    OpenOptions::new().write(true).open(&real)?;
                    Some(found.permissions())
                }
                // Creating it will tell what is wrong with it, if anything is.
                Err(_) => None,
            };
            return Ok(Self::File(Target { named: path.into(), real, permissions }));
        }
        Err(io::Error::other("too many links in a row"))
    }
}

/// File that `path` leads to.
pub fn file(path: &Path) -> Result<Target> {
    match Place::new(path) {
        Ok(Place::File(target)) => Ok(target),
        Ok(_) => Err(Error::write(path, io::Error::other("it is not a file"))),
        Err(cause) => Err(Error::write(path, cause)),
    }
}

/// Opens a stream. What it holds already stays.
pub fn open_stream(path: &Path) -> io::Result<File> {
    // A file that the caller has open already, as in `3>> log`, is written at its end.
    input::open_in_time(path, OpenOptions::new().append(true), "no program reads this pipe")
}

/// What tells whether two paths lead to the same file; `None` for anything else than a file.
#[cfg(unix)]
pub fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    let found = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some((found.dev(), found.ino()))
}

/// What tells whether two paths lead to the same file.
#[cfg(not(unix))]
pub fn identity(path: &Path) -> Option<PathBuf> {
    fs::canonicalize(path).ok()
}

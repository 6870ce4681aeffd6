//! Where an output's path leads: to a file, or into a stream.

use std::fs::{self, File, FileType, OpenOptions, Permissions};
use std::io::{self, BufWriter, Error, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// Links that are followed one after the other, as Linux does.
const MOST_LINKS: usize = 40;

/// Time for a reader to open a named pipe.
const PATIENCE: Duration = Duration::from_secs(5);

/// Kind of place that a path names.
#[derive(Debug)]
pub enum Place {
    /// A file, or nothing yet; links are resolved.
    File { real: PathBuf, permissions: Option<Permissions> },
    /// The program's own stdout.
    Stdout,
    /// A device, a pipe, or another open file of this program.
    Stream { path: PathBuf, is_fifo: bool },
}

impl Place {
    /// Place of `path`. A link is followed, even to where nothing is yet.
    ///
    /// # Errors
    /// Error of the system; a folder; a file that must not be written; an open file that is read.
    pub fn of(path: &Path) -> io::Result<Self> {
        let mut path = path.to_path_buf();
        for _ in 0..MOST_LINKS {
            if is_stdout(&path) {
                return Ok(Self::Stdout);
            }
            if let Some(number) = descriptor(&path) {
                check_descriptor(number)?;
                return Ok(Self::Stream { path, is_fifo: false });
            }
            match fs::symlink_metadata(&path) {
                Ok(found) if found.is_symlink() => {
                    let target = fs::read_link(&path)?;
                    path = path.parent().unwrap_or(Path::new("")).join(target);
                }
                Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
                Ok(found) if found.is_file() => {
                    let permissions = writable(&path)?;
                    let real = fs::canonicalize(&path)?;
                    return Ok(Self::File { real, permissions: Some(permissions) });
                }
                Ok(found) => {
                    return Ok(Self::Stream { path, is_fifo: is_fifo(found.file_type()) });
                }
                // Creating it will tell what is wrong with it, if anything is.
                Err(_) => return Ok(Self::File { real: path, permissions: None }),
            }
        }
        Err(Error::other("too many links lead from one to the next"))
    }
}

/// Whether `path` means the program's own stdout.
fn is_stdout(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| path == Path::new(name))
}

/// Number of the open file of this program that `path` means. It must not be replaced, even if it is a regular file.
fn descriptor(path: &Path) -> Option<&str> {
    match path.to_str()? {
        "/dev/stdin" => Some("0"),
        "/dev/stderr" => Some("2"),
        path => path.strip_prefix("/dev/fd/").or(path.strip_prefix("/proc/self/fd/")),
    }
}

/// Checks that open file `number` is there to be written to: opening it anew would not ask how it was opened.
///
/// # Errors
/// Stdin, or a file that was opened for reading only, as far as the system tells.
fn check_descriptor(number: &str) -> io::Result<()> {
    let refused = |why| Err(Error::new(ErrorKind::PermissionDenied, why));
    if number == "0" {
        return refused("stdin is read and not written");
    }
    let details = fs::read_to_string(format!("/proc/self/fdinfo/{number}")).unwrap_or_default();
    let flags = details.lines().find_map(|line| line.strip_prefix("flags:"));
    // Octal; the last two bits are 0 for reading, 1 for writing and 2 for both.
    let flags = flags.and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok());
    match flags {
        Some(flags) if flags % 4 == 0 => refused("it was opened for reading only"),
        _ => Ok(()),
    }
}

/// Checks that the file at `path` may be written to, and returns its permissions.
///
/// # Errors
/// Error of the system; a file without permission to write, whoever asks.
pub fn writable(path: &Path) -> io::Result<Permissions> {
    let permissions = fs::metadata(path)?.permissions();
    if permissions.readonly() {
        return Err(Error::new(ErrorKind::PermissionDenied, "the file is read-only"));
    }
    OpenOptions::new().write(true).open(path)?;
    Ok(permissions)
}

#[cfg(unix)]
fn is_fifo(kind: FileType) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&kind)
}

#[cfg(not(unix))]
fn is_fifo(_: FileType) -> bool {
    false
}

/// Writer to the program's own stdout.
#[must_use]
pub fn stdout() -> Box<dyn Write> {
    Box::new(BufWriter::new(io::stdout().lock()))
}

/// Opens a stream. What it holds already stays.
///
/// # Errors
/// Error of the system; a named pipe that nobody reads.
pub fn open(path: &Path, is_fifo: bool) -> io::Result<Box<dyn Write>> {
    let file = if is_fifo {
        open_fifo(path)?
    } else {
        // A file that the caller has open already, as in `3>> log`, is written at its end.
        OpenOptions::new().append(true).open(path)?
    };
    Ok(Box::new(BufWriter::new(file)))
}

/// Opens a named pipe, which the system does once somebody reads it.
fn open_fifo(path: &Path) -> io::Result<File> {
    let (opened, result) = mpsc::channel();
    let path = path.to_path_buf();
    // Without a reader this thread waits until the program ends.
    thread::spawn(move || opened.send(OpenOptions::new().write(true).open(path)));
    let unread = || {
        let message = format!("nobody reads this pipe; waited for {} s", PATIENCE.as_secs());
        Err(Error::new(ErrorKind::TimedOut, message))
    };
    result.recv_timeout(PATIENCE).unwrap_or_else(|_| unread())
}

//! Temporary files and folders. Nobody can guess their names, and they go if the work fails or is interrupted.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::disk::Disk;
use super::pending;

/// End of the names of temporaries.
const END: &str = ".tmp";

/// Digits in the names of temporaries.
const DIGITS: usize = 16;

/// Names that are tried until one is free.
const ATTEMPTS: usize = 16;

/// Temporary file beside an output, locked as long as this process is at work on it.
pub struct Temporary<'d> {
    disk: &'d dyn Disk,
    path: PathBuf,
    file: File,
}

impl<'d> Temporary<'d> {
    /// Creates a file beside `output`.
    ///
    /// # Errors
    /// Error of the system.
    pub fn beside(disk: &'d dyn Disk, output: &Path) -> io::Result<Self> {
        for _ in 0..ATTEMPTS {
            let path = output.with_file_name(unguessable(output.file_name(), END));
            let mut pending = pending::lock();
            let file = match disk.create(&path) {
                Err(cause) if cause.kind() == ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            pending.add_file(&path);
            drop(pending);
            let temporary = Self { disk, path, file };
            // Before it was locked, another process may have taken it for a leftover.
            let is_taken = matches!(temporary.file.try_lock(), Err(TryLockError::WouldBlock));
            if !is_taken && temporary.path.exists() {
                return Ok(temporary);
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    /// The file.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Puts the file in the place of `output`.
    ///
    /// # Errors
    /// Error of the system; `output` is then as it was.
    pub fn rename(self, output: &Path) -> io::Result<()> {
        let mut pending = pending::lock();
        let outcome = self.disk.rename(&self.path, output);
        if outcome.is_ok() {
            pending.forget(&self.path);
        }
        drop(pending);
        outcome
    }
}

impl Drop for Temporary<'_> {
    fn drop(&mut self) {
        // After it was renamed there is nothing to remove.
        let _ = self.disk.remove(&self.path);
        pending::lock().forget(&self.path);
    }
}

/// Removes temporary files beside `output` that a killed process has left: those that nobody has locked.
pub fn remove_leftovers(disk: &dyn Disk, output: &Path) {
    let Some(name) = output.file_name() else { return };
    for entry in entries(&folder_of(output)) {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && digits_between(&entry.file_name(), name, END) {
            let path = entry.path();
            let is_free = |file: File| file.try_lock().is_ok();
            if File::open(&path).is_ok_and(is_free) {
                // Another process may be faster, and what cannot be removed is no reason to fail.
                let _ = disk.remove(&path);
            }
        }
    }
}

/// Folder that goes with all that is in it.
#[derive(Debug)]
pub struct Scratch(PathBuf);

impl Scratch {
    /// Makes a folder for one's own use among the system's temporary files.
    ///
    /// # Errors
    /// Error of the system.
    pub fn new() -> io::Result<Self> {
        let path = std::env::temp_dir().join(unguessable(Some(OsStr::new("taxel")), END));
        let mut builder = fs::DirBuilder::new();
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        let mut pending = pending::lock();
        builder.create(&path)?;
        pending.add_tree(&path);
        Ok(Self(path))
    }

    /// Path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
        pending::lock().forget(&self.0);
    }
}

/// Folder that `path` is in.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => ".".into(),
    }
}

/// What is in a folder, as far as that can be told.
pub fn entries(folder: &Path) -> impl Iterator<Item = fs::DirEntry> {
    fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok)
}

/// Hidden name made of `name`, digits and `end`.
pub fn unguessable(name: Option<&OsStr>, end: &str) -> OsString {
    // Every state of the hash has keys of its own, drawn by the system.
    let random = RandomState::new().hash_one(0);
    let mut hidden = OsString::from(".");
    hidden.push(name.unwrap_or_default());
    hidden.push(format!(".{random:0DIGITS$x}{end}"));
    hidden
}

/// Whether `found` is a name that [`unguessable`] makes of `name` and `end`.
pub fn digits_between(found: &OsStr, name: &OsStr, end: &str) -> bool {
    let (found, name) = (found.as_encoded_bytes(), name.as_encoded_bytes());
    let rest = found.strip_prefix(b".").and_then(|rest| rest.strip_prefix(name));
    let rest = rest.and_then(|rest| rest.strip_prefix(b".")?.strip_suffix(end.as_bytes()));
    rest.is_some_and(|it| it.len() == DIGITS && it.iter().all(u8::is_ascii_hexdigit))
}

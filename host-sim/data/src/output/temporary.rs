//! Temporary files and folders, which go if the work fails or is interrupted.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile, TempDir};

use super::place::Target;
use super::step::{Step, step};
use crate::error::{Error, Result};

/// What goes if the program is interrupted. While one thread has the list, an interruption waits. What has gone already
/// may stay in it: nobody will have the same name.
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn pending() -> MutexGuard<'static, Vec<PathBuf>> {
    PENDING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all temporary files and folders, for a program that ends at once. From now on no output is begun or
/// completed: threads that try to will wait for ever.
pub fn abandon() {
    let mut pending = pending();
    for path in pending.drain(..) {
        // There is nobody left to tell of a failure.
        let _ = fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
    }
    std::mem::forget(pending);
}

/// Temporary file beside an output.
pub struct Temporary {
    file: NamedTempFile,
    target: Target,
}

impl Temporary {
    /// Creates an empty file beside `target`, with its permissions.
    pub fn beside(target: Target) -> Result<Self> {
        let error = |cause| Error::write(&target.named, cause);
        let mut prefix = OsString::from(".");
        prefix.push(target.real.file_name().unwrap_or_default());
        prefix.push(".");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".tmp").rand_bytes(16);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // less the umask
        step(Step::Create(&target.real)).map_err(error)?;
        let mut pending = pending();
        let file = builder.tempfile_in(folder_of(&target.real)).map_err(error)?;
        pending.push(file.path().into());
        drop(pending);
        if let Some(permissions) = target.permissions.clone() {
            file.as_file().set_permissions(permissions).map_err(error)?;
        }
        Ok(Self { file, target })
    }

    /// Creates a file beside `target`, and writes it whole.
    pub fn written(
        target: Target,
        write: impl FnOnce(&mut dyn Write) -> Result<()>,
    ) -> Result<Self> {
        let mut temporary = Self::beside(target)?;
        let mut writer = BufWriter::new(&mut temporary);
        write(&mut writer)?;
        let flushed = writer.flush();
        drop(writer);
        let synced = flushed.and_then(|()| sync(temporary.file.as_file(), temporary.file.path()));
        synced.map_err(|cause| Error::write(&temporary.target.named, cause))?;
        Ok(temporary)
    }
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        step(Step::Write(self.file.path()))?;
        self.file.as_file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Renames files to those that they were made for, one after the other; then removes files of an `earlier` run.
pub fn put_in_place(written: Vec<Temporary>, earlier: &[PathBuf]) -> Result<()> {
    // An interruption waits until all is done.
    let mut pending = pending();
    let folders: BTreeSet<PathBuf> = written.iter().map(|it| folder_of(&it.target.real)).collect();
    for Temporary { file, target } in written {
        let error = |cause| Error::write(&target.named, cause);
        step(Step::Rename(file.path(), &target.real)).map_err(error)?;
        let path = file.path().to_path_buf();
        file.persist(&target.real).map_err(|failed| error(failed.error))?;
        pending.retain(|other| *other != path);
    }
    for path in earlier {
        let removed = step(Step::Remove(path)).and_then(|()| fs::remove_file(path));
        match removed {
            Err(cause) if cause.kind() != ErrorKind::NotFound => {
                return Err(Error::write(path, cause));
            }
            _ => {}
        }
    }
    for folder in folders {
        // The files are there; not every system can tell when a folder is safe.
        let _ = File::open(&folder).and_then(|opened| sync(&opened, &folder));
    }
    Ok(())
}

/// Waits until a file or folder is safe from loss of power.
fn sync(file: &File, path: &Path) -> io::Result<()> {
    step(Step::Sync(path))?;
    file.sync_all()
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => ".".into(),
    }
}

/// Folder for one's own use among the system's temporary files. It goes with all that is in it.
#[derive(Debug)]
pub struct Scratch(TempDir);

impl Scratch {
    /// Makes a folder.
    pub fn new() -> io::Result<Self> {
        let mut pending = pending();
        let folder = Builder::new().prefix(".taxel.").suffix(".tmp").tempdir()?;
        pending.push(folder.path().into());
        Ok(Self(folder))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// Temporary folder beside one that is to be made.
pub struct Folder<'p> {
    folder: TempDir,
    target: &'p Path,
}

impl<'p> Folder<'p> {
    /// Makes an empty folder beside `target`, and the folders around it.
    pub fn beside(target: &'p Path) -> Result<Self> {
        let error = |cause| Error::write(target, cause);
        let around = folder_of(target);
        fs::create_dir_all(&around).map_err(error)?;
        let mut prefix = OsString::from(".");
        prefix.push(target.file_name().unwrap_or_default());
        prefix.push(".");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".tmp").rand_bytes(16);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777)); // less the umask
        step(Step::Create(target)).map_err(error)?;
        let mut pending = pending();
        let folder = builder.tempdir_in(&around).map_err(error)?;
        pending.push(folder.path().into());
        Ok(Self { folder, target })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Renames the folder to the one that it was made for.
    pub fn put_in_place(self) -> Result<()> {
        // An interruption waits until all is done.
        let mut pending = pending();
        let path = self.folder.path().to_path_buf();
        step(Step::Rename(&path, self.target))
            .and_then(|()| fs::rename(&path, self.target))
            .map_err(|cause| Error::write(self.target, cause))?;
        // Nothing is left to be removed.
        let _ = self.folder.keep();
        pending.retain(|other| *other != path);
        Ok(())
    }
}

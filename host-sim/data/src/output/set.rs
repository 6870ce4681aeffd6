//! Files of a folder that belong together: those of one run, or of another one, never of both.
//!
//! 1. All files are written to a hidden folder `.<set>.<digits>.tmp` in the folder.
//! 2. It is renamed to `.ready`. From here on the new files are in force: who comes next completes what follows.
//! 3. All old files go except the first, which is replaced.
//! 4. The hidden folder is renamed to `.moving`, its files move into the folder, the first one first, and it goes.
//!
//! Whoever is killed in between leaves files of one run. One process at a time does this in a folder, which it locks.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use super::disk::{Disk, Sink, System};
use super::pending;
use super::place;
use super::temporary::{digits_between, entries, unguessable};
use crate::error::{Error, Result};

/// Ends of the hidden folder's name, in the order of steps.
const BEGUN: &str = ".tmp";
const READY: &str = ".ready";
const MOVING: &str = ".moving";

/// Time for another program to move its files.
const PATIENCE: Duration = Duration::from_secs(10);

/// Files that belong together.
#[derive(Debug, Clone, Copy)]
pub struct FileSet {
    /// Name of what writes them.
    pub name: &'static str,
    /// Names of all files that there may be. The first is there always.
    pub files: &'static [&'static str],
}

impl FileSet {
    /// Checks before long work that [`write`](Self::write) can write to `folder` and would not replace one of the
    /// command's own `inputs`. Completes what a killed process has begun there; otherwise nothing is changed.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written, or [`Error::WrittenOverInput`] if it is an input.
    pub fn check(&self, folder: &Path, inputs: &[&Path]) -> Result<()> {
        for path in self.files.iter().map(|file| folder.join(file)) {
            permissions(&path).map_err(|cause| Error::write(&path, cause))?;
            super::check_no_input(&path, inputs)?;
        }
        // A folder that is not there is made at the end: what is stopped before then leaves none.
        let there = folder.ancestors().find(|path| path.exists()).unwrap_or(Path::new("."));
        let _held = self.hold(&System, there).map_err(|cause| Error::write(folder, cause))?;
        let begun = Hidden::inside(&System, there, self.name);
        begun.map(drop).map_err(|cause| Error::write(folder, cause))
    }

    /// Writes files, by name and content, to `folder`, which is made if it is not there. Other files of the set
    /// are removed: they are from an earlier run. All of that is done, or none.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written.
    pub fn write(&self, folder: &Path, contents: &[(&str, &[u8])]) -> Result<()> {
        self.write_on(&System, folder, contents)
    }

    /// Writes files as [`write`](Self::write) does, by the calls of a `disk`.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written.
    pub fn write_on(
        &self,
        disk: &dyn Disk,
        folder: &Path,
        contents: &[(&str, &[u8])],
    ) -> Result<()> {
        let error = |cause| Error::write(folder, cause);
        let made = Made::folder(disk, folder).map_err(error)?;
        let _held = self.hold(disk, folder).map_err(error)?;
        let mut hidden = Hidden::inside(disk, folder, self.name).map_err(error)?;
        for (name, bytes) in contents {
            let path = folder.join(name);
            hidden.write(name, &path, bytes).map_err(|cause| Error::write(&path, cause))?;
        }
        sync(disk, &hidden.path).map_err(error)?;

        // An interruption waits until all is done.
        let mut pending = pending::lock();
        let ready = hidden.path.with_extension(&READY[1..]);
        disk.rename(&hidden.path, &ready).map_err(error)?;
        hidden.is_done = true;
        pending.forget(&hidden.path);
        made.keep(&mut pending);
        // A fault that passes is no reason to leave this to who comes next.
        let done = self.place(disk, folder, &ready);
        let done = done.or_else(|_| self.place(disk, folder, &ready));
        drop(pending);
        done.map_err(error)
    }

    /// Locks the folder against other processes as long as the result lives, and completes what killed ones have begun.
    /// Where folders cannot be locked, nothing is done: others may be at work.
    fn hold(&self, disk: &dyn Disk, folder: &Path) -> io::Result<Option<File>> {
        let Ok(folder_file) = File::open(folder) else { return Ok(None) };
        let start = Instant::now();
        loop {
            match folder_file.try_lock() {
                Ok(()) => break,
                Err(TryLockError::Error(_)) => return Ok(None),
                Err(TryLockError::WouldBlock) if start.elapsed() > PATIENCE => {
                    return Err(io::Error::other("another program writes to it"));
                }
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(1)),
            }
        }
        let found: Vec<PathBuf> = entries(folder).map(|entry| entry.path()).collect();
        for path in found {
            let name = path.file_name().unwrap_or_default();
            let ends_in = |end| digits_between(name, self.name.as_ref(), end);
            if ends_in(READY) || ends_in(MOVING) {
                self.place(disk, folder, &path.with_extension(&READY[1..]))?;
            } else if ends_in(BEGUN) {
                discard(disk, &path);
            }
        }
        Ok(Some(folder_file))
    }

    /// Puts the files of a hidden folder that is `ready`, or was and is moving now, in their places.
    fn place(&self, disk: &dyn Disk, folder: &Path, ready: &Path) -> io::Result<()> {
        let moving = ready.with_extension(&MOVING[1..]);
        if ready.exists() {
            let is_replaced = self.files.first().is_some_and(|first| ready.join(first).exists());
            for name in &self.files[usize::from(is_replaced)..] {
                remove_if_there(disk, &folder.join(name))?;
            }
            disk.rename(ready, &moving)?;
        }
        for name in self.files {
            match disk.rename(&moving.join(name), &folder.join(name)) {
                // Not written, or moved before.
                Err(cause) if cause.kind() == ErrorKind::NotFound => {}
                other => other?,
            }
        }
        disk.remove_folder(&moving)?;
        // Files are there; not every system can tell when a folder is safe.
        let _ = sync(disk, folder);
        Ok(())
    }
}

/// Permissions of the file at `path`, which will be replaced; `None` if nothing is there.
fn permissions(path: &Path) -> io::Result<Option<fs::Permissions>> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_file() => place::writable(path).map(Some),
        Ok(found) if found.is_dir() => Err(ErrorKind::IsADirectory.into()),
        Ok(found) if found.is_symlink() => {
            Err(io::Error::other("it is a link, and the folder's files are replaced together"))
        }
        Ok(_) => Err(io::Error::other("it is no file")),
        Err(_) => Ok(None),
    }
}

/// Waits until a folder is safe, on systems that can do that.
fn sync(disk: &dyn Disk, folder: &Path) -> io::Result<()> {
    let Ok(opened) = File::open(folder) else { return Ok(()) };
    match disk.sync(&opened) {
        Err(cause) if [ErrorKind::InvalidInput, ErrorKind::Unsupported].contains(&cause.kind()) => {
            Ok(())
        }
        other => other,
    }
}

fn remove_if_there(disk: &dyn Disk, path: &Path) -> io::Result<()> {
    match disk.remove(path) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Removes a hidden folder and the files in it, as far as that can be done.
fn discard(disk: &dyn Disk, hidden: &Path) {
    for entry in entries(hidden) {
        let _ = disk.remove(&entry.path());
    }
    let _ = disk.remove_folder(hidden);
}

/// Hidden folder that receives the new files.
struct Hidden<'d> {
    disk: &'d dyn Disk,
    path: PathBuf,
    is_done: bool,
}

impl<'d> Hidden<'d> {
    fn inside(disk: &'d dyn Disk, folder: &Path, name: &str) -> io::Result<Self> {
        let path = folder.join(unguessable(Some(name.as_ref()), BEGUN));
        let mut pending = pending::lock();
        disk.make_folder(&path)?;
        pending.add_tree(&path);
        Ok(Self { disk, path, is_done: false })
    }

    /// Writes a file that will replace the one at `old`, and keeps its permissions.
    fn write(&mut self, name: &str, old: &Path, bytes: &[u8]) -> io::Result<()> {
        let permissions = permissions(old)?;
        let pending = pending::lock();
        let file = self.disk.create(&self.path.join(name))?;
        drop(pending);
        if let Some(permissions) = permissions {
            self.disk.set_permissions(&file, permissions)?;
        }
        let mut writer = BufWriter::new(Sink::new(self.disk, &file));
        writer.write_all(bytes)?;
        writer.flush()?;
        self.disk.sync(&file)
    }
}

impl Drop for Hidden<'_> {
    fn drop(&mut self) {
        if !self.is_done {
            discard(self.disk, &self.path);
            pending::lock().forget(&self.path);
        }
    }
}

/// Folders that were made, and go again if they stay empty.
struct Made<'d> {
    disk: &'d dyn Disk,
    folders: Vec<PathBuf>,
}

impl<'d> Made<'d> {
    /// Makes a folder, and those that it is in, as far as they are not there.
    fn folder(disk: &'d dyn Disk, folder: &Path) -> io::Result<Self> {
        let is_new = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let mut wanted: Vec<&Path> = folder.ancestors().take_while(is_new).collect();
        wanted.reverse();
        let mut made = Self { disk, folders: Vec::new() };
        for path in wanted {
            let mut pending = pending::lock();
            match disk.make_folder(path) {
                Err(cause) if cause.kind() == ErrorKind::AlreadyExists && path.is_dir() => {}
                Err(cause) => {
                    drop(pending);
                    return Err(cause);
                }
                Ok(()) => {
                    pending.add_folder(path);
                    made.folders.push(path.into());
                }
            }
        }
        Ok(made)
    }

    /// Leaves the folders where they are.
    fn keep(mut self, pending: &mut pending::Pending) {
        self.folders.drain(..).for_each(|path| pending.forget(&path));
    }
}

impl Drop for Made<'_> {
    fn drop(&mut self) {
        for path in self.folders.drain(..).rev() {
            // Only an empty folder can be removed.
            let _ = self.disk.remove_folder(&path);
            pending::lock().forget(&path);
        }
    }
}

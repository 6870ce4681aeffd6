//! The calls to the system that write outputs: a seam, so that tests can let every one of them fail.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::path::Path;

/// Calls to the system. By default each of them does what it says.
pub trait Disk {
    /// Creates a file that is not there yet; a link at its place is not followed.
    ///
    /// # Errors
    /// Error of the system; also if there is anything at `path`.
    fn create(&self, path: &Path) -> io::Result<File> {
        OpenOptions::new().write(true).create_new(true).open(path)
    }

    /// Writes some of `bytes`; returns how many.
    ///
    /// # Errors
    /// Error of the system. After [`io::ErrorKind::Interrupted`] it is called again.
    fn write(&self, mut file: &File, bytes: &[u8]) -> io::Result<usize> {
        file.write(bytes)
    }

    /// Sets the permissions of a file.
    ///
    /// # Errors
    /// Error of the system.
    fn set_permissions(&self, file: &File, permissions: Permissions) -> io::Result<()> {
        file.set_permissions(permissions)
    }

    /// Waits until a file or a folder is safe from loss of power.
    ///
    /// # Errors
    /// Error of the system.
    fn sync(&self, file: &File) -> io::Result<()> {
        file.sync_all()
    }

    /// Renames a file or a folder, over whatever file stands at `to`.
    ///
    /// # Errors
    /// Error of the system.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    /// Removes a file.
    ///
    /// # Errors
    /// Error of the system.
    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    /// Makes a folder.
    ///
    /// # Errors
    /// Error of the system; also if there is anything at `path`.
    fn make_folder(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    /// Removes an empty folder.
    ///
    /// # Errors
    /// Error of the system.
    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir(path)
    }
}

/// The computer's own disks.
#[derive(Debug, Clone, Copy)]
pub struct System;

impl Disk for System {}

/// Writer to a file by the calls of a disk.
pub struct Sink<'d> {
    disk: &'d dyn Disk,
    file: &'d File,
}

impl<'d> Sink<'d> {
    /// Writer to `file`.
    pub fn new(disk: &'d dyn Disk, file: &'d File) -> Self {
        Self { disk, file }
    }
}

impl Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.disk.write(self.file, bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

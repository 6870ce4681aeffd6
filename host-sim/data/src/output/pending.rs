//! What goes if the program is interrupted: temporary files and folders that are there now.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static PENDING: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// Something to remove.
#[derive(Debug)]
enum Entry {
    File(PathBuf),
    /// A folder, if it is empty.
    Folder(PathBuf),
    /// A folder with all that is in it.
    Tree(PathBuf),
}

impl Entry {
    fn path(&self) -> &Path {
        match self {
            Self::File(path) | Self::Folder(path) | Self::Tree(path) => path,
        }
    }

    fn remove(&self) {
        // There is nobody left to tell of a failure.
        let _ = match self {
            Self::File(path) => fs::remove_file(path),
            Self::Folder(path) => fs::remove_dir(path),
            Self::Tree(path) => fs::remove_dir_all(path),
        };
    }
}

/// The list of what is pending. While one thread has it, an interruption waits.
pub struct Pending(MutexGuard<'static, Vec<Entry>>);

/// Takes the list. A thread that has it must not take it again.
pub fn lock() -> Pending {
    Pending(PENDING.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Pending {
    /// Adds a file.
    pub fn add_file(&mut self, path: &Path) {
        self.0.push(Entry::File(path.into()));
    }

    /// Adds a folder that goes if it is empty.
    pub fn add_folder(&mut self, path: &Path) {
        self.0.push(Entry::Folder(path.into()));
    }

    /// Adds a folder that goes with all that is in it.
    pub fn add_tree(&mut self, path: &Path) {
        self.0.push(Entry::Tree(path.into()));
    }

    /// Takes an entry from the list.
    pub fn forget(&mut self, path: &Path) {
        self.0.retain(|entry| entry.path() != path);
    }
}

/// Removes what is pending, for a program that ends at once. From now on no output is begun or completed: threads that
/// try to will wait for ever.
pub fn abandon() {
    let mut pending = lock();
    // Files go before folders that were made for them.
    pending.0.drain(..).rev().for_each(|entry| entry.remove());
    std::mem::forget(pending);
}

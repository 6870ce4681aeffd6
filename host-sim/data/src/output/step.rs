//! Calls to the system that decide what is left of an output: a seam, so that tests can look at the disk before each
//! of them, and let one fail.

use std::cell::RefCell;
use std::io::Result;
use std::path::Path;

/// Call to the system that is about to be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step<'p> {
    /// A temporary file is created beside this one.
    Create(&'p Path),
    /// Bytes are written to this file.
    Write(&'p Path),
    /// This file or folder is made safe from loss of power.
    Sync(&'p Path),
    /// The first file is renamed to the second.
    Rename(&'p Path, &'p Path),
    /// This file is removed.
    Remove(&'p Path),
}

type Watcher = Box<dyn FnMut(Step<'_>) -> Result<()>>;

thread_local! {
    static WATCHER: RefCell<Option<Watcher>> = const { RefCell::new(None) };
}

/// Does `work`, and calls `watcher` before each step that this thread takes in it. If that returns an error, the step
/// fails with it.
pub fn watched<T>(
    watcher: impl FnMut(Step<'_>) -> Result<()> + 'static,
    work: impl FnOnce() -> T,
) -> T {
    WATCHER.set(Some(Box::new(watcher)));
    let done = work();
    WATCHER.set(None);
    done
}

/// Announces a step.
pub fn step(step: Step<'_>) -> Result<()> {
    WATCHER.with_borrow_mut(|watcher| watcher.as_mut().map_or(Ok(()), |watcher| watcher(step)))
}

//! A disk of which the n-th call fails.

use std::cell::Cell;
use std::fs::{File, Permissions};
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

use taxel_data::output::{Disk, System};

/// Kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// From the call on there is no space left: nothing can be created or written.
    Full,
    /// One call fails as if there were no space left.
    FullOnce,
    /// One call fails by an error of the device.
    Broken,
    /// From the call on everything fails, even removing files.
    Stuck,
    /// One write fails because its reader has gone.
    Pipe,
    /// One write is interrupted by a signal.
    Interrupted,
    /// One write takes a single byte.
    Short,
    /// The program is killed before the call.
    Killed,
}

impl Kind {
    pub const ALL: [Self; 8] = [
        Self::Full,
        Self::FullOnce,
        Self::Broken,
        Self::Stuck,
        Self::Pipe,
        Self::Interrupted,
        Self::Short,
        Self::Killed,
    ];

    /// Whether the work must go on.
    pub fn is_harmless(self) -> bool {
        matches!(self, Self::Interrupted | Self::Short)
    }

    fn strikes_writes_alone(self) -> bool {
        matches!(self, Self::Pipe | Self::Interrupted | Self::Short)
    }

    fn cause(self) -> Error {
        match self {
            Self::Full | Self::FullOnce => ErrorKind::StorageFull.into(),
            Self::Pipe => ErrorKind::BrokenPipe.into(),
            Self::Interrupted => ErrorKind::Interrupted.into(),
            Self::Broken | Self::Stuck | Self::Short | Self::Killed => {
                Error::other("input/output error")
            }
        }
    }
}

/// What a call does.
#[derive(Clone, Copy, PartialEq)]
enum Call {
    /// Takes space.
    Create,
    Write,
    Other,
}

/// Disk that fails once, or from some call on.
pub struct FaultyDisk {
    kind: Kind,
    /// Number of the call at which the fault strikes; 0 for none.
    strikes_at: usize,
    calls: Cell<usize>,
}

impl FaultyDisk {
    /// Disk that counts the calls at which a fault of this kind can strike.
    pub fn counting(kind: Kind) -> Self {
        Self::failing(kind, 0)
    }

    pub fn failing(kind: Kind, call: usize) -> Self {
        Self { kind, strikes_at: call, calls: Cell::new(0) }
    }

    /// Number of calls until now.
    pub fn calls(&self) -> usize {
        self.calls.get()
    }

    /// Counts a call, and returns whether the fault strikes.
    fn strikes(&self, call: Call) -> bool {
        if self.kind.strikes_writes_alone() && call != Call::Write {
            return false;
        }
        self.calls.set(self.calls.get() + 1);
        let is_now = self.calls.get() == self.strikes_at;
        let is_later = self.strikes_at > 0 && self.calls.get() > self.strikes_at;
        match self.kind {
            Kind::Killed | Kind::Stuck => is_now || is_later,
            Kind::Full => (is_now || is_later) && call != Call::Other,
            _ => is_now,
        }
    }

    fn call<T>(&self, call: Call, work: impl FnOnce() -> Result<T>) -> Result<T> {
        if self.strikes(call) { Err(self.kind.cause()) } else { work() }
    }
}

impl Disk for FaultyDisk {
    fn create(&self, path: &Path) -> Result<File> {
        self.call(Call::Create, || System.create(path))
    }

    fn write(&self, file: &File, bytes: &[u8]) -> Result<usize> {
        match self.strikes(Call::Write) {
            false => System.write(file, bytes),
            true if self.kind == Kind::Short => System.write(file, &bytes[..bytes.len().min(1)]),
            true => Err(self.kind.cause()),
        }
    }

    fn set_permissions(&self, file: &File, permissions: Permissions) -> Result<()> {
        self.call(Call::Other, || System.set_permissions(file, permissions))
    }

    fn sync(&self, _: &File) -> Result<()> {
        // Power is not lost here, and waiting takes time.
        self.call(Call::Other, || Ok(()))
    }

    fn rename(&self, from: &Path, to: &Path) -> Result<()> {
        self.call(Call::Other, || System.rename(from, to))
    }

    fn remove(&self, path: &Path) -> Result<()> {
        self.call(Call::Other, || System.remove(path))
    }

    fn make_folder(&self, path: &Path) -> Result<()> {
        self.call(Call::Create, || System.make_folder(path))
    }

    fn remove_folder(&self, path: &Path) -> Result<()> {
        self.call(Call::Other, || System.remove_folder(path))
    }
}

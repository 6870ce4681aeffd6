//! What can go wrong, told so that a user can mend it.

use std::path::{Path, PathBuf};

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure. Each message names the file, the place and the value, and says what would be right.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene file says something that cannot be.
    #[error("scene {scene}: {message}")]
    Scene {
        /// File or name of the scene.
        scene: String,
        /// Field, value and fix.
        message: String,
    },
    /// A data file cannot be used.
    #[error("{}: {message}", path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// Line or column, value and fix.
        message: String,
    },
    /// An option has an unusable value.
    #[error("{0}")]
    Usage(String),
    /// A blob was refused.
    #[error("{}: {cause}", path.display())]
    Blob {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: model_core::blob::DecodeError,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {cause}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {cause}; choose another place with -o", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The work itself failed.
    #[error("{0}")]
    Failed(String),
}

impl Error {
    /// Exit status for the shell: 2 for bad usage or input, 1 for work that failed.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Failed(_) => 1,
            _ => 2,
        }
    }

    pub(crate) fn data(path: &Path, message: impl Into<String>) -> Self {
        Self::Data { path: path.into(), message: message.into() }
    }

    pub(crate) fn read(path: &Path, cause: std::io::Error) -> Self {
        Self::Read { path: path.into(), cause }
    }

    pub(crate) fn write(path: &Path, cause: std::io::Error) -> Self {
        Self::Write { path: path.into(), cause }
    }
}

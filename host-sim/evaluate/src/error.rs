//! Errors of the program, as values that a command can match.

use std::fmt;
use std::path::PathBuf;

use taxel_data::BadValue;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure of a command. Each message names the file, the place and the value, and says what would be
/// right.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Refusal or failure of the crates that compute.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Device that failed, other than by a refusal or failure of [`Data`](Self::Data).
    #[error(transparent)]
    Rig(taxel_rig::Error),
    /// File that is not what a command needs.
    #[error("{}: {message}", path.display())]
    Unfit {
        path: PathBuf,
        /// Reason, and a remedy.
        message: String,
    },
    /// Options that cannot be used, or not together.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// Error for work that failed, and the `reason`.
    pub fn failed(reason: impl Into<String>) -> Self {
        taxel_data::Error::failed(reason).into()
    }

    /// Error for a scene with this name or path, and what is wrong with it.
    pub fn of_scene(scene: &str, cause: impl fmt::Display) -> Self {
        taxel_data::Error::unfit(format!("scene {scene}: {cause}")).into()
    }
}

impl From<BadValue> for Error {
    fn from(bad: BadValue) -> Self {
        Self::Data(bad.into())
    }
}

impl From<taxel_rig::Error> for Error {
    fn from(error: taxel_rig::Error) -> Self {
        match error {
            taxel_rig::Error::Data(error) => Self::Data(error),
            error => Self::Rig(error),
        }
    }
}

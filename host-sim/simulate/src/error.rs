//! Errors of a simulation, as values that a program can match.

use embedded_hal::{digital, spi};
use taxel_data::BadValue;

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Request that a real part of the board would not have accepted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Violation(pub(crate) String);

impl digital::Error for Violation {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl spi::Error for Violation {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// Failure of a simulation.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// World with a setting that cannot be used.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// Data file that cannot be used.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Virtual board whose parts were used as real ones must not be.
    #[error("the virtual board refused {times} times, first: {first}")]
    Board { times: usize, first: Violation },
}

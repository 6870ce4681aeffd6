//! What can go wrong in a simulation, as values that a program can match.

use embedded_hal::{digital, spi};
use taxel_data::BadValue;

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Something that a real part of the board would not have accepted.
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

/// A failure of a simulation.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A world has a setting that cannot be used.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// A data file cannot be used.
    #[error(transparent)]
    Data(#[from] taxel_data::Error),
    /// Parts of the virtual board were used as real ones must not be.
    #[error("the virtual board refused {times} times, first: {first}")]
    Board {
        /// How often.
        times: usize,
        /// The first time.
        first: Violation,
    },
    /// The line that drives a virtual board failed.
    #[error("the readout's line failed: {0}")]
    Line(#[from] std::io::Error),
    /// The line that drives a virtual board asked for what does not exist.
    #[error("the readout's line asks for {0}, which does not exist")]
    UnknownRequest(String),
}

//! Requests that no real part would accept, as errors of embedded-hal.

use embedded_hal::{digital, spi};

/// Request that a real part of the board would not have accepted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Violation(pub(super) String);

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

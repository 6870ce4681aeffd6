//! Looks for bytes on a line.

use std::io::ErrorKind;
use std::time::Duration;

use super::Wire;
use crate::error::{Error, Result};

/// Time that one look waits.
pub const GLANCE: Duration = Duration::from_millis(5);

/// Number of bytes that came; 0 if none did in time.
///
/// # Errors
/// [`Error::Closed`] at the line's end, or if it fails.
pub fn read(wire: &mut dyn Wire, bytes: &mut [u8]) -> Result<usize> {
    match wire.read(bytes) {
        Ok(0) => Err(Error::Closed),
        Ok(count) => Ok(count),
        Err(cause) if is_timeout(&cause) => Ok(0),
        Err(cause) => Err(cause.into()),
    }
}

/// Whether a look ended because nothing came.
pub fn is_timeout(cause: &std::io::Error) -> bool {
    matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

//! The interface of a board to the application, besides the sensor and the slots. No function may wait, but for an erase of
//! the storage.

use crate::link::message::Memory;
use crate::store::{Journal, Slot};

/// A serial line to the host. It must keep at least 1000 bytes that arrive while the application scans and decodes.
pub trait Line {
    /// Receives the next byte from the other end, if one has arrived.
    fn receive(&mut self) -> Option<u8>;

    /// Queues bytes for the other end, from the first on; returns how many of them there was room for.
    fn send(&mut self, bytes: &[u8]) -> usize;
}

/// Clocks that never stop, and wrap around to 0 after their largest values.
pub trait Clock {
    /// Time in µs.
    fn now_us(&mut self) -> u32;

    /// Count of the processor's cycles; always 0 on a board without a counter.
    fn cycles(&self) -> u32 {
        0
    }
}

/// Timer that restarts the board if it is not fed.
pub trait Watchdog {
    /// Feeds the watchdog, so that it waits for another period.
    fn feed_watchdog(&mut self);
}

/// Memory besides the slots that survives a restart.
pub trait Storage {
    /// A page of the journal.
    type Page: Slot;

    /// The journal.
    fn journal(&mut self) -> &mut Journal<Self::Page>;
}

/// A board: its parts and its identity.
pub trait Platform: Line + Clock + Watchdog + Storage {
    /// Name of the board, as the link reports it.
    const BOARD: &'static str;

    /// Use of flash and RAM.
    fn memory(&self) -> Memory;

    /// Makes the chip reset while its supply is too low, from the next restart on and for good. Returns whether it does.
    fn set_brown_out(&mut self) -> bool {
        false
    }

    /// Shows outside whether a touch, its load and its slip go on.
    fn signal(&mut self, _going_on: [bool; 3]) {}

    /// Number that no other board of its kind has; zeros on a board without one.
    fn unique_id(&self) -> [u8; 12] {
        [0; 12]
    }
}

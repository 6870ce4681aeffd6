//! The interface of a board to the application, besides the sensor and the slots.

use crate::link::message::Memory;
use crate::store::{Journal, Slot};

/// A serial line, and a clock for time limits on it. No function may wait.
pub trait Port {
    /// Time in µs of a clock that never stops, and wraps around to 0 after its largest value.
    fn now_us(&mut self) -> u32;

    /// Receives the next byte from the other end, if one has arrived.
    fn receive(&mut self) -> Option<u8>;

    /// Queues a byte for the other end; returns `false` if there is no room.
    fn send(&mut self, byte: u8) -> bool;
}

/// A board, whose port leads to the host. The port must keep at least 1000 bytes that arrive while the
/// application scans and decodes.
pub trait Platform: Port {
    /// A page of the journal.
    type Page: Slot;

    /// Name of the board, as the link reports it.
    const BOARD: &'static str;

    /// Feeds the watchdog, so that it waits for another period.
    fn feed_watchdog(&mut self);

    /// Use of flash and RAM.
    fn memory(&self) -> Memory;

    /// What survives a restart besides the slots.
    fn journal(&mut self) -> &mut Journal<Self::Page>;

    /// Makes the chip reset while its supply is too low, from the next restart on and for good. Returns whether it does.
    fn set_brown_out(&mut self) -> bool {
        false
    }

    /// Number that no other board of its kind has; zeros on a board without one.
    fn unique_id(&self) -> [u8; 12] {
        [0; 12]
    }

    /// Count of the processor's cycles, which wraps around; always 0 on a board without a counter.
    fn cycles(&self) -> u32 {
        0
    }
}

//! What the application needs of a board, besides the sensor and the slots.

use crate::link::message::Memory;

/// A serial line, and a clock to give it up by. Nothing here waits.
pub trait Port {
    /// A clock in µs that never stops, and starts anew from 0 after its largest value.
    fn now_us(&mut self) -> u32;

    /// The next byte from the other end, if one has arrived.
    fn receive(&mut self) -> Option<u8>;

    /// Takes a byte for the other end, if there is room.
    fn send(&mut self, byte: u8) -> bool;
}

/// A board. Its port leads to the host, and must keep at least 1000 bytes that arrive while the
/// application scans and decodes.
pub trait Platform: Port {
    /// The board's name, as the link tells it.
    const BOARD: &'static str;

    /// Holds the watchdog off for another period.
    fn feed_watchdog(&mut self);

    /// Where flash and RAM go.
    fn memory(&self) -> Memory;
}

//! What the application needs of a board, besides the sensor and the slots.

use crate::link::message::Memory;

/// A board. Nothing here waits.
pub trait Platform {
    /// The board's name, as the link tells it.
    const BOARD: &'static str;

    /// A clock in µs that never stops, and starts anew from 0 after its largest value.
    fn now_us(&mut self) -> u32;

    /// The next byte from the host, if one has arrived. At least the last 1 KiB of them must be kept
    /// while the application scans and decodes.
    fn receive(&mut self) -> Option<u8>;

    /// Takes a byte for the host, if there is room.
    fn send(&mut self, byte: u8) -> bool;

    /// Holds the watchdog off for another period.
    fn feed_watchdog(&mut self);

    /// Where flash and RAM go.
    fn memory(&self) -> Memory;
}

//! The interface of a board to the application, besides the sensor and the slots.

use crate::link::message::Memory;
use crate::settings::Keeper;
use crate::store::Slot;

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
    /// Memory that keeps settings over restarts.
    type Settings: Keeper;

    /// Flash that holds the device's key, and nothing else. It is not erased once a key is set. Zeros can be written over
    /// whatever it holds.
    type KeyArea: Slot;

    /// Name of the board, as the link reports it.
    const BOARD: &'static str;

    /// Feeds the watchdog, so that it waits for another period.
    fn feed_watchdog(&mut self);

    /// Use of flash and RAM.
    fn memory(&self) -> Memory;

    /// The memory that keeps settings.
    fn settings(&mut self) -> &mut Self::Settings;

    /// The flash that holds the key.
    fn key_area(&mut self) -> &mut Self::KeyArea;

    /// Count of the processor's cycles, which wraps around; always 0 on a board without a counter.
    fn cycles(&self) -> u32 {
        0
    }
}

//! Drivers for the board NUCLEO-F446RE. `docs/board.md` has the wiring.
//!
//! On any other target this library is empty.
#![cfg(target_os = "none")]
#![no_std]

// From the ground up: a module imports only what is declared before it.
mod clock;
mod fault;
mod power;
mod flash;
mod oscillator;
mod reset;
mod dma;
mod serial;
mod slot;
mod own_converters;
mod self_test;
mod board;
mod device;

pub use board::Board;
pub use board_common::memory;
pub use clock::Clock;
pub use device::run;
pub use fault::Fault;
pub use oscillator::Oscillator;
pub use own_converters::{COLUMNS, LINES, OwnConverters};
pub use reset::{ResetCause, restart};
pub use serial::{BAUD, Serial};
pub use slot::{Slot, SlotError};

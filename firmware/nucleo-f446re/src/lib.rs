//! Drivers for the board NUCLEO-F446RE. `docs/board.md` has the wiring.
//!
//! On any other target this library is empty.
#![cfg(target_os = "none")]
#![no_std]

// From the ground up: a module imports only what is declared before it.
mod bus;
mod clock;
mod rest;
mod fault;
mod power;
mod flash;
mod held_pin;
mod oscillator;
mod reset;
mod serial;
mod slot;
mod board;
mod own_converters;
mod device;

pub use board::{
    Board, CONVERTERS, Converter, Converters, OwnConverters, Readout, ReadoutParts, RowPin, SPI_HZ,
    Select,
};
pub use board_common::memory;
pub use bus::Bus;
pub use clock::Clock;
pub use device::run;
pub use fault::Fault;
pub use held_pin::HeldPin;
pub use oscillator::Oscillator;
pub use own_converters::{COLUMNS, LINES, OnChip};
pub use reset::{ResetCause, restart};
pub use serial::{BAUD, Serial};
pub use slot::{Slot, SlotError};

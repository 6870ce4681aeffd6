//! The board NUCLEO-F446RE: what a program needs of it. `docs/board.md` has the wiring.
//!
//! On any other target this library is empty.
#![cfg(target_os = "none")]
#![no_std]

mod board;
mod clock;
#[path = "../../qemu/src/memory.rs"]
pub mod memory;
mod reset;
mod serial;
mod slot;

pub use board::{Board, Converter, SPI_HZ};
pub use clock::Clock;
pub use reset::{ResetCause, restart};
pub use serial::{BAUD, Serial};
pub use slot::{Slot, SlotError};

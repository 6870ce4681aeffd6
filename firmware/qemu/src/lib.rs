//! Drivers for QEMU's machine mps2-an386, a Cortex-M4F at 25 MHz.
//!
//! Logs are defmt's, through semihosting. A panic, a fault and a stack overflow are logged and end
//! QEMU with a failure. On any other target this library is empty.
#![cfg(target_os = "none")]
#![no_std]

pub use board_common::memory;

// From the ground up: a module imports only what is declared before it.
mod registers;
pub mod mailbox;
pub mod psram;
pub mod clock;
pub mod watchdog;
pub mod exit;
mod fault;
#[cfg(feature = "no-panic")]
mod no_panic;
pub mod slot;
pub mod checks;
pub mod fixed;
pub mod shapes;

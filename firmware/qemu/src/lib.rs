//! QEMU's mps2-an386, a Cortex-M4F at 25 MHz: what a program needs of it.
//!
//! Logs are defmt's, through semihosting. A panic, a fault and a stack overflow are logged and end
//! QEMU with a failure. On any other target this library is empty.
#![cfg(target_os = "none")]
#![no_std]

pub mod checks;
pub mod clock;
pub mod exit;
mod fault;
pub mod mailbox;
pub mod memory;
pub mod psram;
mod registers;
pub mod slot;
pub mod uart;
pub mod watchdog;

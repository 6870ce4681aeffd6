//! Promises of a device in QEMU.

mod gdb;
mod running;

mod extremes;
mod victim;
mod ram;

pub use extremes::EXTREMES;
pub use ram::RAM;

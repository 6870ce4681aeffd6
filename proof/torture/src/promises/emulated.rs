//! Promises of a device in QEMU.

mod gdb;
mod running;

mod victim;
mod ram;

pub use ram::RAM;

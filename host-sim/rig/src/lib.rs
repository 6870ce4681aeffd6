//! A test rig for Taxel's devices, real, emulated, or part of a test.
//!
//! [`device::Device`] is the host's end of the serial link that `docs/link.md` specifies; [`emulator`] runs the
//! firmware's image in QEMU. Modules stand from the ground up; each imports only what stands before it.
//!
#![doc = include_str!("../README.md")]
#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

pub mod image;
pub mod error;
pub mod device;
pub mod scans;
pub mod mailbox;
pub mod emulator;

pub use error::{Error, Result};

//! Inference for resistive tactile sensors: from row–column resistances to deformation.
//!
//! Readings travel one way: frame (Ω, a slice) → [`health`] → ([`fill`](reading_model) →) ([`relative`] →) ([`touch`] →) ([`projection`] →)
//! [`scale`] → [`rbf`] (and its affine tail) → [`Estimate`] (→ [`filter`]). The network's weights are read where the [`blob`] lies, in flash or in a
//! file's buffer: nothing is copied, nothing is allocated, and no release code path of [`Decoder`] panics.
//!
//! The crate knows no pin and no file. The same code serves host, emulator and board, so that
//! their estimates agree bit for bit.
//!
//! The network follows Wang et al., "Decoupling research of flexible tactile
//! sensors interfered by white Gaussian noise using improved RBFNN", Sensors & Transducers, 2014
//! ("the paper").
//!
#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), no_std)]

#[cfg(feature = "std")]
extern crate std;

#[cfg(target_endian = "big")]
compile_error!("the weight blob holds little-endian floats that are borrowed in place");

// From the ground up: a module imports only what is declared before it.

pub mod exp;
pub mod scale;
pub mod relative;
pub mod checksum;
mod frame;
mod estimate;
mod cortex_m4;
pub mod health;
pub mod contact;
pub mod filter;
pub mod rbf;
pub mod touch;
pub mod projection;
pub mod reading_model;
pub mod events;
pub mod blob;
mod infer;
mod frame_decoder;
mod decoder;
mod fixed;
pub mod track;

pub use blob::Aligned;
#[cfg(feature = "std")]
pub use blob::AlignedBytes;
#[cfg(feature = "std")]
pub use decoder::OwnedEstimate;
pub use decoder::{Decoder, decoder_ram_bytes, scratch_floats};
pub use estimate::{Estimate, RowStatus};
pub use fixed::{Decoded, Fixed};
pub use frame::{ColumnWire, ColumnWires, RowWire, Wires};
pub use frame_decoder::{Frame, Networks};

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

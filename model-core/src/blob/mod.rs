//! The weight blob: everything a device needs to decode frames, in one checked, relocatable piece.
//!
//! Postcard fields, opened by magic, version, length and shape, closed by a CRC-32; the format
//! is specified with worked bytes in `docs/blob.md`. [`Model::decode`] parses a blob: it checks all of it and
//! then borrows. [`encode`] is its inverse.

// From the ground up: a module imports only what is declared before it.
mod aligned;
mod metadata;
mod error;
mod format;
mod sections;
mod front;
mod decode;
mod encode;

pub use aligned::Aligned;
#[cfg(feature = "std")]
pub use aligned::AlignedBytes;
pub use decode::Model;
pub(crate) use decode::NetworkSection;
#[cfg(feature = "std")]
pub use encode::encode_to_vec;
pub use encode::{ModelParts, encode, encoded_length_bound};
pub use error::{DecodeError, EncodeError};
pub use format::{FORMAT_VERSION, MAGIC};
pub use front::{Front, MOST_FRONTS};
pub use metadata::{Columns, Floats, Metadata, ModelShape, NoiseKind};

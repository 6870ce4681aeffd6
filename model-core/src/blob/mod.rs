//! The weight blob: everything a device needs to decode, in one checked, relocatable piece.
//!
//! Postcard fields, opened by magic, version, length and shape, closed by a CRC-32; the format
//! is specified with worked bytes in `docs/blob.md`. [`Model::decode`] checks all of it and then
//! borrows; [`encode`] is its inverse and lives beside it.

mod decode;
mod encode;
mod error;
mod format;

pub(crate) use decode::NetworkSection;
pub use decode::{Columns, Floats, Model};
pub use encode::{ModelParts, encode, encoded_length_bound};
pub use error::{DecodeError, EncodeError};
pub use format::{FORMAT_VERSION, MAGIC, NoiseKind};

/// The sizes that a blob declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelShape {
    /// Row-wires: each has a block of `inputs` readings and a block of `outputs`.
    pub rows: usize,
    /// Readings a row.
    pub inputs: usize,
    /// Outputs a row.
    pub outputs: usize,
}

/// What is known of a model beyond its weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metadata<'a> {
    /// Name of the scene or data set.
    pub name: &'a str,
    /// CRC-64/XZ of the scene or data file that trained it.
    pub scene_digest: u64,
    /// How the training noise was defined.
    pub noise_kind: NoiseKind,
    /// Training noise level p, as a fraction (0.005 is 0.5 %).
    pub noise_level: f32,
    /// Seed of every random draw in synthesis and training.
    pub seed: u64,
    /// Frames trained on.
    pub training_frames: u32,
    /// Sensor thickness H in mm, for the positional error; 0 where it has no meaning.
    pub thickness_mm: f32,
    /// Reading columns, row after row: `rows × inputs` names.
    pub input_names: Columns<'a>,
    /// Their units (empty for a plain number).
    pub input_units: Columns<'a>,
    /// Output columns, row after row: `rows × outputs` names.
    pub output_names: Columns<'a>,
    /// Their units.
    pub output_units: Columns<'a>,
    /// RMSE on the training data of each output, in its unit.
    pub training_rmse: Floats<'a>,
    /// Full scale of each output, in its unit, for %FS.
    pub full_scale: Floats<'a>,
}

/// Bytes at an address that the floats of a blob may be borrowed from.
///
/// ```
/// static MODEL: model_core::Aligned<[u8; 4]> = model_core::Aligned(*b"TAXL");
/// assert_eq!(MODEL.0.as_ptr() as usize % 4, 0);
/// ```
#[derive(Debug, Clone, Copy)]
#[repr(C, align(4))]
pub struct Aligned<T: ?Sized>(pub T);

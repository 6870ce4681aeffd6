//! The fields of the blob, in their order. `docs/blob.md` is the specification.

use serde::{Deserialize, Serialize};

use super::error::DecodeError;
use super::metadata::NoiseKind;
use crate::rbf::Format;

/// The first four bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TAXL";
/// Version of the blob format that this crate parses and encodes.
pub const FORMAT_VERSION: u8 = 3;

/// Number of bytes before the postcard fields: magic, version, length.
pub(super) const PREFIX_BYTES: usize = 9;
/// Number of bytes of the closing CRC-32.
pub(super) const CRC_BYTES: usize = 4;
/// Multiple of bytes at which a section of floats starts, because they are borrowed in place.
pub(super) const FLOAT_ALIGNMENT: usize = 4;

/// Tag of the metadata section. Each kind of section has its own tag, and networks have
/// [one for each format](Format::tag); an unknown tag is rejected.
pub(super) const TAG_METADATA: u8 = 0;
/// Tag of a section without fields: the model's inputs are relative to the baseline.
pub(super) const TAG_RELATIVE_INPUTS: u8 = 3;
pub(super) const TAG_FRONT: u8 = 4;
pub(super) const TAG_LINEAR: u8 = 6;
pub(super) const TAG_READING_MODEL: u8 = 8;
pub(super) const TAG_TRACKER: u8 = 9;

/// Bytes 0..9, at fixed places, so that a blob's length is known before anything else is read.
#[derive(Serialize, Deserialize)]
pub(super) struct Prefix {
    pub magic: [u8; 4],
    pub version: u8,
    /// Length of the whole blob in bytes, CRC included; little-endian.
    pub length: [u8; 4],
}

#[derive(Serialize, Deserialize)]
pub(super) struct ShapeField<'a> {
    pub rows: u8,
    pub inputs: u16,
    pub outputs: u16,
    pub networks: u8,
    /// Index of the network for each row: `rows` bytes.
    #[serde(borrow)]
    pub row_network: &'a [u8],
}

#[derive(Serialize, Deserialize)]
pub(super) struct MetadataSection<'a> {
    pub tag: u8,
    #[serde(borrow)]
    pub name: &'a str,
    pub scene_digest: u64,
    pub noise_kind: NoiseKind,
    pub noise_level: f32,
    pub seed: u64,
    pub training_frames: u32,
    pub thickness_mm: f32,
    // Names or units of columns, one a line.
    pub input_names: &'a str,
    pub input_units: &'a str,
    pub output_names: &'a str,
    pub output_units: &'a str,
    // Little-endian f32.
    pub training_rmse: &'a [u8],
    pub full_scale: &'a [u8],
}

/// Held-out errors of the linear decoder.
#[derive(Serialize, Deserialize)]
pub(super) struct LinearSection<'a> {
    pub tag: u8,
    // Little-endian f32.
    #[serde(borrow)]
    pub rmse: &'a [u8],
}

/// Header of a network section; padding and the block of words follow.
#[derive(Serialize, Deserialize)]
pub(super) struct RbfHeader {
    pub tag: u8,
    /// Index of the network; networks are in the order 0, 1, …
    pub index: u8,
    pub centres: u16,
    pub affine: bool,
}

impl RbfHeader {
    /// The network's format, from its tag.
    pub fn format(&self) -> Result<Format, DecodeError> {
        let (expected, found) = (Format::F32.tag(), self.tag);
        Format::from_tag(found).ok_or(DecodeError::SectionOrder { expected, found })
    }
}

/// Header of what stands before a network that sees whole frames; padding and its floats follow.
#[derive(Serialize, Deserialize)]
pub(super) struct FrontHeader {
    pub tag: u8,
    /// Number of outputs of the network.
    pub outputs: u16,
    /// 0: readings as they are. 1: shape and strength, for outputs that are places. 2: for amounts.
    pub kind: u8,
    /// Number of features of the projection; 0 without one.
    pub features: u16,
}

/// Header of the reading model's section; padding and its floats follow.
#[derive(Serialize, Deserialize)]
pub(super) struct ReadingModelHeader {
    pub tag: u8,
    /// Number of factors.
    pub factors: u16,
    /// Number of components of the mixture; 0 for a model that only fills missing readings.
    pub components: u16,
}

/// Header of the tracker's section; padding and its floats follow.
#[derive(Serialize, Deserialize)]
pub(super) struct TrackerHeader {
    pub tag: u8,
    /// Number of electrodes of a row.
    pub electrodes: u8,
    /// Number of columns of a group.
    pub span: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_format_of_networks_has_the_tag_of_another_section() {
        let others = [TAG_FRONT, TAG_RELATIVE_INPUTS, TAG_LINEAR, TAG_READING_MODEL, TAG_TRACKER];
        for tag in others.into_iter().chain([TAG_METADATA]) {
            assert_eq!(Format::from_tag(tag), None);
        }
    }
}

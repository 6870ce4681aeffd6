//! The fields of the format, in their order. `docs/blob.md` is the specification.

use serde::{Deserialize, Serialize};

use super::error::DecodeError;
use super::metadata::NoiseKind;
use crate::rbf::Format;

/// The first four bytes of every blob.
pub const MAGIC: [u8; 4] = *b"TAXL";
/// The version that this crate reads and writes.
pub const FORMAT_VERSION: u8 = 1;

/// Bytes before the postcard fields: magic, version, length.
pub(super) const PREFIX_BYTES: usize = 9;
/// Bytes of the closing CRC-32.
pub(super) const CRC_BYTES: usize = 4;
/// Floats are borrowed in place, so their section starts at a multiple of this.
pub(super) const FLOAT_ALIGNMENT: usize = 4;

/// Section tags. Each kind of section has its own, and those of networks [one a format](Format::tag); an unknown
/// one is refused.
pub(super) const TAG_METADATA: u8 = 0;
pub(super) const TAG_PROJECTION: u8 = 4;

/// Bytes 0..9, at fixed places, so that a blob can be measured before it is trusted.
#[derive(Serialize, Deserialize)]
pub(super) struct Prefix {
    pub magic: [u8; 4],
    pub version: u8,
    /// Whole length in bytes, CRC included; little-endian.
    pub length: [u8; 4],
}

#[derive(Serialize, Deserialize)]
pub(super) struct ShapeField<'a> {
    pub rows: u8,
    pub inputs: u16,
    pub outputs: u16,
    pub networks: u8,
    /// Which network serves each row: `rows` bytes.
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
    // Columns: one a line.
    pub input_names: &'a str,
    pub input_units: &'a str,
    pub output_names: &'a str,
    pub output_units: &'a str,
    // Little-endian f32.
    pub training_rmse: &'a [u8],
    pub full_scale: &'a [u8],
}

/// Opens a network section; `padding` and the float block follow.
#[derive(Serialize, Deserialize)]
pub(super) struct RbfHeader {
    pub tag: u8,
    /// Networks stand in order: 0, 1, …
    pub index: u8,
    pub centres: u16,
    /// One width for all centres, or one each.
    pub common_width: bool,
    pub affine: bool,
}

impl RbfHeader {
    /// What the tag says of the network's format. Only [`Format::F32Direct`] may have a width a centre.
    pub fn format(&self) -> Result<Format, DecodeError> {
        match Format::from_tag(self.tag) {
            None => Err(DecodeError::SectionOrder {
                expected: Format::F32Direct.tag(),
                found: self.tag,
            }),
            Some(Format::F32 | Format::Fixed16) if !self.common_width => {
                Err(DecodeError::Malformed { section: "network section" })
            }
            Some(format) => Ok(format),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_format_of_networks_has_the_tag_of_another_section() {
        for tag in [TAG_METADATA, TAG_PROJECTION] {
            assert_eq!(Format::from_tag(tag), None);
        }
    }
}

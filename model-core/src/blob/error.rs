//! Why a blob is refused, one variant a cause.

use super::metadata::ModelShape;
use crate::rbf::NetworkError;

/// Why bytes are not a model. Nothing is loaded then: the model before stays in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The buffer does not start at a multiple of four, so floats cannot be borrowed.
    #[error("the blob must lie at an address that is a multiple of 4 (wrap it in `Aligned`)")]
    Misaligned,
    /// Not a weight blob at all.
    #[error("not a weight blob: it does not start with \"TAXL\"")]
    BadMagic,
    /// Written by another version of the format.
    #[error("blob format version {found}; this build reads version {supported}")]
    UnsupportedVersion {
        /// Version in the blob.
        found: u8,
        /// Version this build reads.
        supported: u8,
    },
    /// Bytes are missing at the end.
    #[error("blob is truncated: {found} bytes of {expected}")]
    Truncated {
        /// Bytes the blob says it has.
        expected: usize,
        /// Bytes given.
        found: usize,
    },
    /// Bytes follow the blob's end.
    #[error("{extra} bytes follow the end of the blob")]
    TrailingBytes {
        /// How many.
        extra: usize,
    },
    /// The CRC-32 does not match: at least one bit changed.
    #[error("blob is corrupt: CRC-32 is {found:#010x}, should be {expected:#010x}")]
    Corrupt {
        /// Checksum computed over the bytes.
        expected: u32,
        /// Checksum stored.
        found: u32,
    },
    /// A section cannot be read as what it should be.
    #[error("blob is malformed in its {section}")]
    Malformed {
        /// Which section.
        section: &'static str,
    },
    /// A section of a kind this build does not know, or not at its place.
    #[error("blob has a section of kind {found} where kind {expected} belongs")]
    SectionOrder {
        /// Tag that belongs there.
        expected: u8,
        /// Tag found.
        found: u8,
    },
    /// Networks do not stand in the order 0, 1, ….
    #[error("blob has network {found} where network {expected} belongs")]
    NetworkOrder {
        /// Index that belongs there.
        expected: u8,
        /// Index found.
        found: u8,
    },
    /// A row names a network that does not exist.
    #[error("row {row} uses network {network}, but the blob holds {networks}")]
    UnknownNetwork {
        /// Row, from 0.
        row: usize,
        /// Network it names.
        network: u8,
        /// Networks there are.
        networks: u8,
    },
    /// A list has the wrong number of entries for the shape.
    #[error("blob lists {found} {what}; its shape asks for {expected}")]
    CountMismatch {
        /// What is listed.
        what: &'static str,
        /// Entries the shape asks for.
        expected: usize,
        /// Entries there are.
        found: usize,
    },
    /// A number in the metadata is not finite or out of its range.
    #[error("blob metadata: {field} is out of range")]
    InvalidMetadata {
        /// Which field.
        field: &'static str,
    },
    /// The projection is unusable.
    #[error("projection: {cause}")]
    Projection {
        /// What is wrong with it.
        cause: NetworkError,
    },
    /// The parameters of a network are unusable.
    #[error("network {index}: {cause}")]
    Network {
        /// Which network, from 0.
        index: u8,
        /// What is wrong with it.
        cause: NetworkError,
    },
    /// Bytes are left over between the last section and the CRC.
    #[error("{bytes} bytes are left over after the last section")]
    LeftOver {
        /// How many.
        bytes: usize,
    },
    /// The blob is sound, but for a sensor of another shape.
    #[error("blob is for {found:?}; this decoder is built for {expected:?}")]
    ShapeMismatch {
        /// Shape the decoder is built for.
        expected: ModelShape,
        /// Shape of the blob.
        found: ModelShape,
    },
}

/// Why a model cannot be written as a blob.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// The buffer is too small (see [`encoded_length_bound`](super::encoded_length_bound)).
    #[error("the buffer is too small for the blob")]
    BufferTooSmall,
    /// A dimension exceeds what the format holds.
    #[error("{what} is {value}; the format holds at most {most}")]
    TooLarge {
        /// Which dimension.
        what: &'static str,
        /// Its value.
        value: usize,
        /// The largest that fits.
        most: usize,
    },
    /// A network's inputs or outputs differ from the first one's.
    #[error("network {index} has another shape than network 0")]
    UnequalNetworks {
        /// Which network, from 0.
        index: usize,
    },
    /// The outputs of the one network behind a projection do not divide among the rows.
    #[error("{outputs} outputs do not divide among {rows} rows")]
    UnevenRows {
        /// Outputs of the network.
        outputs: usize,
        /// Rows.
        rows: usize,
    },
    /// What would be written could not be read back.
    #[error("the model would be refused when read: {0}")]
    Refused(#[from] DecodeError),
}

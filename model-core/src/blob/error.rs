//! Errors of parsing and encoding a blob, with one variant for each cause.

use crate::rbf::NetworkError;

/// Why bytes are not a model. Nothing is loaded then: the previous model stays in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The buffer does not start at a multiple of four, so floats cannot be borrowed.
    #[error("the blob must lie at an address that is a multiple of 4 (wrap it in `Aligned`)")]
    Misaligned,
    /// The bytes do not start with the magic "TAXL": they are not a blob.
    #[error("not a weight blob: it does not start with \"TAXL\"")]
    BadMagic,
    /// The blob was written in another version of the format.
    #[error(
        "blob format version {found}; this program reads version {supported}: train the model again with it, or use a \
         program of version {found}"
    )]
    UnsupportedVersion {
        /// Version in the blob.
        found: u8,
        /// Version this build reads.
        supported: u8,
    },
    /// Bytes are missing at the end.
    #[error("blob is truncated: {found} bytes of {expected}")]
    Truncated {
        /// Length in bytes that the blob declares.
        expected: usize,
        /// Bytes given.
        found: usize,
    },
    /// Bytes follow the blob's end.
    #[error("{extra} bytes follow the end of the blob")]
    TrailingBytes {
        /// Number of bytes behind the blob.
        extra: usize,
    },
    /// The CRC-32 does not match: at least one bit changed.
    #[error("blob is corrupt: CRC-32 is {found:#010x}, should be {expected:#010x}")]
    Corrupt {
        /// CRC-32 computed over the bytes.
        expected: u32,
        /// CRC-32 stored at the end of the blob.
        found: u32,
    },
    /// A section does not have the fields that it must have.
    #[error("blob is malformed in its {section}")]
    Malformed {
        /// Name of the section.
        section: &'static str,
    },
    /// A section is of an unknown kind, or not in its place.
    #[error("blob has a section of kind {found} where kind {expected} belongs")]
    SectionOrder {
        /// Tag that belongs in this place.
        expected: u8,
        /// Tag found in this place.
        found: u8,
    },
    /// The networks are not in the order 0, 1, ….
    #[error("blob has network {found} where network {expected} belongs")]
    NetworkOrder {
        /// Index that belongs in this place.
        expected: u8,
        /// Index found in this place.
        found: u8,
    },
    /// A row names a network that does not exist.
    #[error("row {row} uses network {network}, but the blob holds {networks}")]
    UnknownNetwork {
        /// Index of the row, from 0.
        row: usize,
        /// Index of the network that it names.
        network: u8,
        /// Number of networks in the blob.
        networks: u8,
    },
    /// A list has the wrong number of entries for the shape.
    #[error("blob lists {found} {what}; its shape asks for {expected}")]
    CountMismatch {
        /// What the list holds.
        what: &'static str,
        /// Number of entries that the shape asks for.
        expected: usize,
        /// Number of entries found.
        found: usize,
    },
    /// A number in the metadata is not finite, or out of its range.
    #[error("blob metadata: {field} is out of range")]
    InvalidMetadata {
        /// Name of the field.
        field: &'static str,
    },
    /// The parameters of shape and strength in front of a projection are not valid.
    #[error("touch: {cause}")]
    Touch {
        /// What is wrong with them.
        cause: NetworkError,
    },
    /// The projection's parameters are not valid.
    #[error("projection: {cause}")]
    Projection {
        /// What is wrong with the projection.
        cause: NetworkError,
    },
    /// The tracker's parameters are not valid.
    #[error("tracker: {cause}")]
    Tracker {
        /// What is wrong with the tracker.
        cause: NetworkError,
    },
    /// The reading model's parameters are not valid.
    #[error("reading model: {cause}")]
    ReadingModel {
        /// What is wrong with the reading model.
        cause: NetworkError,
    },
    /// The parameters of a network are not valid.
    #[error("network {index}: {cause}")]
    Network {
        /// Index of the network, from 0.
        index: u8,
        /// What is wrong with the network.
        cause: NetworkError,
    },
    /// Bytes are left over between the last section and the CRC.
    #[error("{bytes} bytes are left over after the last section")]
    LeftOver {
        /// Number of bytes left over.
        bytes: usize,
    },
    /// The blob is sound, but has more rows than the decoder has room for.
    #[error("blob has {found} rows; this decoder has room for {most}")]
    TooManyRows {
        /// Largest number of rows that the decoder has room for.
        most: usize,
        /// Number of rows of the blob's model.
        found: usize,
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
        /// Name of the dimension.
        what: &'static str,
        /// Value of the dimension.
        value: usize,
        /// Largest value that the format holds.
        most: usize,
    },
    /// Networks and their fronts do not match: their numbers differ, or their inputs or outputs do.
    #[error("network {index} does not fit its front")]
    UnfitFront {
        /// Index of the network, from 0.
        index: usize,
    },
    /// A network has another number of inputs or outputs than network 0.
    #[error("network {index} has another shape than network 0")]
    UnequalNetworks {
        /// Index of the network, from 0.
        index: usize,
    },
    /// The outputs of networks that see whole frames cannot be divided evenly among the rows.
    #[error("{outputs} outputs cannot be divided evenly among {rows} rows")]
    UnevenRows {
        /// Number of outputs of all networks.
        outputs: usize,
        /// Number of rows.
        rows: usize,
    },
    /// The encoded blob is rejected when it is parsed again.
    #[error("the model would be refused when read: {0}")]
    Refused(#[from] DecodeError),
}

//! Records of MCAP: their kinds, and fields that are written. [`Bytes`](crate::bytes::Bytes) reads them.
//!
//! A record is a byte that tells its kind, the length of its body in eight bytes, and the body. Fields of a body follow each
//! other without a gap, little-endian; texts, maps and arrays stand after their length in four bytes.

use std::collections::BTreeMap;

/// First and last bytes of a file.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Bytes before a record's body.
pub const HEAD: u64 = 9;

/// Kinds of records.
pub mod kind {
    pub const HEADER: u8 = 1;
    pub const FOOTER: u8 = 2;
    pub const SCHEMA: u8 = 3;
    pub const CHANNEL: u8 = 4;
    pub const MESSAGE: u8 = 5;
    pub const CHUNK: u8 = 6;
    pub const MESSAGE_INDEX: u8 = 7;
    pub const CHUNK_INDEX: u8 = 8;
    pub const ATTACHMENT: u8 = 9;
    pub const ATTACHMENT_INDEX: u8 = 10;
    pub const STATISTICS: u8 = 11;
    pub const METADATA: u8 = 12;
    pub const METADATA_INDEX: u8 = 13;
    pub const DATA_END: u8 = 15;
}

/// What stands before a body that consists of `parts`.
pub fn head(kind: u8, parts: &[&[u8]]) -> [u8; HEAD as usize] {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    let mut head = [kind; HEAD as usize];
    head[1..].copy_from_slice(&(length as u64).to_le_bytes());
    head
}

/// Fields of a body, or records one after the other, that are being written.
#[derive(Debug, Default)]
pub struct Fields(Vec<u8>);

impl Fields {
    /// No field.
    pub fn new() -> Self {
        Self::default()
    }

    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Takes all away, and keeps the memory.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    pub fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Text, map or array of these bytes, after its length.
    ///
    /// # Panics
    /// It is longer than MCAP allows, which the limits of a recording exclude.
    pub fn sequence(self, bytes: &[u8]) -> Self {
        let length = u32::try_from(bytes.len()).expect("a length within the limits of a recording");
        let mut fields = self.u32(length);
        fields.0.extend_from_slice(bytes);
        fields
    }

    pub fn text(self, text: &str) -> Self {
        self.sequence(text.as_bytes())
    }

    /// Map of texts.
    pub fn texts(self, texts: &BTreeMap<String, String>) -> Self {
        let pairs = texts.iter().fold(Self::new(), |pairs, (name, it)| pairs.text(name).text(it));
        self.sequence(&pairs.0)
    }

    /// Appends a record whose body consists of `parts`.
    pub fn record(&mut self, kind: u8, parts: &[&[u8]]) {
        self.0.extend(head(kind, parts));
        parts.iter().for_each(|part| self.0.extend_from_slice(part));
    }
}

//! Numbers and texts in bytes, little-endian: records of MCAP, and messages in CDR, which aligns numbers to their size.

/// Header of a message in little-endian CDR.
const CDR: [u8; 4] = [0, 1, 0, 0];

/// Bytes that are read from their start. Every method returns `None` beyond the end, and allocates nothing.
#[derive(Debug, Clone)]
pub struct Bytes<'b> {
    all: &'b [u8],
    at: usize,
    is_aligned: bool,
}

impl<'b> Bytes<'b> {
    /// Fields of a record of MCAP.
    pub fn record(bytes: &'b [u8]) -> Self {
        Self { all: bytes, at: 0, is_aligned: false }
    }

    /// Fields of a message in CDR; `None` if it is not little-endian.
    pub fn message(bytes: &'b [u8]) -> Option<Self> {
        Some(Self { all: bytes.strip_prefix(&CDR)?, at: 0, is_aligned: true })
    }

    /// Bytes that are left.
    pub fn rest(&self) -> &'b [u8] {
        self.all.get(self.at..).unwrap_or_default()
    }

    /// Next `count` bytes.
    pub fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let taken = self.rest().get(..count)?;
        self.at += count;
        Some(taken)
    }

    fn number<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        if self.is_aligned {
            self.at = self.at.next_multiple_of(SIZE);
        }
        self.take(SIZE)?.try_into().ok()
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.number().map(u8::from_le_bytes)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }

    pub fn f64(&mut self) -> Option<f64> {
        self.number().map(f64::from_le_bytes)
    }

    /// Sequence of bytes, after its length.
    pub fn sequence(&mut self) -> Option<&'b [u8]> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    /// Text in UTF-8, after its length. A message's ends with a zero byte.
    pub fn text(&mut self) -> Option<&'b str> {
        let text = std::str::from_utf8(self.sequence()?).ok()?;
        if self.is_aligned { text.strip_suffix('\0') } else { Some(text) }
    }
}

/// Message in little-endian CDR that is being written.
#[derive(Debug)]
pub struct Message(Vec<u8>);

impl Message {
    /// Message without a field.
    pub fn new() -> Self {
        Self(CDR.into())
    }

    /// Whole message.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn number<const SIZE: usize>(&mut self, bytes: [u8; SIZE]) {
        let aligned = (self.0.len() - CDR.len()).next_multiple_of(SIZE) + CDR.len();
        self.0.resize(aligned, 0);
        self.0.extend(bytes);
    }

    pub fn u8(&mut self, value: u8) {
        self.number(value.to_le_bytes());
    }

    pub fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    pub fn f64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    /// Length of a sequence whose elements follow.
    ///
    /// # Panics
    /// It is longer than CDR allows, which the limits of a layout exclude.
    pub fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("a length within the limits of a layout"));
    }

    /// Sequence of bytes, after its length.
    pub fn sequence(&mut self, bytes: &[u8]) {
        self.length(bytes.len());
        self.0.extend_from_slice(bytes);
    }

    /// Text, after its length, with a zero byte at its end.
    pub fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }
}

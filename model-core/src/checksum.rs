//! The one CRC-32 of the project, so that its table is in flash only once.

/// CRC-32 (ISO-HDLC, as in zip and Ethernet): closes blobs, slot records and link messages.
pub static CRC_32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// A [`CRC_32`] of bytes that come one after the other.
pub type Crc32Digest = crc::Digest<'static, u32>;

//! Digest of files: ties a model to the scene or data that it was trained on.

/// CRC-64/XZ of `bytes`: tells versions of a file apart, but does not protect against forgery.
pub fn digest(bytes: &[u8]) -> u64 {
    let mut digest = crc64fast::Digest::new();
    digest.write(bytes);
    digest.sum64()
}

#[cfg(test)]
mod tests {
    use super::digest;

    #[test]
    fn the_digest_is_crc_64_xz() {
        let reference = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
        assert_eq!(digest(b"123456789"), 0x995d_c9bb_df19_39fa); // the catalogue's check value
        let bytes: Vec<u8> = (0..5000_u32).map(|i| ((i * i) >> 3) as u8).collect();
        for length in [0, 1, 127, 128, 129, 1000, 5000] {
            assert_eq!(digest(&bytes[..length]), reference.checksum(&bytes[..length]));
        }
    }
}

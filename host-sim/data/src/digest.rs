//! Digests of files and tables: tie a model to the scene or data that it was trained on.

use std::fmt;

/// CRC-64/XZ of `bytes`: tells versions of a file apart, but does not protect against forgery.
pub fn digest(bytes: &[u8]) -> u64 {
    let mut digest = crc64fast::Digest::new();
    digest.write(bytes);
    digest.sum64()
}

/// CRC-64/XZ of a value's `Debug` text: of all that the value has, as long as the program is the same.
pub fn of_debug(value: &impl fmt::Debug) -> u64 {
    struct Text(crc64fast::Digest);
    impl fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.write(text.as_bytes());
            Ok(())
        }
    }
    let mut text = Text(crc64fast::Digest::new());
    // Only the writer could fail, and it does not.
    let _ = fmt::write(&mut text, format_args!("{value:?}"));
    text.0.sum64()
}

/// Digest of a table's column `names` and its numbers, line after line: that of the same numbers in any kind of file. All
/// NaN count alike, and so do 0 and −0.
pub fn of_table(names: &[&str], values: impl Iterator<Item = f64>) -> u64 {
    let mut digest = crc64fast::Digest::new();
    for name in names {
        digest.write(format!("{name}\n").as_bytes());
    }
    let bits = |value: f64| if value.is_nan() { f64::NAN } else { value + 0.0 }.to_bits();
    let mut bytes = values.flat_map(|value| bits(value).to_le_bytes());
    loop {
        let some: Vec<u8> = bytes.by_ref().take(65_536).collect();
        if some.is_empty() {
            return digest.sum64();
        }
        digest.write(&some);
    }
}

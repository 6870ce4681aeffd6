//! What gzip packed, of any bytes.

use std::path::Path;

use taxel_data::data_file::{DataFile, Reading};

/// Bytes behind gzip's first two.
pub fn check(bytes: &[u8]) -> bool {
    let bytes = [&[0x1f, 0x8b], bytes].concat();
    let file = DataFile::parse(Path::new("f.csv.gz"), &bytes, &Reading::default());
    let Ok(file) = file else { return false };
    assert!(file.found.starts_with("gzip"), "{}", file.found);
    true
}

//! Arrays as numpy saves them, of any bytes. The first byte says whether they are one array or an archive.

use std::path::Path;

use taxel_data::data_file::{DataFile, Reading};

/// Largest factor by which an archive may pack what it holds.
const PACKED: usize = 1100;

/// Bytes of a file.
pub fn check(bytes: &[u8]) -> bool {
    let Some((kind, bytes)) = bytes.split_first() else { return false };
    let (name, most) = match kind % 2 {
        0 => ("f.npy", bytes.len()),
        _ => ("f.npz", PACKED * bytes.len()),
    };
    let Ok(file) = DataFile::parse(Path::new(name), bytes, &Reading::default()) else {
        return false;
    };
    let (lines, columns) = (file.lines(), file.header.len());
    assert!(lines > 0 && columns > 0, "nothing was read, and accepted");
    // An element takes a byte at least.
    assert!(lines * columns <= most, "{lines} × {columns} numbers of {} bytes", bytes.len());
    for line in 0..file.lines() {
        assert_eq!(file.line_number(line), line as u64 + 1);
        assert!(!file.row(line).iter().any(|value| value.is_infinite()), "infinite");
    }
    true
}

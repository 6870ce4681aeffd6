//! What gzip packed, of any bytes: whole, and piece by piece.

use std::io::Cursor;
use std::path::Path;

use taxel_data::data_file::pieces::Pieces;
use taxel_data::data_file::{DataFile, Reading};

/// Bytes behind gzip's first two.
pub fn check(bytes: &[u8]) -> bool {
    let bytes = [&[0x1f, 0x8b], bytes].concat();
    let (path, reading) = (Path::new("f.csv.gz"), Reading::default());
    let file = DataFile::parse(path, &bytes, &reading);
    let mut pieces = Pieces::new(path.into(), Box::new(Cursor::new(bytes)), reading);
    let piece = pieces.next_piece();
    let (Ok(file), Ok(Some(piece))) = (file, piece) else { return false };
    assert!(file.found.starts_with("gzip"), "{}", file.found);
    assert_eq!((file.lines(), file.header), (piece.lines(), piece.header));
    true
}

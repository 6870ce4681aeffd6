//! A CSV file of any bytes. What is read must be what the `csv` crate and Rust's own parser of numbers read: the reader
//! has a quick way for plain files and a careful one for others, which must not differ.

use std::path::Path;

use taxel_data::data_file::DataFile;

/// Bytes of a file; the first byte says whether the first line is a header whatever it holds.
pub fn check(bytes: &[u8]) -> bool {
    let Some((has_header, bytes)) = bytes.split_first() else { return false };
    let Ok(file) = DataFile::parse(Path::new("f.csv"), bytes, has_header % 2 == 1) else {
        return false;
    };
    let columns = file.header.len();
    let lines: Vec<(u64, Vec<f64>)> =
        (0..file.lines()).map(|line| (file.line_number(line), file.row(line).to_vec())).collect();
    assert!(lines.is_sorted_by(|one, next| one.0 < next.0), "line numbers that do not rise");
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let read: Vec<&[f64]> = lines.iter().map(|(_, values)| values.as_slice()).collect();
    compare(&read, &by_crate(text, file.names_columns, columns));
    if !text.contains(&b'"') {
        let texts = lines_of(text);
        for (number, values) in &lines {
            let line = texts.get(*number as usize - 1).copied().unwrap_or_default();
            let fields: Vec<f64> = line.split(|byte| *byte == b',').map(number_of).collect();
            compare(&[values], &[fields]);
        }
    }
    true
}

/// All lines, by the crate alone.
fn by_crate(text: &[u8], has_header: bool, columns: usize) -> Vec<Vec<f64>> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).has_headers(has_header).from_reader(text);
    let mut record = csv::ByteRecord::new();
    let mut lines = Vec::new();
    while reader.read_byte_record(&mut record).expect("bytes in memory can be read") {
        assert_eq!(record.len(), columns, "accepted, though a line has other columns");
        lines.push(record.iter().map(number_of).collect());
    }
    lines
}

fn number_of(field: &[u8]) -> f64 {
    let text = std::str::from_utf8(field).expect("accepted, though no text").trim();
    if text.is_empty() {
        return f64::NAN;
    }
    let number: f64 = text.parse().expect("accepted, though no number");
    assert!(!number.is_infinite(), "accepted, though infinite");
    number
}

/// Lines as an editor shows them: ended by LF, CR or both.
fn lines_of(text: &[u8]) -> Vec<&[u8]> {
    let mut lines = Vec::new();
    let mut rest = text;
    while let Some(end) = rest.iter().position(|byte| matches!(byte, b'\r' | b'\n')) {
        let both = rest[end..].starts_with(b"\r\n");
        lines.push(&rest[..end]);
        rest = &rest[end + 1 + usize::from(both)..];
    }
    lines.push(rest);
    lines
}

fn compare(read: &[&[f64]], expected: &[Vec<f64>]) {
    assert_eq!(read.len(), expected.len(), "another number of lines");
    for (read, expected) in read.iter().zip(expected) {
        assert_eq!(read.len(), expected.len(), "another number of fields");
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        assert!(read.iter().zip(expected).all(same), "{read:?} was read for {expected:?}");
    }
}

//! A text file of any bytes. What is read of a plain one must be what the `csv` crate and Rust's own parser of numbers
//! read: the reader has a quick way for plain files and a careful one for others, which must not differ. What is read of
//! any other dialect must be the same when it is written as plain CSV.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use taxel_data::data_file::{DataFile, Reading, Separator, Stated};

/// Bytes of a file; the first byte says what is stated of it, and whether it is packed.
pub fn check(bytes: &[u8]) -> bool {
    let Some((stated, bytes)) = bytes.split_first() else { return false };
    let bit = |place: u8| stated >> place & 1 == 1;
    let reading = Reading {
        has_header: bit(0),
        keeps_text: bit(1),
        stated: Stated {
            separator: bit(2).then_some(Separator::Char(if bit(3) { ';' } else { '\t' })),
            decimal_comma: bit(4).then_some(bit(3)),
            comment: bit(5).then(|| "!".into()),
            units_line: bit(6),
        },
    };
    let path = Path::new("f.csv");
    let packed = bit(7).then(|| packed(bytes));
    let Ok(file) = DataFile::parse(path, packed.as_deref().unwrap_or(bytes), &reading) else {
        return false;
    };
    let lines: Vec<(u64, Vec<f64>)> =
        (0..file.lines()).map(|line| (file.line_number(line), file.row(line).to_vec())).collect();
    assert!(lines.is_sorted_by(|one, next| one.0 < next.0), "line numbers that do not rise");
    let is_number = |column: usize| file.check_numbers(&[column]).is_ok();
    let columns: Vec<bool> = (0..file.header.len()).map(is_number).collect();
    let read: Vec<&[f64]> = lines.iter().map(|(_, values)| values.as_slice()).collect();
    assert!(!read.iter().any(|line| line.iter().any(|value| value.is_infinite())), "infinite");
    if file.found.is_empty() && *stated < 2 {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        compare(&read, &by_crate(text, file.names_columns, &columns), &columns);
        if !text.contains(&b'"') {
            let texts = lines_of(text);
            for (number, values) in &lines {
                let line = texts.get(*number as usize - 1).copied().unwrap_or_default();
                let fields = line.split(|byte| *byte == b',').zip(&columns);
                let fields = fields.map(|(field, is_number)| number_of(field, *is_number));
                compare(&[values], &[fields.collect()], &columns);
            }
        }
    }
    // That name would state a separator.
    if !file.header[0].to_ascii_lowercase().starts_with("sep=") {
        let again = as_plain(path, &file, &read);
        assert_eq!(again.header, file.header);
        let values: Vec<Vec<f64>> = again.rows().map(<[f64]>::to_vec).collect();
        compare(&read, &values, &vec![true; columns.len()]);
    }
    true
}

/// The names of `file` and its `lines`, written as plain CSV and read again.
fn as_plain(path: &Path, file: &DataFile, lines: &[&[f64]]) -> DataFile {
    let names = file.header.iter().map(|name| quoted(name)).collect::<Vec<_>>();
    let mut plain = names.join(",") + "\n";
    for line in lines {
        let field = |value: &f64| if value.is_nan() { "NaN".into() } else { value.to_string() };
        plain += &(line.iter().map(field).collect::<Vec<_>>().join(",") + "\n");
    }
    let stated = Stated {
        separator: Some(Separator::Char(',')),
        decimal_comma: Some(false),
        ..Stated::default()
    };
    let reading = Reading { has_header: true, stated, ..Reading::default() };
    DataFile::parse(path, plain.as_bytes(), &reading).expect("plain text of numbers")
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(vec![], Compression::fast());
    packed.write_all(bytes).expect("memory can be written");
    packed.finish().expect("memory can be written")
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// All lines, by the crate alone.
fn by_crate(text: &[u8], has_header: bool, columns: &[bool]) -> Vec<Vec<f64>> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).has_headers(has_header).from_reader(text);
    let mut record = csv::ByteRecord::new();
    let mut lines = Vec::new();
    while reader.read_byte_record(&mut record).expect("bytes in memory can be read") {
        assert_eq!(record.len(), columns.len(), "accepted, though a line has other columns");
        let fields = record.iter().zip(columns);
        lines.push(fields.map(|(field, is_number)| number_of(field, *is_number)).collect());
    }
    lines
}

/// Words for a missing value that the reader knows, in lower case.
const MISSING: [&str; 16] = [
    "na", "n/a", "n.a.", "null", "none", "missing", "<na>", "nat", "#n/a", "#nv", "#div/0!",
    "#value!", "-", "--", "?", ".",
];

/// The number in a field of a column that is one of numbers, or of time stamps.
fn number_of(field: &[u8], is_number: bool) -> f64 {
    if !is_number {
        return f64::NAN;
    }
    let text = std::str::from_utf8(field).expect("accepted, though no text").trim();
    if text.is_empty() || MISSING.contains(&&*text.to_ascii_lowercase()) {
        return f64::NAN;
    }
    let Ok(number) = text.parse::<f64>() else {
        let is_date = text.len() >= 16 && text.bytes().take(4).all(|byte| byte.is_ascii_digit());
        assert!(is_date, "accepted, though neither number nor time: {text:?}");
        return f64::INFINITY;
    };
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

/// Compares columns of numbers; infinity stands for a time stamp, which is not compared.
fn compare(read: &[&[f64]], expected: &[Vec<f64>], columns: &[bool]) {
    assert_eq!(read.len(), expected.len(), "another number of lines");
    for (read, expected) in read.iter().zip(expected) {
        assert_eq!(read.len(), expected.len(), "another number of fields");
        let same = |((a, b), is_number): ((&f64, &f64), &bool)| {
            !is_number
                || b.is_infinite()
                || a.to_bits() == b.to_bits()
                || (a.is_nan() && b.is_nan())
        };
        assert!(
            read.iter().zip(expected).zip(columns).all(same),
            "{read:?} was read for {expected:?}"
        );
    }
}

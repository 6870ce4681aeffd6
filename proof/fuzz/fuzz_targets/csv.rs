//! Text files of any dialect. A file is refused, or it reads the same when it is written as plain CSV. Numbers of a plain
//! file are those of the `csv` crate and of Rust's own parser.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use taxel_data::data_file::{DataFile, Reading, Separator, Stated};

// The first byte says what is stated of the file.
fuzz_target!(|bytes: &[u8]| {
    let Some((stated, bytes)) = bytes.split_first() else { return };
    let bit = |place: u8| stated >> place & 1 == 1;
    let reading = Reading {
        has_header: bit(0),
        keeps_text: bit(1),
        is_strict: bit(5),
        stated: Stated {
            separator: bit(2).then_some(Separator::Char(if bit(3) { ';' } else { '\t' })),
            decimal_comma: bit(4).then_some(bit(3)),
        },
    };
    let path = Path::new("f.csv");
    let Ok(file) = DataFile::parse(path, bytes, &reading) else { return };
    let lines: Vec<u64> = (0..file.lines()).map(|line| file.line_number(line)).collect();
    assert!(lines.is_sorted_by(|one, next| one < next), "line numbers that do not rise");
    let read = &values(&file);
    assert!(!read.iter().any(|line| line.iter().any(|value| value.is_infinite())), "infinite");
    if file.found.is_empty() && *stated < 2 {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let is_number = |column: usize| file.check_numbers(&[column]).is_ok();
        let columns: Vec<bool> = (0..file.header.len()).map(is_number).collect();
        compare(read, &by_crate(text, file.names_columns, &columns));
    }
    // That name would state a separator.
    if !file.header[0].to_ascii_lowercase().starts_with("sep=") {
        let again = as_plain(path, &file, read);
        assert_eq!(again.header, file.header);
        compare(read, &values(&again));
    }
});

/// Values of all lines of a file.
fn values(file: &DataFile) -> Vec<Vec<f64>> {
    let line = |line| (0..file.header.len()).map(|column| file.value(line, column)).collect();
    (0..file.lines()).map(line).collect()
}

/// The names of `file` and its `lines`, written as plain CSV and read again.
fn as_plain(path: &Path, file: &DataFile, lines: &[Vec<f64>]) -> DataFile {
    let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
    let mut plain = file.header.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
    for line in lines {
        let field = |value: &f64| if value.is_nan() { "NaN".into() } else { value.to_string() };
        plain += &(line.iter().map(field).collect::<Vec<_>>().join(",") + "\n");
    }
    let stated = Stated { separator: Some(Separator::Char(',')), decimal_comma: Some(false) };
    let reading = Reading { has_header: true, stated, ..Reading::default() };
    DataFile::parse(path, plain.as_bytes(), &reading).expect("plain text of numbers")
}

/// All lines, by the crate alone.
fn by_crate(text: &[u8], has_header: bool, columns: &[bool]) -> Vec<Vec<f64>> {
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).has_headers(has_header).from_reader(text);
    let line = |record: csv::ByteRecord| {
        assert_eq!(record.len(), columns.len(), "accepted, though a line has other columns");
        record.iter().zip(columns).map(|(field, is_number)| number(field, *is_number)).collect()
    };
    reader.byte_records().map(|record| line(record.expect("bytes in memory"))).collect()
}

/// Words for a missing value that the reader knows, in lower case.
const MISSING: [&str; 16] = [
    "na", "n/a", "n.a.", "null", "none", "missing", "<na>", "nat", "#n/a", "#nv", "#div/0!",
    "#value!", "-", "--", "?", ".",
];

/// The number in a field of a column: of numbers or, as infinity, of time stamps. NaN in a column of text.
fn number(field: &[u8], is_number: bool) -> f64 {
    if !is_number {
        return f64::NAN;
    }
    let text = str::from_utf8(field).expect("accepted, though no text").trim();
    if text.is_empty() || MISSING.contains(&&*text.to_ascii_lowercase()) {
        return f64::NAN;
    }
    if let Ok(number) = text.parse::<f64>() {
        assert!(!number.is_infinite(), "accepted, though infinite");
        return number;
    }
    let is_date = text.len() >= 16 && text.bytes().take(4).all(|byte| byte.is_ascii_digit());
    assert!(is_date, "accepted, though neither number nor time: {text:?}");
    f64::INFINITY
}

/// Compares numbers to the bit; infinity stands for a time stamp, which is not compared.
fn compare(read: &[Vec<f64>], expected: &[Vec<f64>]) {
    assert_eq!(read.len(), expected.len(), "another number of lines");
    for (read, expected) in read.iter().zip(expected) {
        assert_eq!(read.len(), expected.len(), "another number of fields");
        let same = |(a, b): (&f64, &f64)| {
            b.is_infinite() || a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
        };
        assert!(read.iter().zip(expected).all(same), "{read:?} was read for {expected:?}");
    }
}

use std::io::Cursor;
use std::path::Path;

use super::*;

fn pieces(text: &str, at_once: usize) -> Pieces {
    let source = Box::new(Cursor::new(text.as_bytes().to_vec()));
    Pieces { at_once, ..Pieces::new("log.csv".into(), source, Reading::default()) }
}

/// All pieces as one file.
fn read(text: &str, at_once: usize) -> Result<DataFile> {
    whole_of(pieces(text, at_once))
}

fn whole_of(mut pieces: Pieces) -> Result<DataFile> {
    let mut whole = pieces.next_piece()?.expect("a first piece");
    while let Some(piece) = pieces.next_piece()? {
        assert_eq!(piece.header, whole.header);
        whole.values.extend(piece.values);
        whole.line_numbers.extend(piece.line_numbers);
        whole.not_numbers.extend(piece.not_numbers);
        whole.lacks_last_line_end = piece.lacks_last_line_end;
    }
    whole.kept = 0..whole.line_numbers.len();
    Ok(whole)
}

#[test]
fn pieces_together_are_the_file() {
    let numbers = (0..50).map(|i| format!("{i},{}.5\n", 2 * i)).collect::<Vec<_>>().concat();
    for text in [
        format!("a,b\n{numbers}"),
        format!("\"a,c\",\"b\"\n{numbers}").replace('\n', "\r\n"),
        format!("{numbers}1,2"),
        format!("a,b\n{numbers}\"3\",4\n{numbers}"),
    ] {
        let whole =
            DataFile::parse(Path::new("log.csv"), text.as_bytes(), &Reading::default()).unwrap();
        for at_once in [30, 64, 100_000] {
            // Names of columns that a file lacks come with the later pieces.
            let names_columns = whole.names_columns;
            let found = read(&text, at_once).unwrap();
            assert_eq!(DataFile { names_columns, ..found }, whole, "{at_once}: {text:?}");
        }
    }
}

#[test]
fn a_fault_in_a_later_piece_is_told_with_its_line() {
    let text = "a,b\n1,2\n3,4\n5,6\n7,8\n9,ten\n";
    for at_once in [9, 1000] {
        let refused = read(text, at_once).unwrap().column("b").unwrap_err().to_string();
        assert!(refused.contains("line 6") && refused.contains("ten"), "{refused}");
    }
    let refused = read("a,b\n1,2\n3,4\n5,6\n7,8,9\n", 9).unwrap_err().to_string();
    assert!(refused.contains("line 5"), "{refused}");
}

#[test]
fn a_stream_without_data_is_refused() {
    for text in ["", "a,b\n"] {
        assert!(read(text, 100).is_err(), "{text:?}");
    }
}

#[test]
fn blank_lines_of_any_number_do_not_end_the_file() {
    let blank = "\n".repeat(100);
    let text = format!("{blank}a,b\n1,2\n{blank}3,4\n{blank}");
    let whole =
        DataFile::parse(Path::new("log.csv"), text.as_bytes(), &Reading::default()).unwrap();
    assert_eq!(whole.values, [1.0, 2.0, 3.0, 4.0]);
    let text_of_one = format!("a\n1\n{blank}3\n");
    for at_once in [30, 1000] {
        let found = read(&text, at_once).unwrap();
        assert_eq!(DataFile { names_columns: whole.names_columns, ..found }, whole, "{at_once}");
        let refused = read(&text_of_one, at_once).unwrap_err().to_string();
        assert!(refused.contains("line 3 is blank"), "{at_once}: {refused}");
    }
}

#[test]
fn a_line_without_an_end_is_told_as_such() {
    let endless = Cursor::new("a,b\n1,2\n").chain(std::io::repeat(b'1'));
    let mut pieces = Pieces::new("log.csv".into(), Box::new(endless), Reading::default());
    assert_eq!(pieces.next_piece().unwrap().unwrap().values, [1.0, 2.0]);
    let refused = pieces.next_piece().unwrap_err().to_string();
    assert!(refused.contains("after line 2; check the line ends"), "{refused}");
}

#[test]
fn pieces_of_any_dialect_are_the_file() {
    let lines = (0..50).map(|i| format!("{i};{},5;N/A\n", 2 * i)).collect::<Vec<_>>().concat();
    let text = format!("# made by a logger\nt;f µ;n\ns;N;-\n{lines}# a pause\n\n{lines}");
    let whole =
        DataFile::parse(Path::new("log.csv"), text.as_bytes(), &Reading::default()).unwrap();
    assert_eq!(whole.header, ["t (s)", "f µ (N)", "n"]);
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let mut packed = flate2::write::GzEncoder::new(vec![], flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, text.as_bytes()).unwrap();
    for bytes in [text.into_bytes(), latin, packed.finish().unwrap()] {
        for at_once in [120, 100_000] {
            let source = Box::new(Cursor::new(bytes.clone()));
            let new = Pieces::new("log.csv".into(), source, Reading::default());
            let found = whole_of(Pieces { at_once, ..new }).unwrap();
            assert_eq!(format!("{:?}", found.values), format!("{:?}", whole.values));
            assert_eq!(
                (found.header, found.line_numbers),
                (whole.header.clone(), whole.line_numbers.clone())
            );
        }
    }
    let utf_16 = "\u{feff}a;b\n1;2\n".encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
    let source = Box::new(Cursor::new(utf_16));
    let refused = Pieces::new("log.csv".into(), source, Reading::default()).next_piece();
    assert!(refused.unwrap_err().to_string().contains("UTF-16"));
}

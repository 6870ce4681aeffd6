use std::path::Path;

use crate::data_file::{DataFile, Reading, Separator, Stated};
use crate::error::Result;

fn read(bytes: &[u8], stated: Stated) -> Result<DataFile> {
    DataFile::parse(Path::new("log.csv"), bytes, &Reading { stated, ..Reading::default() })
}

fn found(text: &str) -> DataFile {
    read(text.as_bytes(), Stated::default()).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

fn refused(text: &str) -> String {
    read(text.as_bytes(), Stated::default()).unwrap_err().to_string()
}

#[test]
fn lines_keep_their_numbers_whatever_stands_between_them() {
    let text = "sep=;\n# made by a logger\na;b\ns;N\n\n1,5;2\n% later\n3;4\n";
    let file = found(text);
    assert_eq!(file.found, "semicolons, decimal commas, units in line 4, comments");
    assert_eq!(file.header, ["a (s)", "b (N)"]);
    assert_eq!((file.row(0), file.row(1).len(), file.line_number(0)), (&[1.5, 2.0][..], 2, 6));
    let text = "# t f\n1 2\n# pause\n  3   x\n";
    let file = found(text);
    assert_eq!((&file.header[..], file.line_number(1)), (&["t".into(), "f".into()][..], 4));
    let refused = file.column("f").unwrap_err().to_string();
    assert!(refused.contains("line 4, column \"f\": \"x\" is not a number"), "{refused}");
}

#[test]
fn text_that_can_be_read_in_two_ways_is_refused_with_the_option_that_settles_it() {
    let thousands = "a;b\n1,234;5\n2,500;6\n";
    for (text, says) in [
        (thousands, "line 2: \"1,234\" may be a fraction"),
        ("a;b\n\"1,234\";5\n0,5;1.234\n", "line 3: \"1.234\" has a point"),
        ("force\n1,5\n2,5\n", "line 2 has 2 fields, and the header 1: commas seem"),
        ("a,b\n1,5,2,5\n", "commas seem to be decimal ones"),
        ("a;b\n1;2\n1;2\n1;2\n1;2\n\"1;2\n", "line 6: a quoted field does not end"),
    ] {
        let refused = refused(text);
        assert!(refused.contains(says), "{text:?}: {refused}");
    }
    let comma = || Stated { decimal_comma: Some(true), ..Stated::default() };
    assert_eq!(read(thousands.as_bytes(), comma()).unwrap().values, [1.234, 5.0, 2.5, 6.0]);
    assert_eq!(read(b"force\n1,5\n2,5\n", comma()).unwrap().values, [1.5, 2.5]);
    let point = Stated { decimal_comma: Some(false), ..Stated::default() };
    let file = read(thousands.as_bytes(), point).unwrap();
    let refused = file.column("a").unwrap_err().to_string();
    assert!(refused.contains("state --decimal comma") && file.column("b").is_ok(), "{refused}");
    let stated = Stated { separator: Some(Separator::Char(',')), ..comma() };
    assert_eq!(read(b"a,b\n\"1,5\",\"2\"\n", stated).unwrap().values, [1.5, 2.0]);
}

#[test]
fn values_that_are_missing_in_front_are_no_comments() {
    let file = found("a,b\n#N/A,1\n#NV,2\n");
    assert_eq!((file.lines(), file.found.as_str()), (2, ""));
    assert!(file.value(0, 0).is_nan());
    let file = found("a,b\n# note\n#N/A,1\n");
    assert_eq!((file.lines(), file.found.as_str()), (1, "comments"));
}

#[test]
fn a_comment_that_names_other_columns_is_no_header() {
    assert_eq!(found("# three words here\n1 2\n3 4\n").header, ["c1", "c2"]);
    assert_eq!(found("# f f\n1 2\n3 4\n").header, ["c1", "c2"]);
    assert_eq!(found("#t,f\n1,2\n3,4\n").header, ["t", "f"]);
}

#[test]
fn a_line_of_units_is_not_a_line_of_text() {
    // A column of text has text below, too.
    let file = found("id,f\nN,1\ns,2\n");
    assert_eq!((file.found.as_str(), file.lines()), ("", 2));
    let file = found("id,f\nN,-\ns,2\n");
    assert_eq!((file.found.as_str(), file.lines()), ("", 2));
    let file = found("t,f,n\ns,N,-\n1,2,3\n2,3,4\n");
    assert_eq!(file.header, ["t (s)", "f (N)", "n"]);
    let file = found("t_ms,f,g\n[ms],[counts],[kPa]\n1,2,3\n2,3,4\n");
    assert_eq!(file.header, ["t_ms", "f", "g (kPa)"]);
    let stated = Stated { units_line: true, ..Stated::default() };
    assert_eq!(read(b"id,f\nN,kg\ns,2\n", stated).unwrap().header, ["id (N)", "f (kg)"]);
}

#[test]
fn a_long_header_is_read_whole() {
    let names: Vec<String> = (0..30_000).map(|column| format!("r1c{column}")).collect();
    let line = (0..30_000).map(|column| format!("{column},5")).collect::<Vec<_>>().join(";");
    let file = found(&format!("{}\n{line}\n{line}\n", names.join(";")));
    assert_eq!((file.header.len(), file.lines(), file.value(1, 7)), (30_000, 2, 7.5));
}

#[test]
fn what_is_no_text_is_refused() {
    let no_text = read(b"a,b\n1,\0\n", Stated::default()).unwrap_err().to_string();
    assert!(no_text.contains("neither text nor"), "{no_text}");
    for (bytes, says) in [
        (&b"PAR1\x15"[..], "pd.read_parquet('log.csv')"),
        (b"MATLAB 5.0 MAT-file", "loadmat('log.csv')"),
        (b"\x89HDF\r\n\x1a\n", "h5py.File('log.csv')"),
        (b"PK\x03\x04.......xl/workbook.xml", "a spreadsheet"),
        (b"PK\x03\x04.......log.csv", "a zip archive"),
        (b"#ROSBAG V2.0\n", "a ROS bag"),
        (b"\x80\x04\x95", "a pickle"),
        (b"{\"a\": 1}\n", "lines=True"),
    ] {
        let refused = read(bytes, Stated::default()).unwrap_err().to_string();
        assert!(refused.contains(says) && refused.contains("Python"), "{refused}");
    }
}

#[test]
fn no_file_is_told_to_be_converted_to_itself() {
    for (name, converted) in [
        ("log.json", "log.csv"),
        ("log", "log.csv"),
        ("log.csv", "log.converted.csv"),
        ("LOG.CSV", "LOG.converted.csv"),
    ] {
        let found = DataFile::parse(Path::new(name), b"{\"a\": 1}\n", &Reading::default());
        let refused = found.unwrap_err().to_string();
        let python = format!("pd.read_json('{name}', lines=True).to_csv('{converted}', index");
        assert!(refused.contains(&python), "{refused}");
    }
}

#[test]
fn an_encoding_is_found_by_its_mark_or_its_bytes() {
    let text = "t_s;Kraft µ\n1,5;2\n2,5;3\n";
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let utf_16 =
        |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> { text.encode_utf16().flat_map(bytes).collect() };
    let of = |bytes: &[u8]| {
        let file = read(bytes, Stated::default()).unwrap();
        assert_eq!((&*file.header[1], file.values.len()), ("Kraft µ", 4));
        file.found
    };
    assert_eq!(of(text.as_bytes()), "semicolons, decimal commas");
    assert_eq!(of(&latin), "latin-1, semicolons, decimal commas");
    for (mark, bytes) in [
        (&[0xff, 0xfe][..], utf_16(u16::to_le_bytes)),
        (&[0xfe, 0xff], utf_16(u16::to_be_bytes)),
        (&[], utf_16(u16::to_le_bytes)),
        (&[], utf_16(u16::to_be_bytes)),
    ] {
        assert_eq!(of(&[mark, &bytes].concat()), "UTF-16, semicolons, decimal commas");
    }
}

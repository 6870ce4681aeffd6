//! Dialects of text files: how they are found, and when they are refused.

use std::path::Path;

use taxel_data::data_file::{Reading, Separator, Stated};
use taxel_data::{DataFile, Result};

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
    assert_eq!(
        (&file.values[..2], file.values.len(), file.line_number(0)),
        (&[1.5, 2.0][..], 4, 6)
    );
    let text = "# t f\n1 2\n# pause\n  3   x\n";
    let file = found(text);
    assert_eq!((&file.header[..], file.line_number(1)), (&["t".into(), "f".into()][..], 4));
    let refused = file.column("f").unwrap_err().to_string();
    assert!(refused.contains("line 4, column \"f\": \"x\" is not a number"), "{refused}");
}

#[test]
fn ambiguous_text_is_refused_with_the_option_that_resolves_it() {
    let thousands = "a;b\n1,234;5\n2,500;6\n";
    for (text, says) in [
        (thousands, "line 2: \"1,234\" may be a fraction"),
        ("a;b\n\"1,234\";5\n0,5;1.234\n", "line 3: \"1.234\" has a point"),
        ("force\n1,5\n2,5\n", "line 2 has 2 fields, and the header 1: commas seem"),
        ("a,b\n1,5,2,5\n", "commas seem to be decimal commas"),
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
    assert!(refused.contains("give --decimal comma") && file.column("b").is_ok(), "{refused}");
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
}

#[test]
fn what_is_no_text_is_refused() {
    for bytes in [&b"a,b\n1,\0\n"[..], b"\x93NUMPY\x01\0v\0{'descr': '<f8'}", b"PK\x03\x04\0\0"] {
        let refused = read(bytes, Stated::default()).unwrap_err().to_string();
        assert!(refused.contains("it is not text; save the table as CSV"), "{refused}");
    }
}

/// Three lines of a log, of which one lacks a value: `missing` stands for it, and `number` writes the others.
fn log(
    names: &str,
    separator: &str,
    end: &str,
    missing: &str,
    number: impl Fn(f64) -> String,
) -> String {
    let lines = [
        [Some(0.0), Some(1234.5), None],
        [Some(0.5), Some(-0.0042), Some(2e-7)],
        [Some(1.0), Some(7.0), Some(-1.0)],
    ];
    let line = |values: [Option<f64>; 3]| {
        let fields = values.map(|value| value.map_or(missing.to_owned(), &number));
        fields.join(separator) + end
    };
    names.to_owned() + &lines.map(line).concat()
}

#[test]
fn one_log_is_the_same_table_in_any_dialect() {
    let point = |value: f64| value.to_string();
    let comma = |value: f64| value.to_string().replace('.', ",");
    let exponent = |value: f64| format!("{value:.18e}");
    let plain = log("a,b,f\n", ",", "\n", "", point);
    let semicolons = log("a;b;f\r\n", ";", "\r\n", "", comma);
    let utf_16: Vec<u8> = semicolons.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let mut packed = flate2::write::GzEncoder::new(vec![], flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, semicolons.as_bytes()).unwrap();
    let german = "semicolons, decimal commas";
    for (bytes, says) in [
        (plain.clone().into_bytes(), ""),
        (plain.replace('\n', "\r\n").into(), ""),
        (plain.replace('\n', "\r").into(), ""),
        (format!("\u{feff}{plain}").into(), ""),
        (plain.replacen("\n0.5", "\n\n0.5", 1).into(), ""),
        (log("\"a\",\"b\",\"f\"\n", ",", "\n", "#N/A", |it| format!("\"{it}\"")).into(), ""),
        (log("a,b,f\n", ",", "\n", "N/A", |it| format!(" {it} ")).into(), ""),
        (
            log("a,b,f\n", ",", "\n", "\"\"", |it| format!("\"{}\"", comma(it))).into(),
            "decimal commas",
        ),
        (semicolons.clone().into(), german),
        (format!("sep=;\r\n{semicolons}").into(), german),
        ([vec![0xff, 0xfe], utf_16].concat(), "UTF-16, semicolons, decimal commas"),
        (packed.finish().unwrap(), "gzip, semicolons, decimal commas"),
        (log("a\tb\tf\n", "\t", "\n", "NaN", point).into(), "tabs"),
        (log("# a b f\n", " ", "\n", "nan", exponent).into(), "spaces, names in line 1, comments"),
        (log("# a,b,f\n", ",", "\n", "nan", exponent).into(), "names in line 1, comments"),
        (log("   a    b  f\n", "   ", "\n", "NaN", point).into(), "spaces"),
        (log("a,b,f,\n", ",", ",\n", "", point).into(), "a separator at the end of each line"),
        (log("a | b | f\n", " | ", "\n", "-", point).into(), "separator '|'"),
        (plain.replacen("\n0.5", "\n# a bump\n0.5", 1).into(), "comments"),
        (log("a,b,f\ns,V,N\n", ",", "\n", "", point).into(), "units in line 2"),
        (
            log("a;b;f\n[s];[V];[N]\n", ";", "\n", "", comma).into(),
            "semicolons, decimal commas, units in line 2",
        ),
        (log("a (s),b [V],f_N\n", ",", "\n", "", point).replace("f_N", "f (N)").into(), ""),
        (log("", ",", "\n", "NaN", point).into(), ""),
        (log("", " ", "\n", "nan", exponent).into(), "spaces"),
        (log("", ";", "\n", "", comma).into(), german),
    ] {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let file =
            read(&bytes, Stated::default()).unwrap_or_else(|error| panic!("{text:?}: {error}"));
        assert_eq!(file.found, says, "{text:?}");
        assert!(file.value(0, 2).is_nan(), "{text:?}");
        let values: Vec<f64> = file.values.into_iter().filter(|value| !value.is_nan()).collect();
        assert_eq!(values, [0.0, 1234.5, 0.5, -0.0042, 2e-7, 1.0, 7.0, -1.0], "{text:?}");
    }
}

#[test]
fn an_encoding_is_found_by_its_mark_or_its_bytes() {
    let text = "t_s;Kraft µ\n1,5;2\n2,5;3\n";
    let [little, big] =
        [u16::to_le_bytes, u16::to_be_bytes].map(|bytes| text.encode_utf16().flat_map(bytes));
    let [little, big]: [Vec<u8>; 2] = [little.collect(), big.collect()];
    for (bytes, encoding) in [
        (text.into(), ""),
        (text.chars().map(|c| c as u8).collect(), "latin-1, "),
        ([&[0xff, 0xfe], &little[..]].concat(), "UTF-16, "),
        ([&[0xfe, 0xff], &big[..]].concat(), "UTF-16, "),
        (little, "UTF-16, "),
        (big, "UTF-16, "),
    ] {
        let file = read(&bytes, Stated::default()).unwrap();
        assert_eq!((&*file.header[1], file.values.len()), ("Kraft µ", 4));
        assert_eq!(file.found, format!("{encoding}semicolons, decimal commas"));
    }
}

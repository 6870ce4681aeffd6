//! CSV text as it is parsed: lines, fields, and what is damaged.

use std::path::Path;

use taxel_data::data_file::csv::plain;
use taxel_data::data_file::{BLOCK, Reading, Stated};
use taxel_data::{DataFile, Purpose, Random, Result, Stream};

fn parse(path: &Path, bytes: &[u8], has_header: bool) -> Result<DataFile> {
    DataFile::parse(path, bytes, &Reading { has_header, ..Reading::default() })
}

/// Bits of all values, and numbers of all lines.
fn bits(file: &DataFile) -> (Vec<u64>, Vec<u64>) {
    let lines = 0..file.lines();
    (
        file.values.iter().map(|value| value.to_bits()).collect(),
        lines.map(|line| file.line_number(line)).collect(),
    )
}

#[test]
fn the_quick_reader_reads_what_the_careful_one_reads() {
    for (header, lines, is_plain) in [
        ("a,b\n", "1,2\n3,4\n", true),
        ("a,b\r\n", "1,2\r\n3,4\r\n", true),
        ("a,b\n", "1,2\n3,4", true),
        ("a,b\r\n", "1,2\r\n3,4", true),
        ("\n\na,b\n", "1,2\n", true),
        ("\"a\",b\n", "-1e-3,+2.5E7\n.5,7.\n", true),
        ("a,b\n", ",\nNaN,\nnan,-nan\n", true),
        ("a,b\n", " 1 ,\t2\n  ,3\n", true),
        ("a\n", "1\n2\n", true),
        ("a,b\n", "123456789012345678901234567890,0.1000000000000000055511151231257827\n", true),
        ("a,b\n", "4.9406564584124654e-324,1.7976931348623157e308\n", true),
        ("a,b\n", "\"1\",2\n", false),
        ("a,b\n", "1,2\n\n3,4\n", false),
        ("a,b\n", "1,2\n3,4\n\n", false),
        ("a,b\r", "1,2\r3,4\r", false),
        ("a,b\n", "1,2\r3,4\n", false),
        ("\u{feff}a,b\n", "1,2\n", true),
        ("a,b\n", "\u{a0}1,2\n", true),
    ] {
        let columns = 1 + header.matches(',').count();
        let read = |text: &str| parse(Path::new("test.csv"), text.as_bytes(), false).unwrap();
        let (values, numbers) = bits(&read(&[header, lines].concat()));
        // A line in quotes before the others leaves all to the careful reader.
        let end = header.trim_start_matches('\n').trim_start_matches(|it: char| !it.is_control());
        let first = ["\"7\""; 2][..columns].join(",") + end;
        let (careful, moved) = bits(&read(&[header, &first, lines].concat()));
        assert_eq!(values, careful[columns..], "{lines:?}");
        let careful: Vec<u64> = moved[1..].iter().map(|number| number - 1).collect();
        assert_eq!(numbers, careful, "{lines:?}");
        for (lines, is_plain) in [(lines.to_owned(), is_plain), (first + lines, false)] {
            let quick = plain::read(lines.as_bytes(), columns, &mut vec![]);
            assert_eq!(quick.is_some(), is_plain, "{lines:?}");
        }
    }
}

#[test]
fn lines_are_counted_as_an_editor_counts_them() {
    for (text, line) in [
        ("a,b\n1,2\n3,x\n", 3),
        ("a,b\r\n1,2\r\n3,x\r\n", 3),
        ("a,b\r1,2\r3,x\r", 3),
        ("a,b\n\n1,2\n\n\n3,x\n", 6),
        ("\n\na,b\n\"1\",2\n3,x", 5),
        ("\r\ra,b\n1,2\n3,x\n", 5),
        ("\r\n\ra,b\r\n1,2\r\n3,x\r\n", 5),
        ("\u{feff}a,b\n1,2\n3,x\n", 3),
    ] {
        let file = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap();
        let message = file.column("b").unwrap_err();
        assert!(message.to_string().contains(&format!("line {line}")), "{text:?}: {message}");
    }
}

#[test]
fn what_is_wrong_is_left_to_the_careful_reader() {
    for field in ["x", "inf", "1e999", "2e", "2 3", "\u{ff12}", "1.5.2", "0x10"] {
        let file = parse(Path::new("test.csv"), format!("a,b\n1,{field}\n").as_bytes(), false);
        let refused = file.unwrap().column("b").unwrap_err().to_string();
        assert!(refused.contains(&format!("{field:?} is not a number")), "{refused}");
    }
    for (text, says) in [
        ("a,b\n1,2\n3\n", "line 3 has 1 fields; the header names 2"),
        ("a,b\n1,2,3\n4,5,6\n", "line 2 has 3 fields; the header names 2"),
    ] {
        let refused = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap_err().to_string();
        assert!(refused.contains(says), "{text:?}: {refused}");
    }
}

#[test]
fn files_of_many_blocks_are_read_whole_and_faults_in_them_found() {
    let path = Path::new("test.csv");
    let lines = 3 * BLOCK / 40;
    for (separator, line_break, line_end) in
        [(",", "", "\n"), (",", "\n", "\r\n"), (",", "\r", "\n"), (";", " ", "\r")]
    {
        let note = |line: usize| match line_break {
            "" => line.to_string(),
            _ => format!("line{line_break}no. {line}, {}.", "x".repeat(line % 7)),
        };
        let quote = if line_break.is_empty() { "" } else { "\"" };
        let mut text = vec![["a", "b (µm)", "c"].join(separator)];
        text.extend((0..lines).map(|line| {
            let note = [quote, &note(line), quote].concat();
            [(line as f64).sqrt().to_string(), note, "0.5".into()].join(separator)
        }));
        text.push(["1", "2", "three"].join(separator) + line_end);
        let text = text.join(line_end);
        let latin_1: Vec<u8> = text.chars().map(|char| char as u8).collect();
        let stated = Stated { separator: separator.parse().ok(), decimal_comma: Some(false) };
        let reading = Reading { keeps_text: true, stated, ..Reading::default() };
        let file = DataFile::parse(path, &latin_1, &reading).unwrap();
        assert_eq!((file.lines(), &*file.header[1]), (lines, "b (µm)"));
        let of_a_line = if line_break.trim_end_matches(' ').is_empty() { 1 } else { 2 };
        for line in 0..lines {
            assert_eq!([file.value(line, 0), file.value(line, 2)], [(line as f64).sqrt(), 0.5]);
            assert_eq!(file.texts(1).at(line), note(line));
            assert_eq!(file.line_number(line), 2 + (line * of_a_line) as u64);
        }
        let unreadable = file.unreadable.unwrap();
        let line = 2 + (lines * of_a_line) as u64;
        let reason = format!("line {line}, column \"c\": \"three\" is not a number");
        assert_eq!((unreadable.lines, unreadable.first), (1, reason));
    }
    let open = format!("a,b\n1,2\n3,\"{}", "4\n".repeat(3 * BLOCK));
    let refused = parse(path, open.as_bytes(), false).unwrap_err().to_string();
    assert!(refused.contains("line 3: a quoted field does not end"), "{refused}");
}

/// A log of 40 lines whose lines 11, 12, … are these `bad` ones.
fn log_with(bad: &[&[u8]]) -> Vec<u8> {
    let line = |i: usize| match i.checked_sub(10).and_then(|at| bad.get(at)) {
        Some(bad) => bad.to_vec(),
        None => format!("{i},{}.5,pén\n", 2 * i).into_bytes(),
    };
    let lines = (1..=40).map(|i| if i == 1 { b"t,f,label\n".to_vec() } else { line(i - 1) });
    lines.collect::<Vec<_>>().concat()
}

#[test]
fn few_lines_that_are_cut_or_garbled_are_skipped_and_counted() {
    let path = Path::new("log.csv");
    for (bad, reason) in [
        (&b"12,3\n"[..], "line 11 has 2 fields; the header names 3"),
        (b"12,31.5,pen,4\n", "line 11 has 4 fields; the header names 3"),
        (b"12,3\xff\xfe5,pen\n", "line 11, column \"f\": \"3\u{fffd}\u{fffd}5\" is not a number"),
        (b"12,3\x001.5,pen\n", "line 11, column \"f\": \"3\\01.5\" is not a number"),
        (b"t,f,label\n", "line 11, column \"t\": \"t\" is not a number"),
        (b"\"12,31.5,pen\n", "line 11: a quoted field does not end"),
    ] {
        let reading = Reading { keeps_text: true, ..Reading::default() };
        let file = DataFile::parse(path, &log_with(&[bad]), &reading).unwrap();
        let found = file.unreadable.clone().unwrap();
        assert_eq!((found.lines, &*found.first), (1, reason));
        assert_eq!((file.lines(), file.line_number(9), file.value(9, 0)), (38, 12, 11.0));
        assert_eq!((&*file.texts(1).at(9), &*file.texts(2).at(37)), ("22.5", "pén"));
        let strict = Reading { is_strict: true, ..Reading::default() };
        let strict = DataFile::parse(path, &log_with(&[bad]), &strict);
        let refused = strict.and_then(|it| it.columns(["t", "f"])).unwrap_err().to_string();
        assert!(refused.contains(reason), "{refused}");
    }
    let three: [&[u8]; 3] = [b"1\n", b"2\n", b"3,x,pen\n"];
    let refused = DataFile::parse(path, &log_with(&three), &Reading::default()).unwrap_err();
    let says = "3 of 39 lines are cut or garbled, and at most 5 % are skipped; the first: line 11 has 1 fields";
    assert!(refused.to_string().contains(says), "{refused}");
}

#[test]
fn a_first_line_of_numbers_is_data() {
    let path = Path::new("test.csv");
    for (text, header, lines, first_line) in [
        ("1,2\n3,4\n", vec!["c1", "c2"], 2, 1),
        ("1743486221.590758,,-1e-3\r\n2,3,4\r\n", vec!["c1", "c2", "c3"], 2, 1),
        ("\u{feff}1,2\n3,4", vec!["c1", "c2"], 2, 1),
        ("\n\n1,2\n3,4\n", vec!["c1", "c2"], 2, 3),
        ("\"1\",2\n\n3,4\n", vec!["c1", "c2"], 2, 1),
        (" 1 , NaN\n3,4\n", vec!["c1", "c2"], 2, 1),
        ("7\n8\n", vec!["c1"], 2, 1),
    ] {
        let file = parse(path, text.as_bytes(), false).unwrap();
        assert_eq!(file.header, header, "{text:?}");
        assert!(!file.names_columns, "{text:?}");
        assert_eq!((file.lines(), file.line_number(0)), (lines, first_line), "{text:?}");
    }
    let named = parse(path, b"1,2\n3,4\n", true).unwrap();
    assert_eq!((&*named.header, named.lines()), (&["1".into(), "2".into()][..], 1));
    for text in ["a,2\n3,4\n", "nan,inf\n1,2\n", "1,inf\n1,2\n"] {
        assert!(parse(path, text.as_bytes(), false).unwrap().names_columns, "{text:?}");
    }
}

#[test]
fn a_column_that_is_no_number_is_told_once_it_is_asked_for() {
    let path = Path::new("test.csv");
    let file = parse(path, b"t,label,f\n1,pen,2\n2, cup,x\n3,pen,4\n", false).unwrap();
    assert!(file.column("t").is_ok() && file.value(1, 1).is_nan() && file.value(2, 2) == 4.0);
    for (column, says) in [
        ("f", "line 3, column \"f\": \"x\" is not a number"),
        ("label", "line 2, column \"label\": \"pen\" is not a number"),
    ] {
        let column = file.column_of_any(column).unwrap();
        let refused = file.check_numbers(&[0, column]).unwrap_err().to_string();
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn time_stamps_count_in_seconds_where_a_column_has_nothing_else() {
    let path = Path::new("test.csv");
    let file = parse(path, b"2026-11-01T00:00:00Z,1\nNaT,2\n2026-11-01 00:00:01.5,3\n", false);
    let file = file.unwrap();
    assert!(!file.names_columns && file.column("c1").is_ok());
    assert_eq!((file.value(2, 0) - file.value(0, 0), file.value(1, 0).is_nan()), (1.5, true));
    for text in ["t\n2026-11-01 00:00\n5\n", "t\n5\n2026-11-01 00:00\n"] {
        let refused = parse(path, text.as_bytes(), false).unwrap().column("t").unwrap_err();
        assert!(refused.to_string().contains("line 3"), "{refused}");
    }
    // Nor is one a number because the block before held numbers alone.
    let text = format!("t\n{}2026-11-01 00:00\n", "5\n".repeat(BLOCK));
    let file = parse(path, text.as_bytes(), false).unwrap();
    assert_eq!((file.lines(), file.unreadable.unwrap().lines), (BLOCK, 1));
}

#[test]
fn words_for_missing_values_and_unnamed_columns_are_recognised() {
    let path = Path::new("test.csv");
    let file = parse(path, b",a,\n0,N/A,1\n1,na,null\n2,-,?\n", false).unwrap();
    assert_eq!(file.header, ["c1", "a", "c3"]);
    assert!((0..3).all(|line| file.value(line, 1).is_nan()));
    file.check_numbers(&[0, 1, 2]).unwrap();
    let refused = parse(path, b",c1\n1,2\n", false).unwrap_err().to_string();
    assert!(refused.contains("header: column \"c1\" appears twice"), "{refused}");
}

/// Texts of several dialects with a byte flipped, cut short, or with a part that appears twice.
#[test]
fn a_damaged_file_is_refused_or_read_to_finite_numbers() {
    let sound: [&[u8]; 4] = [
        b"time_s,r1c1_ohm,\"a,b\"\n0.0,57.5,1e3\n0.1,N/A,-2.5\n0.2,60,7\n",
        b"\xef\xbb\xbft;x [N]\r\n1,5;2,25\r\n2,5;\r\n",
        b"# log\nsep=\t\nt\tf\n2026-11-01T00:00:00Z\t1\n2026-11-01T00:00:01Z\t2\n",
        b"a b  c\n1 2  3\n4 5  6\n",
    ];
    let mut random = Random::new(1, Stream::Test, Purpose::Damage, 0, 0);
    let mut read = 0;
    for case in 0..4000 {
        let mut bytes = sound[case % sound.len()].to_vec();
        for _ in 0..=random.below(3) {
            let (one, other) = (random.below(bytes.len()), random.below(bytes.len()));
            let part = bytes[one.min(other)..one.max(other)].to_vec();
            match random.below(3) {
                0 => bytes[one] ^= 1 << random.below(8),
                1 => bytes.truncate(one.max(1)),
                _ => drop(bytes.splice(one..one, part)),
            }
        }
        let Ok(file) = parse(Path::new("test.csv"), &bytes, case % 2 == 0) else { continue };
        read += 1;
        assert_eq!(file.values.len(), file.lines() * file.header.len(), "{bytes:?}");
        assert!(!file.values.iter().any(|value| value.is_infinite()), "{bytes:?}");
    }
    assert!((1000..4000).contains(&read), "{read} files were read");
}

#[test]
fn a_part_of_a_file_keeps_the_numbers_of_its_lines() {
    let mut file = parse(Path::new("test.csv"), b"a\n1\n2\n3\n4\n", false).unwrap();
    file.keep_lines(2..4);
    assert_eq!([file.line_number(0), file.line_number(1)], [4, 5]);
}

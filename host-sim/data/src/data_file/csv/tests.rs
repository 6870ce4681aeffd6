use super::*;
use crate::random::{Purpose, Random, Stream};

/// The text as it is parsed, of any dialect.
fn parse(path: &Path, bytes: &[u8], has_header: bool) -> Result<DataFile> {
    super::parse(path, bytes, &Reading { has_header, ..Reading::default() })
}

/// Values and line numbers that the careful reader finds in a file.
fn carefully(bytes: &[u8]) -> Result<(Vec<f64>, Vec<u64>)> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let read = read_carefully(Path::new("test.csv"), bytes, &mut reader, &header);
    read.map(|(values, line_numbers, _)| (values, line_numbers))
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn the_quick_reader_reads_what_the_careful_one_reads() {
    for (text, is_plain) in [
        ("a,b\n1,2\n3,4\n", true),
        ("a,b\r\n1,2\r\n3,4\r\n", true),
        ("a,b\n1,2\n3,4", true),
        ("a,b\r\n1,2\r\n3,4", true),
        ("\n\na,b\n1,2\n", true),
        ("\"a\",b\n-1e-3,+2.5E7\n.5,7.\n", true),
        ("a,b\n,\nNaN,\nnan,-nan\n", true),
        ("a,b\n 1 ,\t2\n  ,3\n", true),
        ("a\n1\n2\n", true),
        ("a,b\n123456789012345678901234567890,0.1000000000000000055511151231257827\n", true),
        ("a,b\n4.9406564584124654e-324,1.7976931348623157e308\n", true),
        ("a,b\n\"1\",2\n", false),
        ("a,b\n1,2\n\n3,4\n", false),
        ("a,b\n1,2\n3,4\n\n", false),
        ("a,b\r1,2\r3,4\r", false),
        ("a,b\n1,2\r3,4\n", false),
        ("\u{feff}a,b\n1,2\n", true),
        ("a,b\n\u{a0}1,2\n", true),
    ] {
        let file = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap();
        let (values, line_numbers) = carefully(text.as_bytes()).unwrap();
        assert_eq!(bits(&file.values), bits(&values), "{text:?}");
        assert_eq!(file.line_numbers, line_numbers, "{text:?}");
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
        let columns = reader.headers().unwrap().len();
        let quick = lines_of_data(text.as_bytes(), reader.position())
            .and_then(|(_, lines)| body::read(lines, columns));
        assert_eq!(quick.is_some(), is_plain, "{text:?}");
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
    for text in ["a,b\n1,2\n3\n", "a,b\n1,2,3\n4,5,6\n"] {
        let message = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap_err();
        let careful = carefully(text.as_bytes()).unwrap_err();
        assert_eq!(message.to_string(), careful.to_string(), "{text:?}");
    }
}

#[test]
fn files_of_many_pieces_are_read_whole_and_faults_in_them_found() {
    let mut text = String::from("a,b,c\n");
    let lines = 60_000;
    for line in 0..lines {
        let value = f64::from(line).sqrt();
        text += &[value, -value * 1e-7, f64::from(line)].map(|v| v.to_string()).join(",");
        text += "\n";
    }
    let file = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap();
    assert_eq!(file.lines(), lines as usize);
    for line in 0..lines {
        let value = f64::from(line).sqrt();
        let found = [0, 1, 2].map(|column| file.value(line as usize, column));
        assert_eq!(found, [value, -value * 1e-7, f64::from(line)]);
        assert_eq!(file.line_number(line as usize), line as u64 + 2);
    }
    text += "1,2,three\n";
    let file = parse(Path::new("test.csv"), text.as_bytes(), false).unwrap();
    let message = file.column("c").unwrap_err().to_string();
    assert!(message.contains("line 60002, column \"c\": \"three\" is not a number"), "{message}");
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
}

#[test]
fn words_for_missing_values_and_columns_without_a_name_are_known() {
    let path = Path::new("test.csv");
    let file = parse(path, b",a,\n0,N/A,1\n1,na,null\n2,-,?\n", false).unwrap();
    assert_eq!(file.header, ["c1", "a", "c3"]);
    assert!(file.rows().all(|row| row[1].is_nan()) && file.not_numbers.is_empty());
    let refused = parse(path, b",c1\n1,2\n", false).unwrap_err().to_string();
    assert!(refused.contains("header: column \"c1\" stands twice"), "{refused}");
}

/// Texts of several dialects with a byte flipped, cut short, or with a part that stands twice.
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
        assert!(file.rows().all(|line| line.len() == file.header.len()), "{bytes:?}");
        assert!(!file.rows().flatten().any(|value| value.is_infinite()), "{bytes:?}");
    }
    assert!((1000..4000).contains(&read), "{read} files were read");
}

use std::path::Path;

use super::*;
use crate::data_file::Reading;

fn log(path: &str, header: &[&str], lines: &[&[f64]]) -> DataFile {
    DataFile {
        path: Path::new(path).into(),
        header: header.iter().map(|name| (*name).to_owned()).collect(),
        names_columns: true,
        values: lines.concat(),
        line_numbers: (2..).take(lines.len()).collect(),
        kept: 0..lines.len(),
        ..DataFile::default()
    }
}

/// A CSV file that was read with its text.
fn read(text: &str) -> DataFile {
    let file = tempfile::NamedTempFile::with_suffix(".csv").unwrap();
    std::fs::write(file.path(), text).unwrap();
    DataFile::read_as(file.path(), &Reading { keeps_text: true, ..Reading::default() }).unwrap()
}

fn on_time(tolerance: f64, lag: f64) -> Join {
    Join {
        on: ["t".into(), "t".into()],
        tolerance: tolerance.into(),
        lag: lag.into(),
        time_factor: None,
    }
}

/// The joined lines, with the columns of both logs.
fn rows(joined: &Joined, [first, second]: [&DataFile; 2]) -> Vec<Vec<f64>> {
    let pairs = joined.pairs.iter();
    pairs.map(|[line, partner]| [first.row(*line), second.row(*partner)].concat()).collect()
}

#[test]
fn each_line_finds_the_nearest_time_stamp_within_the_tolerance() {
    let first = log("a.csv", &["t", "x"], &[&[0.0, 1.0], &[1.0, 2.0], &[2.0, 3.0], &[9.0, 4.0]]);
    let second =
        log("b.csv", &["t", "y"], &[&[0.1, 10.0], &[0.9, 20.0], &[1.2, 30.0], &[2.5, 40.0]]);
    let joined = on_time(0.5, 0.0).join(&first, &second).unwrap();
    assert_eq!(joined.header, ["t", "x", "b.t", "y"]);
    let expected = [[0.0, 1.0, 0.1, 10.0], [1.0, 2.0, 0.9, 20.0], [2.0, 3.0, 2.5, 40.0]];
    assert_eq!(rows(&joined, [&first, &second]), expected);
    assert_eq!((joined.repeated, joined.largest_distance), (0, 0.5));
    assert_eq!(joined.pairs, [[0, 0], [1, 1], [2, 3]]);
}

#[test]
fn the_lag_is_added_to_the_second_log() {
    let first = log("a.csv", &["t"], &[&[10.0], &[11.0]]);
    let second = log("b.csv", &["t", "y"], &[&[7.0, 1.0], &[8.0, 2.0], &[9.0, 3.0]]);
    let joined = on_time(0.1, 3.0).join(&first, &second).unwrap();
    assert_eq!(rows(&joined, [&first, &second]), [[10.0, 7.0, 1.0], [11.0, 8.0, 2.0]]);
    let refused = on_time(0.1, -3.5).join(&first, &second).unwrap_err().to_string();
    assert!(refused.contains("tolerance = 0.1") && refused.contains("4.5 apart"), "{refused}");
}

#[test]
fn of_equally_near_lines_the_first_is_taken() {
    let first = log("a.csv", &["t"], &[&[1.0], &[1.0], &[2.0]]);
    let second = log("b.csv", &["t", "y"], &[&[0.5, 1.0], &[0.5, 2.0], &[1.5, 3.0], &[1.5, 4.0]]);
    let joined = on_time(1.0, 0.0).join(&first, &second).unwrap();
    assert_eq!(
        rows(&joined, [&first, &second]),
        [[1.0, 0.5, 1.0], [1.0, 0.5, 1.0], [2.0, 1.5, 3.0]]
    );
    assert_eq!(joined.repeated, 2);
}

#[test]
fn lines_without_a_time_stamp_are_left_out() {
    let first = log("a.csv", &["t"], &[&[0.0], &[f64::NAN], &[1.0]]);
    let second = log("b.csv", &["t", "y"], &[&[f64::NAN, 1.0], &[0.0, 2.0], &[1.0, f64::NAN]]);
    let joined = on_time(0.0, 0.0).join(&first, &second).unwrap();
    assert_eq!(joined.pairs, [[0, 1], [2, 2]]);
    assert_eq!(rows(&joined, [&first, &second])[0], [0.0, 0.0, 2.0]);
    assert!(rows(&joined, [&first, &second])[1][2].is_nan());
    let empty = log("b.csv", &["t", "y"], &[&[f64::NAN, 1.0]]);
    let refused = on_time(1.0, 0.0).join(&first, &empty).unwrap_err().to_string();
    assert!(refused.contains("no time stamp"), "{refused}");
}

#[test]
fn a_clock_that_was_set_back_is_refused() {
    let first = log("a.csv", &["t"], &[&[0.0], &[1.0]]);
    let second = log("b.csv", &["t"], &[&[0.0], &[5.0], &[f64::NAN], &[4.5]]);
    let refused = on_time(1.0, 0.0).join(&first, &second).unwrap_err().to_string();
    assert!(refused.contains("b.csv: line 5, column \"t\": 4.5 is earlier than 5"), "{refused}");
    assert!(on_time(1.0, 0.0).join(&second, &first).is_err());
}

#[test]
fn names_that_exist_already_get_a_prefix_as_often_as_needed() {
    let first = log("a.csv", &["c1", "b.c1"], &[&[0.0, 1.0]]);
    let second = log("b.csv", &["c1", "c2"], &[&[0.0, 2.0]]);
    let join = Join {
        on: ["c1".into(), "c1".into()],
        tolerance: 0.0.into(),
        lag: 0.0.into(),
        time_factor: None,
    };
    assert_eq!(join.join(&first, &second).unwrap().header, ["c1", "b.c1", "b.b.c1", "c2"]);
}

#[test]
fn times_of_day_keep_their_microseconds() {
    let start = 1_743_486_221.590_758;
    let first = log("a.csv", &["t"], &[&[start], &[start + 1e-4]]);
    let second = log("b.csv", &["t", "y"], &[&[start - 4e-5, 1.0], &[start + 6.2e-5, 2.0]]);
    let joined = on_time(1e-4, 0.0).join(&first, &second).unwrap();
    assert_eq!(
        rows(&joined, [&first, &second]).iter().map(|row| row[2]).collect::<Vec<_>>(),
        [1.0, 2.0]
    );
}

#[test]
fn tolerances_and_lags_that_are_no_times_are_refused() {
    for (join, field) in [
        (on_time(-1.0, 0.0), "tolerance"),
        (on_time(f64::NAN, 0.0), "tolerance"),
        (on_time(1.0, f64::INFINITY), "lag"),
    ] {
        assert_eq!(join.check().unwrap_err().field, field);
    }
    assert_eq!(on_time(0.0, -2.5).check(), Ok(()));
}

#[test]
fn a_tolerance_that_is_met_exactly_joins() {
    // 1.05 − 1.0 and half of the others are a little more than 0.05 in f64.
    let line = |time: usize, more: f64| [time as f64 / 10.0 + more, 0.0];
    let of = |more: f64| -> Vec<[f64; 2]> { (0..50).map(|time| line(time, more)).collect() };
    let lines = [of(0.0), of(0.05)];
    let [first, second] = lines.each_ref().map(|lines| {
        let lines: Vec<&[f64]> = lines.iter().map(<[f64; 2]>::as_slice).collect();
        log("a.csv", &["t", "x"], &lines)
    });
    assert_eq!(on_time(0.05, 0.0).join(&first, &second).unwrap().pairs.len(), 50);
    assert!(on_time(0.04999, 0.0).join(&first, &second).is_err());
}

#[test]
fn nanoseconds_since_1970_are_joined_to_the_last_one() {
    // f64 steps by 256 ns here.
    let start = 1_743_486_221_590_758_123_i64;
    let log = |name: &str, shift: i64| {
        let lines = (0..5).map(|line| format!("{},{line}\n", start + 10 * line + shift));
        read(&format!("{name},value\n{}", lines.collect::<String>()))
    };
    let (first, second) = (log("t", 0), log("t", 3));
    let joined = on_time(3.0, 0.0).join(&first, &second).unwrap();
    assert_eq!(joined.pairs, [[0, 0], [1, 1], [2, 2], [3, 3], [4, 4]]);
    assert_eq!(joined.largest_distance, 3.0);
    assert!(on_time(2.0, 0.0).join(&first, &second).is_err());
    assert_eq!(first.texts(0).unwrap().at(1), (start + 10).to_string());
    let back = read(&format!("t\n{}\n{start}\n", start + 1));
    let refused = on_time(1.0, 0.0).join(&first, &back).unwrap_err().to_string();
    assert!(refused.contains("1743486221590758123 is earlier than"), "{refused}");
    for inexact in [read("t\n1743486221590758123.5\n"), DataFile { texts: None, ..first.clone() }] {
        let refused = on_time(1.0, 0.0).join(&first, &inexact).unwrap_err().to_string();
        assert!(refused.contains("more digits than numbers hold"), "{refused}");
    }
}

#[test]
fn whole_numbers_are_exact_however_far_apart_and_whatever_the_lag() {
    let join = |tolerance: &str, lag: &str, [first, second]: [&str; 2]| {
        let (tolerance, lag) = (tolerance.parse().unwrap(), lag.parse().unwrap());
        let join = Join { tolerance, lag, ..on_time(0.0, 0.0) };
        join.join(&read(&format!("t\n{first}\n")), &read(&format!("t\n{second}\n")))
    };
    // Beyond 2^53 from the first stamp, f64 steps by 2 and more.
    let pairs = |joined: Result<Joined>| joined.unwrap().pairs;
    let far = ["0\n9007199254740995", "9007199254740994\n9007199254740996"];
    assert_eq!(pairs(join("1", "0", far)), [[1, 0]]);
    assert!(join("0", "0", far).is_err());
    let ends = ["-9223372036854775808\n9223372036854775807", "9223372036854775806"];
    assert_eq!(pairs(join("1", "0", ends)), [[1, 0]]);
    // Small time stamps, and a lag from another start: 1743486221590758123 is no f64.
    let lag = "1743486221590758123";
    let clocks = ["1743486221590758130\n1743486221590758140", "7\n17"];
    assert_eq!(pairs(join("0", lag, clocks)), [[0, 0], [1, 1]]);
    assert!(join("0", "1743486221590758124", clocks).is_err());
    assert_eq!(pairs(join("0", "-1743486221590758123", [clocks[1], clocks[0]])).len(), 2);
    assert_eq!(pairs(join("9007199254740993", "9007199254740993", ["0", "0"])).len(), 1);
    assert!(join("9007199254740992", "9007199254740993", ["0", "0"]).is_err());
    for lag in ["1743486221590758123.0", "0.5", "1e300"] {
        let refused = join("1e300", lag, clocks).unwrap_err().to_string();
        assert!(refused.starts_with("lag = ") && refused.contains("a whole number"), "{refused}");
    }
    let refused = join("1", lag, ["0.5", "1"]).unwrap_err().to_string();
    assert!(refused.contains("the time stamp 0.5 has more digits"), "{refused}");
}

#[test]
fn texts_are_those_of_the_lines_that_are_left_and_missing_ones_are_empty() {
    let mut file = read("\u{feff}a,\"b\"\r\n 1.50,-1\r\n\r\n\"2e3\",7\r\n,0010\r\n");
    file.mark_missing(-1.0);
    let texts = |file: &DataFile, column| -> Vec<String> {
        let texts = file.texts(column).unwrap();
        (0..file.lines()).map(|line| texts.at(line).into_owned()).collect()
    };
    assert_eq!([1, 0].map(|column| texts(&file, column)), [["", "7", "0010"], ["1.50", "2e3", ""]]);
    file.keep_lines(1..2);
    assert_eq!([0, 1].map(|column| texts(&file, column)), [["2e3"], ["7"]]);
    file.texts = None;
    assert_eq!(texts(&file, 0), ["2000"]);
}

#[test]
fn logs_that_count_time_in_two_units_are_refused_until_the_factor_is_told() {
    let lines =
        |unit: f64| (0..200).map(|line| vec![unit * f64::from(line) / 20.0]).collect::<Vec<_>>();
    let of = |unit: f64, path| {
        let lines = lines(unit);
        log(path, &["t"], &lines.iter().map(Vec::as_slice).collect::<Vec<_>>())
    };
    for (unit, factor) in [(1e3, 1e-3), (1e6, 1e-6), (1e9, 1e-9), (1e-3, 1e3)] {
        let (first, second) = (of(1.0, "a.csv"), of(unit, "b.csv"));
        let refused = on_time(0.01, 0.0).join(&first, &second).unwrap_err().to_string();
        assert!(refused.contains(&format!("--time-factor {factor} ")), "{refused}");
        let told = Join { time_factor: Some(factor), ..on_time(0.01, 0.0) };
        assert_eq!(told.join(&first, &second).unwrap().pairs.len(), 200);
        let same = Join { time_factor: Some(1.0), ..on_time(0.01, 0.0) };
        assert!(same.join(&first, &second).unwrap().pairs.len() < 200);
    }
    let other = of(20.0, "b.csv"); // a log may be longer
    assert!(on_time(0.5, 0.0).join(&of(1.0, "a.csv"), &other).is_ok());
}

#[test]
fn logs_of_which_hardly_any_line_has_a_partner_are_refused() {
    let lines: Vec<[f64; 1]> = (0..300).map(|line| [f64::from(line)]).collect();
    let late: Vec<[f64; 1]> = (0..300).map(|line| [f64::from(line) + 297.0]).collect();
    let of = |lines: &[[f64; 1]], path| {
        log(path, &["t"], &lines.iter().map(|line| &line[..]).collect::<Vec<_>>())
    };
    let (first, second) = (of(&lines, "a.csv"), of(&late, "b.csv"));
    let refused = on_time(0.5, 0.0).join(&first, &second).unwrap_err().to_string();
    assert!(refused.contains("3 of 300 lines have a partner in b.csv, hardly any"), "{refused}");
    let meant = Join { time_factor: Some(1.0), ..on_time(0.5, 0.0) };
    assert_eq!(meant.join(&first, &second).unwrap().pairs.len(), 3);
    // Few lines of a slow log are all of its lines.
    let slow: Vec<[f64; 1]> = (0..3).map(|line| [f64::from(line) * 100.0]).collect();
    assert_eq!(on_time(0.5, 0.0).join(&first, &of(&slow, "b.csv")).unwrap().pairs.len(), 3);
}

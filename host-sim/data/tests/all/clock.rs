//! Times of logs, and whether their lines resemble their neighbours.

use std::path::Path;

use taxel_data::clock::neighbours_alike;
use taxel_data::data_file::Reading;
use taxel_data::{Clock, DataFile, Result, Table};

fn clock(text: &str, name: Option<&str>) -> Result<Clock> {
    let file = DataFile::parse(Path::new("log.csv"), text.as_bytes(), &Reading::default())?;
    Clock::of(&file, name)
}

#[test]
fn times_are_seconds_since_the_first_line_if_the_unit_is_known() {
    for text in [
        "time_ms,a\n500,1\n1500,2\n2500,3\n",
        "a,Timestamp\n1,2026-11-01 00:00:00.0\n2,2026-11-01 00:00:01.0\n3,2026-11-01 00:00:02.0\n",
        "stamp,a\n1700000000000,1\n1700000001000,2\n1700000002000,3\n",
        "t (s),a\n7,1\n8,2\n9,3\n",
        "time_ms,a\n1500000000,1\n1500001000,2\n1500002000,3\n",
        "millis,a\n500,1\n1500,2\n2500,3\n",
        "Micros,a\n1,1\n1000001,2\n2000001,3\n",
        "a,ms\n1,500\n2,1500\n3,2500\n",
        "us,a\n1,1\n1000001,2\n2000001,3\n",
        "Elapsed [ms],a\n500,1\n1500,2\n2500,3\n",
        "seconds,a\n7,1\n8,2\n9,3\n",
    ] {
        let clock = clock(text, None).unwrap();
        assert_eq!((clock.unit, &clock.at[..]), ("s", &[0.0, 1.0, 2.0][..]), "{text}");
        assert_eq!(clock.span(50.0, 52.0), "in 2.000 s");
        assert_eq!(clock.span(30.0, 120.0), "in 1.5 minutes");
    }
}

#[test]
fn a_log_without_times_counts_its_lines() {
    // A temperature, times that go back, and one that stands still.
    for text in ["t_degC,a\n1,1\n2,2\n", "time,a\n2,1\n1,2\n", "time,a\n1,1\n1,2\n"] {
        let clock = clock(text, None).unwrap();
        assert_eq!((clock.column.as_deref(), &clock.at[..]), (None, &[2.0, 3.0][..]), "{text}");
        assert_eq!(clock.span(2.0, 3.0), "from line 2 to line 3");
    }
    let monotonic = clock("t,a\n12000000000000,1\n12300000000000,2\n", None).unwrap();
    assert_eq!(monotonic.unit, "", "nanoseconds since a start");
    let unknown = clock("time,a\n5,1\n7,2\n", None).unwrap();
    assert_eq!((unknown.unit, unknown.span(5.0, 7.0).as_str()), ("", "from time 5 to 7"));
}

#[test]
fn a_column_that_is_named_must_hold_times() {
    assert_eq!(clock("n,a\n5,1\n7,2\n7,3\n", Some("n")).unwrap().at, [5.0, 7.0, 7.0]);
    let refused = clock("n,a\n5,1\n4,2\n", Some("n")).unwrap_err().to_string();
    assert!(refused.contains("line 3") && refused.contains("4 is earlier than 5"), "{refused}");
    let refused = clock("n,a\n,1\n5,2\n", Some("n")).unwrap_err().to_string();
    assert!(refused.contains("line 2: column \"n\": the time is missing"), "{refused}");
}

#[test]
fn neighbours_are_alike_in_a_log_and_not_in_shuffled_lines() {
    let table = |values: Vec<f64>| Table { names: vec!["f_n".into()], values: values.into() };
    let wave = |step: f64, lines: i32| (0..lines).map(|i| (step * f64::from(i)).sin()).collect();
    assert!(neighbours_alike(&table(wave(0.1, 20))) && !neighbours_alike(&table(wave(0.1, 19))));
    let waves: Vec<f64> = wave(0.8, 200);
    let names = ["x", "y", "constant"].map(String::from).to_vec();
    let values = waves.iter().flat_map(|value| [*value, *value, 7.0]).collect();
    assert!(neighbours_alike(&Table { names, values }));
    let shuffled = |i: i32| 1e3 + f64::from(i * 37 % 101) / 101.0;
    assert!(!neighbours_alike(&table((0..200).map(shuffled).collect())));
    // Pauses without a value do not count.
    let gaps = |i: i32| if i % 3 == 0 { (f64::from(i) / 20.0).sin() } else { f64::NAN };
    assert!(neighbours_alike(&table((0..300).map(gaps).collect())));
    // What never changes tells nothing, however its mean is rounded.
    assert!(!neighbours_alike(&table(vec![0.1; 2400])));
}

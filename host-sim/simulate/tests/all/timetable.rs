//! Times at which rows are read.

use taxel_simulate::timetable::Timetable;

#[test]
fn rows_are_read_in_the_middle_of_their_part_of_a_scan() {
    let table = Timetable::every(0.01, 0.008, 0.05).unwrap();
    assert_eq!((table.scans(), table.starts_s[4]), (5, 0.04));
    let offsets: Vec<f64> = (0..4).map(|place| table.row_offset_s(place, 4)).collect();
    assert_eq!(offsets, [0.001, 0.003, 0.005, 0.007]);
    // In two passes of 4 ms, rows are read at 0.5 and 4.5 ms, … 3.5 and 7.5 ms.
    let passes = table.clone().in_passes(2);
    let offsets: Vec<f64> = (0..4).map(|place| passes.row_offset_s(place, 4)).collect();
    let differences =
        offsets.iter().zip([0.0025, 0.0035, 0.0045, 0.0055]).map(|(a, b)| (a - b).abs());
    assert!(differences.fold(0.0, f64::max) < 1e-15, "{offsets:?}");
    assert_eq!(table.since_last_s(0), 0.0);
    assert!((table.since_last_s(3) - 0.01).abs() < 1e-15);
    assert_eq!(Timetable::every(1.0, 0.0, 0.5).unwrap(), Timetable::still());
}

#[test]
fn a_period_that_is_none_is_refused() {
    for period_s in [0.0, -1.0, f64::NAN, 1e-9] {
        let refused = Timetable::every(period_s, 0.0, 1.0).unwrap_err().to_string();
        assert!(refused.contains("frame period"), "{refused}");
    }
}

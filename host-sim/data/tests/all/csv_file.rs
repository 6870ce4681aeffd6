//! Numbers and lines of CSV files that are written.

use taxel_data::csv_file::{Column, NUMBERS_AT_A_TIME, write_columns};
use taxel_data::output::Scratch;
use taxel_data::{Purpose, Random, Stream};

/// Lines of a file with these columns and lines.
fn written(columns: [Column<'_>; 2], lines: &mut dyn Iterator<Item = [f64; 2]>) -> Vec<String> {
    let folder = Scratch::new().unwrap();
    let path = folder.path().join("data.csv");
    write_columns(&path, columns, lines).unwrap();
    std::fs::read_to_string(&path).unwrap().lines().map(String::from).collect()
}

#[test]
fn numbers_are_written_as_display_writes_them() {
    let mut random = Random::new(1, Stream::Test, Purpose::Damage, 0, 0);
    let drawn =
        (0..200_000).map(|_| (random.unit() - 0.5) * 10_f64.powf(40.0 * random.unit() - 20.0));
    let odd = [0.0, -0.0, 1.0, -1e15, 1e16, 1e17, 1e300, 5e-324, 0.1, 1e-5, 1e-4, f64::INFINITY];
    let drawn: Vec<f64> = drawn.collect();
    let rounded: Vec<f64> = drawn.iter().map(|value| f64::from(*value as f32)).collect();
    let values = [drawn, rounded, odd.to_vec()].concat();
    let columns = ["a", "b"].map(Column::f64);
    let found = written(columns, &mut values.iter().map(|value| [*value, 0.0]));
    assert_eq!(found.len(), 1 + values.len());
    for (value, found) in values.iter().zip(&found[1..]) {
        assert_eq!(*found, format!("{value},0"));
    }
}

#[test]
fn numbers_of_an_f32_get_its_shortest_digits() {
    let texts = |values: &[f64]| {
        let columns = [Column::f32("a"), Column::f64("b")];
        let mut found = written(columns, &mut values.iter().map(|value| [*value, 0.0]));
        assert_eq!(found.remove(0), "a,b");
        found.iter_mut().for_each(|line| assert_eq!(line.split_off(line.len() - 2), ",0"));
        found
    };
    let values = [0.007_460_668_f32, 0.1, -3.0, 16_777_216.0, 1e-9].map(f64::from);
    let no_f32 = 1_743_486_221.590_758;
    assert_eq!(
        texts(&[&values[..], &[f64::NAN, no_f32]].concat()),
        ["0.007460668", "0.1", "-3", "16777216", "0.000000001", "", "1743486221.590758"]
    );
    let mut random = Random::new(2, Stream::Test, Purpose::Damage, 0, 0);
    let drawn = (0..100_000)
        .map(|_| ((random.unit() - 0.5) * 10_f64.powf(20.0 * random.unit() - 10.0)) as f32);
    let drawn: Vec<f32> = drawn.collect();
    let found = texts(&drawn.iter().map(|value| f64::from(*value)).collect::<Vec<_>>());
    assert_eq!(found.len(), drawn.len());
    for (value, digits) in drawn.iter().zip(found) {
        assert_eq!(digits.parse::<f32>().unwrap().to_bits(), value.to_bits());
        assert!(digits.len() <= value.to_string().len(), "{digits} for {value}");
    }
}

#[test]
fn lines_keep_their_order_over_many_pieces() {
    let count = 3 * NUMBERS_AT_A_TIME / 2;
    let columns = ["a", "b"].map(Column::f64);
    let found = written(columns, &mut (0..count).map(|i| [i as f64, f64::NAN]));
    assert_eq!((found.len(), found[0].as_str()), (1 + count, "a,b"));
    for (i, line) in found[1..].iter().enumerate() {
        assert_eq!(*line, format!("{i},"));
    }
}

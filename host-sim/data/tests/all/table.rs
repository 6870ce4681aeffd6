//! Statistics and selections of tables.

use taxel_data::Table;

#[test]
fn the_mean_of_equal_values_is_that_value() {
    // Three times 0.1 is more than 0.3.
    let table = Table { names: vec!["a".into()], values: vec![0.1; 3].into() };
    assert_eq!((table.means(), table.deviations()), (vec![0.1], vec![0.0]));
    let rounded = Table { names: vec!["a".into()], values: vec![100.0, 100.0 + 1e-6].into() };
    assert_eq!(rounded.deviations(), [0.0]);
}

#[test]
fn columns_that_are_missing_in_the_same_lines_go_together() {
    let names = ["x", "f", "y"].map(String::from).to_vec();
    let values = vec![1.0, 2.0, 3.0, f64::NAN, 4.0, f64::NAN, 5.0, 6.0, 7.0];
    let table = Table { names, values: values.into() };
    assert_eq!(table.missing_together(), [vec![0, 2], vec![1]]);
    assert_eq!(table.lines_with(&[0, 2]), [0, 2]);
    let part = table.part(&[0, 2], &[2, 0]);
    assert_eq!(
        (part.names, part.values.into_vec()),
        (vec!["y".into(), "x".into()], vec![3.0, 1.0, 7.0, 5.0])
    );
    assert_eq!(table.pick(&[2, 0]).values, [5.0, 6.0, 7.0, 1.0, 2.0, 3.0]);
    assert_eq!((table.len(), table.is_empty()), (3, false));
    let last = table.columns(1, 2);
    assert_eq!((&last.names[..], &last.lines_with(&[0, 1])[..]), (&table.names[1..], &[0, 2][..]));
    assert_eq!(last.pick(&[0, 2]).cycled(3).values, [2.0, 3.0, 6.0, 7.0, 2.0, 3.0]);
    assert_eq!(table.medians(), [5.0, 4.0, 7.0]);
    let complete = Table { names: table.names, values: vec![0.0; 6].into() };
    assert_eq!(complete.missing_together(), [[0, 1, 2]]);
}

#[test]
fn missing_positions_are_the_mean_where_a_line_is_decoded() {
    let of = |names: [&str; 2], estimates: [f64; 4]| {
        let names = names.map(String::from).to_vec();
        let truth = Table { names, values: vec![1.0, 2.0, 3.0, 6.0].into() };
        format!("{:?}", truth.with_places(&estimates[..]))
    };
    let nan = f64::NAN;
    assert_eq!(of(["x_mm", "f_n"], [nan, 0.0, nan, nan]), "[2.0, 0.0, NaN, NaN]");
    assert_eq!(of(["x_mm", "f_n"], [9.0, nan, 8.0, 7.0]), "[9.0, NaN, 8.0, 7.0]");
    assert_eq!(of(["x_mm", "y_mm"], [nan, nan, 8.0, 7.0]), "[2.0, 4.0, 8.0, 7.0]");
}

#[test]
fn means_and_deviations_skip_missing_values() {
    let nan = f64::NAN;
    let names = ["a", "b", "c"].map(String::from).to_vec();
    let values = vec![1.0, 2.0, nan, nan, 4.0, nan, 3.0, nan, nan];
    let table = Table { names, values: values.into() };
    assert_eq!(table.means()[..2], [2.0, 3.0]);
    assert!(table.means()[2].is_nan());
    assert_eq!(table.deviations(), [1.0, 1.0, 0.0]);
    assert_eq!(table.counts(), [2, 2, 0]);
    assert_eq!(table.missing_together(), [[0], [1], [2]]);
    assert_eq!(table.squared_errors(&[0.0; 9]), [10.0, 20.0, 0.0]);
    // A missing estimate is no error of zero.
    let errors = table.squared_errors(&[nan; 9]);
    assert!(errors[0].is_nan() && errors[1].is_nan() && errors[2] == 0.0);
    let values = vec![nan, 10.0, 1.0, 20.0, 3.0, nan, 5.0, 40.0];
    let table = Table { names: ["a", "b"].map(String::from).to_vec(), values: values.into() };
    // Missing values move none of the others into another column.
    let of = |squares: f64| (squares / 3.0).sqrt();
    assert_eq!(table.deviations(), [of(8.0), of(4200.0 / 9.0)]);
}

//! Folds of measured frames.

use taxel_data::Table;
use taxel_learn::folds::{
    block_folds, number_folds, pooled_rmse, random_folds, smallest_training_part, without,
};

#[test]
fn folds_are_numbered_without_the_one_that_is_held_out() {
    assert_eq!(without(&[0, 1, 2, 3, 1, 0], 1), [0, 1, 2, 0]);
}

#[test]
fn blocks_are_equal_in_number_and_follow_one_another() {
    assert_eq!(block_folds(7, 3), [0, 0, 0, 1, 1, 2, 2]);
    assert!(block_folds(1003, 5).is_sorted());
}

#[test]
fn equal_values_share_a_fold() {
    assert_eq!(number_folds(&[7.0, -1.0, 7.0, 0.5]), [2, 0, 2, 1]);
}

#[test]
fn the_output_with_fewest_frames_limits_the_training_part() {
    let outputs = |y: f64| {
        let values = vec![1.0, y, 2.0, y, 3.0, 4.0, 5.0, 6.0];
        Table { names: ["f", "y"].map(String::from).to_vec(), values: values.into() }
    };
    assert_eq!(smallest_training_part(&[2, 0, 2, 1], &outputs(7.0)), 2);
    assert_eq!(smallest_training_part(&[2, 0, 2, 1], &outputs(f64::NAN)), 1);
}

#[test]
fn errors_of_all_folds_count_the_frames_that_have_the_output() {
    let values = vec![1.0, 2.0, f64::NAN, 4.0, 5.0, f64::NAN];
    let outputs = Table { names: ["f", "y"].map(String::from).to_vec(), values: values.into() };
    let rmse = pooled_rmse(&[vec![6.0, 3.0], vec![2.0, 9.0]], &outputs);
    assert_eq!(rmse, [2.0, 6.0_f64.sqrt()]);
}

#[test]
fn random_folds_are_equal_in_number_and_seeded() {
    let folds = random_folds(103, 5, 7);
    for fold in 0..5 {
        let count = folds.iter().filter(|f| **f == fold).count();
        assert!((20..=21).contains(&count));
    }
    assert_eq!(folds, random_folds(103, 5, 7));
    assert_ne!(folds, random_folds(103, 5, 8));
}

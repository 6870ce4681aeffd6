//! Columns that f32 does not hold.

use taxel_data::Dataset;
use taxel_learn::train::resolution::check;

/// Result for a data set whose input is from `low` to `high` in 100 steps, and whose output is `scale` times that.
fn checked([low, high]: [f64; 2], scale: f64) -> std::result::Result<(), String> {
    let mut data = Dataset::empty(vec!["ch1".into()], vec!["f_n".into()], 1, 101);
    for (step, value) in data.inputs.values.iter_mut().enumerate() {
        *value = low + (high - low) * step as f64 / 100.0;
    }
    data.outputs.values = data.inputs.values.iter().map(|value| value * scale).collect();
    check(&data).map_err(|refusal| refusal.to_string())
}

#[test]
fn columns_that_f32_holds_pass() {
    for range in [[0.0, 1.0], [-1e30, 1e30], [0.0, 1e-27], [1e5, 1e5 + 1.0], [1e9, 1.1e9]] {
        assert_eq!(checked(range, 1.0), Ok(()), "{range:?}");
    }
}

#[test]
fn columns_that_do_not_change_pass_for_they_are_noted_elsewhere() {
    for value in [0.0, 1e-300, 0.1, 1e29] {
        assert_eq!(checked([value; 2], 1.0), Ok(()), "{value:e}");
    }
    assert_eq!(checked([0.1, 0.1_f64.next_up()], 1.0), Ok(()));
}

#[test]
fn what_f32_would_lose_is_refused_by_name_with_the_fix() {
    let empty = checked([f64::NAN; 2], 1.0).unwrap_err();
    assert!(empty.contains("\"ch1\" has no value: leave it out"), "{empty}");
    for (range, scale, words) in [
        ([1e8, 1e8 + 1.0], 1.0, ["ch1", "8.0 apart", "subtract 100000000"]),
        ([1e6, 1e6 + 1.0], 1.0, ["ch1", "0.0625 apart", "subtract 1000000"]),
        ([0.0, 1e-29], 1.0, ["ch1", "1e-28", "multiply it by 1e29"]),
        ([0.0, 1e-300], 1.0, ["ch1", "1e-28", "multiply it by 1e300"]),
        ([0.0, 1e31], 1.0, ["ch1", "1e30", "multiply it by 1e-31"]),
        ([0.0, 1.0], 1e-30, ["f_n", "1e-28", "multiply it by 1e30"]),
        ([0.0, 1.0], 1e300, ["f_n", "1e30", "multiply it by 1e-300"]),
    ] {
        let refusal = checked(range, scale).expect_err("refused");
        assert!(words.iter().all(|word| refusal.contains(word)), "{range:?}: {refusal}");
    }
}

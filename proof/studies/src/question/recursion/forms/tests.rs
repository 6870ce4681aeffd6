use super::*;

#[test]
fn wind_up_is_told_from_rounding_by_the_exact_solution() {
    // The second regressor is hardly excited, until all else of it is forgotten; then it is excited again.
    let sign = |t: usize| if t.is_multiple_of(2) { 1.0 } else { -1.0 };
    let second = |t: usize| if t == 900 { 1.0 } else { 1e-9 * sign(t) };
    let rows = (0..1000).flat_map(|t| [1.0, second(t)]).collect();
    let targets: Vec<f64> = (0..1000).map(sign).collect();
    let stream = Regressed { regressors: 2, rows, targets: &targets };
    let found = stream.outcomes(0.1, 0.95, 1e6);
    for outcome in &found[..2] {
        assert_eq!((outcome.diverged_after, outcome.wound_up), (Some(901), true), "{outcome:?}");
    }
    for outcome in &found[2..] {
        assert_eq!((outcome.diverged_after, outcome.wound_up), (None, false), "{outcome:?}");
    }
}

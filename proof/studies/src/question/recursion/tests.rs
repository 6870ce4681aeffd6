use super::*;
use taxel_data::progress::Silent;

fn study() -> Study {
    let mut experiment = Experiment::load("paper").unwrap();
    experiment.world.read_rows = vec![3];
    let plan = Plan { centres: 16, updates: 2000 };
    compute(&experiment, &plan, &Silent).unwrap()
}

#[test]
fn the_covariance_form_diverges_where_the_square_root_form_does_not() {
    let study = study();
    let of = |kind, width, forgetting, covariance| {
        *study.outcome(kind, width, forgetting, covariance).unwrap()
    };
    let [of_f32, of_f64, root_f32, root_f64] = KINDS;
    assert!(of(of_f32, 4.0, 0.95, 1e6).diverged_after.is_some());
    for outcome in &study.outcomes {
        let kind = (outcome.form, outcome.precision);
        if kind == root_f32 || kind == root_f64 {
            let most = if kind == root_f32 { 0.1 } else { 1e-6 };
            assert!(outcome.difference.is_some_and(|it| it < most), "{outcome:?}");
        }
    }
    // Where nothing is forgotten and little is ill-conditioned, f64 is right by either form.
    let sound = of(of_f64, 0.3, 1.0, 1e2);
    assert!(sound.difference.unwrap() < 1e-6, "{sound:?}");
    let conditions: Vec<f64> = study.widths.iter().map(|it| it.condition).collect();
    // At 0.1, some Gaussians are hardly ever excited.
    assert!(conditions[1..].is_sorted() && conditions[6] > 1e3 * conditions[1], "{conditions:?}");
}

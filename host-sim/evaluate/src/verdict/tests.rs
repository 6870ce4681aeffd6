use taxel_learn::outliers::Outliers;
use taxel_limit::reference::GroupLimit;
use taxel_simulate::noise::{Noise, NoiseKind};

use taxel_core::blob::ModelShape;
use taxel_core::rbf::Format;

use super::*;

fn group(name: &str, rmse: f64, ratio_to_limit: Option<f64>) -> Errors {
    Errors {
        group: name.into(),
        unit: "mm".into(),
        count: 1,
        rmse,
        relative_l2_percent: None,
        full_scale_percent: None,
        positional_percent: None,
        r_squared: Some(0.0),
        mean_relative_percent: None,
        ratio_to_limit,
        ratio_standard_error: None,
    }
}

fn decoders(of: &[(&str, &[(&str, f64)])]) -> Vec<DecoderErrors> {
    let decoder = |(name, groups): &(&str, &[(&str, f64)])| DecoderErrors {
        decoder: (*name).into(),
        errors: groups.iter().map(|(name, rmse)| group(name, *rmse, None)).collect(),
    };
    of.iter().map(decoder).collect()
}

#[test]
fn an_output_that_only_rounding_changes_has_nothing_to_decode() {
    let mut decoders = decoders(&[("network", &[("y", 1e-17)]), ("mean", &[("y", 1e-17)])]);
    decoders[1].errors[0].r_squared = None;
    let sentence = Verdict::new(&decoders, &no_limit()).sentence;
    assert!(sentence.starts_with("y does not change"), "{sentence}");
}

fn outliers(lines: usize) -> Outliers {
    Outliers { found: vec![], lines, left_out: true, kept: vec![] }
}

fn no_limit() -> LimitSummary {
    LimitSummary { frames: 0, groups: vec![], refused: Some("measured".into()) }
}

fn names(verdict: &Verdict) -> Vec<&str> {
    verdict.warnings.iter().map(|warning| warning.name).collect()
}

#[test]
fn a_good_model_is_told_beside_mean_and_linear() {
    let all = decoders(&[
        ("network", &[("dz_mm", 0.047)]),
        ("mean", &[("dz_mm", 0.152)]),
        ("linear", &[("dz_mm", 0.060)]),
    ]);
    let verdict = Verdict::new(&all, &no_limit());
    assert_eq!(
        verdict.sentence,
        "The model decodes dz_mm to 0.0470 mm: 69 % below always predicting the mean, and 22 % below the best linear \
         decoder."
    );
    assert_eq!(verdict.warnings, []);
}

#[test]
fn the_limit_is_named_where_it_is_known() {
    let mut all = decoders(&[("network", &[("dz_mm", 0.047)]), ("mean", &[("dz_mm", 0.152)])]);
    all[0].errors[0].ratio_to_limit = Some(1.5);
    let groups = vec![GroupLimit {
        group: "dz_mm".into(),
        unit: "mm".into(),
        limit: 0.031,
        limit_standard_error: 0.001,
        rmse: 0.031,
        rmse_standard_error: 0.001,
        prior_rmse: 0.152,
        monte_carlo_share: 0.01,
    }];
    let limit = LimitSummary { frames: 10, groups, refused: None };
    let sentence = Verdict::new(&all, &limit).sentence;
    assert!(sentence.ends_with("That is 1.50 times the least possible error."), "{sentence}");
}

#[test]
fn outputs_that_are_hardly_decoded_are_told_apart() {
    let all = decoders(&[
        ("network", &[("dx_mm", 0.030), ("dz_mm", 0.047)]),
        ("mean", &[("dx_mm", 0.035), ("dz_mm", 0.152)]),
    ]);
    let verdict = Verdict::new(&all, &no_limit());
    assert!(verdict.sentence.starts_with("The model decodes dz_mm to 0.0470 mm"), "{verdict:?}");
    let hardly =
        "It tells little of dx_mm: at best 14 % below the error of always predicting the mean.";
    assert!(verdict.sentence.ends_with(hardly), "{verdict:?}");
    assert_eq!(verdict.warnings, []);
}

#[test]
fn a_model_that_has_learnt_nothing_is_called_that() {
    let mut all = decoders(&[
        ("network", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
        ("mean", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
        ("linear", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
    ]);
    let verdict = Verdict::new(&all, &no_limit());
    assert_eq!(
        verdict.sentence,
        "The model has learnt next to nothing of dx_mm and dy_mm: it is no better than always predicting the mean."
    );
    assert_eq!(names(&verdict), ["no-gain-over-mean"]);
    all[0].errors.iter_mut().for_each(|group| group.ratio_to_limit = Some(1.02));
    let sentence = Verdict::new(&all, &no_limit()).sentence;
    assert!(sentence.ends_with("no decoder could be better by more than 2 %."), "{sentence}");
}

#[test]
fn every_warning_is_raised_and_left_out() {
    let raised = [
        (Warning::few_frames(829, 64, 18), "few-frames"),
        (Warning::few_test_frames(29), "few-test-frames"),
        (Warning::trained_on(true), "judged-by-training-data"),
        (Warning::out_of_range(0.0101), "readings-out-of-range"),
        (Warning::larger_than_slot(131_073, &mat(64)), "larger-than-slot"),
        (Warning::outliers(&outliers(1)), "outliers"),
    ];
    for (warning, name) in raised {
        let warning = warning.unwrap();
        assert_eq!(warning.name, name);
        assert!(warning.to_string().starts_with("warning: "), "{warning}");
        assert!(warning.to_string().ends_with(&format!("({name})")), "{warning}");
    }
    let left_out = [
        Warning::few_frames(830, 64, 18),
        Warning::few_test_frames(30),
        Warning::trained_on(false),
        Warning::out_of_range(0.0099),
        Warning::larger_than_slot(131_072, &mat(64)),
        Warning::outliers(&outliers(0)),
    ];
    assert_eq!(left_out, [const { None }; 6]);
}

#[test]
fn a_model_that_is_as_good_as_linear_is_warned_of() {
    let all = decoders(&[
        ("network", &[("f_n", 0.25), ("g_n", 0.10)]),
        ("mean", &[("f_n", 1.0), ("g_n", 1.0)]),
        ("linear", &[("f_n", 0.25), ("g_n", 0.30)]),
    ]);
    let verdict = Verdict::new(&all, &no_limit());
    assert_eq!(names(&verdict), ["no-gain-over-linear"]);
    assert!(verdict.warnings[0].text.starts_with("f_n:"), "{verdict:?}");
    let gains =
        "75 to 90 % below always predicting the mean, and 0 to 67 % below the best linear decoder";
    assert!(verdict.sentence.contains(gains), "{verdict:?}");
}

#[test]
fn a_model_that_is_worse_than_linear_is_told_by_how_much() {
    let gains = |errors: [f64; 2]| {
        let all = decoders(&[
            ("network", &[("f_n", errors[0]), ("g_n", errors[1])]),
            ("mean", &[("f_n", 1.0), ("g_n", 1.0)]),
            ("linear", &[("f_n", 0.5), ("g_n", 0.5)]),
        ]);
        let verdict = Verdict::new(&all, &no_limit());
        assert_eq!(names(&verdict), ["no-gain-over-linear"]);
        verdict.sentence
    };
    for (errors, said) in [
        ([0.63, 0.30], "26 % above to 40 % below the best linear decoder"),
        ([0.63, 0.60], "20 to 26 % above the best linear decoder"),
        ([0.60, 0.60], "20 % above the best linear decoder"),
    ] {
        assert!(gains(errors).contains(said), "{}", gains(errors));
    }
}

#[test]
fn outputs_that_do_not_change_or_have_no_frames_are_named() {
    let all = decoders(&[
        ("network", &[("f_n", 0.0), ("g_n", f64::NAN), ("h_n", 0.1)]),
        ("mean", &[("f_n", 0.0), ("g_n", f64::NAN), ("h_n", 1.0)]),
    ]);
    assert_eq!(
        Verdict::new(&all, &no_limit()).sentence,
        "The model decodes h_n to 0.100 mm: 90 % below always predicting the mean. f_n does not change in these \
         frames: there is nothing to decode. g_n has no frame to judge by."
    );
}

#[test]
fn centres_are_as_many_as_frames_allow_without_a_warning() {
    for (frames, inputs, centres) in
        [(640, 2, 60), (300, 12, 16), (50, 12, 4), (3, 2, 2), (9999, 18, 980)]
    {
        assert_eq!(Warning::enough_frames_for(frames, inputs), centres, "{frames}");
        let few = Warning::few_frames(frames, centres, inputs);
        assert_eq!(few.is_some(), centres <= 4, "{frames}");
    }
}

/// One network for a mat of 16 × 16, with three outputs.
fn mat(centres: usize) -> Design {
    let shape = ModelShape { rows: 1, inputs: 256, outputs: 3 };
    Design::of_rows(shape, Format::F32, centres, true)
}

#[test]
fn what_makes_a_blob_fit_into_a_slot_is_computed() {
    let message = |design: &Design| {
        let bytes = design.parameter_bytes() + 3000;
        Warning::larger_than_slot(bytes, design).unwrap().text
    };
    let found = message(&mat(160));
    let fixes = "it fits with --format fixed16, or with --centres 112, or with --features 18";
    assert!(found.ends_with(fixes), "{found}");
    // Half of that is still too much: no format helps.
    let found = message(&mat(320));
    assert!(!found.contains("fixed16") && found.contains("--centres 112"), "{found}");
}

#[test]
fn averaging_within_a_time_constant_is_warned_of() {
    let noise = Noise {
        correlated_level: 0.005,
        time_constant_ms: 20.0,
        ..Noise::white(NoiseKind::Relative, 0.005)
    };
    let warning = |noise: &Noise, samples, spacing_s| {
        Warning::idle_averaging(samples, |n| noise.averaged(n, spacing_s))
            .map(|it| (it.name, it.text))
    };
    // White noise of 16 samples has a quarter of one's, so that both have 0.73 of it; of eight, 0.75.
    let (name, text) = warning(&noise, 16, 36e-6).unwrap();
    assert_eq!(name, "averaging-does-not-pay");
    assert!(text.contains("the mean of 16 samples has 0.726 of one sample's noise"), "{text}");
    assert_eq!(warning(&noise, 2, 36e-6), None);
    assert_eq!(warning(&noise, 1, 36e-6), None);
    assert_eq!(warning(&noise, 16, 0.1), None);
    assert_eq!(warning(&Noise::white(NoiseKind::Relative, 0.005), 256, 36e-6), None);
}

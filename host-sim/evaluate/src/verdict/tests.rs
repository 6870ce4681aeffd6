use taxel_learn::outliers::Outliers;
use taxel_simulate::noise::{Noise, NoiseKind};

use taxel_core::blob::ModelShape;
use taxel_core::rbf::Format;
use taxel_data::Table;

use super::*;

fn decoders(of: &[(&str, &[(&str, f64)])]) -> Vec<DecoderErrors> {
    let decoder = |(name, groups): &(&str, &[(&str, f64)])| {
        let errors = groups.iter().map(|(name, rmse)| Errors::of(name, *rmse, 0.0));
        DecoderErrors::new(name, errors.collect())
    };
    of.iter().map(decoder).collect()
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
fn a_model_that_has_learnt_nothing_is_called_that() {
    let mut all = decoders(&[
        ("network", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
        ("mean", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
        ("linear", &[("dx_mm", 0.37), ("dy_mm", 0.56)]),
    ]);
    let verdict = Verdict::new(&all, &no_limit());
    assert_eq!(
        verdict.sentence,
        "The model has learnt almost nothing about dx_mm and dy_mm: it is no better than always predicting the mean."
    );
    assert_eq!(names(&verdict), ["no-gain-over-mean"]);
    all[0].errors.iter_mut().for_each(|group| group.ratio_to_limit = Some(1.02));
    let sentence = Verdict::new(&all, &no_limit()).sentence;
    assert!(
        sentence.ends_with("No decoder of these readings could be better by more than 2 %."),
        "{sentence}"
    );
}

#[test]
fn every_warning_is_raised_and_left_out() {
    let raised = [
        (Warning::few_frames(829, 64, 18), "few-frames"),
        (Warning::few_test_frames(29), "few-test-frames"),
        (Warning::trained_on(true), "judged-by-training-data"),
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
        Warning::larger_than_slot(131_072, &mat(64)),
        Warning::outliers(&outliers(0)),
    ];
    assert_eq!(left_out, [const { None }; 5]);
    // Two of 10 000 readings are too many, one is not; zero is one, and what is missing is not.
    let readings = |bad: [f64; 3]| {
        let mut values = vec![100.0; 10_000];
        values[..3].copy_from_slice(&bad);
        Warning::not_positive(&Table { names: vec!["a".into()], values: values.into() })
    };
    let text = readings([0.0, -3.0, 5.0]).unwrap().text;
    assert!(text.starts_with("noise makes 0.02 % of the readings"), "{text}");
    assert_eq!(readings([-3.0, 5.0, f64::NAN]), None);
    // A reading model needs 300 frames if it tells deviations.
    let blob = include_bytes!("../../../../testdata/array-fixed16-confidence.bin");
    let blob = ModelBlob::of_bytes(blob).unwrap();
    let of = |frames, model| Warning::few_frames_for_confidence(frames, model).map(|it| it.name);
    let assesses = blob.parse().reading_model();
    assert_eq!(of(299, assesses), Some("few-frames-for-confidence"));
    assert_eq!([of(300, assesses), of(299, None)], [None; 2]);
}

#[test]
fn a_verdict_tells_gains_and_losses_over_mean_and_linear() {
    let says = |network: [f64; 2], mean: [f64; 2], linear: [f64; 2]| {
        let groups = |errors: [f64; 2]| [("f_n", errors[0]), ("g_n", errors[1])];
        let [network, mean, linear] = [network, mean, linear].map(groups);
        let all = decoders(&[("network", &network), ("mean", &mean), ("linear", &linear)]);
        let verdict = Verdict::new(&all, &no_limit());
        (names(&verdict).concat(), verdict.sentence)
    };
    let (missing, worse) = (f64::NAN, "worse-than-baseline");
    for (network, mean, linear, warning, part) in [
        ([0.25, 0.1], [1.0, 1.0], [0.25, 0.3], "", "75 to 90 % below always predicting the mean"),
        ([0.25, 0.1], [1.0, 1.0], [0.25, 0.3], "", "0 to 67 % below the best linear decoder"),
        ([0.63, 0.3], [1.0, 1.0], [0.5, 0.5], worse, "26 % above to 40 % below the best linear"),
        ([0.63, 0.6], [1.0, 1.0], [0.5, 0.5], worse, "20 to 26 % above the best linear decoder"),
        ([0.6, 0.3], [1.0, 1.0], [0.5, 0.25], worse, ", and 20 % above the best linear"),
        ([0.25, 0.25], [1.0, 1.0], [0.5, 0.5], "", ": 75 % below always predicting"),
        ([0.0, 0.1], [0.0, 1.0], [0.0, 0.3], "", "f_n does not change in these frames"),
        ([missing, 0.1], [missing, 1.0], [missing, 0.3], "", "f_n has no test frame"),
        (
            [0.95, 0.86],
            [1.0, 1.0],
            [1.0, 1.0],
            "",
            "about f_n and g_n: its error is at best 14 % below",
        ),
        (
            [0.86, 0.1],
            [1.0, 1.0],
            [1.0, 0.3],
            "",
            "It has learnt little about f_n: its error is at best 14 % below",
        ),
    ] {
        let (found, sentence) = says(network, mean, linear);
        assert!(found == warning && sentence.contains(part), "{found}: {sentence}");
    }
}

#[test]
fn a_model_that_loses_to_a_baseline_is_told_so_by_output() {
    let groups = ["x_mm", "y_mm", "z_mm", "depth_mm"];
    let rows = [
        ("network", [1.5, 9.9, 0.3, 5.0]),
        ("linear", [2.0, 8.0, 0.2, 6.0]),
        ("centroid", [0.3, 0.4, 0.4, 8.0]),
        ("mean", [10.0; 4]),
    ];
    let rows = rows.map(|(name, rmse)| (name, [0, 1, 2, 3].map(|at| (groups[at], rmse[at]))));
    let all = decoders(&rows.each_ref().map(|(name, errors)| (*name, &errors[..])));
    let verdict = Verdict::new(&all, &no_limit());
    let better = "A simpler decoder does better: x_mm to 0.300 mm (centroid), y_mm to 0.400 mm (centroid) and z_mm to 0.200 mm (linear).";
    assert!(verdict.sentence.ends_with(better), "{}", verdict.sentence);
    assert_eq!(names(&verdict), ["no-gain-over-mean", "worse-than-baseline"]);
    assert!(verdict.warnings[1].text.starts_with("x_mm, y_mm, z_mm: a simpler decoder is better"));
}

#[test]
fn errors_that_chance_explains_are_no_reason_to_warn() {
    // Parts of 50 blocks, whose difference from none has a standard error of about a tenth of their size.
    let with_parts = |size: f64| {
        let mut all = decoders(&[("network", &[("f_n", 1.1)]), ("linear", &[("f_n", 1.0)])]);
        let parts = (0..50).map(|block| size * f64::from(block / 5 * 7 % 10 - 4));
        all[0].blocks.insert("f_n".into(), parts.collect());
        all[1].blocks.insert("f_n".into(), vec![0.0; 50]);
        all.extend(decoders(&[("mean", &[("f_n", 1.3)])]));
        Verdict::new(&all, &no_limit())
    };
    assert_eq!(names(&with_parts(0.02)), ["worse-than-baseline"]);
    let unsure = with_parts(0.1);
    assert_eq!(names(&unsure), [""; 0]);
    assert!(!unsure.sentence.contains("A simpler decoder"), "{}", unsure.sentence);
}

#[test]
fn centres_are_as_many_as_frames_allow_without_a_warning() {
    for (frames, inputs, centres) in
        [(660, 2, 60), (300, 12, 16), (50, 12, 4), (3, 2, 2), (9999, 18, 980)]
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
    assert!(text.contains("the mean of 16 samples has 0.726 of the noise of one sample"), "{text}");
    assert_eq!(warning(&noise, 2, 36e-6), None);
    assert_eq!(warning(&noise, 1, 36e-6), None);
    assert_eq!(warning(&noise, 16, 0.1), None);
    assert_eq!(warning(&Noise::white(NoiseKind::Relative, 0.005), 256, 36e-6), None);
}

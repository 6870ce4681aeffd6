//! Projection of readings to features.

use taxel_core::projection::Projection;
use taxel_data::{Dataset, Purpose, Random, Silent, Stream, Table};
use taxel_learn::decoders::RowDecoder;
use taxel_learn::decoders::linear::LinearRow;
use taxel_learn::train::projection::{
    USUAL_FEATURES, features, features_at_most, fit, view, with_targets,
};
use taxel_learn::train::touch::seen;
use taxel_learn::train::{Features, Kinds, Options, train};
use taxel_simulate::{World, synthesise};

/// Data set of readings r1…r6 in two rows of three; the outputs are known sums of them.
fn known(frames: usize, noise: f64) -> Dataset {
    let names = |prefix: &str, count: usize| (1..=count).map(|n| format!("{prefix}{n}")).collect();
    let mut dataset = Dataset::empty(names("r", 6), names("y", 4), 2, frames);
    let mut random = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let mut draw = || random.unit() - 0.5;
    let lines = dataset.inputs.values.chunks_exact_mut(6);
    for (r, y) in lines.zip(dataset.outputs.values.chunks_exact_mut(4)) {
        r.iter_mut().enumerate().for_each(|(i, r)| *r = 50.0 + 10.0 * i as f64 + draw());
        r[5] = 100.0; // never changes
        let (a, b) = (r[0] + r[3], r[1] - 2.0 * r[4]);
        [a + b, a - b, 2.0 * a, b].iter().zip(y).for_each(|(value, y)| *y = value + noise * draw());
    }
    dataset
}

fn projection<'b>(dataset: &Dataset, parameters: &'b [f32]) -> Projection<'b> {
    view(parameters, dataset.inputs.names.len())
}

#[test]
fn features_carry_all_that_outputs_take_from_readings() {
    let data = known(400, 0.01);
    let parameters = fit(&data, None).unwrap();
    let seen = seen(None, Some(&parameters), &data).table;
    assert_eq!((seen.rows, seen.inputs.names.len(), seen.inputs.len()), (1, 3, 400));
    // Two sums decide all outputs: two features follow them to the noise, and the third is noise.
    let spans: Vec<f64> = seen.inputs.ranges().iter().map(|[low, high]| high - low).collect();
    assert!(spans[0] > 1.0 && spans[1] > 1.0 && spans[2] < 0.02, "{spans:?}");
    let two = Dataset { inputs: seen.inputs.columns(0, 2), ..seen };
    let linear = LinearRow::fit(&two, &(0..400).collect::<Vec<_>>());
    let pairs = linear.predict(&two.inputs.values).into_iter().zip(data.outputs.values.iter());
    let worst = pairs.map(|(found, y)| (found - y).abs()).fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst}");
    // The reading that never changes has no part.
    let parts = &parameters[3..];
    assert_eq!(parts[5 * 3..], [0.0; 3]);
}

#[test]
fn a_line_is_projected_as_on_the_device() {
    let mut data = known(20, 0.0);
    data.inputs.values[7] = f64::NAN;
    let parameters = fit(&known(20, 0.0), None).unwrap();
    let seen = features(projection(&data, &parameters), &data.inputs.values);
    let line: Vec<f32> = data.inputs.values[..6].iter().map(|r| *r as f32).collect();
    let mut expected = [0.0; 3];
    projection(&data, &parameters).project(&line, &mut expected);
    assert_eq!(seen[..3], expected.map(f64::from));
    assert!(seen[3..6].iter().all(|feature| feature.is_nan()));
}

#[test]
fn few_outputs_are_told_by_features_of_their_products() {
    let data = synthesise(&World::contact(), Stream::Training, 3000);
    let parameters = fit(&data, None).unwrap();
    assert_eq!(parameters.len(), USUAL_FEATURES * 145);
    let seen = seen(None, Some(&parameters), &data).table;
    let spans: Vec<f64> = seen.inputs.ranges().iter().map(|[low, high]| high - low).collect();
    assert!(spans.iter().all(|span| *span > 0.0), "{spans:?}");
    // One output has three powers, and there are no more features than that.
    let depth = Dataset { outputs: data.outputs.columns(2, 1), ..data.clone() };
    assert_eq!(fit(&depth, None).unwrap().len(), 3 * 145);
    assert_eq!(fit(&data, Some(5)).unwrap().len(), 5 * 145);
    // A number that a user asks for is given or refused.
    for (data, outputs, most) in [(&data, 4, 34), (&depth, 1, 3)] {
        assert_eq!(fit(data, Some(most)).unwrap().len(), most * 145);
        let message = fit(data, Some(most + 1)).unwrap_err().to_string();
        let rule = format!(
            "features = {}: give from 1 to {most}, fewer than the 144 readings and no more than the {outputs} outputs",
            most + 1
        );
        assert!(message.contains(&rule), "{message}");
        assert_eq!(features_at_most(data, 144), most);
    }
}

/// Outputs that no line has together have their own powers, and no product of both.
#[test]
fn outputs_that_are_never_together_have_no_products() {
    let mut data = known(400, 0.01);
    data.outputs = data.outputs.columns(0, 2);
    for (number, line) in data.outputs.values.chunks_exact_mut(2).enumerate() {
        line[number % 2] = f64::NAN;
    }
    let targets = &with_targets(&data, 9).outputs;
    // a, b, aa, bb, aaa, bbb.
    assert_eq!(targets.names.len(), 6);
    for (number, line) in targets.lines().enumerate() {
        let missing = (0..6).filter(|target| line[*target].is_nan());
        assert!(missing.eq([0, 2, 4].map(|power| power + number % 2)), "{number}: {line:?}");
    }
    assert_eq!(fit(&data, Some(5)).unwrap().len(), 5 * 7);
}

#[test]
fn products_are_those_of_standardised_outputs() {
    let names = ["a", "b"].map(String::from).to_vec();
    let outputs = Table { names, values: vec![1.0, 10.0, 3.0, 10.0, 5.0, 40.0, 7.0, 0.0].into() };
    let data = Dataset { outputs, ..Dataset::empty(vec![], vec![], 1, 0) };
    let (targets, outputs) = (&with_targets(&data, 5).outputs, &data.outputs);
    // a, b, aa, ab, bb.
    assert_eq!(targets.names.len(), 5);
    let z = |line: usize| [(2 * line) as f64 - 3.0, outputs.values[2 * line + 1] - 15.0];
    let products: Vec<f64> = (0..4).map(|line| z(line)[0] * z(line)[1]).collect();
    let mean = products.iter().sum::<f64>() / 4.0;
    let variance = products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 4.0;
    for (line, product) in products.iter().enumerate() {
        let expected = (product - mean) / variance.sqrt();
        assert!((targets.values[5 * line + 3] - expected).abs() < 1e-12);
    }
}

/// Outputs that are missing in half of the lines hardly change what the features tell.
#[test]
fn features_are_those_of_the_lines_that_have_an_output() {
    let data = synthesise(&World::contact(), Stream::Training, 4000);
    let mut partly = data.clone();
    for line in partly.outputs.values.chunks_exact_mut(4).step_by(2) {
        line[..2].fill(f64::NAN);
    }
    let left = |of: &Dataset| {
        let table = seen(None, Some(&fit(of, None).unwrap()), &data).table;
        let lines: Vec<usize> = (0..table.frames()).collect();
        let predicted = LinearRow::fit(&table, &lines).predict(&table.inputs.values);
        table.outputs.squared_errors(&predicted)
    };
    for (partly, all) in left(&partly).into_iter().zip(left(&data)) {
        assert!((0.8..1.25).contains(&(partly / all)), "{partly} {all}");
    }
}

#[test]
fn amounts_that_never_coincide_are_fitted_to_their_own_frames() {
    let mut data = synthesise(&World::contact(), Stream::Training, 1200);
    data.outputs = data.outputs.columns(2, 2);
    for (number, line) in data.outputs.values.chunks_exact_mut(2).enumerate() {
        line[number % 2] = f64::NAN;
    }
    let kinds = Some(Kinds::all(Features::Normalised { threshold: 0.0 }));
    let trained = train(&data, &Options { centres: 8, kinds, ..Options::default() }, &Silent);
    let squares = data.outputs.squared_errors(&trained.unwrap().decode(&data.inputs.values));
    for (square, deviation) in squares.iter().zip(data.outputs.deviations()) {
        let share = (square / 600.0).sqrt() / deviation;
        assert!(share < 0.5, "{share}");
    }
}

//! Training of networks.

mod kmeans;
mod least_squares;
mod penalty;
mod projection;
mod refine;
mod resolution;

use taxel_core::rbf::Format;
use taxel_data::{AtRest, Dataset, Purpose, Random, Silent, Stream, Table};
use taxel_learn::decoders::RowDecoder;
use taxel_learn::decoders::linear::LinearRow;
use taxel_learn::decoders::standard::StandardNetwork;
use taxel_learn::infer::infer;
use taxel_learn::train::memory::peak_bytes;
use taxel_learn::train::{
    Found, INITIAL_COVARIANCE, MOST_MEMORY_BYTES, Options, Ridge, Samples, Solver, Start, train,
};

/// Table of `frames` of a smooth function of two inputs, with a little noise.
fn table(frames: usize, noise: f64) -> Dataset {
    let mut random = Random::new(11, Stream::Training, Purpose::Noise, 0, 0);
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for _ in 0..frames {
        let (a, b) = (random.unit(), random.unit());
        inputs.extend([40.0 + 20.0 * a, 100.0 - 5.0 * b]);
        let wave = (5.0 * a).sin() * b;
        outputs.extend([wave + noise * random.normal(), a - 2.0 * b + noise * random.normal()]);
    }
    let names = |list: [&str; 2]| list.map(String::from).to_vec();
    Dataset {
        inputs: Table { names: names(["a_ohm", "b_ohm"]), values: inputs.into() },
        outputs: Table { names: names(["wave_mm", "plane_mm"]), values: outputs.into() },
        ..Dataset::empty(vec![], vec![], 1, 0)
    }
}

#[test]
fn the_standard_network_interpolates_its_samples_exactly() {
    let table = table(60, 0.2);
    let standard = StandardNetwork::fit(&table, 0.05).unwrap();
    let predicted = standard.predict(&table.inputs.values);
    let differ = predicted.iter().zip(table.outputs.values.iter()).map(|(p, y)| (p - y).abs());
    assert!(differ.fold(0.0, f64::max) < 1e-9);
    assert_eq!(StandardNetwork::fit(&table, 30.0), None, "its solution misses the samples");
    let mut twice = table.clone();
    twice.inputs.values.extend(table.inputs.values.iter());
    twice.outputs.values.extend(table.outputs.values.iter());
    assert!(StandardNetwork::fit(&twice, 0.05).is_none(), "duplicates cannot be interpolated");
}

#[test]
fn penalties_fitted_together_give_the_networks_of_each_alone() {
    let table = table(3000, 0.05);
    let penalties = [None, Some(1e-9), Some(1e-5), Some(1e-2)];
    for format in Format::ALL {
        let options = Options { centres: 12, spread: 0.4, format, ..Options::of_rows() };
        let starts = Start::all(&table, &options).unwrap();
        let layers = starts.iter().map(|start| start.layers(&options)).collect();
        let found = Found::new(&starts, layers, &options, &penalties, None, &Silent).unwrap();
        let together: Vec<_> =
            found.fit(format, false, &Silent).into_iter().map(|it| it.unwrap().networks).collect();
        assert_eq!(together.len(), penalties.len());
        for (penalty, networks) in penalties.iter().zip(&together) {
            let alone = train(&table, &Options { penalty: *penalty, ..options }, &Silent).unwrap();
            assert_eq!(*networks, alone.networks, "{format:?} {penalty:?}");
        }
        assert_ne!(together[0], together[3]);
    }
}

#[test]
fn a_penalty_is_for_each_frame() {
    let with = |penalty| Options { penalty, ..Options::of_rows() };
    assert!((with(Some(1e-7)).initial_covariance(2000) * 2e-4 - 1.0).abs() < 1e-12);
    assert_eq!(with(None).initial_covariance(2000), INITIAL_COVARIANCE);
    for penalty in [0.0, -1e-7, 2000.0, f64::NAN] {
        let message = with(Some(penalty)).check(1000).unwrap_err().to_string();
        assert!(message.starts_with("penalty = "), "{message}");
    }
    with(Some(1e-7)).check(1000).unwrap();
    // On the affine tail of two inputs it is at most 1e-7, or a thousandth of one above 1; on the bias it stays small.
    let roots = |penalty| {
        [0, 6, 7].map(|it| Ridge::new(2, &with(Some(penalty))).root(100, it, 8).powi(2) / 100.0)
    };
    for (penalty, wanted) in [(0.1, [0.1, 1e-7, 1e-7]), (10.0, [10.0, 0.01, 1e-7])] {
        let near = |(a, b): (f64, f64)| (a / b - 1.0).abs() < 1e-9;
        assert!(roots(penalty).into_iter().zip(wanted).all(near), "{:?}", roots(penalty));
    }
}

#[test]
fn training_beyond_the_memory_bound_is_refused_in_advance() {
    let names = |count: usize| (0..count).map(|column| format!("c{column}")).collect();
    let wide = Dataset::empty(names(20_000), vec!["y".into()], 1, 60);
    let options = Options { centres: 10, ..Options::of_rows() };
    let refused = train(&wide, &options, &Silent).unwrap_err().to_string();
    assert!(
        refused.starts_with("memory = about 12.9 GB: training may take at most 8.0 GB"),
        "{refused}"
    );
    // Refinement holds the square of all weights for every piece of the samples.
    let narrow = Dataset::empty(names(10), vec!["y".into()], 1, 50_000);
    let many = Options { centres: 4000, ..options };
    let bytes = [None, Some(250)].map(|pieces| peak_bytes(&narrow, &many, pieces));
    assert!(bytes[0] <= MOST_MEMORY_BYTES && bytes[1] > MOST_MEMORY_BYTES, "{bytes:?}");
}

/// The usual table, whose first output is missing wherever the second one is below −0.3. The input's range is that of the
/// lines that have all outputs.
fn with_missing_outputs(frames: usize) -> Dataset {
    let mut table = table(frames, 0.05);
    table.inputs.values[..4].copy_from_slice(&[40.0, 95.0, 60.0, 100.0]);
    for line in table.outputs.values.chunks_exact_mut(2).skip(2) {
        line[0] = if line[1] < -0.3 { f64::NAN } else { line[0] };
    }
    assert!(
        (500..frames - 500).contains(&table.outputs.counts()[0]),
        "{:?}",
        table.outputs.counts()
    );
    table
}

/// Lines of `table` that have the output number `column`, with that output alone.
fn alone(table: &Dataset, column: usize) -> Dataset {
    let lines = table.outputs.lines_with(&[column]);
    let inputs = table.inputs.part(&lines, &[0, 1]);
    Dataset { inputs, outputs: table.outputs.part(&lines, &[column]), ..table.clone() }
}

#[test]
fn each_output_has_the_network_that_its_own_lines_give_alone() {
    let table = with_missing_outputs(3000);
    let (samples, inputs) = (Samples::new(&table), &table.inputs);
    let mut solvers = vec![(Format::F32, Solver::Rls)];
    solvers.extend(Format::ALL.map(|it| (it, Solver::Qr)));
    for (format, solver) in solvers {
        let usual = Options { centres: 20, spread: 0.4, format, solver, ..Options::of_rows() };
        let centres = samples.centres(&usual, 0);
        for penalty in [None, Some(1e-6)] {
            let options = Options { penalty, ..usual };
            let predicted = |table: &Dataset| {
                let fitted = Samples::new(table).fit(&centres, &options).unwrap();
                (fitted.format(), infer(&fitted.network(), &inputs.values))
            };
            let (format, together) = predicted(&table);
            for column in 0..2 {
                let (of_one, expected) = predicted(&alone(&table, column));
                let found = together.iter().skip(column).step_by(2).copied();
                assert_eq!(format, of_one);
                assert_eq!(found.collect::<Vec<_>>(), expected, "{format:?}, output {column}");
            }
        }
    }
}

#[test]
fn the_linear_decoder_fits_each_output_on_lines_that_have_it() {
    let table = with_missing_outputs(2000);
    let fit = |table: &Dataset| LinearRow::fit(table, &(0..table.frames()).collect::<Vec<_>>());
    let together = fit(&table).predict(&table.inputs.values);
    for column in 0..2 {
        let found: Vec<f64> = together.iter().skip(column).step_by(2).copied().collect();
        assert_eq!(found, fit(&alone(&table, column)).predict(&table.inputs.values));
    }
}

#[test]
fn outputs_with_too_few_frames_are_refused_by_name() {
    let mut data = with_missing_outputs(3000);
    let count = data.fewest_values();
    let refused = |data: &Dataset, options: &Options| {
        train(data, options, &Silent).expect_err("refused").to_string()
    };
    let options = Options { centres: count, ..Options::of_rows() };
    let message = refused(&data, &options);
    assert!(message.contains("wave_mm") && message.contains(&format!("the {count} ")), "{message}");
    data.outputs.values.iter_mut().step_by(2).for_each(|value| *value = f64::NAN);
    assert!(refused(&data, &Options { centres: 1, ..Options::of_rows() }).contains("wave_mm"));
}

#[test]
fn readings_at_rest_that_f32_does_not_hold_are_refused_by_name() {
    let rest = AtRest { level: vec![50.0, 1e39], deviation: vec![0.1; 2] };
    let frames = Dataset { at_rest: Some(rest), ..table(100, 0.2) };
    let refused = train(&frames, &Options::of_rows(), &Silent).unwrap_err().to_string();
    assert!(refused.starts_with("column \"b_ohm\" is 1e39 ± 0.1 at rest"), "{refused}");
}

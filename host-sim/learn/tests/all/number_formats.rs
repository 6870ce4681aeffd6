//! Loss of accuracy by number formats: the same centres fitted and evaluated in f64, in f32 and in 16-bit
//! fixed point, on both reference scenes, by axis. Figures: `TAXEL_CASES=3 cargo test -p taxel-learn --test all number_formats -- --nocapture`.

use taxel_core::rbf::Format;
use taxel_data::{Dataset, Stream, Table, columns};
use taxel_learn::Options;
use taxel_learn::infer::infer;
use taxel_learn::train::least_squares::{Factor, Regressors};
use taxel_learn::train::{InputScale, Samples};
use taxel_simulate::{World, synthesise};

const NOISE_LEVELS: [f64; 2] = [0.0, 0.005];
/// Row-wires at the rim, beside the middle, and in between: the first, or as many as `TAXEL_CASES` says.
const ROWS: [usize; 3] = [1, 4, 7];

fn rows() -> &'static [usize] {
    let count = std::env::var("TAXEL_CASES").map_or(1, |count| count.parse().unwrap());
    &ROWS[..ROWS.len().min(count)]
}

fn world(name: &str, noise: f64) -> World {
    let mut world = if name == "paper" { World::paper() } else { World::press() };
    world.set_noise_level(noise).unwrap();
    world.read_rows = rows().iter().map(|row| row - 1).collect();
    world
}

/// Predictions of a network in f64, with neither centres nor weights rounded.
fn in_f64(training: &Dataset, centres: &[f64], options: &Options, test: &Dataset) -> Vec<f64> {
    let scale = InputScale::new(training);
    let regressors = Regressors {
        centres,
        inputs: training.inputs.names.len(),
        decays: &[1.0 / (2.0 * options.spread * options.spread)],
        affine_tail: options.affine_tail,
    };
    let weights = Factor::new(
        &regressors.of(scale.apply(&training.inputs.values)),
        &training.outputs.values[..],
        training.outputs.names.len(),
        options.initial_covariance(training.inputs.len()),
    )
    .weights();
    let mut values = vec![0.0; regressors.count()];
    let outputs = training.outputs.names.len();
    let answer = |scaled: &[f64]| {
        regressors.evaluate(scaled, &mut values);
        let column = |output: usize| weights.iter().skip(output).step_by(outputs);
        let sum = |output| values.iter().zip(column(output)).map(|(v, w)| v * w).sum::<f64>();
        (0..outputs).map(sum).collect::<Vec<f64>>()
    };
    scale.apply(&test.inputs.values).chunks_exact(regressors.inputs).flat_map(answer).collect()
}

/// Squared errors, summed by axis.
fn by_axis(truth: &Table, estimate: &[f64]) -> Vec<f64> {
    let squares = truth.squared_errors(estimate);
    let groups = columns::groups(&truth.names);
    groups.iter().map(|(_, members)| members.iter().map(|c| squares[*c]).sum()).collect()
}

/// RMSE in mm by axis for f64, f32 and fixed16.
fn errors(name: &str, noise: f64) -> [Vec<f64>; 3] {
    let world = world(name, noise);
    let training = synthesise(&world, Stream::Training, 8000);
    let test = synthesise(&world, Stream::Test, 4000);
    let options = Options::of_rows();
    let of_rows: Vec<[Vec<f64>; 3]> = (0..rows().len())
        .map(|row| {
            let (training, test) = (training.row_table(row), test.row_table(row));
            let samples = Samples::new(&training);
            let centres = samples.centres(&options, row);
            let exact = by_axis(&test.outputs, &in_f64(&training, &centres, &options, &test));
            let [float, fixed] = [Format::F32, Format::Fixed16].map(|format| {
                let fitted = samples.fit(&centres, &Options { format, ..options }).unwrap();
                let estimate = infer(&fitted.network(), &test.inputs.values);
                by_axis(&test.outputs, &estimate)
            });
            [exact, float, fixed]
        })
        .collect();
    let values = (rows().len() * 6 * test.frames()) as f64;
    std::array::from_fn(|format| {
        let axis = |axis: usize| of_rows.iter().map(|row| row[format][axis]).sum::<f64>();
        (0..3).map(|a| (axis(a) / values).sqrt()).collect()
    })
}

fn check(name: &str) {
    println!("{name}: RMSE in mm (x, y, z) of f64; growth in f32 and in fixed16");
    for noise in NOISE_LEVELS {
        let [exact, float, fixed] = errors(name, noise);
        let growth = |of: &[f64]| -> Vec<f64> {
            of.iter().zip(&exact).map(|(e, exact)| 100.0 * (e / exact - 1.0)).collect()
        };
        let (float, fixed) = (growth(&float), growth(&fixed));
        println!(
            "  noise {:>4} %: {exact:.5?}  f32 {float:+.3?} %  fixed16 {fixed:+.3?} %",
            noise * 100.0
        );
        assert!(float.iter().all(|growth| *growth <= 0.1), "f32 at {noise}: {float:?}");
        // Without noise, weights are large and results are small differences, so 16 bits show.
        let most = if noise >= 0.005 { 1.0 } else { 40.0 };
        assert!(fixed.iter().all(|growth| *growth <= most), "fixed16 at {noise}: {fixed:?}");
    }
}

#[test]
fn sixteen_bits_cost_no_more_than_a_hundredth_on_press() {
    check("press");
}

#[test]
fn sixteen_bits_cost_no_more_than_a_hundredth_on_paper() {
    check("paper");
}

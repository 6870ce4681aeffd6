//! Tables of a set-up: one for each penalty and each formula of the error, from the same networks.

use std::sync::Arc;

use taxel_data::dataset::RowTable;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_learn::decoders::textbook::{Textbook, predict_each};
use taxel_simulate::outputs::{ElectrodeOutputs, Outputs, Quantity};
use taxel_simulate::sensor::Axis;
use taxel_simulate::{Synthesis, World};

use super::setup::{JudgedOn, NoiseOf, Setup};
use crate::evaluate::printed::{Cells, NOISE_LEVELS, SPREADS};

/// Initial covariances δ of the recursion that are tried; the penalty on squared weights is 1/δ.
pub const INITIAL_COVARIANCES: [f64; 6] = [1e6, 1e4, 1e2, 10.0, 3.0, 1.0];

/// Formulas of the error that are tried, for Δz with errors e, as pages name them.
pub const FORMULAS: [&str; 7] = [
    "mean|e|/(H − Δz)",
    "mean|e|/1 mm",
    "mean|e|/range of Δz",
    "mean|e|/H",
    "‖e‖/‖Δz‖",
    "RMSE/H",
    "mean over samples of max|e|/(H − Δz)",
];

/// Row-wire (from 0) whose table is computed: one of the middle.
const ROW: usize = 3;
/// Fresh samples that a table is judged on.
const TEST_FRAMES: usize = 400;

/// Tables of a set-up, by initial covariance, then by formula.
pub type Tables = Vec<[Cells; FORMULAS.len()]>;

/// Computes the tables of `setup` for one `draw` of samples and noise; judged on at most `most` samples.
#[must_use]
pub fn compute(setup: &Setup, draw: u64, most: usize) -> Tables {
    let z_alone = ElectrodeOutputs { quantity: Quantity::Deformation, axes: vec![Axis::Z] };
    let world = World {
        seed: draw,
        motion: setup.motion(),
        read_rows: vec![ROW],
        outputs: Outputs::Electrodes(z_alone),
        ..World::paper()
    };
    let thickness_mm = world.sensor.size_mm[2];
    let synthesis = Synthesis::of(&world).ideal();
    let ideal = synthesis.frames(Stream::Training, setup.frames()).row_table(0);
    let test = match setup.judged_on() {
        JudgedOn::Fresh => synthesis.frames(Stream::Test, TEST_FRAMES.min(most)).row_table(0),
        JudgedOn::SameDeformations | JudgedOn::Training => ideal.first(setup.frames().min(most)),
    };
    let mut tables = vec![[[[f64::NAN; 4]; 10]; FORMULAS.len()]; INITIAL_COVARIANCES.len()];
    for (j, level) in NOISE_LEVELS.into_iter().enumerate() {
        let noisy = |table: &RowTable, stream| {
            let mut random = Random::new(draw, stream, Purpose::Noise, j as u64, ROW as u64);
            let inputs =
                with_noise(&table.inputs, &ideal.inputs, setup.noise(), level, &mut random);
            RowTable { inputs, ..table.clone() }
        };
        let training = noisy(&ideal, Stream::Training);
        let judged = match setup.judged_on() {
            JudgedOn::Training => training.first(test.inputs.len()),
            JudgedOn::Fresh | JudgedOn::SameDeformations => noisy(&test, Stream::Test),
        };
        let mut random =
            Random::new(draw, Stream::Training, Purpose::Centres, j as u64, ROW as u64);
        let hidden =
            Arc::new(Textbook::new(&training, setup.scaling(), setup.centres(), &mut random));
        for (i, spread) in SPREADS.into_iter().enumerate() {
            let decay = setup.spread().decay(spread);
            let networks = hidden.fit(&training, decay, setup.bias(), &INITIAL_COVARIANCES);
            let predicted = predict_each(&networks, &judged.inputs.values);
            for (tables, predicted) in tables.iter_mut().zip(predicted) {
                let errors = errors(&judged.outputs, &predicted, thickness_mm, setup.range_mm());
                tables.iter_mut().zip(errors).for_each(|(table, error)| table[i][j] = error);
            }
        }
    }
    tables
}

/// Readings of `table` with noise of this `level`, whose meaning refers to the `ideal` readings of training.
fn with_noise(
    table: &Table,
    ideal: &Table,
    noise: NoiseOf,
    level: f64,
    random: &mut Random,
) -> Table {
    let deviations: Vec<f64> = match noise {
        NoiseOf::Reading => Vec::new(),
        NoiseOf::Span => ideal.ranges().iter().map(|[low, high]| level * (high - low)).collect(),
        NoiseOf::Deviation => {
            ideal.deviations().iter().map(|deviation| level * deviation).collect()
        }
        NoiseOf::Power => ideal.deviations().iter().map(|d| level.sqrt() * d).collect(),
        NoiseOf::Mean => {
            let mean = ideal.values.iter().sum::<f64>() / ideal.values.len() as f64;
            vec![level * mean; ideal.names.len()]
        }
    };
    let mut values = table.values.clone();
    for line in values.chunks_exact_mut(table.names.len()) {
        for (k, reading) in line.iter_mut().enumerate() {
            *reading += deviations.get(k).unwrap_or(&(level * *reading)) * random.normal();
        }
    }
    Table { names: table.names.clone(), values }
}

/// Errors of `predicted` by each of the [`FORMULAS`], in per cent.
fn errors(
    truth: &Table,
    predicted: &[f64],
    thickness_mm: f64,
    range_mm: f64,
) -> [f64; FORMULAS.len()] {
    let (mut positional, mut absolute, mut squares, mut truths, mut largest) =
        (0.0, 0.0, 0.0, 0.0, 0.0);
    for (line, predicted) in truth.lines().zip(predicted.chunks_exact(truth.names.len())) {
        let mut worst = 0.0_f64;
        for (z, p) in line.iter().zip(predicted) {
            let error = (p - z).abs();
            positional += error / (thickness_mm - z);
            absolute += error;
            squares += error * error;
            truths += z * z;
            worst = worst.max(error / (thickness_mm - z));
        }
        largest += worst;
    }
    let (count, lines) = (truth.values.len() as f64, truth.len() as f64);
    let mean = absolute / count;
    let rmse = f64::sqrt(squares / count);
    let relative_l2 = f64::sqrt(squares / truths);
    [
        positional / count,
        mean,
        mean / range_mm,
        mean / thickness_mm,
        relative_l2,
        rmse / thickness_mm,
        largest / lines,
    ]
    .map(|error| 100.0 * error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_their_formulas() {
        let names = ["a", "b"].map(String::from).to_vec();
        let truth = Table { names, values: vec![0.0, 1.0, -1.0, 0.0] };
        let found = errors(&truth, &[0.5, 1.0, -1.0, -0.5], 5.0, 2.0);
        let expected =
            [(0.5 / 5.0 + 0.5 / 5.0) / 4.0, 0.25, 0.125, 0.05, 0.5, f64::sqrt(0.125) / 5.0, 0.1];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - 100.0 * expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn a_standard_network_judged_on_its_own_samples_has_no_error_and_one_judged_afresh_has() {
        // x, y and z; ±1 mm; N = K = 50; noise of the reading; [0, 1]; σ; no bias.
        let [own, fresh] = [2, 0].map(|judged| {
            let tables = compute(&Setup([0, 1, 0, 5, 0, 0, 0, 0, judged]), 1, 400);
            tables[0][5] // δ = 1e6, RMSE/H
        });
        assert!(own[0].iter().all(|error| *error < 0.1), "{own:?}");
        // Always predicting the mean has 100·(1/√3)/5 = 11.5 %.
        assert!(fresh.as_flattened().iter().all(|error| *error > 8.0), "{fresh:?}");
    }
}

//! Tables of a set-up: one for each penalty and each formula of the error, from the same networks.

use std::sync::Arc;

use taxel_data::dataset::RowTable;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_evaluate::evaluate::printed::{Cells, NOISE_LEVELS, SPREADS};
use taxel_learn::decoders::textbook::{Textbook, predict_each};
use taxel_limit::solve::{Unknowns, solve};
use taxel_simulate::outputs::{ElectrodeOutputs, Quantity};
use taxel_simulate::sensor::Axis;
use taxel_simulate::{Synthesis, World};

use super::setup::{JudgedOn, NoiseOf, Setup};

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
/// Most samples that a table is judged on; training has up to 600.
const TEST_FRAMES: usize = 600;
/// Most samples for which networks are inverted: each takes a millisecond.
const INVERTED_FRAMES: usize = 24;
/// Electrodes of a row-wire.
const ELECTRODES: usize = 6;
/// Standard deviation of a deformation that is uniform on ±1 mm.
const DEVIATION_MM: f64 = 0.577_350_269_189_625_8;

/// Tables of a set-up, by initial covariance, then by formula.
pub type Tables = Vec<[Cells; FORMULAS.len()]>;

/// Samples at one noise level: what networks are trained on, and what they are judged on.
struct Level {
    training: RowTable,
    judged: RowTable,
    random: Random,
}

/// Computes the tables of `setup` for one `draw` of samples and noise; judged on at most `most` samples.
pub fn compute(setup: &Setup, draw: u64, most: usize) -> Tables {
    let every_axis = setup.is_forward() && !setup.moves_z_alone();
    let axes = if every_axis { vec![Axis::X, Axis::Y, Axis::Z] } else { vec![Axis::Z] };
    let world = World {
        seed: draw,
        motion: setup.motion(),
        read_rows: vec![ROW],
        outputs: ElectrodeOutputs { quantity: Quantity::Deformation, axes }.into(),
        ..World::paper()
    };
    let thickness_mm = world.sensor.size_mm[2];
    let synthesis = Synthesis::new(&world).ideal();
    let ideal = synthesis.frames(Stream::Training, setup.frames()).row_table(0);
    let most = if setup.is_forward() { most.min(INVERTED_FRAMES) } else { most.min(TEST_FRAMES) };
    let test = match setup.judged_on() {
        JudgedOn::Fresh => synthesis.frames(Stream::Test, most).row_table(0),
        JudgedOn::SameDeformations | JudgedOn::Training => ideal.first(setup.frames().min(most)),
    };
    let mut tables = vec![[[[f64::NAN; 4]; 10]; FORMULAS.len()]; INITIAL_COVARIANCES.len()];
    for (j, noise_level) in NOISE_LEVELS.into_iter().enumerate() {
        let noisy = |table: &RowTable, stream| {
            let mut random = Random::new(draw, stream, Purpose::Noise, j as u64, ROW as u64);
            let noise = (setup.noise(), noise_level);
            let inputs = with_noise(&table.inputs, &ideal.inputs, noise, &mut random);
            RowTable { inputs, ..table.clone() }
        };
        let training = noisy(&ideal, Stream::Training);
        let judged = match setup.judged_on() {
            JudgedOn::Training => training.first(test.inputs.len()),
            JudgedOn::Fresh | JudgedOn::SameDeformations => noisy(&test, Stream::Test),
        };
        let random = Random::new(draw, Stream::Training, Purpose::Centres, j as u64, ROW as u64);
        let level = Level { training, judged, random };
        let predicted =
            if setup.is_forward() { inverted(setup, level) } else { direct(setup, level) };
        for (i, each) in predicted.into_iter().enumerate() {
            for (tables, (truth, predicted)) in tables.iter_mut().zip(each) {
                let errors = errors(&truth, &predicted, thickness_mm, setup.range_mm());
                tables.iter_mut().zip(errors).for_each(|(table, error)| table[i][j] = error);
            }
        }
    }
    tables
}

/// True Δz of a table, and their predictions, by spread, then by initial covariance.
type Predicted = Vec<Vec<(Table, Vec<f64>)>>;

/// Predictions of networks from readings to deformations.
fn direct(setup: &Setup, mut level: Level) -> Predicted {
    let hidden =
        Textbook::new(&level.training, setup.scaling(), setup.centres(), &mut level.random);
    let hidden = Arc::new(hidden);
    let of_spread = |spread| {
        let decay = setup.spread().decay(spread);
        let networks = hidden.fit(&level.training, decay, setup.bias(), &INITIAL_COVARIANCES);
        let predicted = predict_each(&networks, &level.judged.inputs.values);
        predicted.into_iter().map(|predicted| (level.judged.outputs.clone(), predicted)).collect()
    };
    SPREADS.into_iter().map(of_spread).collect()
}

/// Predictions by inverting networks from deformations to readings, from rest; for the largest initial covariance alone.
fn inverted(setup: &Setup, mut level: Level) -> Predicted {
    let RowTable { inputs: readings, outputs: deformations, .. } = level.training;
    let training = RowTable { inputs: deformations, outputs: readings, common_span: false };
    let hidden = Textbook::new(&training, setup.scaling(), setup.centres(), &mut level.random);
    let hidden = Arc::new(hidden);
    let (readings, truth) = (&level.judged.inputs, &level.judged.outputs);
    let (count, unknowns) = (readings.names.len(), truth.names.len());
    let along_z: Vec<usize> =
        (0..unknowns).filter(|i| unknowns == ELECTRODES || i % 3 == 2).collect();
    let z_of = |line: &[f64]| -> Vec<f64> { along_z.iter().map(|i| line[*i]).collect() };
    let z = Table {
        names: along_z.iter().map(|i| truth.names[*i].clone()).collect(),
        values: truth.lines().flat_map(z_of).collect(),
    };
    let rest = vec![0.0; unknowns];
    let start = Unknowns { start: &rest, deviation: DEVIATION_MM, largest: 1.0 };
    let mut slopes = vec![0.0; count * unknowns];
    let mut of_spread = |spread| {
        let decay = setup.spread().decay(spread);
        let covariances = &INITIAL_COVARIANCES[..1];
        let network = hidden.fit(&training, decay, setup.bias(), covariances).swap_remove(0);
        let mut predicted = Vec::new();
        for reading in readings.lines() {
            let found = solve(&start, count, (0.0, 0.0), |place, residuals, derivatives| {
                network.predict_with_slopes(place, residuals, &mut slopes);
                for (k, (residual, reading)) in residuals.iter_mut().zip(reading).enumerate() {
                    *residual = *residual / reading - 1.0;
                    for i in 0..unknowns {
                        derivatives[(k, i)] = slopes[k * unknowns + i] / reading;
                    }
                }
            });
            predicted.extend(z_of(&found.place));
        }
        vec![(z.clone(), predicted)]
    };
    SPREADS.into_iter().map(&mut of_spread).collect()
}

/// Readings of `table` with noise of this `level`, whose meaning refers to the `ideal` readings of training.
fn with_noise(
    table: &Table,
    ideal: &Table,
    (noise, level): (NoiseOf, f64),
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
            let tables = compute(&Setup([0, 1, 0, 5, 0, 0, 0, 0, judged, 0]), 1, 400);
            tables[0][5] // δ = 1e6, RMSE/H
        });
        assert!(own[0].iter().all(|error| *error < 0.1), "{own:?}");
        // Always predicting the mean has 100·(1/√3)/5 = 11.5 %.
        assert!(fresh.as_flattened().iter().all(|error| *error > 8.0), "{fresh:?}");
    }

    #[test]
    fn a_network_of_readings_inverted_decodes_where_z_alone_moves() {
        // z alone; 0 … 1 mm; N = 600, K = 180; noise of the reading; [0, 1]; σ; with bias; fresh samples.
        let tables = compute(&Setup([1, 0, 4, 3, 0, 0, 0, 1, 0, 1]), 1, 8);
        let rmse = tables[0][5]; // δ = 1e6, RMSE/H; always predicting the mean has 5.8 %
        assert!(rmse[9][0] < 4.0 && rmse[9][0] < rmse[9][3], "{rmse:?}");
        assert!(tables[1][5].as_flattened().iter().all(|cell| cell.is_nan()), "one covariance");
    }
}

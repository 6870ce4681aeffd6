//! Faults of the sensor in virtual hardware: which are named, how often a sound sensor is accused, and what is left of
//! frames.

use std::sync::OnceLock;

use model_core::health::Limits;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_learn::faults::{WINDOW, diagnose};
use taxel_learn::train::train;
use taxel_learn::{Exponential, ModelBlob, Options, Origin, fill, pack};
use taxel_simulate::readout::Readout;
use taxel_simulate::virtual_board::{BoardFault, VirtualBoard, scan};
use taxel_simulate::{World, synthesise};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

mod strikes;

use strikes::Strike;

pub const NAMED: Promise = Promise {
    name: "sensor-fault-named",
    text: "a fault of wires or converters is named in 200 frames",
    share: 4,
    check: named,
};

pub const NOTICED: Promise = Promise {
    name: "sensor-at-supply",
    text: "a wire at the supply voltage is noticed in 200 frames",
    share: 1,
    check: noticed,
};

pub const SILENT: Promise = Promise {
    name: "sensor-false-alarm",
    text: "a sound sensor has no faults, at 0.5 % and 5 % noise",
    share: 4,
    check: silent,
};

pub const FILLED: Promise = Promise {
    name: "sensor-fill",
    text: "z without one reading, column-wire or row-wire",
    share: 1,
    check: filled,
};

/// Rows and columns of the sensor.
const ROWS: usize = 8;
const COLUMNS: usize = 18;

/// Frames for the model.
const TRAINING_FRAMES: usize = 2000;

/// A model of the whole array that fills missing readings.
fn model() -> Result<&'static ModelBlob, String> {
    static MODEL: OnceLock<Result<ModelBlob, String>> = OnceLock::new();
    let fitted = || {
        let frames = synthesise(&World::press(), Stream::Training, TRAINING_FRAMES);
        let options = Options { centres: 24, spread: 0.4, whole_array: true, ..Options::default() };
        let trained = train(&frames, &options, &Silent)?;
        let blob = pack(&trained, &frames, &Origin::of_data("press", 0, 1, &frames))?;
        fill::add(&blob, &frames.inputs)
    };
    let fitted = || fitted().map_err(|error: taxel_learn::Error| error.to_string());
    MODEL.get_or_init(fitted).as_ref().map_err(Clone::clone)
}

/// Readings of `frames` with this noise, drawn with `seed`.
fn readings(seed: u64, noise: f64, frames: usize) -> Table {
    let mut world = World { seed, ..World::press() };
    world.noise.level = noise;
    synthesise(&world, Stream::Test, frames).inputs
}

/// Names of the faults in what a board scans of `readings`. With a `planted` fault nobody looks at more than health.
fn names(readings: &Table, planted: bool) -> Result<Vec<String>, String> {
    let model = model()?.parse();
    let fill = model.fill().filter(|_| !planted);
    let found = diagnose(readings, Limits::USUAL, fill);
    Ok(found.iter().map(|found| found.fault.to_string()).collect())
}

/// Scans `readings` by the firmware's readout, on a board with switches, leads and converters that have noise.
fn scanned(readings: &Table, faults: &[BoardFault]) -> Result<Table, String> {
    let readout = Readout {
        cross_talk: Some(true),
        row_switch_ohm: Some(0.26),
        line_ohm: Some(0.1),
        adc_noise_counts: Some(0.5),
        ..Readout::default()
    };
    let board =
        VirtualBoard::with_readout(&World::press(), &readout).map_err(|cause| cause.to_string())?;
    board.set_faults(faults);
    scan(&board, board.series_resistance(), readings).map_err(|cause| cause.to_string())
}

/// Runs cases until there are enough, and tells the share of those that fail, in per cent.
fn share(
    effort: &Effort,
    (least, most): (u64, u64),
    bound: f64,
    case: impl Fn(u64) -> Result<(), String> + Sync,
) -> Found {
    let (mut cases, mut failures) = (0, Vec::new());
    while cases < least || (cases < most && !effort.is_over()) {
        let several = (least - cases.min(least)).max(32).min(most - cases);
        let failed = (0..several).into_par_iter().filter_map(|offset| {
            let seed = effort.seed().wrapping_add(cases + offset);
            case(seed).err().map(|note| (seed, note))
        });
        failures.extend(failed.collect::<Vec<_>>());
        cases += several;
    }
    let worst = 100.0 * failures.len() as f64 / cases as f64;
    let (seed, note) = failures.into_iter().next().unwrap_or((effort.seed(), String::new()));
    Found { cases, worst, bound, unit: "%", seed, note }
}

fn named(effort: &Effort, _: &Tools) -> Result<Found, String> {
    model()?;
    let strikes = strikes::all();
    let count = strikes.len() as u64;
    let least = if effort.is_planted() { 24 } else { 48 };
    Ok(share(effort, (least, count * 40), 1.0, |seed| {
        // A prime that does not divide their number visits every fault once.
        let strike = &strikes[(seed.wrapping_mul(1009) % count) as usize];
        let mut frames = readings(seed, 0.005, WINDOW);
        strike.add_noise(seed, &mut frames);
        let mut found = names(&scanned(&frames, strike.faults())?, effort.is_planted())?;
        let mut expected = strike.names();
        found.sort();
        expected.sort();
        if found == expected {
            return Ok(());
        }
        Err(format!("{}: found {}", strike.names().join(", "), found.join(", ")))
    }))
}

fn noticed(effort: &Effort, _: &Tools) -> Result<Found, String> {
    model()?;
    let count = (ROWS + COLUMNS) as u64;
    Ok(share(effort, (count / 2, count * 10), 1.0, |seed| {
        let wire = (seed.wrapping_mul(7) % count) as usize;
        let fault = match wire.checked_sub(ROWS) {
            None => BoardFault::RowAtSupply(wire),
            Some(column) => BoardFault::ColumnAtSupply(column),
        };
        let struck = if effort.is_planted() { &[][..] } else { &[fault] };
        let found = names(&scanned(&readings(seed, 0.005, WINDOW), struck)?, false)?;
        if found.is_empty() { Err(format!("{fault:?} is not noticed")) } else { Ok(()) }
    }))
}

fn silent(effort: &Effort, _: &Tools) -> Result<Found, String> {
    model()?;
    // A window with an alarm is an alarm in as many frames.
    let least = if effort.is_planted() { 8 } else { 40 };
    let found = share(effort, (least, 10_000), 0.01, |seed| {
        let mut frames = readings(seed, if seed % 2 == 0 { 0.005 } else { 0.05 }, WINDOW);
        if effort.is_planted() {
            Strike::noisy(3, 4).add_noise(seed, &mut frames);
        }
        let found = names(&frames, false)?;
        if found.is_empty() { Ok(()) } else { Err(format!("found {}", found.join(", "))) }
    });
    Ok(Found { cases: found.cases * WINDOW as u64, ..found })
}

/// Columns without a reading, and the largest ratio of errors in z that this may cost.
type Without = (&'static str, fn(usize, usize) -> bool, f64);

const WITHOUT: [Without; 3] = [
    ("a reading", |row, column| (row, column) == (3, 4), 1.01),
    ("a column-wire", |_, column| column == 8, 1.04),
    ("a row-wire", |row, _| row == 3, 1.10),
];

fn filled(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let prepared = model()?.prepare(Exponential::default());
    Ok(effort.worst((3, 30), (1.0, "allowed"), |seed| {
        let (what, is_missing, most) = WITHOUT[(seed % 3) as usize];
        let world = World { seed, ..World::press() };
        let frames = synthesise(&world, Stream::Test, 2000);
        let outputs = &frames.outputs;
        let error = |readings: &[f64]| {
            let estimate = prepared.decode_lines(readings);
            let squares = outputs.squared_errors(&estimate);
            let z = outputs.names.iter().zip(squares).filter(|(name, _)| name.ends_with("dz_mm"));
            z.map(|(_, square)| square).sum::<f64>().sqrt()
        };
        let mut faulty = frames.inputs.values.clone();
        for (at, reading) in faulty.iter_mut().enumerate() {
            let (row, column) = (at / COLUMNS % ROWS, at % COLUMNS);
            if is_missing(row, column) {
                *reading = f64::NAN;
            }
        }
        let (filled, _) = prepared.filled(&faulty).ok_or("the model has no fill")?;
        let filled = if effort.is_planted() { with_means(&faulty, &frames.inputs) } else { filled };
        let ratio = error(&filled) / error(&frames.inputs.values);
        if ratio > most {
            Err(format!("without {what}: {ratio:.3} times the error"))
        } else {
            Ok(ratio / most)
        }
    }))
}

/// The planted fault: missing readings are filled with their means, whatever the others say.
fn with_means(faulty: &[f64], readings: &Table) -> Vec<f64> {
    let means = readings.means();
    let fill = |(at, reading): (usize, &f64)| {
        if reading.is_nan() { means[at % means.len()] } else { *reading }
    };
    faulty.iter().enumerate().map(fill).collect()
}

/// Draws for what a strike adds to readings.
fn draws(seed: u64) -> Random {
    Random::new(seed, Stream::Test, Purpose::AdcNoise, 0, 0)
}

//! Faults of the sensor in virtual hardware: which are named, and how often a sound sensor is accused.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use taxel_core::fill::Fill;
use taxel_core::health::Limits;
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_data::table::Table;
use taxel_learn::faults::{FEWEST_FOR_NOISE, WINDOW, diagnose};
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, fill, pack};
use taxel_simulate::readout::Readout;
use taxel_simulate::{World, synthesise};
use taxel_virtual_board::{BoardFault, VirtualBoard, scan};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

mod strikes;

use strikes::Strike;

pub const NAMED: Promise = Promise {
    name: "sensor-fault-named",
    text: "a fault of wires is named in 200 frames",
    share: 4,
    check: named,
};

pub const SILENT: Promise = Promise {
    name: "sensor-false-alarm",
    text: "a sound sensor has no faults",
    share: 16,
    check: silent,
};

/// Rows and columns of the sensor.
const ROWS: usize = 8;
const COLUMNS: usize = 18;

/// Numbers of training frames of the fills that sensors are judged by: the least that is accepted, and more.
const FILLS: [usize; 3] = [ROWS * COLUMNS * 10, 2000, 6000];

/// Models whose fills were fitted to so many frames each.
fn models() -> Result<&'static [ModelBlob], String> {
    static MODELS: OnceLock<Result<Vec<ModelBlob>, String>> = OnceLock::new();
    let fitted = |frames: usize| {
        let frames = synthesise(&World::press(), Stream::Training, frames);
        let options = Options { centres: 8, whole_array: true, ..Options::default() };
        let trained = train(&frames, &options, &Silent)?;
        let blob = pack(&trained, &frames, &Origin::of_data("press", 0, 1, &frames))?;
        fill::add(&blob, &frames.inputs)
    };
    let all = || FILLS.into_iter().map(fitted).collect::<Result<_, taxel_learn::Error>>();
    let models = MODELS.get_or_init(|| all().map_err(|error| error.to_string()));
    models.as_deref().map_err(Clone::clone)
}

/// Readings of `frames` with this noise, drawn with `seed`.
fn readings(seed: u64, noise: f64, frames: usize) -> Table {
    let mut world = World { seed, ..World::press() };
    world.noise.level = noise;
    synthesise(&world, Stream::Test, frames).inputs
}

/// Names of the faults in what a board scans of `readings`, judged by this `fill`.
fn named_by(fill: Option<Fill<'_>>, readings: &Table) -> Vec<String> {
    let found = diagnose(readings, Limits::USUAL, fill);
    found.iter().map(|found| found.fault.to_string()).collect()
}

/// Scans `readings` by the firmware's readout, on a board with switches, leads and converters that have noise.
fn scanned(seed: u64, readings: &Table, faults: &[BoardFault]) -> Result<Table, String> {
    let readout = Readout {
        cross_talk: Some(true),
        row_switch_ohm: Some(0.26),
        line_ohm: Some(0.1),
        adc_noise_counts: Some(0.5),
        ..Readout::default()
    };
    let board = VirtualBoard::with_readout(&World { seed, ..World::press() }, &readout)
        .map_err(|cause| cause.to_string())?;
    board.set_faults(faults);
    scan(&board, board.series_resistance(), readings).map_err(|cause| cause.to_string())
}

/// Scans `readings` on a board that a fault strikes, in every frame or now and then.
fn struck(seed: u64, readings: &Table, strike: &Strike) -> Result<Table, String> {
    let mut faulty = scanned(seed, readings, strike.fault.as_slice())?;
    if strike.one_in > 1 {
        let sound = scanned(seed, readings, &[])?;
        let width = readings.names.len();
        let frames = faulty.values.chunks_exact_mut(width).zip(sound.lines()).enumerate();
        let are_sound = frames.filter(|(frame, _)| frame % strike.one_in != 0);
        are_sound.for_each(|(_, (faulty, sound))| faulty.copy_from_slice(sound));
    }
    Ok(faulty)
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
    Found { cases, refused: 0, worst, bound, unit: "%", seed, note }
}

fn named(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let model = &models()?[1];
    let strikes = strikes::all();
    let count = strikes.len() as u64;
    Ok(share(effort, (60, count * 40), 1.0, |seed| {
        // A prime that does not divide their number visits every fault once.
        let strike = &strikes[(seed.wrapping_mul(1009) % count) as usize];
        let mut frames = readings(seed, 0.005, WINDOW);
        strike.add_noise(seed, &mut frames);
        let mut found = named_by(model.parse().fill(), &struck(seed, &frames, strike)?);
        let mut expected = strike.names.clone();
        found.sort();
        expected.sort();
        let is_right = if expected.is_empty() { !found.is_empty() } else { found == expected };
        if is_right { Ok(()) } else { Err(format!("{strike:?}: found {}", found.join(", "))) }
    }))
}

/// A case is one window of a sound sensor, as one alarm is an alarm in all frames of its window. Windows of fewer frames
/// than tell noise are tested, but do not count.
fn silent(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let models = models()?;
    let [windows, frames] = [AtomicU64::new(0), AtomicU64::new(0)];
    let found = share(effort, (60, 40_000), 0.01, |seed| {
        let mut draw = Random::new(seed, Stream::Test, Purpose::Damage, 0, 0);
        let model = &models[draw.below(models.len())];
        let noise = [0.005, 0.05][draw.below(2)];
        let count = 1 + draw.below(2 * WINDOW - 1);
        let sound = readings(seed, noise, count);
        if count >= FEWEST_FOR_NOISE {
            windows.fetch_add(1, Ordering::Relaxed);
            frames.fetch_add(count as u64, Ordering::Relaxed);
        }
        let found = named_by(model.parse().fill(), &scanned(seed, &sound, &[])?);
        if found.is_empty() {
            return Ok(());
        }
        let found = found.join(", ");
        Err(format!("{count} frames, {:.1} % noise: found {found}", noise * 100.0))
    });
    let (windows, frames) = (windows.into_inner(), frames.into_inner());
    // The rule of three.
    let shown = 300.0 / windows.max(1) as f64;
    let found = found.noted(|| {
        format!(
            "{frames} frames; with 95 % confidence, alarms are in less than {shown:.2} % of windows"
        )
    });
    Ok(Found { cases: windows, ..found })
}

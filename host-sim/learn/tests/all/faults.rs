//! Faults of wires, told from frames.

use std::ops::Range;

use taxel_core::health::Limits;
use taxel_data::{Purpose, Random, Stream, Table};
use taxel_learn::faults::{Found, Grid, Kind, Place, WINDOW, WireFault, diagnose, windows};
use taxel_learn::reading_model::factors::Factors;
use taxel_simulate::path::Path;
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World, synthesise};

/// Readings of a whole sensor, and factors fitted to other ones.
fn sensor() -> (Table, Factors) {
    let world = World::press();
    let training = synthesise(&world, Stream::Training, 2000).inputs;
    (synthesise(&world, Stream::Test, 200).inputs, Factors::fit(&training, 11).unwrap())
}

fn named(readings: &Table, factors: &Factors) -> Vec<String> {
    let found = told(readings, Some(factors));
    assert!(found.iter().all(|(_, frames)| frames % WINDOW == 0));
    found.into_iter().map(|(fault, _)| fault).collect()
}

/// Names of faults, and in how many frames they are.
fn told(readings: &Table, factors: Option<&Factors>) -> Vec<(String, usize)> {
    let found = diagnose(readings, Limits::USUAL, factors.map(Factors::model));
    found.iter().map(|found| (found.fault.to_string(), found.frames)).collect()
}

fn with(readings: &Table, change: impl Fn(usize, &mut [f64])) -> Table {
    let mut changed = readings.clone();
    changed.values.chunks_exact_mut(144).enumerate().for_each(|(line, frame)| change(line, frame));
    changed
}

/// Frames of `table`, with this value of some `readings` in some lines.
fn struck(table: &Table, when: fn(usize) -> bool, readings: Range<usize>, ohm: f64) -> Table {
    with(table, |line, frame| {
        if when(line) {
            frame[readings.clone()].fill(ohm);
        }
    })
}

const SHORTED: &str = "shorted (or too small)";

#[test]
fn every_kind_of_fault_is_named_and_sound_frames_have_none() {
    let (sound, factors) = sensor();
    assert_eq!(named(&sound, &factors), [""; 0]);
    let row = |ohm: f64| struck(&sound, |_| true, 54..72, ohm);
    assert_eq!(named(&row(f64::INFINITY), &factors), ["row-wire 4 open"]);
    assert_eq!(named(&row(f64::NAN), &factors), ["row-wire 4 missing"]);
    let column =
        with(&sound, |_, frame| frame.iter_mut().skip(4).step_by(18).for_each(|r| *r = 0.0));
    assert_eq!(named(&column, &factors), [format!("column-wire 5 {SHORTED}")]);
    let single = struck(&sound, |_| true, 58..59, 0.02);
    assert_eq!(named(&single, &factors), [format!("r4c5 {SHORTED}")]);
    // What a device reads: nothing is known of the row.
    let beside = |when: fn(usize) -> bool| {
        struck(&struck(&sound, when, 54..72, f64::NAN), when, 58..59, 0.0)
    };
    let expected = ["row-wire 4 unknown beside a short".into(), format!("r4c5 {SHORTED}")];
    assert_eq!(named(&beside(|_| true), &factors), expected);
    let now_and_then = told(&beside(|line| line % 5 == 0), Some(&factors));
    let expected = ["row-wire 4 intermittently missing", "r4c5 intermittently shorted"];
    assert_eq!(now_and_then, expected.map(|fault| (fault.to_string(), 40)));
    let ground = with(&sound, |_, frame| {
        frame.iter_mut().enumerate().for_each(|(at, r)| *r = if at / 18 == 6 { 1e9 } else { 0.0 });
    });
    assert_eq!(named(&ground, &factors), ["row-wire 7 shorted to ground"]);
    let none = with(&sound, |_, frame| frame.fill(f64::INFINITY));
    assert_eq!(named(&none, &factors), ["all readings open"]);
    let touching = |pairs: &[[usize; 2]]| {
        with(&sound, |_, frame| {
            pairs.iter().for_each(|[a, b]| {
                let mean = f64::midpoint(frame[*a], frame[*b]);
                (frame[*a], frame[*b]) = (mean, mean);
            });
        })
    };
    let columns = touching(&[8, 26, 44, 62, 80, 98, 116, 134].map(|at| [at, at + 1]));
    assert_eq!(named(&columns, &factors), ["column-wires 9 and 10 shorted together"]);
    let rows: Vec<_> = (90..108).map(|at| [at, at + 18]).collect();
    assert_eq!(named(&touching(&rows), &factors), ["row-wires 6 and 7 shorted together"]);
    let mut draw = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let draws: Vec<f64> = (0..200).map(|_| draw.normal()).collect();
    let noisy = with(&sound, |line, frame| frame[100] *= 1.0 + 0.5 * draws[line]);
    assert_eq!(named(&noisy, &factors), ["r6c11 noisy"]);
}

#[test]
fn few_frames_of_a_sound_sensor_have_no_faults() {
    let (_, factors) = sensor();
    for frames in [5, 6, 9, 12, 49, 50, 205, 207, 399] {
        for seed in 0..3 {
            let world = World { seed: 30 + seed, ..World::press() };
            let sound = synthesise(&world, Stream::Test, frames).inputs;
            assert_eq!(told(&sound, Some(&factors)), [], "{frames} frames of seed {seed}");
        }
    }
}

/// Contacts that slide and press as slowly as the live view's: a window has a single touch, in which the model errs alike.
#[test]
fn slow_touches_of_a_sound_sensor_have_no_faults() {
    let (_, factors) = sensor();
    let path = Path {
        speed_mm_per_s: [4.0, 12.0],
        press_rate_hz: [0.25, 0.5],
        duration_s: 12.0,
        ..Path::at(0.0, 0.0)
    };
    let timetable = Timetable::instants((0..1200).map(|at| f64::from(at) / 100.0).collect());
    let world = World::press();
    let slow = Synthesis::new(&world).along(path, timetable).frames(Stream::Test, 10 * 1200);
    assert_eq!(told(&slow.inputs, Some(&factors)), []);
}

#[test]
fn every_window_has_frames_enough_and_all_frames_are_in_one() {
    let ends = |frames| -> Vec<[usize; 2]> {
        windows(frames).into_iter().map(|window| [window.start, window.end]).collect()
    };
    assert_eq!(ends(0), [[0, 0]]);
    assert_eq!(ends(5), [[0, 5]]);
    assert_eq!(ends(399), [[0, 399]]);
    assert_eq!(ends(605), [[0, 200], [200, 400], [400, 605]]);
}

#[test]
fn intermittent_faults_are_named_and_counted_by_frame() {
    let (sound, factors) = sensor();
    let (factors, none) = (Some(&factors), None);
    let told = |readings: &Table, factors: Option<&Factors>, expected: &[(&str, usize)]| {
        let found = told(readings, factors);
        let found: Vec<_> = found.iter().map(|(name, frames)| (name.as_str(), *frames)).collect();
        assert_eq!(found, expected);
    };
    for model in [factors, none] {
        let single = |ohm| struck(&sound, |line| line % 8 == 0, 58..59, ohm);
        told(&single(1e6), model, &[("r4c5 intermittently open", 25)]);
        told(&single(0.02), model, &[("r4c5 intermittently shorted", 25)]);
        told(&single(f64::NAN), model, &[("r4c5 intermittently missing", 25)]);
        let row = struck(&sound, |line| line % 5 == 0, 54..72, f64::INFINITY);
        told(&row, model, &[("row-wire 4 intermittently open", 40)]);
        // It breaks for good, and lasts in most of the frames.
        let breaks = struck(&sound, |line| line >= 8, 58..59, 1e6);
        told(&breaks, model, &[("r4c5 open", 192)]);
    }
    // All readings of a column are open in an eighth of the frames, but never together.
    let apart = with(&sound, |line, frame| frame[line % 8 * 18] = 1e6);
    let each: Vec<String> = (1..=8).map(|row| format!("r{row}c1 intermittently open")).collect();
    let each: Vec<(&str, usize)> = each.iter().map(|name| (name.as_str(), 25)).collect();
    told(&apart, factors, &each);
    let twice =
        Table { values: [&sound.values[..], &sound.values].concat().into(), ..sound.clone() };
    let breaks = struck(&twice, |line| line >= 150, 58..59, 1e6);
    told(&breaks, factors, &[("r4c5 open", 250)]);
    let mut draw = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let draws: Vec<f64> = (0..200).map(|_| draw.normal()).collect();
    let noisy = with(&sound, |line, frame| frame[100] *= (1.0 + draws[line]).max(0.0));
    told(&noisy, factors, &[("r6c11 noisy", 200)]);
    let shorted = noisy.lines().filter(|frame| frame[100] < 5.0).count();
    assert!(shorted > 20);
    told(&noisy, none, &[("r6c11 intermittently shorted", shorted)]);
}

#[test]
fn without_a_reading_model_health_alone_is_told() {
    let (sound, _) = sensor();
    let open = with(&sound, |_, frame| frame[..18].fill(f64::INFINITY));
    let found = diagnose(&open, Limits::USUAL, None);
    let fault = WireFault { place: Place::Row(1), kind: Kind::Open };
    assert_eq!(found, [Found { fault, frames: 200 }]);
}

#[test]
fn columns_without_wires_have_no_faults() {
    let table =
        Table { names: vec!["a_ohm".into(), "b_ohm".into()], values: vec![f64::NAN; 40].into() };
    assert!(diagnose(&table, Limits::USUAL, None).is_empty());
    let names = ["r1c1_ohm", "r1c2_ohm", "r2c1_ohm"].map(String::from);
    assert_eq!(Grid::new(&names), None);
}

#[test]
fn a_row_and_a_column_at_once_are_both_told_and_nothing_else() {
    let names = (1..=3).flat_map(|m| (4..=7).map(move |k| format!("r{m}c{k}_ohm")));
    let grid = Grid::new(&names.collect::<Vec<_>>()).unwrap();
    let cross = [2, 4, 5, 6, 7, 10];
    assert_eq!(grid.wires_of(&cross), [Place::Row(2), Place::Column(6)]);
    assert_eq!(grid.wires_of(&cross[1..]), [Place::Row(2), Place::Reading(3, 6)]);
}

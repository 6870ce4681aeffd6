use taxel_data::random::{Purpose, Random, Stream};
use taxel_simulate::{World, synthesise};

use super::*;
use crate::fill;

/// Readings of a whole sensor, and a fill fitted to other ones.
fn sensor() -> (Table, Vec<f32>) {
    let world = World::press();
    let training = synthesise(&world, Stream::Training, 2000).inputs;
    (synthesise(&world, Stream::Test, 200).inputs, fill::fit(&training, 16).unwrap())
}

fn named(readings: &Table, block: &[f32]) -> Vec<String> {
    let fill = Fill::new(144, 16, block).unwrap();
    let found = diagnose(readings, Limits::USUAL, Some(fill));
    assert!(found.iter().all(|found| found.frames % WINDOW == 0));
    found.iter().map(|found| found.fault.to_string()).collect()
}

fn with(readings: &Table, change: impl Fn(usize, &mut [f64])) -> Table {
    let mut changed = readings.clone();
    changed.values.chunks_exact_mut(144).enumerate().for_each(|(line, frame)| change(line, frame));
    changed
}

#[test]
fn every_kind_of_fault_is_named_and_sound_frames_have_none() {
    let (sound, block) = sensor();
    assert_eq!(named(&sound, &block), [""; 0]);
    let row = |ohm: f64| with(&sound, |_, frame| frame[3 * 18..][..18].fill(ohm));
    assert_eq!(named(&row(f64::INFINITY), &block), ["row-wire 4 open"]);
    assert_eq!(named(&row(f64::NAN), &block), ["row-wire 4 missing"]);
    let column =
        with(&sound, |_, frame| frame.iter_mut().skip(4).step_by(18).for_each(|r| *r = 0.0));
    assert_eq!(named(&column, &block), ["column-wire 5 shorted"]);
    let single = with(&sound, |_, frame| frame[3 * 18 + 4] = 0.02);
    assert_eq!(named(&single, &block), ["r4c5 shorted"]);
    let ground = with(&sound, |_, frame| {
        frame.iter_mut().enumerate().for_each(|(at, r)| *r = if at / 18 == 6 { 1e9 } else { 0.0 });
    });
    assert_eq!(named(&ground, &block), ["row-wire 7 shorted to ground"]);
    let none = with(&sound, |_, frame| frame.fill(f64::INFINITY));
    assert_eq!(named(&none, &block), ["all readings open"]);
    let touching = with(&sound, |_, frame| {
        for m in 0..8 {
            let mean = f64::midpoint(frame[m * 18 + 8], frame[m * 18 + 9]);
            frame[m * 18 + 8..][..2].fill(mean);
        }
    });
    assert_eq!(named(&touching, &block), ["column-wires 9 and 10 shorted together"]);
    let mut draw = Random::new(1, Stream::Test, Purpose::Noise, 0, 0);
    let draws: Vec<f64> = (0..200).map(|_| draw.normal()).collect();
    let noisy = with(&sound, |line, frame| frame[100] *= 1.0 + 0.5 * draws[line]);
    assert_eq!(named(&noisy, &block), ["r6c11 noisy"]);
}

#[test]
fn without_a_fill_health_alone_is_told() {
    let (sound, _) = sensor();
    let open = with(&sound, |_, frame| frame[..18].fill(f64::INFINITY));
    let found = diagnose(&open, Limits::USUAL, None);
    let fault = WireFault { place: Place::Row(1), kind: Kind::Open };
    assert_eq!(found, [Found { fault, frames: 200 }]);
}

#[test]
fn columns_without_wires_have_no_faults() {
    let table = Table { names: vec!["a_ohm".into(), "b_ohm".into()], values: vec![f64::NAN; 40] };
    assert!(diagnose(&table, Limits::USUAL, None).is_empty());
    let names = ["r1c1_ohm", "r1c2_ohm", "r2c1_ohm"].map(String::from);
    assert_eq!(Grid::of(&names), None);
}

//! How well a board tells events of a touch: hits, false alarms and latencies, at rest, in presses and in slips.
//!
//! `cargo run -p taxel-evaluate --example events`, which takes half a minute, and fails where an event is false or missed that
//! must not be.

use std::f64::consts::TAU;

use rayon::prelude::*;
use taxel_core::Decoder;
use taxel_core::contact::Detector;
use taxel_core::events::{Events, Kind, Settings, Shown};
use taxel_core::track::{Frame, State, Tracker};
use taxel_data::random::{Purpose, Random, Stream};
use taxel_evaluate::device::{Device, Readout, Wires};
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::{Error, Result};
use taxel_firmware::readout::Baseline;
use taxel_learn::cost::Cost;
use taxel_simulate::sensor::Sensor;
use taxel_simulate::timetable::Timetable;

/// Trials of each case at rest, with presses and with slips, and the time of one in s: 20 minutes at rest and of presses.
const TRIALS: [u64; 3] = [1200, 240, 240];
const TRIAL_S: f64 = 1.0;

/// Speed at which a contact lands and lifts, and greatest length of a slip.
const LANDING_MM_PER_S: f64 = 50.0;
const SLIP_MM: f64 = 6.0;

/// A touch begins at so many deviations of a reading's noise, and a slip at this speed.
const TOUCH_DEVIATIONS: f64 = 6.5;
const SLIP_MM_PER_S: f32 = 2.0;

/// How a board reads a sensor.
struct Board<'b> {
    sensor: &'b Sensor,
    decoder: Decoder<'b, 8>,
    tracker: Tracker<'b>,
    noise: f64,
    settings: Settings,
    table: Timetable,
    /// Time in s from the start of a scan to the event.
    frame_s: f64,
}

/// A contact that lands, slides in a straight line in the middle of its time, and lifts.
struct Course {
    times_s: [f64; 4],
    depth_mm: f64,
    speed_mm_per_s: f64,
    middle_mm: [f64; 2],
    direction: [f64; 2],
    radius_mm: f64,
    shear: [f64; 2],
}

impl Course {
    fn draw(random: &mut Random, [depth_mm, speed_mm_per_s]: [f64; 2]) -> Self {
        let mut direction = || {
            let (sine, cosine) = random.between([0.0, TAU]).sin_cos();
            [cosine, sine]
        };
        let (direction, sheared) = (direction(), direction());
        let ratio = random.between([0.0, 0.5]);
        let slide_s = 0.4 + random.between([0.0, 0.1]);
        let length_s = (SLIP_MM / speed_mm_per_s).min(0.25);
        let [land_s, lift_s] = [[0.1, 0.2], [0.78, 0.85]].map(|range| random.between(range));
        Self {
            times_s: [land_s, slide_s, slide_s + length_s, lift_s],
            depth_mm,
            speed_mm_per_s,
            middle_mm: [random.between([8.0, 12.0]), random.between([7.0, 11.0])],
            direction,
            radius_mm: random.between([2.0, 5.0]),
            shear: sheared.map(|along| ratio * along),
        }
    }

    fn depth_mm(&self, at_s: f64) -> f64 {
        let [land_s, .., lift_s] = self.times_s;
        (LANDING_MM_PER_S * (at_s - land_s).min(lift_s - at_s)).clamp(0.0, self.depth_mm)
    }

    /// Deformation of each electrode of a row.
    fn deformations(&self, sensor: &Sensor, row: usize, at_s: f64) -> Vec<[f64; 3]> {
        let [_, from_s, to_s, _] = self.times_s;
        let along_mm = self.speed_mm_per_s * (at_s.clamp(from_s, to_s) - 0.5 * (from_s + to_s));
        let place = [0, 1].map(|axis| self.middle_mm[axis] + along_mm * self.direction[axis]);
        let of_electrode = |at: &[f64; 3]| {
            let square = (at[0] - place[0]).powi(2) + (at[1] - place[1]).powi(2);
            let z = self.depth_mm(at_s) * (-0.5 * square / self.radius_mm.powi(2)).exp();
            [self.shear[0] * z, self.shear[1] * z, z]
        };
        sensor.row_electrodes_mm(row).iter().map(of_electrode).collect()
    }

    /// Whether it really touches and slips at a time.
    fn truth(&self, at_s: f64) -> [bool; 3] {
        let [_, from_s, to_s, _] = self.times_s;
        let slips = self.speed_mm_per_s > 0.0 && (from_s..to_s).contains(&at_s);
        let touches = self.depth_mm(at_s) > 0.0;
        [touches, touches, slips]
    }
}

/// What came of touches or of slips.
#[derive(Default)]
struct Outcome {
    all: usize,
    false_alarms: usize,
    /// Number of frames from the first scan that shows any of it to its event, of those that were told.
    frames: Vec<usize>,
}

impl Board<'_> {
    fn readings(&self, course: &Course, at_s: f64, random: &mut Random) -> Vec<f32> {
        let mut noisy = |ohm: f64| (ohm * (1.0 + self.noise * random.normal())) as f32;
        let rows = (0..8).flat_map(|row| {
            let deformations =
                course.deformations(self.sensor, row, at_s + self.table.row_offset_s(row, 8));
            self.sensor.linearise(row, &deformations)
        });
        rows.map(|reading| noisy(reading.resistance_ohm)).collect()
    }

    /// Runs a trial, and adds what came of it.
    fn run(&self, course: &Course, random: &mut Random) -> [Outcome; 3] {
        let (mut memory, mut state) = ([0.0; 144], State::new());
        let mut baseline = Baseline::new(&mut memory);
        baseline.restart(144);
        (0..100).for_each(|_| baseline.add(&self.readings(course, -1.0, random)));
        let row_us: Vec<f32> =
            (0..8).map(|row| 1e6 * self.table.row_offset_s(row, 8) as f32).collect();
        let (mut touch, mut events) = (Detector::default(), Events::default());
        let (mut outcomes, mut onsets) = (<[Outcome; 3]>::default(), [None; 3]);
        let mut went_on = [false; 3];
        for (number, start_s) in self.table.starts_s.iter().enumerate() {
            let readings_ohm = &self.readings(course, *start_s, random)[..];
            let mut estimate = self.decoder.decode(readings_ohm).expect("a frame of this model");
            let start_us = (1e6 * start_s) as u64;
            let frame = Frame { readings_ohm, reciprocals: None, start_us, row_us: &row_us };
            let is_followed = self.tracker.follow(&mut state, &frame);
            if !is_followed {
                self.tracker.start(&mut state, &frame, &estimate.borrowed());
            }
            let change = baseline.largest_relative_deviation(readings_ohm).unwrap_or(0.0);
            let is_touched = touch.update(change, (TOUCH_DEVIATIONS * self.noise) as f32);
            let deepest = || estimate.outputs.iter().copied().fold(0.0, f32::max);
            let load = if is_followed { state.depth_mm() } else { deepest() };
            let place_mm = state.place_mm().filter(|_| is_followed);
            let shown = Shown { start_us, is_touched, load, place_mm };
            events.update(self.settings, shown);
            let [from, to] =
                [0.0, self.table.scan_s].map(|after_s| course.truth(start_s + after_s));
            for (at, kind) in Kind::ALL.into_iter().enumerate() {
                let (outcome, onset) = (&mut outcomes[at], &mut onsets[at]);
                let goes_on = from[at] || to[at];
                if goes_on && !went_on[at] {
                    (outcome.all, *onset) = (outcome.all + 1, Some(number));
                }
                went_on[at] = goes_on;
                *onset = onset.filter(|_| goes_on);
                if events.changed(kind) == Some(true) {
                    match onset.take() {
                        Some(onset) => outcome.frames.push(number - onset),
                        None => outcome.false_alarms += 1,
                    }
                }
            }
        }
        outcomes
    }

    /// Prints what came of all trials with contacts of a depth and speed. Returns for each kind whether all were told, and
    /// whether none was false.
    fn print(&self, [depth_mm, speed_mm_per_s]: [f64; 2], trials: u64) -> [[bool; 2]; 3] {
        let run = |trial| {
            let index = trial + (1e6 * depth_mm + 1e9 * speed_mm_per_s) as u64;
            let mut random = Random::new(1, Stream::Test, Purpose::Path, index, 0);
            self.run(&Course::draw(&mut random, [depth_mm, speed_mm_per_s]), &mut random)
        };
        let all: Vec<[Outcome; 3]> = (0..trials).into_par_iter().map(run).collect();
        print!("{depth_mm:8.2} {speed_mm_per_s:8.0}");
        let mut found = [[true; 2]; 3];
        for at in 0..3 {
            let of = || all.iter().map(move |outcomes| &outcomes[at]);
            let mut frames: Vec<usize> = of().flat_map(|it| it.frames.iter().copied()).collect();
            frames.sort_unstable();
            let expected = of().map(|it| it.all).sum::<usize>();
            let hits = format!("{} of {expected}", frames.len());
            let alarms = of().map(|it| it.false_alarms).sum::<usize>() as f64;
            found[at] = [frames.len() == expected, alarms == 0.0];
            let per_hour = alarms * 3600.0 / (trials as f64 * TRIAL_S);
            print!(" | {hits:>10} {per_hour:5.0}");
            let Some(last) = frames.len().checked_sub(1) else {
                print!("{:25}", "");
                continue;
            };
            let [median, most] = [0.5, 0.95].map(|share| frames[(share * last as f64) as usize]);
            let [median_ms, most_ms] =
                [median, most].map(|it| 1e3 * (self.table.starts_s[it] + self.frame_s));
            print!(" {median:4} {most:4} {median_ms:7.1} {most_ms:6.1}");
        }
        println!();
        found
    }
}

fn main() -> Result<()> {
    let mut scene = Experiment::load("moving")?;
    (scene.training.refine, scene.training.track) = (false, true);
    let blob = scene.train(&taxel_data::Silent)?;
    let model = blob.parse();
    let tracker = model.tracker().expect("a model that was trained to track");
    let cost = Cost::of_tracker(tracker.sizes());
    let mut broken = Vec::new();
    // With the least depth at which every touch is told.
    for (readout, samples, load, sure_mm) in
        [(Readout::OnChip, 12, 0.1, 0.2), (Readout::Spi, 1, 0.2, 1.0)]
    {
        let mut hold = |holds: bool, what: String| {
            if !holds {
                broken.push(format!("{samples} samples: {what}"));
            }
        };
        let (device, wires) = (Device { readout, ..Device::default() }, Wires::of(&scene.world));
        let scan_ms = device.scan_ms(Some(wires), samples);
        let times = device.times(scan_ms, &cost);
        let [period_s, scan_s] = [times.period_ms(), scan_ms.unwrap_or(0.0)].map(|ms| 1e-3 * ms);
        let table = Timetable::every(period_s, scan_s, TRIAL_S)?.in_passes(device.passes(samples));
        let board = Board {
            sensor: &scene.world.sensor,
            decoder: Decoder::new(model).expect("a model that was trained"),
            tracker,
            noise: device.averaged(scene.world.noise, Some(wires), samples).level,
            settings: Settings { load, slip_mm_per_s: SLIP_MM_PER_S },
            table,
            frame_s: 1e-3 * times.frame_ms,
        };
        println!(
            "\n{samples} samples a reading, a frame every {:.2} ms; touch from {:.2} %, load from {load} mm, slip from {SLIP_MM_PER_S} mm/s.",
            1e3 * period_s,
            100.0 * TOUCH_DEVIATIONS * board.noise,
        );
        println!("Latencies: median and 95 %, in frames and in ms.\n");
        let told = "told false/h  frames           ms";
        println!("depth mm slip mm/s |    touch {told} |     load {told} |     slip {told}");
        let at_rest = board.print([0.0, 0.0], TRIALS[0]);
        hold(at_rest.iter().all(|[_, none_false]| *none_false), "an event at rest".into());
        for depth_mm in [0.05, 0.1, 0.2, 0.5, 1.0] {
            let [touch, load, slip] = board.print([depth_mm, 0.0], TRIALS[1]);
            hold(slip[1], format!("a press of {depth_mm} mm that slips"));
            hold(touch[0] || depth_mm < sure_mm, format!("a touch of {depth_mm} mm is missed"));
            hold(load[0] || depth_mm < 0.5, format!("a load of {depth_mm} mm is missed"));
        }
        for speed_mm_per_s in [5.0, 10.0, 20.0, 50.0] {
            let [.., slip] = board.print([0.5, speed_mm_per_s], TRIALS[2]);
            let what = format!("a slip of {speed_mm_per_s} mm/s is missed");
            hold(slip[0] || speed_mm_per_s < 20.0, what);
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(Error::failed(broken.join("\n"))) }
}

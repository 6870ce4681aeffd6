//! Whether something touches a sensor, by its readings alone.

use taxel_core::contact::Detector;
use taxel_core::health::Limits;
use taxel_recording::Layout;

use super::sheet;

/// Standard deviations at rest that a change exceeds before it counts.
const THRESHOLD: f32 = 2.0;
/// What a normal deviate exceeds the threshold by: mean and standard deviation.
const EXCESS: [f32; 2] = [0.017, 0.107];
/// Standard deviations of S at rest, and besides a number, by which S is above its mean when a touch begins.
const BEGIN: [f32; 2] = [6.2, 2.0];
/// Share by which S is above all that it had in the frames at rest when a touch begins, where their noise is correlated.
const ABOVE_REST: f32 = 1.5;
/// Time constant in s by which the detector follows drift while nothing touches, and its greatest step.
const DRIFT_S: f32 = 5.0;
const MOST_DRIFT: f32 = 0.02;
/// Least deviation of a reading, relative to itself, and of one that comes in whole numbers.
const LEAST_DEVIATION: f32 = 2e-4;
const LEAST_WHOLE: f32 = 0.5;

/// Detector of touch: S, by changes from rest that are averaged over neighbouring wires, since a touch is broader than a cell.
pub struct Touch {
    /// Rows and columns of the readings.
    grid: [usize; 2],
    /// Limits, if all readings are in Ω.
    limits: Option<Limits>,
    baseline: Vec<f32>,
    deviations: Vec<f32>,
    begin: f32,
    detector: Detector,
    last_us: u64,
}

/// Touch that was seen: how many times the level at which one begins, and the reading that shows it most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    pub times: f32,
    pub reading: usize,
}

impl Touch {
    /// Detector for the readings of `layout`, with these `limits` if they are in Ω, by the noise of frames at rest. They are its baseline too, unless one is known.
    pub fn new(
        layout: &Layout,
        limits: Limits,
        at_rest: &[Vec<f32>],
        baseline: Option<&[f32]>,
    ) -> Self {
        let mut touch = Self {
            grid: [layout.rows, layout.columns],
            limits: sheet::limits(sheet::names(&layout.readings), limits),
            baseline: mean(at_rest),
            deviations: vec![],
            begin: 0.0,
            detector: Detector::default(),
            last_us: 0,
        };
        let changes: Vec<Vec<f32>> = at_rest.iter().map(|frame| touch.changes(frame)).collect();
        let cells = if touch.is_grid() { 9.0_f32 } else { 1.0 };
        let mut known = at_rest.iter().flatten().filter(|reading| reading.is_finite());
        let is_whole = known.all(|reading| reading.fract() == 0.0);
        let least = if is_whole { LEAST_WHOLE / cells.sqrt() } else { 0.0 };
        let deviation = |(reading, rest): (usize, &f32)| {
            let squares = changes.iter().map(|it| it[reading] * it[reading]);
            let squares = squares.filter(|it| it.is_finite());
            let variance = squares.clone().sum::<f32>() / (squares.count() as f32 - 1.0);
            // NaN for a reading without a value at rest.
            variance.sqrt().max(LEAST_DEVIATION * rest.abs()).max(least) + 0.0 * rest
        };
        touch.deviations = touch.baseline.iter().enumerate().map(deviation).collect();
        let largest = changes.iter().map(|it| touch.strength(it)).fold(0.0, f32::max);
        let known = touch.deviations.iter().filter(|it| it.is_finite()).count() as f32;
        // Deviations of few frames are often too small.
        let mean = EXCESS[0] * known * (1.0 + 16.0 / at_rest.len() as f32);
        let usual = mean + BEGIN[0] * EXCESS[1] * (known * cells).sqrt() + BEGIN[1];
        touch.begin = usual.max(ABOVE_REST * largest);
        if let Some(baseline) = baseline {
            touch.baseline = baseline.to_vec();
        }
        touch
    }

    /// Takes a frame. Returns whether something touches.
    pub fn update(&mut self, readings: &[f32], time_us: u64) -> bool {
        let is_touched = self.detector.update(self.strength(&self.changes(readings)), self.begin);
        let step_s = time_us.saturating_sub(self.last_us) as f32 * 1e-6;
        self.last_us = time_us;
        if !is_touched {
            let share = (step_s / DRIFT_S).min(MOST_DRIFT);
            for (rest, reading) in self.baseline.iter_mut().zip(readings) {
                let step = share * (reading - *rest);
                *rest += if step.is_finite() { step } else { 0.0 };
            }
        }
        is_touched
    }

    /// The strongest touch of `frames`, if there is any, or one goes on.
    pub fn look(&self, frames: &[Vec<f32>]) -> Option<Seen> {
        let seen = |frame: &Vec<f32>| {
            let changes = self.changes(frame);
            let shown = changes.iter().zip(&self.deviations).map(|(it, of)| it.abs() / of);
            let shown = shown.enumerate().filter(|it| it.1.is_finite());
            let most = shown.max_by(|a, b| a.1.total_cmp(&b.1));
            Seen { times: self.strength(&changes) / self.begin, reading: most.map_or(0, |it| it.0) }
        };
        let strongest = frames.iter().map(seen).max_by(|a, b| a.times.total_cmp(&b.times))?;
        (self.detector.is_touched() || strongest.times > 1.0).then_some(strongest)
    }

    /// Strength S: what each change exceeds the threshold by, in standard deviations at rest. One that is NaN counts nothing.
    fn strength(&self, changes: &[f32]) -> f32 {
        let pairs = changes.iter().zip(&self.deviations);
        pairs.map(|(change, deviation)| (change.abs() / deviation - THRESHOLD).max(0.0)).sum()
    }

    fn is_grid(&self) -> bool {
        self.grid.iter().all(|it| *it > 1)
    }

    /// Change of each reading from the baseline, as the mean over it and its neighbours, as far as they can be believed.
    fn changes(&self, readings: &[f32]) -> Vec<f32> {
        let is_faulty = |it: f32| self.limits.is_some_and(|limits| limits.fault(it).is_some());
        let change = |(reading, rest): (&f32, &f32)| {
            if is_faulty(*reading) { f32::NAN } else { reading - rest }
        };
        let alone: Vec<f32> = readings.iter().zip(&self.baseline).map(change).collect();
        if !self.is_grid() {
            return alone;
        }
        let [rows, columns] = self.grid;
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let averaged = |cell: usize| {
            let cells = around(cell / columns, rows)
                .flat_map(|row| around(cell % columns, columns).map(move |it| row * columns + it));
            let known = cells.clone().map(|it| alone[it]).filter(|it| it.is_finite());
            // A mean over fewer has more noise: it is given the weight that keeps its deviation.
            let weight = ((cells.count() * known.clone().count()) as f32).sqrt();
            if alone[cell].is_finite() { known.sum::<f32>() / weight } else { f32::NAN }
        };
        (0..alone.len()).map(averaged).collect()
    }
}

/// What shows that `frames` are not steady: the touch that frames of either half, or their mean, are beside the other half.
pub fn unsteady(layout: &Layout, limits: Limits, frames: &[Vec<f32>]) -> Option<Seen> {
    let (first, second) = frames.split_at(frames.len() / 2);
    let seen = |rest: &[Vec<f32>], others: &[Vec<f32>]| {
        let touch = Touch::new(layout, limits, rest, None);
        // The difference of two means, with the noise of one frame.
        let gain = (first.len() as f32 / 2.0).sqrt();
        let pairs = touch.baseline.iter().zip(mean(others));
        let scaled = pairs.map(|(rest, other)| rest + gain * (other - rest)).collect();
        touch.look(&[others, &[scaled]].concat())
    };
    seen(first, second).or_else(|| seen(second, first))
}

/// Mean of each reading over `frames`, as far as it is known.
pub fn mean(frames: &[Vec<f32>]) -> Vec<f32> {
    let mean = |reading: usize| {
        let values = frames.iter().map(|frame| frame[reading]).filter(|it| it.is_finite());
        values.clone().sum::<f32>() / values.count() as f32
    };
    (0..frames.first().map_or(0, Vec::len)).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use taxel_data::Stream;
    use taxel_simulate::outputs::{ContactOutput, Outputs};
    use taxel_simulate::path::Path;
    use taxel_simulate::timetable::Timetable;
    use taxel_simulate::{Synthesis, World};

    use super::super::sheet;
    use super::super::simulation::SLOW;
    use super::*;
    use crate::experiment::Experiment;

    /// A scene's world, of which only the force is asked, and its detector.
    fn start(scene: &str) -> (World, Touch) {
        let world = Experiment::load(scene).unwrap().world;
        let world = World { outputs: Outputs::Contact(vec![ContactOutput::Force]), ..world };
        let touch = Touch::new(
            &layout(&world),
            Limits::USUAL,
            &at_rest(&world, Stream::Training, 64),
            None,
        );
        (world, touch)
    }

    fn layout(world: &World) -> Layout {
        let names = world.reading_names();
        let readings = sheet::columns(names.iter().map(String::as_str), []);
        sheet::layout("", readings, vec![], Some(&world.sensor))
    }

    fn at_rest(world: &World, stream: Stream, count: usize) -> Vec<Vec<f32>> {
        let frames = Synthesis::new(world).untouched().frames(stream, count);
        frames.inputs.lines().map(|line| line.iter().map(|it| *it as f32).collect()).collect()
    }

    /// Readings and true force in N of presses for so many times 12 s, 100 times a second.
    fn pressed(world: &World, times: usize) -> Vec<(Vec<f32>, f64)> {
        let starts_s = (0..1200).map(|it| f64::from(it) / 100.0).collect();
        let path = Path { duration_s: 12.0, ..world.path.unwrap_or(SLOW) };
        let synthesis = Synthesis::new(world).along(path, Timetable::instants(starts_s));
        let frames = synthesis.frames(Stream::Test, times * synthesis.steps());
        let floats = |line: &[f64]| line.iter().map(|it| *it as f32).collect();
        let forces = frames.outputs.lines().map(|line| line[0]);
        frames.inputs.lines().map(floats).zip(forces).collect()
    }

    #[test]
    fn presses_are_told_as_far_as_noise_allows_and_rest_is_not() {
        // Least shares of frames above 0.5 N and above 2 N that are told, in %. A decoder that knew the touch beforehand would
        // tell 93 % above 0.5 N, by one frame.
        for (scene, least) in [
            ("press", [85.0, 98.0]),
            ("moving", [85.0, 98.0]),
            ("../scenes/mat.toml", [80.0, 98.5]),
        ] {
            let (world, mut touch) = start(scene);
            let (mut told, mut all) = ([0.0; 2], [0.0; 2]);
            for ((readings, force_n), frame) in pressed(&world, 6).iter().zip(0..) {
                let is_touched = touch.update(readings, frame * 10_000);
                for level in (0..2).filter(|level| *force_n > [0.5, 2.0][*level]) {
                    all[level] += 1.0;
                    told[level] += f64::from(is_touched);
                }
            }
            let shares = [0, 1].map(|level| 100.0 * told[level] / all[level]);
            assert!(
                shares.iter().zip(least).all(|(share, least)| *share > least),
                "{scene}: {shares:?}"
            );
            let (_, mut touch) = start(scene);
            let rest = at_rest(&world, Stream::Test, 10_000);
            let is_told =
                |(readings, frame): (&Vec<f32>, u64)| touch.update(readings, frame * 10_000);
            let false_alarms = rest.iter().zip(0..).map(is_told).filter(|it| *it).count();
            assert!(false_alarms <= 1, "{scene}: {false_alarms} of 10000");
        }
    }

    #[test]
    fn a_load_is_seen_among_the_newest_frames_and_rest_is_not() {
        let (world, touch) = start("contact");
        let frames = pressed(&world, 12);
        let loaded = |it: &&[(Vec<f32>, f64)]| it.iter().all(|it| it.1 > 3.0) && it[0].1 < 4.7;
        let loads: Vec<_> = frames.chunks(24).filter(loaded).collect();
        assert!(loads.len() >= 20, "{}", loads.len());
        for load in loads {
            let load: Vec<Vec<f32>> = load.iter().map(|it| it.0.clone()).collect();
            assert!(touch.look(&load).is_some_and(|seen| seen.times > 1.0));
        }
        let (layout, rest) = (layout(&world), at_rest(&world, Stream::Test, 200 * 24));
        assert!(rest.chunks(24).all(|rest| touch.look(rest).is_none()));
        let unsteady =
            rest.chunks(24).filter(|rest| unsteady(&layout, Limits::USUAL, rest).is_some()).count();
        assert!(unsteady <= 10, "{unsteady} of 200 at rest");
    }

    #[test]
    fn drift_is_followed_and_a_broken_wire_touches_nothing() {
        let (world, mut touch) = start("contact");
        for (mut readings, frame) in at_rest(&world, Stream::Test, 6000).into_iter().zip(0..) {
            // 0.6 % in a minute, more than a deviation of a reading.
            readings.iter_mut().for_each(|it| *it *= 1.0 + 1e-6 * frame as f32);
            if frame > 3000 {
                readings[18..36].fill(1e6);
            }
            assert!(!touch.update(&readings, frame * 10_000), "frame {frame}");
        }
    }

    #[test]
    fn means_beside_a_broken_wire_have_the_noise_of_those_at_rest() {
        let (world, touch) = start("contact");
        let frames = at_rest(&world, Stream::Test, 2000).into_iter().map(|mut readings| {
            readings[18..36].fill(1e6);
            touch.changes(&readings)
        });
        let scaled = frames.flat_map(|changes| {
            let beside: Vec<f32> =
                (0..18).map(|cell| changes[cell] / touch.deviations[cell]).collect();
            beside
        });
        let squares: Vec<f32> = scaled.map(|it| it * it).collect();
        let variance = squares.iter().sum::<f32>() / squares.len() as f32;
        assert!((0.85..1.2).contains(&variance), "{variance}");
    }
}

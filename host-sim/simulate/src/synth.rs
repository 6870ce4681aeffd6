//! Synthesis: frames of a world, seeded, the same on any number of threads.

use std::borrow::Cow;

use rayon::prelude::*;
use taxel_data::{Dataset, LANES, Purpose, Stream, Table};
use taxel_firmware::link::message::Configuration;

use crate::drift::Drift;
use crate::motion::{self, Independent};
use crate::noise::{Noise, NoiseKind};
use crate::outputs::Outputs;
use crate::path::Path;
use crate::timetable::Timetable;
use crate::world::World;

mod lanes;

use lanes::LaneSynthesis;

/// Number of frames of the untouched sensor whose mean is a baseline, unless a user says otherwise.
pub const BASELINE_FRAMES: usize = 100;
/// Number of frames that measure a channel's maximum and minimum over the world, for `span` noise.
pub const SPAN_FRAMES: usize = 4096;

/// Synthesis of frames of a world, with some of its settings replaced.
#[derive(Debug, Clone)]
pub struct Synthesis<'w> {
    world: &'w World,
    noise: Noise,
    /// Purpose of the draws of noise.
    noise_purpose: Purpose,
    drift: Option<Drift>,
    motion: Cow<'w, motion::Kind>,
    path: Option<Path>,
    /// When each scan of a trajectory reads.
    timetable: Timetable,
    read_rows: Cow<'w, [usize]>,
    outputs: Cow<'w, Outputs>,
}

/// Synthesises `frames` of `stream`: noisy readings in Ω and true outputs, of the rows and axes that
/// `world` asks for.
pub fn synthesise(world: &World, stream: Stream, frames: usize) -> Dataset {
    Synthesis::new(world).frames(stream, frames)
}

impl<'w> Synthesis<'w> {
    /// Synthesis with all settings of `world`.
    pub fn new(world: &'w World) -> Self {
        Self {
            world,
            noise: world.noise,
            noise_purpose: Purpose::Noise,
            drift: world.drift,
            motion: Cow::Borrowed(&world.motion),
            path: None,
            timetable: Timetable::still(),
            read_rows: Cow::Borrowed(&world.read_rows),
            outputs: Cow::Borrowed(&world.outputs),
        }
    }

    /// World whose frames are synthesised.
    pub fn world(&self) -> &'w World {
        self.world
    }

    /// Replaces the level of the white noise, a fraction (0.005 is 0.5 %).
    #[must_use]
    pub fn noise_level(self, level: f64) -> Self {
        let noise = self.noise.with_level(level);
        self.noise(noise)
    }

    /// Replaces the noise.
    #[must_use]
    pub fn noise(mut self, noise: Noise) -> Self {
        self.noise = noise;
        self
    }

    /// Leaves out the noise on readings.
    #[must_use]
    pub fn ideal(self) -> Self {
        let kind = self.noise.kind;
        self.noise(Noise::white(kind, 0.0))
    }

    /// Replaces the drift of the gain; `None` for no drift.
    #[must_use]
    pub fn drift(mut self, drift: Option<Drift>) -> Self {
        self.drift = drift;
        self
    }

    /// Scans trajectories at these times, one frame a scan, instead of still frames. Noise is that of single scans.
    #[must_use]
    pub fn timed(mut self, timetable: Timetable) -> Self {
        self.timetable = timetable;
        self
    }

    /// Moves contacts along this path, and scans them at these times.
    #[must_use]
    pub fn along(mut self, path: Path, timetable: Timetable) -> Self {
        self.path = Some(path);
        self.timed(timetable)
    }

    /// Replaces what is pressed into the sensor, but not the span of noise, which stays that of the world.
    #[must_use]
    pub fn moved_by(mut self, motion: &'w motion::Kind) -> Self {
        self.motion = Cow::Borrowed(motion);
        self
    }

    /// Leaves the sensor untouched: nothing moves.
    #[must_use]
    pub fn untouched(mut self) -> Self {
        self.path = None;
        self.motion = Cow::Owned(Independent::default().into());
        self
    }

    /// Replaces the outputs.
    #[must_use]
    pub fn outputs(mut self, outputs: Outputs) -> Self {
        self.outputs = Cow::Owned(outputs);
        self
    }

    /// Number of frames of a trajectory.
    pub fn steps(&self) -> usize {
        self.timetable.scans()
    }

    /// Synthesises the first `frames` of `stream`: readings in Ω, and their true outputs.
    ///
    /// Frame n is the same however many frames are asked for. It is scan n mod S of trajectory n div S, where S is the
    /// number of [`steps`](Self::steps). Outputs of a row are those at the time when the row is read; those of a contact
    /// are from the middle of the scan.
    pub fn frames(&self, stream: Stream, frames: usize) -> Dataset {
        self.frames_from(stream, 0, frames)
    }

    /// Synthesises `frames` of `stream` from trajectory number `first` on, as [`frames`](Self::frames) does.
    pub fn frames_from(&self, stream: Stream, first: usize, frames: usize) -> Dataset {
        let sensor = &self.world.sensor;
        let mut dataset = Dataset::empty(
            sensor.reading_names(&self.read_rows),
            self.outputs.names(sensor, &self.read_rows),
            self.outputs.row_tables(self.read_rows.len()),
            frames,
        );
        let (n, o) = (dataset.inputs.names.len(), dataset.outputs.names.len());
        let of_lanes = LANES * self.steps();
        let synthesis = LaneSynthesis::new(self, stream, self.noise_unit_ohm());
        let readings = dataset.inputs.values.par_chunks_mut(of_lanes * n);
        let pieces = readings.zip(dataset.outputs.values.par_chunks_mut(of_lanes * o)).enumerate();
        pieces.for_each_init(
            || synthesis.workspace(),
            |workspace, (piece, (readings, outputs))| {
                synthesis.fill(workspace, first + piece * LANES, readings, outputs);
            },
        );
        dataset
    }

    /// Synthesises the true outputs of the first `frames` of `stream` alone, as [`frames`](Self::frames) does.
    pub fn true_outputs(&self, stream: Stream, frames: usize) -> Table {
        let sensor = &self.world.sensor;
        let names = self.outputs.names(sensor, &self.read_rows);
        let mut values = vec![0.0; names.len() * frames];
        let pieces = values.par_chunks_mut(LANES * self.steps() * names.len()).enumerate();
        let synthesis = LaneSynthesis::new(self, stream, Vec::new());
        pieces.for_each_init(
            || synthesis.workspace(),
            |workspace, (piece, outputs)| {
                synthesis.fill(workspace, piece * LANES, &mut [], outputs);
            },
        );
        Table { names, values: values.into() }
    }

    /// Synthesises the baseline of the session that each of the first `frames` of `stream` belongs to: one line a
    /// frame, in Ω. A session is a trajectory.
    ///
    /// A baseline is what a user captures before the session: the mean of so many `averaged` frames of the untouched
    /// sensor. It has the session's drift, and what averaging [leaves](Noise::averaged) of the noise, with draws of its
    /// own. Frames follow one another as scans do, or as a board scans until it is configured.
    pub fn baselines(&self, stream: Stream, frames: usize, averaged: usize) -> Table {
        self.baselines_from(stream, 0, frames, averaged)
    }

    /// Synthesises the baselines of `frames` of `stream` from trajectory number `first` on, as
    /// [`baselines`](Self::baselines) does.
    pub fn baselines_from(
        &self,
        stream: Stream,
        first: usize,
        frames: usize,
        averaged: usize,
    ) -> Table {
        let steps = self.steps();
        let mut at_rest = self.clone().untouched().timed(Timetable::still());
        let spacing_s = match steps {
            1 => f64::from(Configuration::DEFAULT.frame_period_us) * 1e-6,
            _ => self.timetable.since_last_s(1),
        };
        at_rest.noise = at_rest.noise.averaged(averaged, spacing_s);
        at_rest.noise_purpose = Purpose::Baseline;
        let sessions = at_rest.frames_from(stream, first, frames.div_ceil(steps)).inputs;
        if steps == 1 {
            return sessions;
        }
        let of_frame = |frame: usize| sessions.lines().nth(frame / steps).unwrap_or_default();
        let values = (0..frames).flat_map(|frame| of_frame(frame).iter().copied()).collect();
        Table { names: sessions.names, values }
    }

    /// Synthesises the readings in Ω of one still `frame` of `stream`.
    pub fn readings_of(&self, stream: Stream, frame: usize) -> Vec<f64> {
        let sensor = &self.world.sensor;
        let mut readings = vec![0.0; self.read_rows.len() * sensor.column_wires];
        let mut outputs = vec![0.0; self.outputs.count(sensor, self.read_rows.len())];
        let synthesis = LaneSynthesis::new(self, stream, self.noise_unit_ohm());
        synthesis.fill(&mut synthesis.workspace(), frame, &mut readings, &mut outputs);
        readings
    }

    /// What the level of noise is a multiple of in every channel, in Ω: its span over the world, or 1 Ω for absolute
    /// noise. Empty for noise relative to the reading, and without noise.
    pub fn noise_unit_ohm(&self) -> Vec<f64> {
        match self.noise.kind {
            NoiseKind::Span if !self.noise.is_none() => {}
            NoiseKind::Absolute => {
                return vec![1.0; self.read_rows.len() * self.world.sensor.column_wires];
            }
            _ => return Vec::new(),
        }
        let motion = Cow::Borrowed(&self.world.motion);
        let moved = Self { motion, path: None, drift: None, ..self.clone() };
        let moved = moved.timed(Timetable::still());
        let ideal = moved.ideal().frames(Stream::Span, SPAN_FRAMES);
        ideal.inputs.ranges().into_iter().map(|[low, high]| high - low).collect()
    }
}

//! Synthesis: frames of a world, seeded, the same on any number of threads.

use std::borrow::Cow;

use rayon::prelude::*;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_data::simd::LANES;

use crate::motion;
use crate::noise::{Noise, NoiseKind};
use crate::outputs::Outputs;
use crate::world::World;

mod lanes;

use lanes::LaneSynthesis;

/// Number of frames that measure a channel's maximum and minimum over the world, for `span` noise.
const SPAN_FRAMES: usize = 4096;

/// Synthesis of frames of a world, with some of its settings replaced.
#[derive(Debug, Clone)]
pub struct Synthesis<'w> {
    world: &'w World,
    noise: Noise,
    motion: Cow<'w, motion::Kind>,
    read_rows: Cow<'w, [usize]>,
    outputs: Cow<'w, Outputs>,
}

/// Synthesises `frames` of `stream`: noisy readings in Ω and true outputs, of the rows and axes that
/// `world` asks for.
#[must_use]
pub fn synthesise(world: &World, stream: Stream, frames: usize) -> Dataset {
    Synthesis::of(world).frames(stream, frames)
}

impl<'w> Synthesis<'w> {
    /// Synthesis with all settings of `world`.
    #[must_use]
    pub fn of(world: &'w World) -> Self {
        Self {
            world,
            noise: world.noise,
            motion: Cow::Borrowed(&world.motion),
            read_rows: Cow::Borrowed(&world.read_rows),
            outputs: Cow::Borrowed(&world.outputs),
        }
    }

    /// Replaces the noise level, a fraction (0.005 is 0.5 %).
    #[must_use]
    pub fn noise_level(mut self, level: f64) -> Self {
        self.noise.level = level;
        self
    }

    /// Leaves out the noise on readings.
    #[must_use]
    pub fn ideal(self) -> Self {
        self.noise_level(0.0)
    }

    /// Replaces the motion of the electrodes.
    #[must_use]
    pub fn motion(mut self, motion: impl Into<motion::Kind>) -> Self {
        self.motion = Cow::Owned(motion.into());
        self
    }

    /// Synthesises readings and outputs of all row-wires, whichever the world reads.
    #[must_use]
    pub fn all_rows(mut self) -> Self {
        self.read_rows = Cow::Owned((0..self.world.sensor.row_wires).collect());
        self
    }

    /// Replaces the outputs.
    #[must_use]
    pub fn outputs(mut self, outputs: Outputs) -> Self {
        self.outputs = Cow::Owned(outputs);
        self
    }

    /// Synthesises the first `frames` of `stream`: readings in Ω, and their true outputs.
    ///
    /// Frame n is the same however many frames are asked for. It is step n mod S of trajectory n div S,
    /// where S is the motion's number of steps.
    #[must_use]
    pub fn frames(&self, stream: Stream, frames: usize) -> Dataset {
        let sensor = &self.world.sensor;
        let mut dataset = Dataset::empty(
            sensor.reading_names(&self.read_rows),
            self.outputs.names(sensor, &self.read_rows),
            self.read_rows.len(),
            frames,
        );
        let (n, o) = (dataset.inputs.names.len(), dataset.outputs.names.len());
        let of_lanes = LANES * self.motion.steps();
        let synthesis = LaneSynthesis::new(self, stream, self.noise_span_ohm());
        let readings = dataset.inputs.values.par_chunks_mut(of_lanes * n);
        let pieces = readings.zip(dataset.outputs.values.par_chunks_mut(of_lanes * o)).enumerate();
        pieces.for_each_init(
            || synthesis.workspace(),
            |workspace, (piece, (readings, outputs))| {
                synthesis.fill(workspace, piece * LANES, readings, outputs);
            },
        );
        dataset
    }

    /// Synthesises the readings in Ω of one `frame` of `stream`, for motions whose trajectories have one
    /// step.
    #[must_use]
    pub fn readings_of(&self, stream: Stream, frame: usize) -> Vec<f64> {
        let sensor = &self.world.sensor;
        let mut readings = vec![0.0; self.read_rows.len() * sensor.column_wires];
        let mut outputs = vec![0.0; self.outputs.names(sensor, &self.read_rows).len()];
        let synthesis = LaneSynthesis::new(self, stream, self.noise_span_ohm());
        synthesis.fill(&mut synthesis.workspace(), frame, &mut readings, &mut outputs);
        readings
    }

    /// Span in Ω of every channel over the world, if its noise is relative to the span; otherwise empty.
    fn noise_span_ohm(&self) -> Vec<f64> {
        if self.noise.kind == NoiseKind::Relative || self.noise.level == 0.0 {
            return Vec::new();
        }
        let ideal = self.clone().ideal().frames(Stream::Span, SPAN_FRAMES);
        ideal.inputs.ranges().into_iter().map(|[low, high]| high - low).collect()
    }
}

#[cfg(test)]
mod tests;

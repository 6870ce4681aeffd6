//! Interface of decoders: whatever turns frames of readings into estimates.
//!
//! Configuration (the decoder itself, immutable) is kept apart from state (what a filter remembers
//! between the frames of a trajectory), like in idsp's `SplitProcess`. A new kind of decoder implements
//! [`FrameDecoder`]; every [`FrameDecoder`] is a [`Decoder`], of which programs hold lists. Both take [`Frames`], which
//! tell when each reading was taken if that is known.

use crate::parallel;

/// Estimates of a number of frames, frame after frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Estimates {
    /// Outputs in their units, `frames × outputs`; NaN where nothing could be decoded.
    pub values: Vec<f64>,
    /// Standard deviation of each value, in its unit, `frames × outputs`; only from decoders that
    /// compute it.
    pub deviation: Option<Vec<f64>>,
    /// Novelty of each frame in nats, only from decoders that compute it: above 0, it is unlike the frames of training.
    pub novelty: Option<Vec<f64>>,
}

impl Estimates {
    /// Estimates without standard deviations and novelty.
    pub fn of_values(values: Vec<f64>) -> Self {
        Self { values, deviation: None, novelty: None }
    }

    /// Appends the estimates of the following frames. Deviations or novelty that only one of the two has
    /// are dropped.
    fn append(&mut self, next: Self) {
        let join = |all: &mut Option<Vec<f64>>, next: Option<Vec<f64>>| match (all.as_mut(), next) {
            (Some(all), Some(next)) => all.extend(next),
            _ => *all = None,
        };
        self.values.extend(next.values);
        join(&mut self.deviation, next.deviation);
        join(&mut self.novelty, next.novelty);
    }
}

/// Frames of readings, and when they were taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames<'a> {
    /// Readings, `frames × inputs`, frame after frame, in Ω (or the data's unit).
    pub readings: &'a [f64],
    /// Times of the frames; `None` if they are not known.
    pub timing: Option<Timing<'a>>,
}

/// Times of frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing<'a> {
    /// Start of each frame in µs, by a clock that goes on through a trajectory.
    pub start_us: &'a [u64],
    /// Time in µs from the start of a frame until each of its readings is taken, the same in every frame; none at all
    /// if it is not known. Readings of a row are one after the other on some boards, and at once on others.
    pub reading_offset_us: &'a [f64],
}

impl<'a> Frames<'a> {
    /// Frames whose times are not known.
    pub fn untimed(readings: &'a [f64]) -> Self {
        Self { readings, timing: None }
    }

    /// Trajectory number `index` of these frames, of `steps` frames of so many `inputs`; the last one may have fewer.
    fn trajectory(self, index: usize, steps: usize, inputs: usize) -> Self {
        let timing = self.timing.map(|Timing { start_us, reading_offset_us }| Timing {
            start_us: parallel::piece(start_us, steps, index),
            reading_offset_us,
        });
        Self { readings: parallel::piece(self.readings, steps * inputs, index), timing }
    }
}

/// Decoder of frames, with its configuration in `self` and its memory in a state.
pub trait FrameDecoder: Sync {
    /// Memory between the frames of a trajectory; its default is the start of one. `()` for no memory.
    type State: Default;

    /// Name of the decoder in tables and results.
    fn name(&self) -> &str;

    /// Number of readings in a frame.
    fn inputs(&self) -> usize;

    /// Decodes consecutive frames of one trajectory. A decoder without memory is given frames of any number of
    /// trajectories at once.
    fn decode(&self, state: &mut Self::State, frames: Frames<'_>) -> Estimates;
}

/// Decoder of any kind, for lists of decoders.
pub trait Decoder: Sync {
    /// Name of the decoder in tables and results.
    fn name(&self) -> &str;

    /// Decodes all of `frames`, in trajectories of `steps` frames each.
    ///
    /// # Panics
    /// If there are times, and not one for each frame.
    fn decode_frames(&self, frames: Frames<'_>, steps: usize) -> Estimates;

    /// Decodes all of `readings` (`frames × inputs`, in the data's unit), whose times are not known, in trajectories of
    /// `steps` frames each.
    fn decode_all(&self, readings: &[f64], steps: usize) -> Estimates {
        self.decode_frames(Frames::untimed(readings), steps)
    }
}

impl<D: FrameDecoder> Decoder for D {
    fn name(&self) -> &str {
        FrameDecoder::name(self)
    }

    fn decode_frames(&self, frames: Frames<'_>, steps: usize) -> Estimates {
        let (inputs, steps) = (self.inputs().max(1), steps.max(1));
        if let Some(Timing { start_us, .. }) = frames.timing {
            assert_eq!(start_us.len(), frames.readings.len() / inputs, "a time for each frame");
        }
        if size_of::<D::State>() == 0 {
            return self.decode(&mut D::State::default(), frames);
        }
        let decode =
            |index| self.decode(&mut D::State::default(), frames.trajectory(index, steps, inputs));
        let trajectories = frames.readings.len().div_ceil(steps * inputs);
        let mut decoded = parallel::map(trajectories, &decode).into_iter();
        let mut all = decoded.next().unwrap_or_default();
        decoded.for_each(|next| all.append(next));
        all
    }
}

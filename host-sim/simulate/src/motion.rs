//! How electrodes are moved: one file a kind of motion, each an implementation of [`Motion`].
//!
//! A lane of the synthesis is a *trajectory* of [`Motion::steps`] steps, and a frame is read at each step.
//! Today's kinds draw every frame on its own: their trajectories have one step.

use std::fmt::Debug;

use taxel_data::BadValue;
use taxel_data::random::{Purpose, RandomLanes, Stream};
use taxel_data::simd::Lanes;

use crate::kinds::kinds;
use crate::sensor::Sensor;

mod independent;
mod press;

pub use independent::Independent;
pub use press::Press;

/// A way in which electrodes move, drawn at random for every trajectory.
pub trait Motion: Debug + Send + Sync {
    /// Extreme deformation of any electrode along each axis, in mm: `[axis][low, high]`.
    fn range_mm(&self) -> [[f64; 2]; 3];

    /// Checks the motion's settings.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    fn check(&self) -> Result<(), BadValue>;

    /// Frames of a trajectory.
    fn steps(&self) -> usize {
        1
    }

    /// Time between two steps, in s; nothing depends on it where trajectories have one step.
    fn step_s(&self) -> f64 {
        0.0
    }

    /// Draws what [`LANES`](taxel_data::simd::LANES) trajectories of `sensor` share over all rows and steps.
    fn start<'m>(&'m self, sensor: &'m Sensor, draws: &mut Draws) -> Box<dyn Trajectories + 'm>;
}

/// Trajectories that have been drawn, one a lane.
pub trait Trajectories {
    /// Deformation in mm of the electrodes of row-wire `row` (from 0) at `step`, by electrode and axis.
    ///
    /// Steps come in ascending order; at each step, rows do too.
    fn deform(
        &mut self,
        row: usize,
        step: usize,
        draws: &mut Draws,
        deformation_mm: &mut [[Lanes; 3]],
    );
}

/// Random sources of consecutive trajectories, one a lane.
#[derive(Debug, Clone)]
pub struct Draws {
    seed: u64,
    stream: Stream,
    lanes: RandomLanes,
}

impl Draws {
    /// Sources of `stream` for the trajectories from number `first` on.
    #[must_use]
    pub fn new(seed: u64, stream: Stream, first: usize) -> Self {
        Self { seed, stream, lanes: RandomLanes::new(first) }
    }

    /// The sources for `purpose` and `part` (say a row), at their beginning.
    #[inline(always)]
    pub fn of(&mut self, purpose: Purpose, part: u64) -> &mut RandomLanes {
        self.lanes.start(self.seed, self.stream, purpose, part);
        &mut self.lanes
    }
}

kinds! {
    /// One of the kinds of motion that a scene can name.
    Motion: Independent, Press
}

/// Checks a uniform distribution's range.
fn check_range(field: &str, [low, high]: [f64; 2]) -> Result<(), BadValue> {
    if low.is_finite() && high.is_finite() && low <= high {
        return Ok(());
    }
    let value = format!("[{low}, {high}]");
    Err(BadValue::new(format!("deformation.{field}"), value, "give [low, high] with low ≤ high"))
}

//! The large part of an application's memory.

use taxel_core::filter::Track;
use taxel_core::track;
use taxel_core::{Estimate, RowStatus};

/// The buffers of an application with room for `ROWS` rows of `COLUMNS` readings and `OUTPUTS` outputs. They are all
/// zero at first, so that a static of them costs no flash, and nothing is moved over the stack.
///
/// `BYTES` is the length of the longest message ([`Capacity::message_bytes`](crate::capacity::Capacity)).
pub struct Buffers<
    const ROWS: usize,
    const COLUMNS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> {
    pub(super) received: [u8; BYTES],
    pub(super) message: [u8; BYTES],
    pub(super) frame: [[f32; COLUMNS]; ROWS],
    /// The readings of a frame before any is filled.
    pub(super) measured: [[f32; COLUMNS]; ROWS],
    /// Place of each reading of the model in a scan.
    pub(super) places: [[u16; COLUMNS]; ROWS],
    pub(super) baseline: [[f32; COLUMNS]; ROWS],
    /// One over each reading of the baseline.
    pub(super) reciprocals: [[f32; COLUMNS]; ROWS],
    /// Working space of a decoder ([`Capacity::scratch_floats`](crate::capacity::Capacity::scratch_floats)).
    pub(super) scratch: [[[f32; COLUMNS]; ROWS]; 2],
    pub(super) estimate: Outcome<ROWS, OUTPUTS>,
    /// State of the filter in time.
    pub(super) tracks: [[Track; OUTPUTS]; ROWS],
    /// State of the tracker of a contact.
    pub(super) contact: track::State,
    /// Standard deviations of the outputs.
    pub(super) deviations: [[f32; OUTPUTS]; ROWS],
}

/// Outputs of all rows, and their status.
pub(super) struct Outcome<const ROWS: usize, const OUTPUTS: usize> {
    outputs: [[f32; OUTPUTS]; ROWS],
    status: [RowStatus; ROWS],
}

impl<const ROWS: usize, const OUTPUTS: usize> Outcome<ROWS, OUTPUTS> {
    const NOTHING: Self =
        Self { outputs: [[0.0; OUTPUTS]; ROWS], status: [RowStatus::Decoded; ROWS] };

    pub fn whole(&mut self) -> Estimate<'_> {
        Estimate { outputs: self.outputs.as_flattened_mut(), status: &mut self.status }
    }
}

impl<const ROWS: usize, const COLUMNS: usize, const OUTPUTS: usize, const BYTES: usize> Default
    for Buffers<ROWS, COLUMNS, OUTPUTS, BYTES>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const ROWS: usize, const COLUMNS: usize, const OUTPUTS: usize, const BYTES: usize>
    Buffers<ROWS, COLUMNS, OUTPUTS, BYTES>
{
    /// Makes empty buffers.
    pub const fn new() -> Self {
        const {
            let capacity = Self::CAPACITY;
            assert!(BYTES >= capacity.message_bytes(), "the longest message must fit");
            assert!(ROWS >= 2 && ROWS <= 255 && OUTPUTS >= 1 && OUTPUTS <= 255);
            assert!(COLUMNS >= 1 && COLUMNS <= taxel_core::health::MOST_COLUMNS);
        }
        Self {
            received: [0; BYTES],
            message: [0; BYTES],
            frame: [[0.0; COLUMNS]; ROWS],
            measured: [[0.0; COLUMNS]; ROWS],
            places: [[0; COLUMNS]; ROWS],
            baseline: [[0.0; COLUMNS]; ROWS],
            reciprocals: [[0.0; COLUMNS]; ROWS],
            scratch: [[[0.0; COLUMNS]; ROWS]; 2],
            estimate: Outcome::NOTHING,
            tracks: [[[0.0; 2]; OUTPUTS]; _],
            contact: track::State::new(),
            deviations: [[0.0; OUTPUTS]; _],
        }
    }

    /// Sensor and model that these buffers have room for.
    pub const CAPACITY: crate::capacity::Capacity =
        crate::capacity::Capacity { rows: ROWS, columns: COLUMNS, outputs: OUTPUTS };
}

/// The part of an estimate's memory that the model in force uses.
pub fn cut<'e>(whole: &'e mut Estimate<'_>, rows: usize, outputs: usize) -> Estimate<'e> {
    Estimate {
        outputs: whole.outputs.get_mut(..outputs).unwrap_or_default(),
        status: whole.status.get_mut(..rows).unwrap_or_default(),
    }
}

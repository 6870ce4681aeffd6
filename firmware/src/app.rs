//! The application: scan → health → gate → decode → report, and the link, in one loop without waits.
//!
//! A board's program makes an [`App`] of its parts and calls [`App::run`], which returns only when the program
//! must restart. All large memory is in [`Buffers`], for which the program has a static: nothing grows, nothing
//! is allocated.

use model_core::{Estimate, RowWire, Wires};

use crate::capacity::Capacity;
use crate::link::message::{Configuration, Statistics};
use crate::link::receive::Receiver;
use crate::log::info;
use crate::platform::Platform;
use crate::readout::{Baseline, FrameSource};
use crate::store::{Slot, Upload};

// From the ground up: a module imports only what is declared before it.
mod buffers;
mod configuration;
mod frame_clock;
mod lease;
mod line;
mod session_end;
mod model;
mod saved_settings;
mod authenticity;
mod records;
mod recheck;
mod trial;
mod undo;
mod session;
mod answer;

use authenticity::Authenticity;
pub use buffers::Buffers;
use frame_clock::{FrameClock, LongClock};
use lease::Lease;
use line::Line;
pub use session::Session;
pub use session_end::SessionEnd;
use trial::Trial;

/// The application's state, except the model in force. `ROWS` is the largest number of rows.
pub struct App<'m, P, F, const ROWS: usize> {
    receiver: Receiver<&'m mut [u8]>,
    core: Core<'m, P, F, ROWS>,
}

/// The application without the receiver: a request borrows the receiver's bytes while it is answered.
struct Core<'m, P, F, const ROWS: usize> {
    line: Line<'m, P>,
    source: F,
    /// The configuration in force.
    configuration: Configuration,
    /// The device's own configuration, which is in force without a lease.
    own_configuration: Configuration,
    lease: Lease,
    statistics: Statistics,
    clock: FrameClock,
    time: LongClock,
    capacity: Capacity,
    /// Numbers of wires that are scanned: those of the model in force, else all.
    wires: Wires,
    /// Which row-wires these are.
    row_wires: [RowWire; ROWS],
    /// Rows of the model in force, and outputs of all of them; without a model, rows that are scanned and 0.
    rows: usize,
    outputs: usize,
    /// Room for the longest frame.
    frame: &'m mut [f32],
    /// One over each reading of the last complete baseline; NaN without one.
    reciprocals: &'m mut [f32],
    /// Whether at least one reading has a reciprocal, so that a model with relative inputs may decode.
    has_reciprocals: bool,
    /// Working space of a decoder.
    scratch: &'m mut [f32],
    estimate: Estimate<'m>,
    /// The baseline, decoded by the model in force; valid once a baseline is captured.
    rest: Estimate<'m>,
    /// Bits of the last frame's faulty readings, a word a row.
    faulty_columns: [u32; ROWS],
    baseline: Baseline<'m>,
    /// Whether the last scan gave at least one reading.
    sensor_answers: bool,
    capture: Option<Capture>,
    upload: Upload,
    trial: Trial,
    authenticity: Authenticity,
    /// Number of times that settings may still be written before the next restart.
    writes_left: u16,
    /// Standard deviations of the outputs, for a model with a confidence.
    deviations: &'m mut [f32],
}

/// A baseline that is being captured.
#[derive(Clone, Copy)]
struct Capture {
    /// Number of the request that waits for it.
    number: u16,
    /// Number of frames asked for.
    frames: u16,
    /// Number of frames still to be scanned.
    left: u16,
}

impl<'m, P: Platform, F: FrameSource, const ROWS: usize> App<'m, P, F, ROWS> {
    /// Makes an application. Its own configuration and constants are those that are kept, else `configuration` and the
    /// constants of `source`.
    pub fn new<const COLUMNS: usize, const OUTPUTS: usize, const BYTES: usize>(
        mut platform: P,
        source: F,
        configuration: Configuration,
        buffers: &'m mut Buffers<ROWS, COLUMNS, OUTPUTS, BYTES>,
    ) -> Self {
        let Buffers {
            received,
            message,
            frame,
            baseline,
            reciprocals,
            scratch,
            estimate,
            rest,
            deviations,
        } = buffers;
        let capacity = Buffers::<ROWS, COLUMNS, OUTPUTS, BYTES>::CAPACITY;
        let now_us = platform.now_us();
        let authenticity = Authenticity::new(platform.key_area());
        let mut core = Core {
            line: Line::new(platform, message),
            source,
            configuration,
            own_configuration: configuration,
            lease: Lease::NONE,
            statistics: Statistics::default(),
            clock: FrameClock::starting_at(now_us),
            time: LongClock::starting_at(now_us),
            capacity,
            wires: capacity.wires(),
            row_wires: core::array::from_fn(RowWire),
            rows: ROWS,
            outputs: 0,
            frame: frame.as_flattened_mut(),
            reciprocals: reciprocals.as_flattened_mut(),
            has_reciprocals: false,
            scratch: scratch.as_flattened_mut().as_flattened_mut(),
            estimate: estimate.whole(),
            rest: rest.whole(),
            faulty_columns: [0; ROWS],
            baseline: Baseline::new(baseline.as_flattened_mut()),
            sensor_answers: true,
            capture: None,
            upload: Upload::new(),
            trial: Trial::default(),
            authenticity,
            writes_left: saved_settings::MOST_WRITES,
            deviations: deviations.as_flattened_mut(),
        };
        core.load_settings();
        Self { receiver: Receiver::new(received), core }
    }

    /// Runs until the host asks for a restart. When another model comes into force, another session begins.
    ///
    /// A model that fits into `weights` is copied there from its slot, and decoded from there: on most boards RAM is
    /// faster than flash.
    /// It may be empty.
    pub fn run<S: Slot>(&mut self, slots: &mut [S; 2], weights: &mut [u32]) {
        loop {
            let mut session = Session::start(self, slots, weights);
            let end = loop {
                if let Some(end) = session.step() {
                    break end;
                }
            };
            if end == SessionEnd::Restart {
                return;
            }
            info!("another session begins");
        }
    }

    /// The board's platform, for tests that inspect it.
    pub fn platform(&mut self) -> &mut P {
        self.core.line.platform()
    }
}

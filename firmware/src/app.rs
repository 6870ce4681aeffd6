//! The application: scan → health → gate → decode → report, and the link, in one loop without waits.
//!
//! A board's program makes an [`App`] of its parts and calls [`App::run`], which returns only when the program
//! must restart. All large memory is in [`Buffers`], for which the program has a static: nothing grows, nothing
//! is allocated.

use model_core::{Decoder, Estimate, Frame, RowStatus};

use crate::link::message::{Configuration, Statistics};
use crate::link::receive::Receiver;
use crate::log::info;
use crate::platform::Platform;
use crate::readout::{Baseline, FrameSource};
use crate::store::{Slot, Upload, blob_in_slot, generation};

// From the ground up: a module imports only what is declared before it.
mod configuration;
mod frame_clock;
mod line;
mod session;
mod answer;

use frame_clock::FrameClock;
use line::Line;
pub use session::{Leave, Session};

/// Bytes of the longest message for the paper's sensor: 8 × 18 floats and the fields around them.
pub const PAPER_MESSAGE_BYTES: usize = 608;

/// The application for the paper's sensor.
pub type PaperApp<'m, P, F> = App<'m, P, F, 8, 18, 18, PAPER_MESSAGE_BYTES>;

/// The buffers for the paper's sensor.
pub type PaperBuffers = Buffers<8, 18, 18, PAPER_MESSAGE_BYTES>;

/// The large part of an application's memory. It is all zero at first, so that a static of it costs no flash, and
/// nothing is moved over the stack.
///
/// `BYTES` is the length of the longest message: `4 · ROWS · max(COLS, OUTPUTS) + ROWS + 24`, at least 128.
pub struct Buffers<const ROWS: usize, const COLS: usize, const OUTPUTS: usize, const BYTES: usize> {
    receiver: Receiver<BYTES>,
    message: [u8; BYTES],
    frame: Frame<ROWS, COLS>,
    estimate: Estimate<ROWS, OUTPUTS>,
    baseline: Baseline<ROWS, COLS>,
    rest: Estimate<ROWS, OUTPUTS>,
}

impl<const ROWS: usize, const COLS: usize, const OUTPUTS: usize, const BYTES: usize> Default
    for Buffers<ROWS, COLS, OUTPUTS, BYTES>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const ROWS: usize, const COLS: usize, const OUTPUTS: usize, const BYTES: usize>
    Buffers<ROWS, COLS, OUTPUTS, BYTES>
{
    /// Makes empty buffers.
    #[must_use]
    pub const fn new() -> Self {
        const {
            let widest = if COLS > OUTPUTS { COLS } else { OUTPUTS };
            assert!(BYTES >= 4 * ROWS * widest + ROWS + 24, "the longest message must fit");
            assert!(BYTES >= 128, "and so must an identity");
            assert!(ROWS > 0 && ROWS < 256 && COLS > 0 && OUTPUTS > 0 && OUTPUTS < 256);
        }
        let nothing =
            Estimate { outputs: [[0.0; OUTPUTS]; ROWS], status: [RowStatus::Decoded; ROWS] };
        Self {
            receiver: Receiver::new(),
            message: [0; BYTES],
            frame: Frame { row_column_resistance_ohm: [[0.0; COLS]; ROWS] },
            estimate: nothing,
            baseline: Baseline::new(),
            rest: nothing,
        }
    }
}

/// The application's state, except the model in force.
pub struct App<
    'm,
    P: Platform,
    F,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> {
    receiver: &'m mut Receiver<BYTES>,
    core: Core<'m, P, F, ROWS, COLS, OUTPUTS, BYTES>,
}

/// The application without the receiver: a request borrows the receiver's bytes while it is answered.
struct Core<
    'm,
    P,
    F,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> {
    line: Line<'m, P, BYTES>,
    source: F,
    configuration: Configuration,
    statistics: Statistics,
    clock: FrameClock,
    frame: &'m mut Frame<ROWS, COLS>,
    estimate: &'m mut Estimate<ROWS, OUTPUTS>,
    baseline: &'m mut Baseline<ROWS, COLS>,
    /// The baseline, decoded by the model in force; valid once a baseline is captured.
    rest: &'m mut Estimate<ROWS, OUTPUTS>,
    /// Whether the last scan gave at least one reading.
    sensor_answers: bool,
    /// Number of the request that waits for the baseline, and number of frames still to be scanned for it.
    capture: Option<(u16, u16)>,
    upload: Upload,
}

impl<
    'm,
    P: Platform,
    F: FrameSource<ROWS, COLS>,
    const ROWS: usize,
    const COLS: usize,
    const OUTPUTS: usize,
    const BYTES: usize,
> App<'m, P, F, ROWS, COLS, OUTPUTS, BYTES>
{
    /// Makes an application that starts with `configuration`.
    pub fn new(
        mut platform: P,
        source: F,
        configuration: Configuration,
        buffers: &'m mut Buffers<ROWS, COLS, OUTPUTS, BYTES>,
    ) -> Self {
        let Buffers { receiver, message, frame, estimate, baseline, rest } = buffers;
        let clock = FrameClock::starting_at(platform.now_us());
        let core = Core {
            line: Line::new(platform, message),
            source,
            configuration,
            statistics: Statistics::default(),
            clock,
            frame,
            estimate,
            baseline,
            rest,
            sensor_answers: true,
            capture: None,
            upload: Upload::new(),
        };
        Self { receiver, core }
    }

    /// Runs until the host asks for a restart. When another model is committed, it replaces the one in force.
    pub fn run<S: Slot>(&mut self, slots: &mut [S; 2]) {
        loop {
            let mut session = Session::start(self, slots);
            let leave = loop {
                if let Some(leave) = session.step() {
                    break leave;
                }
            };
            match leave {
                Leave::NewModel => info!("model exchanged"),
                Leave::Restart => return,
            }
        }
    }

    /// The board's platform, for tests that inspect it.
    pub fn platform(&mut self) -> &mut P {
        self.core.line.platform()
    }

    /// Number and generation of the most recent slot whose model is sound.
    fn choose<S: Slot>(slots: &[S; 2]) -> Option<(usize, u32)> {
        let [a, b] = slots.each_ref().map(Slot::bytes);
        let mut candidates = [(0, generation(0, a), a), (1, generation(1, b), b)];
        if candidates[1].1 > candidates[0].1 {
            candidates.swap(0, 1);
        }
        candidates.into_iter().find_map(|(index, generation, bytes)| {
            let sound = Decoder::<ROWS, COLS, OUTPUTS>::check(blob_in_slot(bytes)).is_ok();
            generation.filter(|_| sound).map(|generation| (index, generation))
        })
    }
}

//! An application on its board.

use taxel_firmware::app::{App, Buffers, Session};
use taxel_firmware::link::message::{Configuration, UploadStep};
use taxel_firmware::store::Journal;

use super::board::Board;
use super::flash::Flash;
use super::host::{Answer, Host, trial_steps};
use super::shape::{COLS, MESSAGE_BYTES, OUTPUTS, ROWS};
use super::source::Source;

/// Memory of an application.
pub type Memory = Buffers<ROWS, COLS, OUTPUTS, MESSAGE_BYTES>;

/// An application on the mock board.
pub type TestApp<'m> = App<'m, Board, Source, ROWS>;

/// A configuration that scans only on request.
pub fn quiet() -> Configuration {
    Configuration { frame_period_us: 0, ..Configuration::DEFAULT }
}

/// A configuration that scans at this period.
pub fn every(frame_period_us: u32) -> Configuration {
    Configuration { frame_period_us, ..quiet() }
}

/// An application, its flash, and the host's ends of everything it is connected to.
pub struct Bench<'m> {
    pub app: TestApp<'m>,
    pub board: Board,
    pub slots: [Flash; 2],
    /// Memory for a copy of the model.
    pub weights: Vec<u32>,
}

/// A host of a new board with `blob` in its first slot, which is never freed.
pub fn started(configuration: Configuration, blob: &[u8]) -> Host<'static, 'static> {
    Box::leak(Box::new(Bench::new(configuration, blob))).session()
}

impl Bench<'static> {
    /// An application on a new board with `blob` in its first slot, without memory for a copy. Its memory, half a kilobyte, is
    /// never freed: whoever makes many uses [`Bench::on`].
    pub fn new(configuration: Configuration, blob: &[u8]) -> Self {
        let (board, memory) = (Board::new(Flash::journal()), Box::leak(Box::new(Memory::new())));
        Self::on(board, Flash::slots_with(blob), memory, configuration)
    }
}

impl<'m> Bench<'m> {
    /// An application on this board and these slots in this `memory`, which is cleared: what a restart leaves. The memory can
    /// be used again when the bench is dropped.
    pub fn on(
        board: Board,
        slots: [Flash; 2],
        memory: &'m mut Memory,
        configuration: Configuration,
    ) -> Self {
        *memory = Memory::new();
        let source = Source::new(&board);
        let app = App::new(board.clone(), source, configuration, memory);
        Self { app, board, slots, weights: Vec::new() }
    }

    /// The host of the next session.
    pub fn session(&mut self) -> Host<'_, 'm> {
        let session = Session::start(&mut self.app, &mut self.slots, &mut self.weights);
        Host { session, board: self.board.clone() }
    }

    /// Carries out steps of an upload in one session after the other, until the device refuses one; returns the last
    /// answer.
    pub fn upload(&mut self, steps: &[UploadStep<'_>]) -> Answer {
        let mut steps = steps.iter();
        loop {
            let (last, _) = self.session().upload(steps.by_ref());
            if last.is_err() || steps.len() == 0 {
                return last;
            }
        }
    }

    /// Uploads `blob`, and confirms it.
    pub fn install(&mut self, blob: &[u8]) -> Answer {
        self.upload(&[&trial_steps(blob)[..], &[UploadStep::Confirm]].concat())
    }

    /// Its board's journal, for the next start.
    pub fn journal(&mut self) -> Journal<Flash> {
        self.app.platform().journal.clone()
    }
}

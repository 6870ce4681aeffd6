//! An application on its board.

use taxel_firmware::app::{App, Buffers, Session};
use taxel_firmware::link::message::Configuration;
use taxel_firmware::store::Journal;

use super::board::Board;
use super::flash::Flash;
use super::shape::{COLS, MESSAGE_BYTES, OUTPUTS, ROWS};
use super::source::Source;

/// Memory of an application.
pub type Memory = Buffers<ROWS, COLS, OUTPUTS, MESSAGE_BYTES>;

/// An application on the mock board.
pub type TestApp<'m> = App<'m, Board, Source, ROWS>;

/// A session of an application in memory of any lifetime.
pub type Running<'a, 'm> = Session<'a, 'm, Board, Source, Flash, ROWS>;

/// A session of an application whose memory is never freed.
pub type TestSession<'a> = Running<'a, 'static>;

/// A configuration that scans only on request.
pub fn quiet() -> Configuration {
    Configuration { frame_period_us: 0, ..Configuration::DEFAULT }
}

/// A configuration that scans at this period.
pub fn every(frame_period_us: u32) -> Configuration {
    Configuration { frame_period_us, ..quiet() }
}

/// An application, and the host's ends of everything it is connected to.
pub struct Bench<'m> {
    /// The application. A session borrows it.
    pub app: TestApp<'m>,
    pub board: Board,
}

/// A session on a new board with `blob` in its first slot, and the board. Neither is ever freed.
pub fn started(configuration: Configuration, blob: &[u8]) -> (TestSession<'static>, Board) {
    let slots = Box::leak(Box::new(Flash::slots_with(blob)));
    let bench = Box::leak(Box::new(Bench::new(configuration)));
    let board = bench.board.clone();
    (Session::start(&mut bench.app, slots, &mut []), board)
}

impl Bench<'static> {
    /// An application on a new board. Its memory, half a kilobyte, is never freed: whoever makes many uses
    /// [`Bench::on`].
    pub fn new(configuration: Configuration) -> Self {
        Self::with_journal(configuration, Flash::journal())
    }

    /// As [`Bench::new`], on a board with this journal.
    pub fn with_journal(configuration: Configuration, journal: Journal<Flash>) -> Self {
        Self::on(Board::new(journal), Box::leak(Box::new(Memory::new())), configuration)
    }
}

impl<'m> Bench<'m> {
    /// An application on this board in this `memory`, which is cleared: what a restart leaves. The memory can be used again
    /// when the bench is dropped.
    pub fn on(board: Board, memory: &'m mut Memory, configuration: Configuration) -> Self {
        *memory = Memory::new();
        let source = Source::new(&board);
        Self { app: App::new(board.clone(), source, configuration, memory), board }
    }

    /// Its board's journal, for the next start.
    pub fn journal(&mut self) -> Journal<Flash> {
        self.app.platform().journal.clone()
    }
}

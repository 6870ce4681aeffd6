//! A device through restarts: its flash, the power that it may lose, and what a host asks of it.

use std::cell::RefCell;
use std::rc::Rc;

use taxel_firmware::link::message::{ModelIdentity, UploadState, UploadStep};
use taxel_firmware::store::{Journal, KeepError, Kind};

use super::bench::{Bench, Memory, quiet};
use super::board::Board;
use super::flash::{Flash, Supply};
use super::host::{Answer, Host};
use super::models::crc_of;

/// The answer to a confirmation of `blob`.
pub fn confirmed(blob: &[u8]) -> UploadState {
    UploadState::Confirmed { crc_32: crc_of(blob) }
}

/// A device that scans on request alone, and the host that it knows. Each of its functions starts it anew.
pub struct Device {
    pub slots: [Flash; 2],
    pub journal: Journal<Flash>,
    /// Words of memory for a copy of the model.
    pub ram_words: usize,
    /// Operation of the flash behind which the power is cut at the next start.
    pub cut_after: Option<u64>,
    /// Power that is cut: that of the slots.
    pub supply: Rc<RefCell<Supply>>,
    memory: Box<Memory>,
}

/// What a device's flash holds.
pub type Snapshot = ([Flash; 2], Journal<Flash>);

impl Device {
    /// A device with these slots.
    pub fn new(slots: [Flash; 2]) -> Self {
        Self {
            supply: slots[0].supply(),
            slots,
            journal: Flash::journal(),
            ram_words: 1024,
            cut_after: None,
            memory: Box::new(Memory::new()),
        }
    }

    /// What its flash holds.
    pub fn snapshot(&self) -> Snapshot {
        (self.slots.clone(), self.journal.clone())
    }

    /// Puts back what its flash held.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        (self.slots, self.journal) = snapshot.clone();
    }

    /// Switches the power on, and lets weak bits settle.
    pub fn power_on(&mut self) {
        self.slots.iter_mut().chain(self.journal.pages()).for_each(Flash::settle);
        self.supply.borrow_mut().on(self.cut_after.take());
    }

    /// Lets the power be cut behind so many operations after the next start.
    pub fn cut(&mut self, after: u64) -> &mut Self {
        self.cut_after = Some(after);
        self
    }

    /// Starts it, and does `work` with it.
    fn start<T>(&mut self, work: impl FnOnce(&mut Bench<'_>) -> T) -> T {
        self.power_on();
        let board = Board::new(self.journal.clone());
        let mut bench = Bench::on(board, self.slots.clone(), &mut self.memory, quiet());
        bench.weights = vec![0; self.ram_words];
        let done = work(&mut bench);
        self.journal = bench.journal();
        self.slots = bench.slots;
        done
    }

    /// Starts it, and does `work` in its session.
    pub fn session<T>(&mut self, work: impl FnOnce(&mut Host<'_, '_>) -> T) -> T {
        self.start(|bench| work(&mut bench.session()))
    }

    /// Whether the power was cut since the last start.
    pub fn is_cut(&self) -> bool {
        self.supply.borrow().gone
    }

    /// CRC-32 of the model that is in force after a restart.
    pub fn restart(&mut self) -> Option<u32> {
        self.model().map(|model| model.crc_32)
    }

    /// The model in force.
    pub fn model(&mut self) -> Option<ModelIdentity> {
        self.start(|bench| bench.session().model())
    }

    /// Carries out these steps of an upload, until one is refused; returns the last answer.
    pub fn upload(&mut self, steps: &[UploadStep<'_>]) -> Answer {
        self.start(|bench| bench.upload(steps))
    }

    /// Uploads `blob`, and confirms it.
    pub fn install(&mut self, blob: &[u8]) -> Answer {
        self.start(|bench| bench.install(blob))
    }

    /// Keeps `bytes` in the journal, past the application.
    pub fn keep(&mut self, kind: Kind, bytes: &[u8]) -> Result<bool, KeepError> {
        self.power_on();
        self.journal.keep(kind, &[bytes])
    }
}

//! A device through restarts: its flash, the power that it may lose, and what a host asks of it.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::app::{Session, SessionEnd};
use firmware::link::message::{
    Identity, KeyState, ModelIdentity, Refusal, Report, Request, UploadState, UploadStep,
};
use firmware::seal::{Key, Seal};

use crate::bench::{Bench, Memory, Running, quiet};
use crate::board::Board;
use crate::flash::{Cells, Flash, Supply};
use crate::host::{self, ask, model_crc, upload_steps};
use crate::models::crc_of;
use crate::pages::SharedSettings;

/// Bytes of a chunk of an upload.
const CHUNK: usize = 100;

/// Answer to a step of an upload, or to an undo.
pub type Answer = Result<UploadState, Refusal>;

/// The answer to a confirmation of `blob`.
pub fn confirmed(blob: &[u8]) -> Answer {
    Ok(UploadState::Confirmed { crc_32: crc_of(blob) })
}

/// A device that scans on request alone. Each of its functions starts it anew.
pub struct Device {
    pub slots: [Flash; 2],
    pub key: Flash,
    pub settings: SharedSettings,
    /// Memory for a copy of the model.
    pub weights: Vec<u32>,
    /// Operation of the flash behind which the power is cut at the next start.
    pub cut_after: Option<u64>,
    /// Power that is cut: that of the slots, unless it is replaced by the key's.
    pub supply: Rc<RefCell<Supply>>,
    memory: Box<Memory>,
}

impl Device {
    /// A device without a key, with these slots.
    pub fn new(slots: [Flash; 2]) -> Self {
        Self {
            cut_after: None,
            supply: slots[0].supply(),
            slots,
            key: Flash::without_key(),
            settings: SharedSettings::default(),
            weights: vec![0; 1024],
            memory: Box::new(Memory::new()),
        }
    }

    /// What both slots hold.
    pub fn cells(&self) -> [Cells; 2] {
        self.slots.each_ref().map(Flash::cells)
    }

    /// Puts back what both slots held.
    pub fn restore(&mut self, cells: &[Cells; 2]) {
        self.slots.iter_mut().zip(cells).for_each(|(slot, cells)| slot.restore(cells));
    }

    /// Lets the power be cut behind so many operations after the next start.
    pub fn cut(&mut self, after: u64) -> &mut Self {
        self.cut_after = Some(after);
        self
    }

    /// Starts it, and does `work` with it.
    fn start<T>(
        &mut self,
        work: impl FnOnce(&mut Bench<'_>, &mut [Flash; 2], &mut [u32]) -> T,
    ) -> T {
        self.slots.iter_mut().chain([&mut self.key]).for_each(Flash::settle);
        self.supply.borrow_mut().on(self.cut_after.take());
        let mut board = Board::with_settings(&self.settings);
        board.key = self.key.clone();
        let mut bench = Bench::on(board, &mut self.memory, quiet());
        let done = work(&mut bench, &mut self.slots, &mut self.weights);
        self.key = bench.app.platform().key.clone();
        done
    }

    /// Starts it, and does `work` in its session.
    pub fn session<T>(&mut self, work: impl FnOnce(&mut Running<'_, '_>, &Board) -> T) -> T {
        self.start(|bench, slots, weights| {
            let board = bench.board.clone();
            work(&mut Session::start(&mut bench.app, slots, weights), &board)
        })
    }

    /// Whether the power was cut since the last start.
    pub fn is_cut(&self) -> bool {
        self.supply.borrow().gone
    }

    /// CRC-32 of the model that is in force after a restart.
    pub fn restart(&mut self) -> Option<u32> {
        self.session(model_crc)
    }

    /// The model in force, whether there is a key, and the highest version.
    pub fn identity(&mut self) -> (Option<ModelIdentity>, KeyState, Option<u32>) {
        self.session(identity)
    }

    /// Carries out these steps of an upload, until one is refused; returns the last answer.
    pub fn upload(&mut self, steps: &[UploadStep<'_>]) -> Answer {
        self.start(|bench, slots, weights| host::upload(bench, slots, weights, steps))
    }

    /// Uploads `blob` with this seal, and confirms it.
    pub fn install(&mut self, blob: &[u8], seal: Option<Seal>) -> Answer {
        self.upload(&confirmed_steps(blob, seal))
    }

    /// Leaves the model with the CRC-32 `left` for the one before it.
    pub fn undo(&mut self, left: u32) -> Answer {
        self.session(|session, board| undo(session, board, left).0)
    }

    /// Sets `key`.
    pub fn provision(&mut self, key: Key) -> Result<(), Refusal> {
        self.session(|session, board| provision(session, board, key).0)
    }
}

/// Steps of an upload in chunks of 100 bytes, until it is on trial.
pub fn trial_steps(blob: &[u8], seal: Option<Seal>) -> Vec<UploadStep<'_>> {
    let mut steps = upload_steps(blob, CHUNK);
    steps.pop();
    steps.push(UploadStep::Try { seal, lease_ms: 60_000 });
    steps
}

/// The same, and its confirmation.
pub fn confirmed_steps(blob: &[u8], seal: Option<Seal>) -> Vec<UploadStep<'_>> {
    let mut steps = trial_steps(blob, seal);
    steps.push(UploadStep::Confirm);
    steps
}

/// The model in force, whether there is a key, and the highest version.
pub fn identity(
    session: &mut Running<'_, '_>,
    board: &Board,
) -> (Option<ModelIdentity>, KeyState, Option<u32>) {
    ask(session, board, &Request::Identify, |report| match report {
        Report::Identity(Identity { model, key, highest_version, .. }) => {
            (model, key, highest_version)
        }
        other => panic!("{other:?}"),
    })
    .0
}

/// Carries out one step of an upload.
pub fn upload_step(
    session: &mut Running<'_, '_>,
    board: &Board,
    step: UploadStep<'_>,
) -> (Answer, Option<SessionEnd>) {
    ask(session, board, &Request::Upload(step), answer)
}

/// Leaves the model with the CRC-32 `left` for the one before it.
pub fn undo(
    session: &mut Running<'_, '_>,
    board: &Board,
    left: u32,
) -> (Answer, Option<SessionEnd>) {
    ask(session, board, &Request::Undo { crc_32: left }, answer)
}

fn answer(report: Report<'_>) -> Answer {
    match report {
        Report::Upload(state) => Ok(state),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    }
}

/// Sets the key.
pub fn provision(
    session: &mut Running<'_, '_>,
    board: &Board,
    key: Key,
) -> (Result<(), Refusal>, Option<SessionEnd>) {
    ask(session, board, &Request::Provision { key }, |report| match report {
        Report::Provisioned => Ok(()),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    })
}

//! A device whose power can be cut at every operation of its flash, and a host that asks it.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::app::Session;
use firmware::link::message::{
    RecalibrationReport, RecalibrationState, RecalibrationStep, Refusal, Report, Request,
    UploadState, UploadStep,
};
use firmware::store::Slot;

use crate::bench::{Bench, Memory, Running, quiet};
use crate::board::Board;
use crate::flash::{Cells, Flash, Supply, Torn};
use crate::host::{self, ask, model_crc, upload_steps};
use crate::pages::SharedSettings;

/// Words of a slot.
pub const SLOT_WORDS: usize = 192;
/// Bytes of a chunk of an upload.
const CHUNK: usize = 100;

/// What becomes of a request to change the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The model with this CRC-32 comes into force.
    InForce(u32),
    /// The power was cut.
    Cut,
    /// The device refused.
    Refused(Refusal),
    /// Anything else.
    GoingOn,
}

/// A device.
pub struct Device {
    pub slots: [Flash; 2],
    pub supply: Rc<RefCell<Supply>>,
    memory: Box<Memory>,
    /// Memory for a copy of the weights, and for a recalibration.
    weights: Vec<u32>,
    settings: SharedSettings,
}

impl Device {
    /// A device with erased slots, and power whose cuts are of the kind `torn` and draw from `seed`.
    pub fn new(seed: u64, torn: Torn) -> Self {
        let supply = Supply::new(seed);
        Self {
            slots: [0, 1].map(|_| Flash::erased(SLOT_WORDS, &supply, torn)),
            supply,
            memory: Box::new(Memory::new()),
            weights: vec![0; 1024],
            settings: SharedSettings::default(),
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

    /// Starts the device, and does `work` in its session. The power is cut in the operation after `cut_after`, if given.
    pub fn session<T>(
        &mut self,
        cut_after: Option<u64>,
        work: impl FnOnce(&mut Running<'_, '_>, &Board) -> T,
    ) -> T {
        self.slots.iter_mut().for_each(Flash::settle);
        self.supply.borrow_mut().on(cut_after);
        let mut bench = Bench::within(&mut self.memory, quiet(), &self.settings);
        let board = bench.board.clone();
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut self.weights);
        work(&mut session, &board)
    }

    /// CRC-32 of the model that is in force after a restart.
    pub fn restart(&mut self) -> Option<u32> {
        self.session(None, model_crc)
    }

    /// Uploads the first steps of `blob`, as many as `steps`; all of them confirm it.
    pub fn upload(&mut self, blob: &[u8], steps: usize, cut_after: Option<u64>) -> Outcome {
        let mut all = upload_steps(blob, CHUNK);
        all.push(UploadStep::Confirm);
        all.truncate(steps);
        self.slots.iter_mut().for_each(Flash::settle);
        self.supply.borrow_mut().on(cut_after);
        let mut bench = Bench::within(&mut self.memory, quiet(), &self.settings);
        let last = host::upload(&mut bench, &mut self.slots, &mut self.weights, &all);
        match last {
            _ if self.supply.borrow().gone => Outcome::Cut,
            Ok(UploadState::Confirmed { crc_32 }) => Outcome::InForce(crc_32),
            Ok(_) => Outcome::GoingOn,
            Err(refusal) => Outcome::Refused(refusal),
        }
    }

    /// Uploads the first steps of `blob`, as many as `steps`, and does `work` in the same session.
    pub fn upload_then(
        &mut self,
        blob: &[u8],
        steps: usize,
        work: impl FnOnce(&mut Running<'_, '_>, &Board),
    ) {
        self.session(None, |session, board| {
            for step in upload_steps(blob, CHUNK).into_iter().take(steps) {
                upload_step(session, board, step);
            }
            work(session, board);
        });
    }

    /// Number of steps of an upload of `blob` before its trial.
    pub fn steps_to_trial(blob: &[u8]) -> usize {
        1 + blob.len().div_ceil(CHUNK)
    }

    /// What slot number `slot` holds.
    pub fn bytes(&self, slot: usize) -> &[u8] {
        self.slots[slot].bytes()
    }

    /// Number of the slot that holds this `blob`.
    pub fn slot_of(&self, blob: &[u8]) -> Option<usize> {
        self.slots.iter().position(|slot| slot.bytes().starts_with(blob))
    }

    /// Leaves the model with the CRC-32 `left` for the one before it.
    pub fn undo(&mut self, left: u32, cut_after: Option<u64>) -> Outcome {
        let supply = self.supply.clone();
        self.session(cut_after, |session, board| {
            let step = RecalibrationStep::Undo { crc_32: left };
            let outcome = recalibration_step(session, board, step);
            if supply.borrow().gone { Outcome::Cut } else { outcome }
        })
    }
}

/// Carries out one step of an upload that ends no session.
pub fn upload_step(session: &mut Running<'_, '_>, board: &Board, step: UploadStep<'_>) -> Outcome {
    ask(session, board, &Request::Upload(step), |report| match report {
        Report::Upload(_) => Outcome::GoingOn,
        Report::Refused(refusal) => Outcome::Refused(refusal),
        other => panic!("{other:?}"),
    })
    .0
}

/// Carries out one step of a recalibration.
pub fn recalibration_step(
    session: &mut Running<'_, '_>,
    board: &Board,
    step: RecalibrationStep<'_>,
) -> Outcome {
    ask(session, board, &Request::Recalibrate(step), |report| match report {
        Report::Recalibration(RecalibrationReport {
            state: RecalibrationState::InForce { crc_32 },
            ..
        }) => Outcome::InForce(crc_32),
        Report::Recalibration(_) => Outcome::GoingOn,
        Report::Refused(refusal) => Outcome::Refused(refusal),
        other => panic!("{other:?}"),
    })
    .0
}

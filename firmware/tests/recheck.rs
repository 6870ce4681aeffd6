//! The model in force is checked again and again while the device works, and replaced when its bytes decay.
//!
//! Bits of memory that a session has borrowed are flipped from outside, through the kernel, as radiation does.
#![cfg(target_os = "linux")]

use firmware::app::{Leave, Session};
use firmware::link::message::{
    Configuration, EstimateReport, ModelFault, ModelIdentity, Refusal, Report, Request, Statistics,
    UploadState, UploadStep,
};
use firmware::store::Slot;
use mock_board::*;

/// Place of the damage in a blob.
const PLACE: usize = 41;

fn identity(session: &mut TestSession<'_>, board: &Board) -> Option<ModelIdentity> {
    let read = |report: Report<'_>| match report {
        Report::Identity(identity) => identity.model,
        other => panic!("{other:?}"),
    };
    ask(session, board, &Request::Identify, read).0
}

fn statistics(session: &mut TestSession<'_>, board: &Board) -> Statistics {
    let read = |report: Report<'_>| match report {
        Report::Statistics(statistics) => statistics,
        other => panic!("{other:?}"),
    };
    ask(session, board, &Request::Statistics, read).0
}

/// Runs turns until the session ends, at most as many as two checks of all copies take.
fn run(session: &mut TestSession<'_>) -> Option<Leave> {
    (0..4 * MockSlot::BYTES.div_ceil(256)).find_map(|_| session.step())
}

/// A device with the model `new` in slot 1 and `old` in slot 0, and what happens to bits of it.
struct Rig {
    slots: [MockSlot; 2],
    weights: Vec<u32>,
    bench: Bench<'static>,
}

impl Rig {
    fn new(old: &[u8], new: &[u8], words: usize) -> Self {
        let mut slots = MockSlot::pair_with(old);
        let scanning = Configuration { frame_period_us: 100, ..Configuration::DEFAULT };
        let mut bench = Bench::new(scanning);
        let mut weights = vec![0; words];
        install(&mut bench, &mut slots, &mut weights, (new, 60)).unwrap();
        Self { slots, weights, bench }
    }

    /// Addresses of [`PLACE`] in the copy in RAM, and in each slot.
    fn addresses(&self) -> [usize; 3] {
        let [a, b] = self.slots.each_ref().map(|slot| slot.bytes().as_ptr().addr());
        [self.weights.as_ptr().addr(), a, b].map(|start| start + PLACE)
    }

    /// Lets bits flip in a session; returns why it ends, and the model and the counts after that.
    fn damage(
        &mut self,
        addresses: &[usize],
    ) -> (Option<Leave>, Option<ModelIdentity>, Statistics) {
        let Self { slots, weights, bench } = self;
        let board = bench.board.clone();
        let mut session = Session::start(&mut bench.app, slots, weights);
        assert_eq!(run(&mut session), None, "sound");
        addresses.iter().for_each(|address| flip_bit(*address, 3));
        let leave = run(&mut session);
        if leave.is_some() {
            let _ = session;
            let mut session = Session::start(&mut bench.app, slots, weights);
            assert_eq!(run(&mut session), None, "sound again");
            return (leave, identity(&mut session, &board), statistics(&mut session, &board));
        }
        (leave, identity(&mut session, &board), statistics(&mut session, &board))
    }
}

#[test]
fn the_copy_in_ram_is_taken_from_its_slot_again() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut rig = Rig::new(&old, &new, 512);
    let [copy, ..] = rig.addresses();
    for damages in 1..=3 {
        let (leave, model, s) = rig.damage(&[copy]);
        assert_eq!(leave, Some(Leave::Damaged));
        let model = model.unwrap();
        assert_eq!((model.crc_32, model.in_ram), (crc_of(&new), true));
        assert_eq!((s.model_damages, s.slot_damages), (damages, 0));
        assert!(s.model_checks > 2 && s.frames_missed == 0, "{s:?}");
    }
}

#[test]
fn a_damaged_slot_is_counted_once_and_decoding_goes_on_from_ram() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut rig = Rig::new(&old, &new, 512);
    let [copy, _, slot] = rig.addresses();
    let (leave, model, s) = rig.damage(&[slot]);
    assert_eq!((leave, model.unwrap().crc_32), (None, crc_of(&new)));
    assert_eq!((s.model_damages, s.slot_damages), (0, 1));
    // The next session finds the slot damaged, and takes the other slot's model.
    let Rig { slots, weights, bench } = &mut rig;
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, slots, weights);
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&old)));
    let _ = (session, copy);
}

#[test]
fn if_copy_and_slot_are_damaged_the_other_slots_model_comes_into_force() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut rig = Rig::new(&old, &new, 512);
    let [copy, _, slot] = rig.addresses();
    let (leave, model, s) = rig.damage(&[copy, slot]);
    assert_eq!((leave, model.unwrap().crc_32), (Some(Leave::Damaged), crc_of(&old)));
    assert_eq!(s.model_damages, 1);
}

#[test]
fn a_model_that_is_decoded_from_flash_is_replaced_by_the_other_slots() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut rig = Rig::new(&old, &new, 0);
    let [_, _, slot] = rig.addresses();
    let (leave, model, s) = rig.damage(&[slot]);
    assert_eq!((leave, model.unwrap().crc_32), (Some(Leave::Damaged), crc_of(&old)));
    assert_eq!((s.model_damages, s.slot_damages), (1, 0));
}

#[test]
fn if_everything_is_damaged_no_model_is_in_force_and_the_device_scans_on() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    for words in [0, 512] {
        let mut rig = Rig::new(&old, &new, words);
        let [copy, other, slot] = rig.addresses();
        let damaged = if words > 0 { &[copy, slot, other][..] } else { &[slot, other] };
        let (leave, model, s) = rig.damage(damaged);
        assert_eq!((leave, model), (Some(Leave::Damaged), None));
        assert_eq!(s.model_damages, 1);
        let Rig { slots, weights, bench } = &mut rig;
        let board = bench.board.clone();
        board.pins.borrow_mut().to_host.clear();
        let mut session = Session::start(&mut bench.app, slots, weights);
        (0..50).for_each(|_| assert_eq!(session.step(), None));
        let all = reports(&board.pins.borrow().to_host);
        let flag = format!("flags: {},", EstimateReport::NO_MODEL);
        assert!(!all.is_empty() && all.iter().all(|(_, text)| text.contains(&flag)), "{all:?}");
        let _ = session;
        // It takes a model as ever.
        let state = install(bench, slots, weights, (&new, 60));
        assert_eq!(state, Ok(UploadState::Confirmed { crc_32: crc_of(&new) }));
    }
}

#[test]
fn damage_ends_an_upload_and_a_trial_outlasts_damage_in_ram_alone() {
    let (old, new, next) = (blob(1, 3), blob(2, 5), blob(3, 4));
    let mut rig = Rig::new(&old, &new, 512);
    let [copy, ..] = rig.addresses();
    let Rig { slots, weights, bench } = &mut rig;
    let steps = upload_steps(&next, 60);
    upload(bench, slots, weights, &steps[..3]).unwrap();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(copy, 3);
    assert_eq!(run(&mut session), Some(Leave::Damaged));
    let _ = session;
    assert!(upload(bench, slots, weights, &steps[3..]).is_err());

    upload(bench, slots, weights, &steps).unwrap();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(copy, 3);
    assert_eq!(run(&mut session), Some(Leave::Damaged));
    let _ = session;
    let state = upload(bench, slots, weights, &[UploadStep::Confirm]);
    assert_eq!(state, Ok(UploadState::Confirmed { crc_32: crc_of(&next) }));
}

#[test]
fn a_model_that_decays_in_its_slot_while_on_trial_is_not_confirmed() {
    let (old, new, next) = (blob(1, 3), blob(2, 5), blob(3, 4));
    let mut rig = Rig::new(&old, &new, 512);
    let [_, slot, _] = rig.addresses();
    let Rig { slots, weights, bench } = &mut rig;
    upload(bench, slots, weights, &upload_steps(&next, 60)).unwrap();
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(slot, 3);
    assert_eq!(run(&mut session), None);
    assert_eq!(statistics(&mut session, &board).slot_damages, 1);
    board.pins.borrow_mut().to_host.clear();
    let confirm = request_bytes(7, &Request::Upload(UploadStep::Confirm));
    board.pins.borrow_mut().to_device.extend(confirm);
    assert_eq!(settle(&mut session, &board), Some(Leave::Confirm));
    let _ = session;
    let mut session = Session::start(&mut bench.app, slots, weights);
    let answers = reports(&board.pins.borrow().to_host);
    let refused = Report::Refused(Refusal::BadModel(ModelFault::Corrupt));
    assert_eq!(answers, [(7, format!("{refused:?}"))]);
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&new)));
}

//! A model that decays while another is uploaded or on trial.
//!
//! Bits of memory that a session has borrowed are flipped from outside, through the kernel, as radiation does.
#![cfg(target_os = "linux")]

use mock_board::*;
use taxel_firmware::app::{Session, SessionEnd};
use taxel_firmware::link::message::{Configuration, ModelFault, Refusal, UploadStep};
use taxel_firmware::store::Slot;

/// Place of the damage in a blob.
const PLACE: usize = 41;

/// Runs turns until the session ends, at most as many as two checks of all copies take.
fn run(session: &mut TestSession<'_>) -> Option<SessionEnd> {
    (0..4 * Flash::SLOT_BYTES.div_ceil(256)).find_map(|_| session.step())
}

/// A device with the model `new` in slot 1 and in RAM, and `old` in slot 0; and addresses in the copy and in slot 0.
fn device(old: &[u8], new: &[u8]) -> ([Flash; 2], Vec<u32>, Bench<'static>, [usize; 2]) {
    let mut slots = Flash::slots_with(old);
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..Configuration::DEFAULT });
    let mut weights = vec![0; 512];
    install(&mut bench, &mut slots, &mut weights, (new, 60)).unwrap();
    let starts = [weights.as_ptr().addr(), slots[0].bytes().as_ptr().addr()];
    (slots, weights, bench, starts.map(|start| start + PLACE))
}

#[test]
fn damage_ends_an_upload_and_a_trial_outlasts_damage_in_ram_alone() {
    let (old, new, next) = (blob(1, 3), blob(2, 5), blob(3, 4));
    let (mut slots, mut weights, mut bench, [copy, _]) = device(&old, &new);
    let (slots, weights, bench) = (&mut slots, &mut weights, &mut bench);
    let steps = upload_steps(&next, 60);
    upload(bench, slots, weights, &steps[..3]).unwrap();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(copy, 3);
    assert_eq!(run(&mut session), Some(SessionEnd::Damaged));
    let _ = session;
    assert!(upload(bench, slots, weights, &steps[3..]).is_err());

    upload(bench, slots, weights, &steps).unwrap();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(copy, 3);
    assert_eq!(run(&mut session), Some(SessionEnd::Damaged));
    let _ = session;
    let state = upload(bench, slots, weights, &[UploadStep::Confirm]);
    assert_eq!(state, confirmed(&next));
}

#[test]
fn a_model_that_decays_in_its_slot_while_on_trial_is_not_confirmed() {
    let (old, new, next) = (blob(1, 3), blob(2, 5), blob(3, 4));
    let (mut slots, mut weights, mut bench, [_, slot]) = device(&old, &new);
    let (slots, weights, bench) = (&mut slots, &mut weights, &mut bench);
    upload(bench, slots, weights, &upload_steps(&next, 60)).unwrap();
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, slots, weights);
    flip_bit(slot, 3);
    assert_eq!(run(&mut session), None);
    assert_eq!(statistics(&mut session, &board).slot_damages, 1);
    let (refused, end) = upload_step(&mut session, &board, UploadStep::Confirm);
    assert_eq!(refused, Err(Refusal::BadModel(ModelFault::Corrupt)));
    assert_eq!(end, Some(SessionEnd::NewModel));
    let _ = session;
    let mut session = Session::start(&mut bench.app, slots, weights);
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&new)));
}

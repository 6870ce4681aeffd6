//! Undo over the link: the previous model comes into force again, whole and for good.

use crate::mock::*;
use taxel_firmware::link::message::{KeepFault, Refusal, UploadState};

/// A device with the model `first`, flashed, and the others uploaded.
fn device(first: &[u8], others: &[&[u8]]) -> Device {
    let mut device = Device::new(Flash::slots_with(first));
    for blob in others {
        device.install(blob).unwrap();
    }
    device
}

#[test]
fn the_previous_model_can_be_had_again() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let mut device = device(&old, &[&new]);
    let back_to = |crc_32| Ok(UploadState::Confirmed { crc_32 });
    let (old, new) = (crc_of(&old), crc_of(&new));
    // Repeated, an undo is done already. The other way, it is the next one.
    for (left, expected) in [(new, old), (new, old), (old, new)] {
        assert_eq!(device.undo(left), back_to(expected));
        assert_eq!(device.restart(), Some(expected));
    }
    assert_eq!(device.undo(7), Err(Refusal::NothingToUndo));
}

#[test]
fn once_an_upload_has_begun_there_is_no_way_back_even_if_it_sends_the_same_bytes() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let mut device = device(&old, &[&new, &old, &new]);
    let mut steps = trial_steps(&old);
    steps.pop();
    device.upload(&steps).unwrap();
    assert_eq!(device.undo(crc_of(&new)), Err(Refusal::NothingToUndo));
    assert_eq!(device.restart(), Some(crc_of(&new)));
}

#[test]
fn an_upload_that_could_not_begin_leaves_the_way_back() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let mut device = device(&old, &[&new]);
    let supply = device.journal.pages()[0].supply();
    device.session(|session, board| {
        supply.borrow_mut().on(Some(0));
        assert_eq!(upload_step(session, board, begin(&old)).0, Err(Refusal::Flash));
        supply.borrow_mut().on(None);
        assert_eq!(statistics(session, board).slot_erases, 0);
        let back = UploadState::Confirmed { crc_32: crc_of(&old) };
        assert_eq!(undo(session, board, crc_of(&new)).0, Ok(back));
    });
}

#[test]
fn undos_wear_flash_and_are_limited_between_restarts() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let mut bench = Bench::new(quiet(), &old);
    bench.install(&new).unwrap();
    let mut in_force = [crc_of(&new), crc_of(&old)];
    for undos in 0..=100 {
        let (mut session, board) = bench.session();
        let expected = match undos {
            100 => Err(Refusal::Keep(KeepFault::TooOften)),
            _ => Ok(UploadState::Confirmed { crc_32: in_force[1] }),
        };
        assert_eq!(undo(&mut session, &board, in_force[0]).0, expected, "{undos}");
        in_force.reverse();
    }
}

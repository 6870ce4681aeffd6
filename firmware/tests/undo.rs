//! Undo over the link: the previous model comes into force again, whole and for good.

use firmware::link::message::{Refusal, UploadState};
use firmware::store::{MOST_RECORDS, Slot};
use mock_board::*;
use model_core::checksum::CRC_32;

/// A device with the model `first`, flashed, and the others uploaded.
fn device(first: &[u8], others: &[&[u8]]) -> Device {
    let mut device = Device::new(Flash::slots_with(first));
    for blob in others {
        device.install(blob, None).unwrap();
    }
    device
}

#[test]
fn the_previous_model_can_be_had_again_as_long_as_there_is_room_for_records() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let mut device = device(&old, &[&new]);
    let back_to = |crc_32| Ok(UploadState::Confirmed { crc_32 });
    let (old, new) = (crc_of(&old), crc_of(&new));
    // Repeated, an undo is done already. The other way, it is the next one.
    for (left, expected) in [(new, old), (new, old), (old, new)] {
        assert_eq!(device.undo(left), back_to(expected));
        assert_eq!(device.restart(), Some(expected));
    }
    let nothing = Err(Refusal::NothingToUndo);
    assert_eq!(device.undo(7), nothing);
    // Every change takes a record; at last there is no place for one.
    let mut in_force = [new, old];
    let mut undos = 0;
    while device.undo(in_force[0]) == back_to(in_force[1]) {
        in_force.reverse();
        undos += 1;
    }
    assert_eq!(undos, MOST_RECORDS - 4, "a pair for each");
    assert_eq!(device.undo(in_force[0]), nothing);
    assert_eq!(device.restart(), Some(in_force[0]));
    // Uploads make room: one in each slot.
    let [next, last] = [blob(2, 5), blob(3, 2)];
    device.install(&next, None).unwrap();
    device.install(&last, None).unwrap();
    assert_eq!(device.undo(crc_of(&last)), back_to(crc_of(&next)));
}

#[test]
fn behind_the_largest_generation_no_undo_comes_into_force() {
    let old = blob(1, 3);
    let mut device = device(&old, &[&blob(2, 5), &old]);
    // Another record of the model in force, in slot 0, with the largest generation.
    let record = [&b"SLOT"[..], &[0xFF; 4], &crc_of(&old).to_le_bytes()].concat();
    let record = [&record[..], &CRC_32.checksum(&record).to_le_bytes()].concat();
    device.slots[0].write(Flash::SLOT_BYTES - 48, &record).unwrap();
    assert_eq!(device.undo(crc_of(&old)), Err(Refusal::LastGeneration));
    assert_eq!(device.restart(), Some(crc_of(&old)));
}

#[test]
fn a_model_that_decayed_does_not_come_back() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut device = device(&old, &[&new]);
    assert!(device.undo(crc_of(&new)).is_ok());
    device.slots[1].decay(20, 4);
    assert_eq!(device.undo(crc_of(&old)), Err(Refusal::NothingToUndo));
    assert_eq!(device.restart(), Some(crc_of(&old)));
}

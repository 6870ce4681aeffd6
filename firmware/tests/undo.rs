//! Undo over the link: the previous model comes into force again, whole and for good.

use firmware::app::Session;
use firmware::link::message::{Refusal, Report, Request, UploadState};
use firmware::store::{MOST_RECORDS, Slot};
use mock_board::*;
use model_core::checksum::CRC_32;

/// CRC-32 of the model that is in force after a restart.
fn after_restart(slots: &mut [MockSlot; 2]) -> Option<u32> {
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, slots, &mut []);
    model_crc(&mut session, &bench.board)
}

/// Leaves the model with the CRC-32 `left`; returns that of the one in force then.
fn undo(slots: &mut [MockSlot; 2], left: u32) -> Result<u32, Refusal> {
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, slots, &mut []);
    let request = Request::Undo { crc_32: left };
    ask(&mut session, &bench.board, &request, |report| match report {
        Report::Upload(UploadState::Confirmed { crc_32 }) => Ok(crc_32),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    })
    .0
}

fn upload(slots: &mut [MockSlot; 2], blob: &[u8]) {
    install(&mut Bench::new(quiet()), slots, &mut [], (blob, 60)).unwrap();
}

#[test]
fn the_previous_model_can_be_had_again_as_long_as_there_is_room_for_records() {
    let (old, new) = (blob(1, 3), blob(4, 3));
    let (old_crc, crc_32) = (crc_of(&old), crc_of(&new));
    let mut slots = MockSlot::pair_with(&old);
    upload(&mut slots, &new);
    assert_eq!(after_restart(&mut slots), Some(crc_32));
    assert_eq!(undo(&mut slots, crc_32), Ok(old_crc));
    assert_eq!(after_restart(&mut slots), Some(old_crc));
    // Repeated, it is done already. The other way, it is the next undo.
    assert_eq!(undo(&mut slots, crc_32), Ok(old_crc));
    assert_eq!(after_restart(&mut slots), Some(old_crc));
    assert_eq!(undo(&mut slots, old_crc), Ok(crc_32));
    assert_eq!(after_restart(&mut slots), Some(crc_32));
    let nothing = Err(Refusal::NothingToUndo);
    assert_eq!(undo(&mut slots, 7), nothing);
    // Every change takes a record; at last there is no place for one.
    let mut in_force = [crc_32, old_crc];
    let mut undos = 0;
    while undo(&mut slots, in_force[0]) == Ok(in_force[1]) {
        in_force.reverse();
        undos += 1;
    }
    assert_eq!(undos, MOST_RECORDS - 4, "a pair for each");
    assert_eq!(undo(&mut slots, in_force[0]), nothing);
    assert_eq!(after_restart(&mut slots), Some(in_force[0]));
    // Uploads make room: one in each slot.
    let [next, last] = [blob(2, 5), blob(3, 2)];
    upload(&mut slots, &next);
    upload(&mut slots, &last);
    assert_eq!(undo(&mut slots, crc_of(&last)), Ok(crc_of(&next)));
}

#[test]
fn behind_the_largest_generation_no_undo_comes_into_force() {
    let old = blob(1, 3);
    let mut slots = MockSlot::pair_with(&old);
    upload(&mut slots, &blob(2, 5));
    upload(&mut slots, &old);
    // Another record of the model in force, in slot 0, with the largest generation.
    let record = [&b"SLOT"[..], &[0xFF; 4], &crc_of(&old).to_le_bytes()].concat();
    let record = [&record[..], &CRC_32.checksum(&record).to_le_bytes()].concat();
    slots[0].write(MockSlot::BYTES - 48, &record).unwrap();
    assert_eq!(undo(&mut slots, crc_of(&old)), Err(Refusal::LastGeneration));
    assert_eq!(after_restart(&mut slots), Some(crc_of(&old)));
}

#[test]
fn a_power_cut_at_any_word_of_an_undo_leaves_the_old_or_the_new_model() {
    let (first, second) = (blob(1, 3), blob(4, 3));
    let (old, new) = (crc_of(&first), crc_of(&second));
    let mut cuts = 0;
    for operations in 0.. {
        let mut slots = MockSlot::pair_with(&first);
        upload(&mut slots, &second);
        slots[0].cut_power_after(operations);
        let outcome = undo(&mut slots, new);
        let cut = slots[0].power_on();
        let found = after_restart(&mut slots);
        if operations >= 4 {
            assert_eq!((outcome, found), (Ok(old), Some(old)), "{operations}");
        } else {
            assert_eq!((outcome, found), (Err(Refusal::Flash), Some(new)), "{operations}");
            // It can be done again: there is place for other records.
            assert_eq!(undo(&mut slots, new), Ok(old));
            assert_eq!(after_restart(&mut slots), Some(old));
        }
        if !cut {
            break;
        }
        cuts += 1;
    }
    assert_eq!(cuts, 8, "words of a pair of records");
}

#[test]
fn a_model_that_decayed_does_not_come_back() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut slots = MockSlot::pair_with(&old);
    upload(&mut slots, &new);
    assert_eq!(after_restart(&mut slots), Some(crc_of(&new)));
    assert_eq!(undo(&mut slots, crc_of(&new)), Ok(crc_of(&old)));
    slots[1].decay(20, 4);
    let nothing = Err(Refusal::NothingToUndo);
    assert_eq!(undo(&mut slots, crc_of(&old)), nothing);
    // The bytes of a blob that fills its slot are no records.
    assert!(slots[0].bytes().len() == MockSlot::BYTES);
    assert_eq!(after_restart(&mut slots), Some(crc_of(&old)));
}

//! Uploading a model: sound models come into force, and nothing else ever does.

use crate::mock::*;
use taxel_firmware::link::message::{ModelFault, Refusal, UploadState, UploadStep};
use taxel_firmware::store::ERASES_AT_ONCE;

#[test]
fn a_good_model_comes_into_force_and_stays_and_a_repeated_confirmation_does_no_harm() {
    let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
    for generation in 1..=5_u32 {
        let next = blob(1 + generation as usize, 2 + generation as usize);
        let again = [TRY, UploadStep::Confirm, UploadStep::Confirm];
        let steps = [trial_steps(&next), again.to_vec()].concat();
        assert_eq!(device.upload(&steps), Ok(confirmed(&next)));
        let model = device.model().unwrap();
        assert_eq!((model.crc_32, model.generation), (crc_of(&next), generation));
        assert!(!model.on_trial);
        assert_eq!(u32::from(model.slot), generation % 2, "in turn");
    }
}

#[test]
fn the_watchdog_is_fed_just_before_and_after_a_slot_is_erased_even_if_the_sensor_is_silent() {
    let mut host = started(every(1000), &[]);
    *host.frame() = [[f32::NAN; COLS]; ROWS];
    host.turn(2000);
    let fed = host.pins().feeds;
    let good = blob(4, 3);
    let mut too_long = good.to_vec();
    too_long[5..9].copy_from_slice(&(1_u32 << 20).to_le_bytes());
    for (blob, more) in [(&too_long[..], 0), (&good[..], 3)] {
        assert_eq!(host.upload(&[begin(blob)]).0.is_ok(), more == 3);
        assert_eq!(host.pins().feeds - fed, more);
    }
}

#[test]
fn a_model_flashed_with_the_firmware_is_in_force_until_the_first_upload_begins_in_its_slot() {
    let (flashed, first) = (blob(1, 3), blob(2, 4));
    let mut device = Device::new(Flash::slots_with(&flashed));
    device.install(&first).unwrap();
    assert_eq!(device.restart(), Some(crc_of(&first)));
    // It stands in for the uploaded model that has decayed.
    device.slots[1].decay(20, 4);
    assert_eq!(device.restart(), Some(crc_of(&flashed)));
    // In slot 1 none counts that was not uploaded.
    let mut device = Device::new(Flash::slots());
    device.slots[1].flash(0, &flashed);
    assert_eq!(device.restart(), None);
}

#[test]
fn what_cannot_come_into_force_costs_no_erase_and_a_repeated_begin_costs_none_more() {
    let mut host = started(quiet(), &blob(1, 3));
    let good = blob(2, 4);
    // Another number of rows, of inputs, another version, and heads that are cut.
    for (length, place, byte, fault) in [
        (16, 9, 3, ModelFault::Shape),
        (16, 10, 4, ModelFault::Shape),
        (16, 4, 9, ModelFault::NotABlob),
        (16, 5, 16, ModelFault::Length),
        (11, 0, b'T', ModelFault::NotABlob),
        (1, 0, b'T', ModelFault::NotABlob),
    ] {
        let mut head = good[..length].to_vec();
        head[place] = byte;
        if fault == ModelFault::Length {
            head[6..9].fill(0); // no more than this head
        }
        let (outcome, _) = host.upload(&[UploadStep::Begin { head: &head }]);
        assert_eq!(outcome, Err(Refusal::BadModel(fault)), "{head:?}");
    }
    assert_eq!(host.statistics().slot_erases, 0);
    for _ in 0..1000 {
        host.upload(&[begin(&good)]).0.unwrap();
    }
    assert_eq!(host.statistics().slot_erases, 1);
    // An empty slot takes the model, after an abort as well; one with a chunk must be erased.
    let steps = trial_steps(&good);
    host.upload(&[UploadStep::Abort, steps[0], steps[1], steps[0]]).0.unwrap();
    assert_eq!(host.statistics().slot_erases, 2);
    let (outcome, end) = host.upload(&steps);
    assert!(outcome.is_ok() && end.is_some(), "{outcome:?}");
    assert_eq!(host.statistics().slot_erases, 2);
}

#[test]
fn erases_are_limited_in_rate() {
    const INTERVAL_US: u32 = 600_000_000;
    let mut bench = Bench::new(quiet(), &blob(1, 3));
    bench.slots[1].erase_interval_s = 600;
    let mut host = bench.session();
    let new = blob(2, 4);
    let steps = &trial_steps(&new)[..2];
    // All looks at the clock so far take less than a millisecond.
    let expect_refused = |host: &mut Host<'_, '_>, wait_us: u32| match host.upload(steps).0 {
        Err(Refusal::TooSoon { wait_us: found }) => {
            assert!(found.abs_diff(wait_us.into()) < 1000, "{found} instead of {wait_us}");
        }
        other => panic!("{other:?}"),
    };
    for _ in 0..ERASES_AT_ONCE {
        host.upload(steps).0.unwrap();
    }
    expect_refused(&mut host, INTERVAL_US);
    host.pass(INTERVAL_US - 10_000);
    expect_refused(&mut host, 10_000);
    host.pass(10_000);
    host.upload(steps).0.unwrap();
    expect_refused(&mut host, INTERVAL_US);
    // After a long rest there are as many again, and no more. The clock is looked at before it wraps around.
    for _ in 0..200 {
        host.pass(INTERVAL_US);
    }
    for _ in 0..ERASES_AT_ONCE {
        host.upload(steps).0.unwrap();
    }
    expect_refused(&mut host, INTERVAL_US);
}

#[test]
fn a_blob_may_fill_the_slot() {
    let mut host = started(quiet(), &[]);
    let slot_bytes = Flash::SLOT_BYTES as u32;
    let mut head = blob(1, 3)[..16].to_vec();
    for (length, expected) in [
        (slot_bytes + 1, Err(Refusal::TooLarge { slot_bytes })),
        (slot_bytes, Ok(UploadState::Receiving { received: 0 })),
    ] {
        head[5..9].copy_from_slice(&length.to_le_bytes());
        assert_eq!(host.upload(&[UploadStep::Begin { head: &head }]).0, expected);
    }
}

#[test]
fn each_fault_of_a_model_is_named() {
    let old = blob(1, 3);
    let mut host = started(quiet(), &old);
    let mut corrupt = old.clone();
    corrupt[40] ^= 1;
    let truncated = &old[..old.len() - 4];
    let received = |bytes: usize| Refusal::OutOfPlace { received: bytes as u32 };
    let whole_chunks = old.len() / CHUNK * CHUNK;
    for (blob, refusal) in [
        (&[0xFF; 64][..], Refusal::BadModel(ModelFault::NotABlob)),
        (truncated, received(truncated.len())),
        (&[&old[..], &[0; 4]].concat(), received(whole_chunks)),
        (&corrupt, Refusal::BadModel(ModelFault::Corrupt)),
    ] {
        let (outcome, _) = host.upload(&trial_steps(blob));
        assert_eq!(outcome, Err(refusal));
    }
    // A blob that says another length than its upload did.
    let mut longer = old.clone();
    longer[5] += 4;
    let mut steps = trial_steps(&longer);
    steps[0] = begin(&old);
    let (outcome, _) = host.upload(&steps);
    assert_eq!(outcome, Err(Refusal::BadModel(ModelFault::Length)));
    assert_eq!(host.model_crc(), Some(crc_of(&old)));
}

#[test]
fn steps_out_of_order_are_refused_and_repeated_ones_are_not() {
    let (old, new) = (blob(1, 3), blob(2, 4));
    let steps = trial_steps(&new);
    let mut host = started(quiet(), &old);
    let mut one = |step: &UploadStep<'_>| host.upload(&[*step]).0;

    assert_eq!(one(&steps[1]), Err(Refusal::NoUpload));
    assert_eq!(one(&TRY), Err(Refusal::NoUpload));
    assert_eq!(one(&UploadStep::Confirm), Err(Refusal::NoUpload));
    assert_eq!(one(&steps[0]), Ok(UploadState::Receiving { received: 0 }));
    assert_eq!(one(&steps[2]), Err(Refusal::OutOfPlace { received: 0 }));
    let received = CHUNK as u32;
    for _ in 0..2 {
        assert_eq!(one(&steps[1]), Ok(UploadState::Receiving { received })); // doubled
    }
    assert_eq!(one(&TRY), Err(Refusal::OutOfPlace { received }));
    assert_eq!(one(&UploadStep::Confirm), Err(Refusal::NoUpload));
    let too_long = UploadStep::Chunk { offset: received, bytes: &[1; 236] };
    assert_eq!(one(&too_long), Err(Refusal::Unknown));
    for bytes in [&[1; 3][..], &[1; 100]] {
        let chunk = UploadStep::Chunk { offset: received, bytes };
        let beyond = received as usize + bytes.len() > new.len() || bytes.len() == 3;
        assert_eq!(one(&chunk).is_err(), beyond);
        assert!(one(&steps[0]).is_ok()); // begin anew
        one(&steps[1]).unwrap();
    }
    for step in &steps[2..] {
        one(step).unwrap();
    }
    let on_trial = UploadState::OnTrial { crc_32: crc_of(&new) };
    assert_eq!(one(&TRY), Ok(on_trial)); // the answer was lost
}

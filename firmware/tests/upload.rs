//! Uploading a model: sound models come into force, and nothing else ever does.

use crate::mock::*;
use taxel_firmware::link::message::{ModelFault, Refusal, UploadState, UploadStep};
use taxel_firmware::store::ERASES_AT_ONCE;

#[test]
fn a_good_model_becomes_active_and_may_be_confirmed_again() {
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
fn the_watchdog_is_fed_before_and_after_a_slot_is_erased() {
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
fn a_flashed_model_is_active_until_an_upload_erases_its_slot() {
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
fn a_refused_upload_erases_nothing_nor_does_a_repeated_begin() {
    let mut host = started(quiet(), &blob(1, 3));
    let good = blob(2, 4);
    let slot_bytes = Flash::SLOT_BYTES as u32;
    // Another number of rows, of inputs, another version, no more than this head, too much, and heads that are cut.
    let refused = Refusal::BadModel;
    for (length, place, bytes, refusal) in [
        (16, 9, &[3][..], refused(ModelFault::Shape)),
        (16, 10, &[4], refused(ModelFault::Shape)),
        (16, 4, &[9], refused(ModelFault::NotABlob)),
        (16, 5, &[16, 0, 0, 0], refused(ModelFault::Length)),
        (16, 5, &(slot_bytes + 1).to_le_bytes(), Refusal::TooLarge { slot_bytes }),
        (11, 0, b"T", refused(ModelFault::NotABlob)),
        (1, 0, b"T", refused(ModelFault::NotABlob)),
    ] {
        let mut head = good[..length].to_vec();
        head[place..][..bytes.len()].copy_from_slice(bytes);
        let (outcome, _) = host.upload(&[UploadStep::Begin { head: &head }]);
        assert_eq!(outcome, Err(refusal), "{head:?}");
    }
    assert_eq!(host.statistics().slot_erases, 0);
    // A blob may fill the slot.
    let mut head = good[..16].to_vec();
    head[5..9].copy_from_slice(&slot_bytes.to_le_bytes());
    host.upload(&[UploadStep::Begin { head: &head }]).0.unwrap();
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
fn each_fault_of_a_model_is_named() {
    let old = blob(1, 3);
    let mut host = started(quiet(), &old);
    let mut corrupt = old.clone();
    corrupt[40] ^= 1;
    let truncated = &old[..old.len() - 4];
    let mut odd = old[..18].to_vec();
    odd[5..9].copy_from_slice(&18_u32.to_le_bytes());
    let received = |bytes: usize| Refusal::OutOfPlace { received: bytes as u32 };
    let whole_chunks = old.len() / CHUNK * CHUNK;
    for (blob, refusal) in [
        (&[0xFF; 64][..], Refusal::BadModel(ModelFault::NotABlob)),
        (truncated, received(truncated.len())),
        (&[&old[..], &[0; 4]].concat(), received(whole_chunks)),
        (&corrupt, Refusal::BadModel(ModelFault::Corrupt)),
        (&odd, Refusal::BadModel(ModelFault::Corrupt)), // its end is no whole word
    ] {
        assert_eq!(host.upload(&trial_steps(blob)).0, Err(refusal));
    }
    // A blob that says another length than its upload did.
    let mut longer = old.clone();
    longer[5] += 4;
    let mut steps = trial_steps(&longer);
    steps[0] = begin(&old);
    assert_eq!(host.upload(&steps).0, Err(Refusal::BadModel(ModelFault::Length)));
    assert_eq!(host.upload(&[TRY]).0, Err(Refusal::NoUpload));
    assert_eq!(host.model_crc(), Some(crc_of(&old)));
}

#[test]
fn steps_out_of_order_are_refused_and_repeated_ones_are_not() {
    let (old, new) = (blob(1, 3), blob(2, 4));
    let steps = trial_steps(&new);
    let mut host = started(quiet(), &old);
    let receiving = |received| Ok(UploadState::Receiving { received });
    let out_of_place = |received| Err(Refusal::OutOfPlace { received });
    let chunk = |bytes| UploadStep::Chunk { offset: 60, bytes };
    for (step, expected) in [
        (steps[1], Err(Refusal::NoUpload)),
        (TRY, Err(Refusal::NoUpload)),
        (UploadStep::Confirm, Err(Refusal::NoUpload)),
        (steps[0], receiving(0)),
        (steps[2], out_of_place(0)),
        (steps[1], receiving(60)),
        (steps[1], receiving(60)), // doubled
        (TRY, out_of_place(60)),
        (UploadStep::Confirm, Err(Refusal::NoUpload)),
        (chunk(&[1; 236]), Err(Refusal::Unknown)), // too long
        (chunk(&[1; 3]), out_of_place(60)),        // no whole words
        (chunk(&[1; 100]), receiving(160)),
        (UploadStep::Abort, Ok(UploadState::Idle)),
        (steps[1], Err(Refusal::NoUpload)),
        (steps[0], receiving(0)),
    ] {
        assert_eq!(host.upload(&[step]), (expected, None), "{step:?}");
    }
    let on_trial = Ok(UploadState::OnTrial { crc_32: crc_of(&new) });
    assert_eq!(host.upload(&steps[1..]).0, on_trial);
    assert_eq!(host.upload(&[TRY]).0, on_trial, "the answer was lost");
}

//! A new model is on trial until it is confirmed: until then every restart brings the previous one back. Then an undo does.

use crate::mock::*;
use taxel_core::AlignedBytes;
use taxel_firmware::app::SessionEnd;
use taxel_firmware::link::message::{
    KeepFault, ModelIdentity, Refusal, Report, Request, UploadState, UploadStep,
};
use taxel_firmware::link::packet::UNASKED;

fn old() -> AlignedBytes {
    blob(1, 3)
}

fn new() -> AlignedBytes {
    blob(2, 5)
}

/// The model that is in force after a restart.
fn after_restart(bench: &mut Bench<'_>) -> Option<ModelIdentity> {
    let mut device = Device::new(bench.slots.clone());
    device.journal = bench.journal();
    device.ram_words = 0;
    device.model()
}

/// A device with the old model, and with the new one on trial.
fn on_trial() -> Bench<'static> {
    let mut bench = Bench::new(quiet(), &old());
    let state = bench.upload(&trial_steps(&new()));
    assert_eq!(state, Ok(UploadState::OnTrial { crc_32: crc_of(&new()) }));
    bench
}

/// A device with the old model, and the new one in force.
fn installed() -> Bench<'static> {
    let mut bench = Bench::new(quiet(), &old());
    bench.install(&new()).unwrap();
    bench
}

#[test]
fn a_model_on_trial_is_decoded_with_and_gone_after_a_restart() {
    for words in [0, 512] {
        let mut bench = on_trial();
        bench.weights = vec![0; words];
        let tried = bench.session().model().unwrap();
        assert_eq!((tried.crc_32, tried.slot, tried.generation), (crc_of(&new()), 1, 1));
        assert_eq!((tried.on_trial, tried.in_ram), (true, words > 0));
        let left = after_restart(&mut bench).unwrap();
        assert_eq!((left.crc_32, left.on_trial), (crc_of(&old()), false));
    }
}

#[test]
fn a_confirmation_that_cannot_be_written_down_ends_the_trial() {
    let mut bench = on_trial();
    let supply = bench.journal().pages()[0].supply();
    supply.borrow_mut().on(Some(0));
    assert_eq!(bench.upload(&[UploadStep::Confirm]), Err(Refusal::Flash));
    supply.borrow_mut().on(None);
    assert_eq!(bench.session().model_crc(), Some(crc_of(&old())));
    assert_eq!(after_restart(&mut bench).unwrap().crc_32, crc_of(&old()));
    assert_eq!(bench.install(&new()), Ok(confirmed(&new())));
}

#[test]
fn an_abort_and_an_undo_end_a_trial_without_touching_the_flash() {
    let words_written = |bench: &Bench<'_>| bench.slots.each_ref().map(|slot| slot.words_written);
    let mut bench = on_trial();
    let writes = words_written(&bench);
    let ended = bench.session().upload(&[UploadStep::Abort]);
    assert_eq!(ended, (Ok(UploadState::Idle), Some(SessionEnd::NewModel)));
    assert_eq!(bench.session().model_crc(), Some(crc_of(&old())));
    assert_eq!(words_written(&bench), writes);
    let refused = bench.upload(&[UploadStep::Confirm]);
    assert_eq!(refused, Err(Refusal::NoUpload), "nothing is on trial any more");

    let mut bench = on_trial();
    // The second time, the answer was lost.
    for end in [Some(SessionEnd::NewModel), None] {
        assert_eq!(bench.session().undo(crc_of(&new())), (Ok(confirmed(&old())), end));
    }
    assert_eq!(words_written(&bench), writes);
    // The model that was tried was never confirmed: there is no way back to it.
    assert_eq!(bench.session().undo(crc_of(&old())).0, Err(Refusal::NothingToUndo));
}

#[test]
fn on_trial_nothing_overwrites_the_previous_model() {
    let mut bench = on_trial();
    assert_eq!(bench.upload(&trial_steps(&old())), Err(Refusal::OnTrial));
    assert_eq!(bench.session().model_crc(), Some(crc_of(&new())));
    let ended = bench.session().upload(&[UploadStep::Confirm]);
    assert_eq!(ended, (Ok(confirmed(&new())), Some(SessionEnd::NewModel)));
}

#[test]
fn a_trial_ends_when_its_model_decays() {
    let mut bench = on_trial();
    bench.slots[1].decay(20, 4);
    assert_eq!(bench.session().model_crc(), Some(crc_of(&old())));
    assert_eq!(bench.upload(&[UploadStep::Confirm]), Err(Refusal::NoUpload));
}

#[test]
fn a_trial_that_is_not_confirmed_in_time_ends_and_says_so() {
    // The host may let it last longer, half an hour at most; asking alone does not.
    for (trial_ms, trial_us) in [(120_000, 120_000_000), (u32::MAX, 1_800_000_000)] {
        let mut bench = on_trial();
        let mut host = bench.session();
        assert_eq!(host.pass(59_000_000), None);
        host.tell(&Request::Upload(UploadStep::Try { trial_ms }));
        assert_eq!(host.pass(trial_us - 1_000_000), None);
        assert_eq!(host.model_crc(), Some(crc_of(&new())));
        assert_eq!(host.pass(1_000_000), Some(SessionEnd::NewModel));
        let over = UploadState::TrialOver { crc_32: crc_of(&new()) };
        assert_eq!(host.reports(), [(UNASKED, format!("{:?}", Report::Upload(over)))]);
        assert_eq!(bench.session().model_crc(), Some(crc_of(&old())));
        assert_eq!(bench.upload(&[UploadStep::Confirm]), Err(Refusal::TrialOver));
        assert_eq!(bench.install(&new()), Ok(confirmed(&new())));
    }
}

#[test]
fn undo_alternates_between_two_models_a_limited_number_of_times() {
    let mut bench = installed();
    assert_eq!(bench.session().undo(7).0, Err(Refusal::NothingToUndo));
    for undos in 0..100 {
        let [left, back] = if undos % 2 == 0 { [new(), old()] } else { [old(), new()] };
        // Repeated, an undo is done already. Nothing is left to be confirmed.
        for _ in 0..2 {
            assert_eq!(bench.session().undo(crc_of(&left)).0, Ok(confirmed(&back)), "{undos}");
            assert_eq!(bench.upload(&[UploadStep::Confirm]), Err(Refusal::NoUpload));
        }
        assert_eq!(after_restart(&mut bench).unwrap().crc_32, crc_of(&back));
    }
    let worn = Err(Refusal::Keep(KeepFault::TooOften));
    assert_eq!(bench.session().undo(crc_of(&new())).0, worn);
}

#[test]
fn an_upload_that_has_begun_ends_undo_even_with_the_same_bytes() {
    let mut bench = installed();
    let old = old();
    bench.install(&old).unwrap();
    bench.install(&new()).unwrap();
    let steps = trial_steps(&old);
    let mut host = bench.session();
    host.upload(&steps[..steps.len() - 1]).0.unwrap();
    assert_eq!(host.undo(crc_of(&new())).0, Err(Refusal::NothingToUndo));
    assert_eq!(after_restart(&mut bench).unwrap().crc_32, crc_of(&new()));
}

#[test]
fn an_upload_that_could_not_begin_leaves_the_way_back() {
    let mut bench = installed();
    let supply = bench.journal().pages()[0].supply();
    let mut host = bench.session();
    let erases = host.statistics().slot_erases;
    supply.borrow_mut().on(Some(0));
    assert_eq!(host.upload(&[begin(&old())]).0, Err(Refusal::Flash));
    supply.borrow_mut().on(None);
    assert_eq!(host.statistics().slot_erases, erases);
    assert_eq!(host.undo(crc_of(&new())).0, Ok(confirmed(&old())));
}

#[test]
fn an_upload_that_cannot_be_written_down_ends() {
    let mut bench = Bench::new(quiet(), &old());
    let (new, supply) = (new(), bench.slots[1].supply());
    let (mut host, steps) = (bench.session(), trial_steps(&new));
    host.upload(&steps[..2]).0.unwrap();
    supply.borrow_mut().on(Some(0));
    assert_eq!(host.upload(&steps[2..3]).0, Err(Refusal::Flash));
    supply.borrow_mut().on(None);
    assert_eq!(host.upload(&steps[2..3]).0, Err(Refusal::NoUpload));
}

//! A new model is on trial until it is confirmed: until then every restart brings the previous one back.

use crate::mock::*;
use taxel_firmware::app::SessionEnd;
use taxel_firmware::link::message::{
    ModelIdentity, Refusal, Report, Request, UploadState, UploadStep,
};
use taxel_firmware::link::packet::UNASKED;

/// The model that is in force after a restart.
fn after_restart(bench: &mut Bench<'_>) -> Option<ModelIdentity> {
    let mut device = Device::new(bench.slots.clone());
    device.journal = bench.journal();
    device.ram_words = 0;
    device.model()
}

/// A device with the model `old`, and with `new` on trial.
fn on_trial(old: &[u8], new: &[u8]) -> Bench<'static> {
    let mut bench = Bench::new(quiet(), old);
    let state = bench.upload(&trial_steps(new));
    assert_eq!(state, Ok(UploadState::OnTrial { crc_32: crc_of(new) }));
    bench
}

/// Number of words that were written to each slot.
fn words_written(bench: &Bench<'_>) -> [usize; 2] {
    bench.slots.each_ref().map(|slot| slot.words_written)
}

#[test]
fn a_model_on_trial_is_decoded_with_and_gone_after_a_restart() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    for words in [0, 512] {
        let mut bench = on_trial(&old, &new);
        bench.weights = vec![0; words];
        let (mut session, board) = bench.session();
        let tried = model(&mut session, &board).unwrap();
        assert_eq!((tried.crc_32, tried.slot, tried.generation), (crc_of(&new), 1, 1));
        assert_eq!((tried.on_trial, tried.in_ram), (true, words > 0));
        let left = after_restart(&mut bench).unwrap();
        assert_eq!((left.crc_32, left.on_trial), (crc_of(&old), false));
    }
}

#[test]
fn a_confirmation_that_cannot_be_written_down_ends_the_trial() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut bench = on_trial(&old, &new);
    let supply = bench.app.platform().journal.pages()[0].supply();
    supply.borrow_mut().on(Some(0));
    let state = bench.upload(&[UploadStep::Confirm]);
    assert_eq!(state, Err(Refusal::Flash));
    supply.borrow_mut().on(None);
    let (mut session, board) = bench.session();
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&old)));
    assert_eq!(after_restart(&mut bench).unwrap().crc_32, crc_of(&old));
    assert_eq!(bench.install(&new), Ok(confirmed(&new)));
}

#[test]
fn an_abort_and_an_undo_end_a_trial_without_touching_the_flash() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut bench = on_trial(&old, &new);
    let writes = words_written(&bench);
    bench.upload(&[UploadStep::Abort]).unwrap();
    let (mut session, board) = bench.session();
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&old)));
    assert_eq!(words_written(&bench), writes);
    let refused = bench.upload(&[UploadStep::Confirm]);
    assert_eq!(refused, Err(Refusal::NoUpload), "nothing is on trial any more");

    let mut bench = on_trial(&old, &new);
    let (mut session, board) = bench.session();
    assert_eq!(
        undo(&mut session, &board, crc_of(&new)),
        (Ok(confirmed(&old)), Some(SessionEnd::NewModel))
    );
    let (mut session, board) = bench.session();
    assert_eq!(
        undo(&mut session, &board, crc_of(&new)),
        (Ok(confirmed(&old)), None),
        "the answer was lost"
    );
    assert_eq!(words_written(&bench), writes);
    // The model that was tried was never confirmed: there is no way back to it.
    let (mut session, board) = bench.session();
    assert_eq!(undo(&mut session, &board, crc_of(&old)).0, Err(Refusal::NothingToUndo));
}

#[test]
fn on_trial_nothing_overwrites_the_previous_model() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let mut bench = on_trial(&old, &new);
    let refused = bench.upload(&trial_steps(&old));
    assert_eq!(refused, Err(Refusal::OnTrial));
    let (mut session, board) = bench.session();
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&new)));
    let state = bench.upload(&[UploadStep::Confirm]);
    assert_eq!(state, Ok(confirmed(&new)));
}

#[test]
fn a_trial_that_is_not_confirmed_in_time_ends_and_says_so() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    // The host may let it last longer, half an hour at most; asking alone does not.
    for (trial_ms, trial_us) in [(120_000, 120_000_000), (u32::MAX, 1_800_000_000)] {
        let mut bench = on_trial(&old, &new);
        let (mut session, board) = bench.session();
        let pass = |session: &mut Running<'_, '_>, us| {
            board.pins.borrow_mut().now_us += us;
            board.pins.borrow_mut().to_host.clear();
            session.step()
        };
        assert_eq!(pass(&mut session, 59_000_000), None);
        tell(&mut session, &board, &Request::Upload(UploadStep::Try { trial_ms }));
        assert_eq!(pass(&mut session, trial_us - 1_000_000), None);
        assert_eq!(model_crc(&mut session, &board), Some(crc_of(&new)));
        assert_eq!(pass(&mut session, 1_000_000), Some(SessionEnd::NewModel));
        let said = reports(&board.pins.borrow().to_host);
        let over = UploadState::TrialOver { crc_32: crc_of(&new) };
        assert_eq!(said, [(UNASKED, format!("{:?}", Report::Upload(over)))]);
        let (mut session, board) = bench.session();
        assert_eq!(model_crc(&mut session, &board), Some(crc_of(&old)));
        let late = bench.upload(&[UploadStep::Confirm]);
        assert_eq!(late, Err(Refusal::TrialOver));
        let state = bench.install(&new);
        assert_eq!(state, Ok(confirmed(&new)));
    }
}

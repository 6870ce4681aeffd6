//! Uploading a model: sound models come into force, and nothing else ever does.

mod common;

use common::*;
use firmware::app::{Leave, Session};
use firmware::link::message::{
    Configuration, ModelFault, Refusal, Report, Request, UploadState, UploadStep,
};
use model_core::rbf::Shape;
use model_core::rbf::direct::{Network, Parameters};

const CHUNK: usize = 60;

/// Carries out an upload as far as it goes; returns the last answer, and whether the session ended.
fn upload(
    session: &mut TestSession<'_>,
    board: &Board,
    steps: &[UploadStep<'_>],
) -> (Result<UploadState, Refusal>, Option<Leave>) {
    let mut last = (Ok(UploadState::Idle), None);
    for step in steps {
        last = ask(session, board, &Request::Upload(*step), |report| match report {
            Report::Upload(state) => Ok(state),
            Report::Refused(refusal) => Err(refusal),
            other => panic!("{other:?}"),
        });
        if last.0.is_err() {
            break;
        }
    }
    last
}

#[test]
fn a_good_model_comes_into_force_and_stays_through_restarts() {
    let mut slots = MockSlot::pair_with(&blob(1, 3));
    for generation in 1..=5_u32 {
        let next = blob(1 + generation as usize, 2 + generation as usize);
        {
            let mut bench = Bench::new(quiet());
            let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
            let (outcome, leave) = upload(&mut session, &bench.board, &upload_steps(&next, CHUNK));
            assert_eq!(outcome, Ok(UploadState::Committed { crc_32: crc_of(&next) }));
            assert_eq!(leave, Some(Leave::NewModel));
        }
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        let (identity, _) = ask(&mut session, &bench.board, &Request::Identify, |r| match r {
            Report::Identity(identity) => identity.model.unwrap(),
            other => panic!("{other:?}"),
        });
        assert_eq!(identity.crc_32, crc_of(&next));
        assert_eq!(identity.generation, generation);
        assert_eq!(u32::from(identity.slot), generation % 2); // in turn
    }
}

#[test]
fn a_device_without_a_model_takes_one() {
    let mut slots = MockSlot::pair();
    let mut bench = Bench::new(quiet());
    let new = blob(4, 3);
    {
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        assert_eq!(model_crc(&mut session, &bench.board), None);
        let (_, leave) = upload(&mut session, &bench.board, &upload_steps(&new, CHUNK));
        assert_eq!(leave, Some(Leave::NewModel));
    }
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&new)));
}

#[test]
fn the_watchdog_is_fed_just_before_a_slot_is_erased_even_if_the_sensor_is_silent() {
    let mut slots = MockSlot::pair();
    let mut bench = Bench::new(Configuration { frame_period_us: 1000, ..quiet() });
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    *bench.frame.borrow_mut() = [[f32::NAN; COLS]; ROWS];
    for _ in 0..2000 {
        session.step();
    }
    let feeds = || board.0.borrow().feeds;
    let fed = feeds();
    for (length, more) in [(1 << 20, 0), (100, 1)] {
        let (outcome, _) = upload(&mut session, &board, &[UploadStep::Begin { length }]);
        assert_eq!((outcome.is_ok(), feeds() - fed), (more == 1, more), "{length} bytes");
    }
}

#[test]
fn an_interruption_after_any_step_leaves_the_old_model() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    let steps = upload_steps(&new, CHUNK);
    let mut slots = MockSlot::pair_with(&old);
    for taken in 0..steps.len() {
        {
            let mut bench = Bench::new(quiet());
            let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
            let (outcome, leave) = upload(&mut session, &bench.board, &steps[..taken]);
            assert!(outcome.is_ok() && leave.is_none(), "{taken}: {outcome:?}");
            assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&old)), "{taken}");
        }
        // The old model is in force after a restart too.
        let mut bench = Bench::new(quiet());
        let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
        assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&old)), "{taken}");
    }
}

#[test]
fn the_power_may_go_in_the_middle_of_any_word() {
    let (old, new) = (blob(1, 3), blob(2, 5));
    // The old model is in slot 0 without a record, and then in slot 1 with one.
    for old_uploaded in [false, true] {
        let mut operations = 0;
        let mut cuts = 0;
        loop {
            let mut slots = MockSlot::pair_with(if old_uploaded { &new } else { &old });
            if old_uploaded {
                let mut bench = Bench::new(quiet());
                let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
                upload(&mut session, &bench.board, &upload_steps(&old, CHUNK)).0.unwrap();
            }
            slots[0].cut_power_after(operations);
            {
                let mut bench = Bench::new(quiet());
                let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
                let (outcome, _) = upload(&mut session, &bench.board, &upload_steps(&new, CHUNK));
                assert!(matches!(outcome, Ok(UploadState::Committed { .. }) | Err(Refusal::Flash)));
            }
            let cut = slots[0].power_on();
            let mut bench = Bench::new(quiet());
            let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
            let found = model_crc(&mut session, &bench.board);
            if !cut {
                assert_eq!(found, Some(crc_of(&new)));
                break;
            }
            assert_eq!(found, Some(crc_of(&old)), "cut after {operations} words");
            // The device still takes an upload.
            let mended = upload(&mut session, &bench.board, &upload_steps(&new, CHUNK)).0;
            assert_eq!(mended, Ok(UploadState::Committed { crc_32: crc_of(&new) }));
            operations += 1;
            cuts += 1;
        }
        // The power was cut at every word of the erase, the blob and the record.
        assert_eq!(cuts, MockSlot::BYTES / 4 + new.len().div_ceil(4) + 4);
    }
}

#[test]
fn damage_of_any_bit_leaves_the_old_model() {
    let (old, new) = (blob(1, 3), blob(2, 4));
    let mut slots = MockSlot::pair_with(&old);
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for bit in 0..8 * new.len() {
        let mut damaged = new.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let (outcome, leave) = upload(&mut session, &bench.board, &upload_steps(&damaged, CHUNK));
        assert!(matches!(outcome, Err(Refusal::BadModel(_))), "bit {bit}: {outcome:?}");
        assert_eq!(leave, None);
    }
    assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&old)));
}

#[test]
fn each_fault_of_a_model_is_named() {
    let old = blob(1, 3);
    let mut slots = MockSlot::pair_with(&old);
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let wide = Network::try_new(
        Shape { inputs: COLS + 1, centres: 1, outputs: 1 },
        Parameters {
            input_minimum: &[0.0; COLS + 1],
            input_per_span: &[1.0; COLS + 1],
            centres: &[0.5; COLS + 1],
            decay: &[1.0],
            output_weights: &[1.0],
            bias: &[0.0],
            affine: &[],
        },
    );
    let mut corrupt = old.clone();
    corrupt[40] ^= 1;
    let truncated = &old[..old.len() - 4];
    for (blob, fault) in [
        (&[0xFF; 64][..], ModelFault::NotABlob),
        (truncated, ModelFault::Length),
        (&[&old[..], &[0; 4]].concat(), ModelFault::Length),
        (&corrupt, ModelFault::Corrupt),
        (&blob_of(wide.unwrap().into()), ModelFault::Shape),
    ] {
        let (outcome, _) = upload(&mut session, &bench.board, &upload_steps(blob, CHUNK));
        assert_eq!(outcome, Err(Refusal::BadModel(fault)));
    }
    assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&old)));
}

#[test]
fn steps_out_of_order_are_refused_and_repeated_ones_are_not() {
    let (old, new) = (blob(1, 3), blob(2, 4));
    let steps = upload_steps(&new, CHUNK);
    let mut slots = MockSlot::pair_with(&old);
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let board = bench.board.clone();
    let mut one = |step: &UploadStep<'_>| upload(&mut session, &board, &[*step]).0;

    assert_eq!(one(&steps[1]), Err(Refusal::NoUpload));
    assert_eq!(one(&UploadStep::Commit), Err(Refusal::NoUpload));
    let slot_bytes = MockSlot::BYTES as u32 - 16;
    let too_long = UploadStep::Begin { length: slot_bytes + 1 };
    assert_eq!(one(&too_long), Err(Refusal::TooLarge { slot_bytes }));

    assert_eq!(one(&steps[0]), Ok(UploadState::Receiving { received: 0 }));
    assert_eq!(one(&steps[2]), Err(Refusal::OutOfPlace { received: 0 }));
    let received = CHUNK as u32;
    for _ in 0..2 {
        assert_eq!(one(&steps[1]), Ok(UploadState::Receiving { received })); // doubled
    }
    assert_eq!(one(&UploadStep::Commit), Err(Refusal::OutOfPlace { received }));
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
    let committed = UploadState::Committed { crc_32: crc_of(&new) };
    assert_eq!(one(&UploadStep::Commit), Ok(committed)); // the answer was lost
}

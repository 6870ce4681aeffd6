//! Recalibration over the link: what is learned comes into force whole or not at all, and can be undone.

use std::array;

use firmware::app::{Leave, Session};
use firmware::link::message::{
    Configuration, RecalibrationFault, RecalibrationReport, RecalibrationState, RecalibrationStep,
    Refusal, Report, Request, SealFault, UploadState, UploadStep,
};
use firmware::seal::{Key, Seal};
use firmware::store::{MOST_RECORDS, Slot, blob_in_slot, seal_in_slot};
use mock_board::*;
use model_core::blob::Floats;
use model_core::checksum::CRC_32;
use model_core::recalibration::Recalibration;
use model_core::{AlignedBytes, Decoder};

const ALL: usize = ROWS * OUTPUTS;
/// How far the sensor's readings have moved since training, in Ω.
const SHIFTS: TestFrame = [[4.0, -3.0, 5.0], [-6.0, 2.0, 3.0]];

fn trained() -> AlignedBytes {
    blob_to_recalibrate(4)
}

/// What the sensor read in training for press number `i`.
fn press(i: usize) -> TestFrame {
    let part = |seed: usize| ((i * seed) % 97) as f32 / 97.0;
    let seeds = [[13, 29, 31], [37, 41, 53]];
    seeds.map(|row| row.map(|seed| 50.0 + 20.0 * part(seed)))
}

/// What it reads for a frame today.
fn today(frame: &TestFrame) -> TestFrame {
    core::array::from_fn(|m| core::array::from_fn(|k| frame[m][k] + SHIFTS[m][k]))
}

fn outputs(blob: &[u8], frame: &TestFrame) -> [f32; ALL] {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    decoder.decode(frame.as_flattened()).unwrap().outputs.try_into().unwrap()
}

/// Memory for the weights, and for a recalibration behind them.
fn memory() -> Vec<u32> {
    let blob = trained();
    let model = model_core::blob::Model::decode(&blob).unwrap();
    let floats =
        Recalibration::floats(&model).unwrap() + Recalibration::scratch_floats(&model).unwrap();
    vec![0; blob.len().div_ceil(4) + floats]
}

type Answer = Result<RecalibrationReport, Refusal>;

fn step(
    session: &mut TestSession<'_>,
    board: &Board,
    step: RecalibrationStep<'_>,
) -> (Answer, Option<Leave>) {
    ask(session, board, &Request::Recalibrate(step), |report| match report {
        Report::Recalibration(report) => Ok(report),
        Report::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    })
}

/// Lets the device decode a frame, as if it had been scanned.
fn show(session: &mut TestSession<'_>, board: &Board, frame: &TestFrame) -> [f32; ALL] {
    let readings_ohm = Floats::of(frame.as_flattened());
    let request = Request::Decode { frame: 1, readings_ohm };
    ask(session, board, &request, |report| match report {
        Report::Estimate(estimate) => {
            estimate.outputs.iter().collect::<Vec<_>>().try_into().unwrap()
        }
        other => panic!("{other:?}"),
    })
    .0
}

/// Begins, and adds so many presses that the device does not scan but is shown.
fn add_presses(session: &mut TestSession<'_>, board: &Board, presses: usize) {
    add_presses_as(session, board, presses, today);
}

/// As [`add_presses`], where the sensor reads frames as this tells.
fn add_presses_as(
    session: &mut TestSession<'_>,
    board: &Board,
    presses: usize,
    read: impl Fn(&TestFrame) -> TestFrame,
) {
    let blob = trained();
    step(session, board, RecalibrationStep::Begin).0.unwrap();
    for i in 0..presses {
        show(session, board, &read(&press(i)));
        let stated = outputs(&blob, &press(i));
        let outputs = Floats::of(&stated);
        let added = RecalibrationStep::Press { before: i as u16, frames: 0, outputs };
        assert_eq!(step(session, board, added).0.unwrap().presses, i as u16 + 1);
    }
}

/// Largest error of the outputs on other presses.
fn largest_error(session: &mut TestSession<'_>, board: &Board) -> f32 {
    let blob = trained();
    let mut largest = 0.0_f32;
    for i in 1000..1020 {
        let found = show(session, board, &today(&press(i)));
        let pairs = found.iter().zip(outputs(&blob, &press(i)));
        largest = pairs.fold(largest, |most, (a, b)| most.max((a - b).abs()));
    }
    largest
}

/// CRC-32 of the model that is in force after a restart.
fn after_restart(slots: &mut [Flash; 2]) -> Option<u32> {
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, slots, &mut []);
    model_crc(&mut session, &bench.board)
}

/// Recalibrates by 60 presses, as far as the power lasts; returns the new model's CRC-32.
fn recalibrate(slots: &mut [Flash; 2]) -> Result<u32, Refusal> {
    let (mut bench, mut memory) = (Bench::new(quiet()), memory());
    let mut session = Session::start(&mut bench.app, slots, &mut memory);
    add_presses(&mut session, &bench.board, 60);
    match step(&mut session, &bench.board, RecalibrationStep::Commit) {
        (Ok(RecalibrationReport { state: RecalibrationState::InForce { crc_32 }, .. }), leave) => {
            assert_eq!(leave, Some(Leave::NewModel));
            Ok(crc_32)
        }
        (Ok(other), _) => panic!("{other:?}"),
        (Err(refusal), leave) => {
            assert_eq!(leave, None);
            Err(refusal)
        }
    }
}

/// Leaves the model with the CRC-32 `left`.
fn undo(slots: &mut [Flash; 2], left: u32) -> Result<u32, Refusal> {
    let mut bench = Bench::new(quiet());
    let mut session = Session::start(&mut bench.app, slots, &mut []);
    let (answer, _) = step(&mut session, &bench.board, RecalibrationStep::Undo { crc_32: left });
    answer.map(|report| match report.state {
        RecalibrationState::InForce { crc_32 } => crc_32,
        other => panic!("{other:?}"),
    })
}

fn upload(slots: &mut [Flash; 2], blob: &[u8]) {
    install(&mut Bench::new(quiet()), slots, &mut [], (blob, 60)).unwrap();
}

#[test]
fn a_recalibration_takes_the_memory_of_the_weights_where_it_must() {
    let blob = trained();
    let mut slots = Flash::slots_with(&blob);
    let (mut bench, mut memory) = (Bench::new(quiet()), memory());
    let board = bench.board.clone();
    let less = memory.len() - 1;
    let is_in_ram = |session: &mut TestSession<'_>| {
        let read = |report: Report<'_>| match report {
            Report::Identity(identity) => identity.model.map(|model| model.in_ram),
            other => panic!("{other:?}"),
        };
        ask(session, &board, &Request::Identify, read).0
    };
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory[..less]);
    assert_eq!(is_in_ram(&mut session), Some(true));
    let outputs_before = show(&mut session, &board, &press(3));
    board.pins.borrow_mut().to_host.clear();
    let begin = Request::Recalibrate(RecalibrationStep::Begin);
    board.pins.borrow_mut().to_device.extend(request_bytes(9, &begin));
    assert_eq!(settle(&mut session, &board), Some(Leave::MakeRoom));
    assert!(board.pins.borrow().to_host.is_empty(), "the next session answers");
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory[..less]);
    let answers = reports(&board.pins.borrow().to_host);
    assert!(answers.len() == 1 && answers[0].0 == 9, "{answers:?}");
    assert!(answers[0].1.contains("state: Collecting"), "{answers:?}");
    assert_eq!(is_in_ram(&mut session), Some(false));
    assert_eq!(show(&mut session, &board, &press(3)), outputs_before);
    let (answer, leave) = step(&mut session, &board, RecalibrationStep::Abort);
    assert_eq!(answer.unwrap().state, RecalibrationState::Idle);
    assert_eq!(leave, Some(Leave::MakeRoom));
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory[..less]);
    assert_eq!(is_in_ram(&mut session), Some(true));
}

#[test]
fn presses_bring_a_changed_sensor_back_and_the_previous_model_can_be_had_again() {
    let old = trained();
    let mut slots = Flash::slots_with(&old);
    let (mut bench, mut memory) = (Bench::new(quiet()), memory());
    let board = bench.board.clone();
    let crc_32 = {
        let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
        assert!(largest_error(&mut session, &board) > 10.0 * TRAINING_ERROR);
        add_presses(&mut session, &board, 100);
        let progress = step(&mut session, &board, RecalibrationStep::Status).0.unwrap();
        assert_eq!((progress.networks, progress.excited), (2, 2));
        assert!(progress.error_before > 5.0 && progress.error_after < 1.0, "{progress:?}");
        let (answer, leave) = step(&mut session, &board, RecalibrationStep::Commit);
        assert_eq!(leave, Some(Leave::NewModel));
        match answer.unwrap().state {
            RecalibrationState::InForce { crc_32 } => crc_32,
            other => panic!("{other:?}"),
        }
    };
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
    assert_eq!(model_crc(&mut session, &board), Some(crc_32));
    assert!(largest_error(&mut session, &board) < TRAINING_ERROR);
    // The answer to the commit was lost: the same again changes nothing.
    let (again, leave) = step(&mut session, &board, RecalibrationStep::Commit);
    assert_eq!(again.unwrap().state, RecalibrationState::InForce { crc_32 });
    assert_eq!(leave, None);
    let _ = session;
    assert_eq!(after_restart(&mut slots), Some(crc_32));

    let old_crc = crc_of(&old);
    assert_eq!(undo(&mut slots, crc_32), Ok(old_crc));
    assert_eq!(after_restart(&mut slots), Some(old_crc));
    // Repeated, it is done already. The other way, it is the next undo.
    assert_eq!(undo(&mut slots, crc_32), Ok(old_crc));
    assert_eq!(after_restart(&mut slots), Some(old_crc));
    assert_eq!(undo(&mut slots, old_crc), Ok(crc_32));
    assert_eq!(after_restart(&mut slots), Some(crc_32));
    let nothing = Err(Refusal::Recalibration(RecalibrationFault::NothingToUndo));
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
fn behind_the_largest_generation_no_recalibration_and_no_undo_comes_into_force() {
    let old = trained();
    let mut slots = Flash::slots_with(&old);
    upload(&mut slots, &blob(2, 5));
    upload(&mut slots, &old);
    // Another record of the model in force, in slot 0, with the largest generation.
    let record = [&b"SLOT"[..], &[0xFF; 4], &crc_of(&old).to_le_bytes()].concat();
    let record = [&record[..], &CRC_32.checksum(&record).to_le_bytes()].concat();
    slots[0].write(Flash::SLOT_BYTES - 48, &record).unwrap();
    assert_eq!(undo(&mut slots, crc_of(&old)), Err(Refusal::LastGeneration));
    assert_eq!(recalibrate(&mut slots), Err(Refusal::LastGeneration));
    assert_eq!(after_restart(&mut slots), Some(crc_of(&old)));
}

#[test]
#[cfg(target_os = "linux")]
fn a_model_that_decays_is_not_recalibrated() {
    let old = trained();
    for place in (0..old.len() - 4).step_by(7) {
        for in_ram in [true, false] {
            let (mut slots, mut bench) = (Flash::slots_with(&old), Bench::new(quiet()));
            let board = bench.board.clone();
            let mut memory = memory();
            let words = memory.len() - usize::from(!in_ram);
            let start =
                if in_ram { memory.as_ptr().addr() } else { slots[0].bytes().as_ptr().addr() };
            let mut session = Session::start(&mut bench.app, &mut slots, &mut memory[..words]);
            if !in_ram {
                let begin = Request::Recalibrate(RecalibrationStep::Begin);
                board.pins.borrow_mut().to_device.extend(request_bytes(9, &begin));
                assert_eq!(settle(&mut session, &board), Some(Leave::MakeRoom));
                let _ = session;
                session = Session::start(&mut bench.app, &mut slots, &mut memory[..words]);
            }
            add_presses(&mut session, &board, 20);
            flip_bit(start + place, 3);
            let (answer, _) = step(&mut session, &board, RecalibrationStep::Commit);
            assert!(answer.is_err(), "{place}, in RAM: {in_ram}: {answer:?}");
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_copy_in_ram_is_kept_if_its_slot_has_decayed() {
    let old = trained();
    let mut slots = Flash::slots_with(&blob(5, 2));
    upload(&mut slots, &old);
    let mut bench = Bench::new(Configuration { frame_period_us: 100, ..quiet() });
    let board = bench.board.clone();
    let mut memory = memory();
    let words = memory.len() - 1;
    let slot = slots[1].bytes().as_ptr().addr();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory[..words]);
    flip_bit(slot + 40, 3);
    assert!((0..100).all(|_| session.step().is_none()), "decoded from its copy");
    let (answer, leave) = step(&mut session, &board, RecalibrationStep::Begin);
    let no_room = |fault| matches!(fault, RecalibrationFault::NoRoom { .. });
    assert!(matches!(answer, Err(Refusal::Recalibration(fault)) if no_room(fault)), "{answer:?}");
    assert_eq!((leave, model_crc(&mut session, &board)), (None, Some(crc_of(&old))));
}

#[test]
fn with_a_key_the_device_seals_the_model_that_it_makes_and_can_return_to_the_one_before() {
    const KEY: Key = [9; 32];
    let (old, key) = (trained(), Flash::with_key(&KEY));
    let mut slots = Flash::slots();
    let mut steps = upload_steps(&old, 60);
    steps.pop();
    let seal = Some(Seal::of(&KEY, 5, &old));
    steps.extend([UploadStep::Try { seal }, UploadStep::Confirm]);
    mock_board::upload(&mut Bench::with_key(quiet(), &key), &mut slots, &mut [], &steps).unwrap();
    let (mut bench, mut memory) = (Bench::with_key(quiet(), &key), memory());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
    add_presses(&mut session, &board, 60);
    step(&mut session, &board, RecalibrationStep::Commit).0.unwrap();
    let _ = session;
    let in_force = |slots: &mut [Flash; 2]| {
        let mut bench = Bench::with_key(quiet(), &key);
        let mut session = Session::start(&mut bench.app, slots, &mut []);
        let model = ask(&mut session, &bench.board, &Request::Identify, |report| match report {
            Report::Identity(identity) => identity.model.unwrap(),
            other => panic!("{other:?}"),
        });
        let undo = RecalibrationStep::Undo { crc_32: model.0.crc_32 };
        (model.0, step(&mut session, &bench.board, undo).0)
    };
    let (new, undone) = in_force(&mut slots);
    assert_eq!((new.generation, new.version), (2, Some(5)));
    assert!(undone.is_ok() && new.crc_32 != crc_of(&old));
    assert_eq!(in_force(&mut slots).0.crc_32, crc_of(&old));
}

/// Whoever is at the line can recalibrate twice: the original is erased then, and must be had again.
#[test]
fn behind_two_recalibrations_the_owner_s_original_is_taken_again_and_nothing_else_of_its_version() {
    const KEY: Key = [9; 32];
    let (old, other, key) = (trained(), blob(5, 1), Flash::with_key(&KEY));
    let mut slots = Flash::slots();
    let install = |slots: &mut [Flash; 2], blob: &[u8], seal, last| {
        let mut steps = upload_steps(blob, 60);
        steps.pop();
        steps.extend([UploadStep::Try { seal: Some(seal) }, last]);
        mock_board::upload(&mut Bench::with_key(quiet(), &key), slots, &mut [], &steps)
    };
    let seal = Seal::of(&KEY, 5, &old);
    let rejected = Seal::of(&KEY, 5, &other);
    // A model of the same version that its owner has tried, and not confirmed.
    install(&mut slots, &other, rejected, UploadStep::Abort).unwrap();
    install(&mut slots, &old, seal, UploadStep::Confirm).unwrap();
    let mut own = Vec::new();
    for shifts in [1.0, -1.0] {
        let (mut bench, mut memory) = (Bench::with_key(quiet(), &key), memory());
        let board = bench.board.clone();
        let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
        let read = |frame: &TestFrame| {
            array::from_fn(|m| array::from_fn(|k| frame[m][k] + shifts * SHIFTS[m][k]))
        };
        add_presses_as(&mut session, &board, 60, read);
        step(&mut session, &board, RecalibrationStep::Commit).0.unwrap();
        let _ = session;
        let slot = own.len() % 2; // the original is in slot 1
        own.push((
            blob_in_slot(slots[slot].bytes()).to_vec(),
            seal_in_slot(slots[slot].bytes()).unwrap(),
        ));
    }
    assert!(slots.iter().all(|slot| !slot.bytes().starts_with(&old)), "the original is erased");
    let outdated = Err(Refusal::Seal(SealFault::Outdated { highest: 5 }));
    let older = Seal::of(&KEY, 4, &old);
    assert_eq!(install(&mut slots, &other, rejected, UploadStep::Confirm), outdated);
    assert_eq!(install(&mut slots, &old, older, UploadStep::Confirm), outdated);
    // What the device has sealed is for itself: nobody can upload it.
    let (recalibrated, own_seal) = &own[0];
    assert_eq!(own_seal.version, 5);
    let forged = Err(Refusal::Seal(SealFault::Forged));
    assert_eq!(install(&mut slots, recalibrated, *own_seal, UploadStep::Confirm), forged);
    let confirmed = UploadState::Confirmed { crc_32: crc_of(&old) };
    assert_eq!(install(&mut slots, &old, seal, UploadStep::Confirm), Ok(confirmed));
    let mut bench = Bench::with_key(quiet(), &key);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    assert_eq!(model_crc(&mut session, &bench.board), Some(crc_of(&old)));
}

#[test]
fn a_press_is_the_mean_of_frames_and_counts_once_however_often_it_is_sent() {
    let blob = trained();
    let mut slots = Flash::slots_with(&blob);
    let scanning = Configuration { frame_period_us: 1000, send_estimates: false, ..quiet() };
    let (mut bench, mut memory) = (Bench::new(scanning), memory());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
    step(&mut session, &board, RecalibrationStep::Begin).0.unwrap();
    let mut wait = |request: &Request<'_>, number: u16, times: usize| {
        board.pins.borrow_mut().to_host.clear();
        for _ in 0..times {
            board.pins.borrow_mut().to_device.extend(request_bytes(number, request));
        }
        let until = board.pins.borrow().now_us + 10_000;
        while board.pins.borrow().now_us < until {
            assert_eq!(session.step(), None);
        }
        reports(&board.pins.borrow().to_host)
    };
    for i in 0..80 {
        let stated = outputs(&blob, &press(i));
        *bench.frame.borrow_mut() = today(&press(i));
        let outputs = Floats::of(&stated);
        let added = RecalibrationStep::Press { before: i as u16, frames: 3, outputs };
        // Sent three times before the frames are scanned, and once more later.
        let all = wait(&Request::Recalibrate(added), 100 + i as u16, 3);
        assert_eq!(all.len(), 1, "{all:?}");
        let presses = format!("presses: {},", i + 1);
        assert!(all[0].0 == 100 + i as u16 && all[0].1.contains(&presses), "{all:?}");
        let all = wait(&Request::Recalibrate(added), 200 + i as u16, 1);
        assert!(all[0].1.contains(&presses), "{all:?}");
    }
    let all = wait(&Request::Recalibrate(RecalibrationStep::Commit), 300, 0);
    assert!(all.is_empty());
    let (answer, leave) = step(&mut session, &board, RecalibrationStep::Commit);
    let report = answer.unwrap();
    assert!(report.error_after < 0.2 * report.error_before, "{report:?}");
    assert_eq!(leave, Some(Leave::NewModel));
}

#[test]
fn another_request_that_ends_a_press_refuses_it() {
    let blob = trained();
    let mut slots = Flash::slots_with(&blob);
    let scanning = Configuration { frame_period_us: 1000, send_estimates: false, ..quiet() };
    let (mut bench, mut memory) = (Bench::new(scanning), memory());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
    step(&mut session, &board, RecalibrationStep::Begin).0.unwrap();
    let stated = outputs(&blob, &press(1));
    let outputs = Floats::of(&stated);
    let added = RecalibrationStep::Press { before: 0, frames: 1000, outputs };
    board.pins.borrow_mut().to_host.clear();
    board.pins.borrow_mut().to_device.extend(request_bytes(5, &Request::Recalibrate(added)));
    settle(&mut session, &board);
    board.pins.borrow_mut().to_device.extend(request_bytes(6, &configure(quiet())));
    settle(&mut session, &board);
    let all = reports(&board.pins.borrow().to_host);
    assert!(all[0].0 == 5 && all[0].1.contains("Recalibration(Frames)"), "{all:?}");
    assert_eq!(step(&mut session, &board, RecalibrationStep::Status).0.unwrap().presses, 0);
}

#[test]
fn what_cannot_be_done_is_refused_by_name() {
    let blob = trained();
    let mut slots = Flash::slots_with(&blob);
    let (mut bench, mut memory) = (Bench::new(quiet()), memory());
    let board = bench.board.clone();
    let fault = |fault| Err(Refusal::Recalibration(fault));
    let stated = outputs(&blob, &press(1));
    let added = |before: u16, frames: u16| {
        let outputs = Floats::of(&stated);
        RecalibrationStep::Press { before, frames, outputs }
    };
    {
        let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
        let mut one = |wanted: RecalibrationStep<'_>| step(&mut session, &board, wanted).0;
        assert_eq!(one(added(0, 0)), fault(RecalibrationFault::NotBegun));
        assert_eq!(one(RecalibrationStep::Commit), fault(RecalibrationFault::NotBegun));
        assert_eq!(one(RecalibrationStep::Status).unwrap().state, RecalibrationState::Idle);
        let nothing = fault(RecalibrationFault::NothingToUndo);
        assert_eq!(one(RecalibrationStep::Undo { crc_32: crc_of(&blob) }), nothing);

        let begun = one(RecalibrationStep::Begin).unwrap();
        assert_eq!((begun.state, begun.presses), (RecalibrationState::Collecting, 0));
        assert_eq!(one(added(1, 0)), fault(RecalibrationFault::OutOfPlace { presses: 0 }));
        assert_eq!(one(added(0, 5)), fault(RecalibrationFault::Frames)); // nothing is scanned
        let short = RecalibrationStep::Press { before: 0, frames: 0, outputs: Floats(&[0; 8]) };
        assert_eq!(one(short), fault(RecalibrationFault::Outputs { expected: ALL as u16 }));
        // Nothing was shown yet: readings of 0 Ω.
        assert_eq!(one(added(0, 0)), fault(RecalibrationFault::UnusablePress));
        assert_eq!(
            one(RecalibrationStep::Commit),
            fault(RecalibrationFault::NotExcited { row: 0 })
        );
        let bad = [f32::NAN; ALL];
        let outputs = Floats::of(&bad);
        let bad = RecalibrationStep::Press { before: 0, frames: 0, outputs };
        assert_eq!(one(bad), fault(RecalibrationFault::UnusablePress));
        let aborted = one(RecalibrationStep::Abort).unwrap();
        assert_eq!(aborted.state, RecalibrationState::Idle);
        assert_eq!(one(added(0, 0)), fault(RecalibrationFault::NotBegun));
    }
    // The same press again and again teaches nothing.
    {
        let mut session = Session::start(&mut bench.app, &mut slots, &mut memory);
        step(&mut session, &board, RecalibrationStep::Begin).0.unwrap();
        show(&mut session, &board, &today(&press(1)));
        for before in 0..100 {
            step(&mut session, &board, added(before, 0)).0.unwrap();
        }
        let (answer, leave) = step(&mut session, &board, RecalibrationStep::Commit);
        assert_eq!((answer, leave), (fault(RecalibrationFault::NotExcited { row: 0 }), None));
    }
    // Without memory, for a model whose rows share a network, and without a model.
    let floats = memory.len() - blob.len().div_ceil(4);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let begun = step(&mut session, &board, RecalibrationStep::Begin).0;
    let bytes = 4 * floats as u32;
    assert_eq!(begun, fault(RecalibrationFault::NoRoom { bytes, free_bytes: 0 }));
    let _ = session;
    let mut shared = Flash::slots_with(&mock_board::blob(1, 3));
    let mut session = Session::start(&mut bench.app, &mut shared, &mut memory);
    let begun = step(&mut session, &board, RecalibrationStep::Begin).0;
    assert_eq!(begun, fault(RecalibrationFault::SharedNetworks));
    let _ = session;
    let mut empty = Flash::slots();
    let mut session = Session::start(&mut bench.app, &mut empty, &mut memory);
    let begun = step(&mut session, &board, RecalibrationStep::Begin).0;
    assert_eq!(begun, fault(RecalibrationFault::NoModel));
}

#[test]
fn an_undo_brings_back_the_model_before_an_upload_too() {
    let (old, new) = (trained(), blob(2, 5));
    let mut slots = Flash::slots_with(&old);
    upload(&mut slots, &new);
    assert_eq!(after_restart(&mut slots), Some(crc_of(&new)));
    assert_eq!(undo(&mut slots, crc_of(&new)), Ok(crc_of(&old)));
    // A model that decayed does not come back.
    slots[1].decay(20, 4);
    let nothing = Err(Refusal::Recalibration(RecalibrationFault::NothingToUndo));
    assert_eq!(undo(&mut slots, crc_of(&old)), nothing);
    // The bytes of a blob that fills its slot are no records.
    assert!(slots[0].bytes().len() == Flash::SLOT_BYTES);
    assert_eq!(after_restart(&mut slots), Some(crc_of(&old)));
}

//! Flipped bits of the model in force, in RAM and in flash. The device checks the model while it works: what is damaged
//! is found within two passes, and replaced by what is sound.

use std::fmt::Debug;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_core::blob::Floats;
use taxel_core::{AlignedBytes, Decoder};
use taxel_firmware::app::{Session, SessionEnd};
use taxel_firmware::link::message::{Configuration, EstimateReport, Report, Request};
use taxel_firmware::store::Slot;

use crate::bench::{Bench, Memory, Running};
use crate::board::Board;
use crate::decay::flip_bit;
use crate::flash::Flash;
use crate::host::{ask, install, model_crc, statistics};
use crate::models::{blob, crc_of};
use crate::shape::{COLS, ROWS};

/// Bytes that a turn of the loop checks, at least.
const PIECE: usize = 256;
/// Words of RAM for a copy of the model.
const COPY_WORDS: usize = 512;
/// Frames that are compared with the host's.
const FRAMES: usize = 4;

/// What a device does about flipped bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    CopiedAgain,
    Noted,
    OtherSlot,
    NoModel,
}

/// Where a bit is flipped: in the copy in RAM, the slot in force, the other slot.
#[derive(Debug, Clone, Copy)]
struct Case {
    hits: [bool; 3],
    /// Whether the model is decoded from its slot, without a copy.
    is_in_flash: bool,
    right: Outcome,
}

const fn case(hits: [bool; 3], is_in_flash: bool, right: Outcome) -> Case {
    Case { hits, is_in_flash, right }
}

const CASES: [Case; 6] = [
    case([true, false, false], false, Outcome::CopiedAgain),
    case([false, true, false], false, Outcome::Noted),
    case([true, true, false], false, Outcome::OtherSlot),
    case([true, true, true], false, Outcome::NoModel),
    case([false, true, false], true, Outcome::OtherSlot),
    case([false, true, true], true, Outcome::NoModel),
];

/// Lets bits flip while a device works, and judges what it does about it. Returns whether the model is copied again (0),
/// the damage noted (1), the other slot's model in force (2), or none (3).
///
/// # Errors
/// What is wrong, and in which case.
pub fn flip_model(seed: u64) -> Result<usize, String> {
    let case = CASES[(seed % CASES.len() as u64) as usize];
    let outcome = run(case, seed).and_then(|outcome| {
        expect(outcome, case.right, "what the device does")?;
        Ok(outcome as usize)
    });
    outcome.map_err(|why| format!("{case:?}: {why}"))
}

/// Lets the bits flip; returns what the device shows that it did.
fn run(case: Case, seed: u64) -> Result<Outcome, String> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut below = |end: usize| (random.next_u64() % end as u64) as usize;
    let [old, new] = [1, 2].map(|one| blob(one, 1 + below(60)));
    let mut slots = Flash::slots_with(&old);
    let mut weights = vec![0; if case.is_in_flash { 0 } else { COPY_WORDS }];
    let mut buffers = Box::new(Memory::new());
    let scanning = Configuration { frame_period_us: 100, ..Configuration::DEFAULT };
    let mut bench = Bench::on(Board::new(Flash::journal()), &mut buffers, scanning);
    install(&mut bench, &mut slots, &mut weights, (&new, 200))
        .map_err(|refusal| format!("the upload is refused: {refusal:?}"))?;
    let [other, slot] = slots.each_ref().map(|slot| slot.bytes().as_ptr().addr());
    let copy = weights.as_ptr().addr();
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut weights);

    let copies = if case.is_in_flash { 1 } else { 2 };
    let pass = copies * new.len().div_ceil(PIECE) + 1;
    expect(turns(&mut session, below(2 * pass)), None, "before")?;
    for (index, (address, blob)) in [(copy, &new), (slot, &new), (other, &old)].iter().enumerate() {
        if case.hits[index] {
            flip_bit(*address, below(8 * blob.len()));
        }
    }
    let end = turns(&mut session, 2 * pass);

    let is_decoded_from = case.hits[0] || case.is_in_flash;
    expect(end, is_decoded_from.then_some(SessionEnd::Damaged), "within two passes")?;
    let counts = statistics(&mut session, &board);
    expect(counts.model_damages, u32::from(is_decoded_from), "damages of the model")?;
    if end.is_none() {
        expect(counts.slot_damages, 1, "damages of the slot")?;
        judge(&mut session, &board, Some(&new))?;
    }
    let _ = session;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut weights);
    expect(turns(&mut session, 2 * pass), None, "afterwards")?;
    let crc_32 = model_crc(&mut session, &board);
    let in_force = [&new, &old].into_iter().find(|blob| crc_32 == Some(crc_of(blob)));
    judge(&mut session, &board, in_force)?;
    let outcome = match in_force {
        None => Outcome::NoModel,
        Some(blob) if blob == &new => Outcome::CopiedAgain,
        Some(_) if end.is_none() => Outcome::Noted,
        Some(_) => Outcome::OtherSlot,
    };
    let counts = statistics(&mut session, &board);
    expect(counts.model_checks > 0 || in_force.is_none(), true, "whole checks are counted")?;
    let _ = session;
    let next = install(&mut bench, &mut slots, &mut weights, (&new, 200));
    expect(next.is_ok(), true, "the next upload")?;
    Ok(outcome)
}

/// Runs so many turns of the loop, or until the session ends.
fn turns(session: &mut Running<'_, '_>, count: usize) -> Option<SessionEnd> {
    (0..count).find_map(|_| session.step())
}

/// Whether the device has the model `in_force`, and decodes with it as the host does.
fn judge(
    session: &mut Running<'_, '_>,
    board: &Board,
    in_force: Option<&AlignedBytes>,
) -> Result<(), String> {
    expect(model_crc(session, board), in_force.map(|blob| crc_of(blob)), "the model in force")?;
    for frame in 0..FRAMES {
        let reading = |i: usize| 50.0 + ((7 * i + 3 * frame) % 20) as f32;
        let readings_ohm: Vec<f32> = (0..ROWS * COLS).map(reading).collect();
        let request =
            Request::Decode { frame: 0, start_us: 0, readings_ohm: Floats::new(&readings_ohm) };
        let (found, flags) = ask(session, board, &request, |report| match report {
            Report::Estimate(it) => Ok((it.outputs.iter().map(f32::to_bits).collect(), it.flags)),
            other => Err(format!("{other:?}")),
        })
        .0?;
        let found: Vec<u32> = found;
        let Some(blob) = in_force else {
            expect(flags & EstimateReport::NO_MODEL, EstimateReport::NO_MODEL, "the flag")?;
            continue;
        };
        let decoder = Decoder::<ROWS>::load(blob).map_err(|cause| cause.to_string())?;
        let right = decoder.decode(&readings_ohm[..]).map_err(|cause| cause.to_string())?;
        let right: Vec<u32> = right.outputs.into_iter().map(f32::to_bits).collect();
        expect(&found[..], &right[..], "the bits of an estimate")?;
    }
    Ok(())
}

fn expect<T: Copy + PartialEq + Debug>(found: T, right: T, what: &str) -> Result<(), String> {
    if found == right { Ok(()) } else { Err(format!("{what}: {found:?} and not {right:?}")) }
}

//! A line that is too slow: every report arrives whole or is counted as lost.

use mock_board::{
    Bench, Board, Flash, Memory, blob, blob_with_confidence, find_report, quiet, request_bytes,
    settle, statistics,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{ConfidenceSent, Configuration, Report, Request};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::Tally;
use crate::tools::Tools;

pub const LINK: Promise = Promise {
    name: "load-link",
    text: "a slow line: each report arrives, or is counted",
    share: 4,
    check,
};

const LEAST: u64 = 64;
/// Turns of the loop in a case.
const TURNS: u64 = 3000;

fn check(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let counts = Tally::new(["produced", "arrived", "counted as lost", "of them both"]);
    let mut found = effort.worst((LEAST, 1 << 40), (0.0, "reports"), |seed| {
        let [produced, arrived, lost] = run(seed)?;
        let both = (arrived + lost).saturating_sub(produced);
        [produced, arrived, lost, both].iter().enumerate().for_each(|(i, n)| counts.add(i, *n));
        // A report that was given up before its very last byte arrives after all, with the byte that ends it.
        Ok(produced.saturating_sub(arrived + lost) as f64)
    });
    found.cases = counts.count(0);
    Ok(found.noted(|| format!("reports: {}", counts.text())))
}

/// Numbers of reports that were produced, that arrived, and that were counted as lost.
fn run(seed: u64) -> Result<[u64; 3], String> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut below = |end: u32| random.next_u32() % end;
    let models = [blob(1, 2), blob_with_confidence(false)];
    let mut slots = match seed % 3 {
        2 => Flash::slots(),
        model => Flash::slots_with(&models[model as usize]),
    };
    let scanning = Configuration {
        frame_period_us: 1000,
        send_readings: seed / 3 % 2 == 1,
        confidence: ConfidenceSent::Novelty,
        ..quiet()
    };
    let mut memory = Box::new(Memory::new());
    let mut bench = Bench::on(Board::new(Flash::journal()), &mut memory, scanning);
    let (board, frame) = (bench.board.clone(), bench.frame.clone());
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let has_health = seed / 6 % 2 == 1;
    if has_health {
        frame.borrow_mut()[0][0] = f32::NAN;
    }
    board.pins.borrow_mut().look_us = 30;
    let mut bytes = Vec::new();
    let mut requests = 0;
    for _ in 0..TURNS {
        {
            // The host takes bytes fast, slowly, so many more, or none.
            let mut pins = board.pins.borrow_mut();
            if below(20) == 0 {
                pins.gap_us = [0, 3, 100, 60_000][below(4) as usize];
                pins.room = (below(3) == 0).then(|| below(200) as usize);
            }
            if below(50) == 0 {
                requests += 1;
                pins.to_device.extend(request_bytes(9, &Request::Statistics));
            }
            pins.now_us = pins.now_us.wrapping_add(below(1500));
            bytes.append(&mut pins.to_host);
        }
        session.step();
    }
    // The line is free again: what is asked now is answered.
    board.pins.borrow_mut().gap_us = 0;
    board.pins.borrow_mut().room = None;
    let stop = request_bytes(10, &Request::Configure(quiet()));
    board.pins.borrow_mut().to_device.extend(stop);
    settle(&mut session, &board);
    bytes.append(&mut board.pins.borrow_mut().to_host);
    let s = statistics(&mut session, &board);
    let per_frame = 1 + u64::from(scanning.send_readings) + u64::from(has_health);
    let produced = u64::from(s.frames_scanned) * per_frame + requests + 1;
    Ok([produced, arrived(&bytes)?, u64::from(s.lost_reports)])
}

/// Number of whole reports. Each is of a later frame than the one of its kind before it.
fn arrived(bytes: &[u8]) -> Result<u64, String> {
    let (mut last, mut whole) = ([0; 3], 0);
    let late = find_report(bytes, |_, report| {
        whole += 1;
        let (kind, frame) = match report {
            Report::Readings { frame, .. } => (0, frame),
            Report::Health(health) => (1, health.frame),
            Report::Estimate(estimate) => (2, estimate.frame),
            _ => return None,
        };
        let before = std::mem::replace(&mut last[kind], frame);
        (frame <= before).then(|| format!("frame {frame} arrives after frame {before}"))
    });
    late.map_or(Ok(whole), Err)
}

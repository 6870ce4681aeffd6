//! Very many frames: counters and clocks go on, and memory stays as it is.

use std::cell::RefCell;

use mock_board::{
    Bench, Board, Flash, Memory, Running, ask, blob, blob_of_features, blob_with_confidence,
    find_report, frame_at_rest, quiet, statistics,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{
    ConfidenceSent, Configuration, EstimateReport, Report, Request,
};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const FRAMES: Promise = Promise {
    name: "load-frames",
    text: "frames without end: counted, timed, no leak",
    share: 20,
    check,
};

/// Frames of a case.
const FRAMES_PER_CASE: u32 = 20_000;
/// Cases of the short form.
const LEAST: u64 = 48;
/// Largest growth of the process in KiB, in all cases together.
const GROWTH_KIB: f64 = 1024.0;

/// Longest time in µs that turns without a frame take.
const SLACK_US: u64 = 200;

/// Time in µs before a frame is due from which on the loop runs turn by turn: more than a frame takes.
const EARLY_US: u32 = 40;
/// Frames after which the loop is in step, wherever it was.
const SETTLING: u32 = 200;

thread_local! {
    /// Memory that cases use again, so that the process grows by what the firmware or its driver loses alone.
    static MEMORY: RefCell<Memory> = const { RefCell::new(Memory::new()) };
}

fn check(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let case = |seed| MEMORY.with_borrow_mut(|memory| run(seed, memory).map(|()| 0.0));
    // Allocators of all threads settle first.
    let settled = effort.worst((16, 16), (0.0, ""), case);
    let before = resident_kib()?;
    let mut found = effort.worst((LEAST, 1 << 40), (GROWTH_KIB, "KiB"), case);
    if settled.worst > 0.0 {
        found = Found { bound: GROWTH_KIB, unit: "KiB", ..settled };
    }
    found.cases = (found.cases + 16) * u64::from(FRAMES_PER_CASE);
    if found.worst <= 0.0 {
        found.worst = (resident_kib()? - before).max(0.0);
        found.note = format!("{:.1} years of simulated time", years(effort.seed(), found.cases));
    }
    Ok(found)
}

/// Memory of this process that is resident, in KiB.
fn resident_kib() -> Result<f64, String> {
    let path = "/proc/self/status";
    let status = std::fs::read_to_string(path).map_err(|cause| format!("{path}: {cause}"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let number = line.and_then(|line| line.trim().trim_end_matches(" kB").trim().parse().ok());
    number.ok_or_else(|| format!("{path} does not tell the resident memory"))
}

/// Periods of frames in µs: the clock of 32 bits wraps every 4.3 million frames, or every second one.
const PERIODS_US: [u32; 4] = [1_000, 10_000, 1_000_000, 900_000_000];

fn period_us(seed: u64) -> u32 {
    PERIODS_US[(seed % 4) as usize]
}

fn years(seed: u64, frames: u64) -> f64 {
    let cases = frames / u64::from(FRAMES_PER_CASE);
    let us = |case: u64| f64::from(period_us(seed.wrapping_add(case)));
    let mean_us = (0..4).map(us).sum::<f64>() / 4.0;
    mean_us * cases as f64 * f64::from(FRAMES_PER_CASE) / 1e6 / 86_400.0 / 365.25
}

/// Runs an application for some thousands of frames: with a model or none.
fn run(seed: u64, memory: &mut Memory) -> Result<(), String> {
    let models = [blob(1, 1), blob_with_confidence(false), blob_of_features(2), blob(3, 5)];
    let mut slots = match seed / 4 % 5 {
        4 => Flash::slots(),
        model => Flash::slots_with(&models[model as usize]),
    };
    let period_us = period_us(seed);
    let configuration = Configuration {
        frame_period_us: period_us,
        send_readings: seed / 20 % 2 == 1,
        confidence: ConfidenceSent::Deviations,
        ..quiet()
    };
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut bench = Bench::on(Board::new(Flash::journal()), memory, configuration);
    let (board, frame) = (bench.board.clone(), bench.frame.clone());
    let start_us = random.next_u32();
    board.pins.borrow_mut().now_us = start_us;
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    // The clock was set after the application had looked at it.
    while statistics(&mut session, &board).frames_scanned == 0 {
        let mut pins = board.pins.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(period_us / 2);
    }
    if seed / 40 % 2 == 1 {
        let rest = frame_at_rest();
        let readings_ohm = taxel_core::blob::Floats::new(rest.as_flattened());
        ask(&mut session, &board, &Request::SetBaseline { readings_ohm }, |_| ());
    }
    // Frames fall into step with this loop, so that none is scanned together with the answer.
    for _ in 0..SETTLING {
        board.pins.borrow_mut().to_host.clear();
        next_frame(&mut session, &board, period_us);
    }
    let first = statistics(&mut session, &board);
    let mut sent = 0;
    let mut elapsed_us = 0;
    let mut last: Option<(u32, u64, u64)> = None;
    for number in 0..FRAMES_PER_CASE {
        frame.borrow_mut()[0][0] = 60.0 + (number % 7) as f32;
        elapsed_us += u64::from(next_frame(&mut session, &board, period_us));
        let mut pins = board.pins.borrow_mut();
        sent += pins.to_host.len();
        if number % 1000 == 0 {
            let (frame, time_us) = estimate(&pins.to_host)?;
            if let Some((frame_before, time_before, elapsed_before)) = last {
                let frames = frame.wrapping_sub(frame_before);
                let wrong_us = (time_us - time_before).abs_diff(elapsed_us - elapsed_before);
                if frames != 1000 || wrong_us > SLACK_US {
                    return Err(format!("{frames} of 1000 frames, clock wrong by {wrong_us} µs"));
                }
            }
            last = Some((frame, time_us, elapsed_us));
        }
        pins.to_host.clear();
    }
    let s = statistics(&mut session, &board);
    let scanned = s.frames_scanned - first.frames_scanned;
    if scanned != FRAMES_PER_CASE || sent == 0 {
        return Err(format!("{scanned} of {FRAMES_PER_CASE} frames scanned, {sent} bytes sent"));
    }
    let lost = [s.lost_reports, s.frames_missed - first.frames_missed, s.bad_loops, s.bad_packets];
    if lost == [0; 4] { Ok(()) } else { Err(format!("reports, frames, loops, packets: {lost:?}")) }
}

/// Lets most of a period pass, and runs the loop until it sends something; returns the time in µs that it took.
fn next_frame(session: &mut Running<'_, '_>, board: &Board, period_us: u32) -> u32 {
    let before_us = board.pins.borrow().now_us;
    board.pins.borrow_mut().now_us = before_us.wrapping_add(period_us - EARLY_US);
    while board.pins.borrow().to_host.is_empty() {
        session.step();
    }
    board.pins.borrow().now_us.wrapping_sub(before_us)
}

/// Number and time of the estimate among these bytes.
fn estimate(bytes: &[u8]) -> Result<(u32, u64), String> {
    let found = find_report(bytes, |_, report| match report {
        Report::Estimate(EstimateReport { frame, start_us, .. }) => Some((frame, start_us)),
        _ => None,
    });
    found.ok_or_else(|| format!("no estimate in {} bytes", bytes.len()))
}

//! Lines and flash that are as slow as can be: the watchdog is fed in time.

use std::cell::RefCell;
use std::rc::Rc;

use mock_board::{
    Bench, Board, Flash, Memory, Pins, blob, blob_with_confidence, quiet, request_bytes,
    upload_steps,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{ConfidenceSent, Configuration, Request, Setting, UploadStep};
use taxel_firmware::store::{Journal, Kind, PAGE_BYTES};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const WATCHDOG: Promise = Promise {
    name: "load-watchdog",
    text: "no line and no flash keeps the watchdog unfed",
    share: 2,
    check,
};

const LEAST: u64 = 240;
/// The fastest watchdog of the board, in s: the clock of the 8 s one runs 47 % too fast.
const FASTEST_S: f64 = 5.4;
/// Longest time in µs that the erase of a slot takes, with writes of 32 bits.
const ERASE_US: u32 = 2_000_000;
/// Longest time in µs that the erase of a page of the journal takes.
const ERASE_PAGE_US: u32 = 500_000;
/// Longest time in µs of writing a word.
const WORD_US: u32 = 100;
/// Bytes of a slot, as on the board.
const SLOT_BYTES: usize = 128 * 1024;
/// Words of memory for a copy of the weights.
const MEMORY: usize = 4096;

/// Bytes of a chunk of an upload.
const CHUNK: usize = 100;
/// Configuration with the most reports.
const BUSY: Configuration = Configuration {
    frame_period_us: 10_000,
    send_readings: true,
    send_estimates: true,
    confidence: ConfidenceSent::Deviations,
    ..Configuration::DEFAULT
};

fn check(effort: &Effort, _: &Tools) -> Result<Found, String> {
    Ok(effort.worst((LEAST, 1 << 40), (FASTEST_S, "s"), |seed| Ok(longest_unfed_s(seed))))
}

/// A journal in these pages, one of which is full: they are exchanged at the next write. From then on they may be worn.
fn nearly_full(pages: [Flash; 2], is_worn: bool) -> Journal<Flash> {
    let mut journal = Journal::new(pages);
    for number in 0..PAGE_BYTES / 64 - 1 {
        let kept = journal.keep(Kind::Configuration, &[&[number as u8; 40]]);
        assert_eq!(kept, Ok(true), "write {number}");
    }
    journal.pages().iter_mut().for_each(|page| page.fails_to_erase = is_worn);
    journal
}

/// Longest time in s between feeds of the watchdog.
fn longest_unfed_s(seed: u64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let gaps_us = [0, 1_000, 10_000, 49_000, 1_000_000, 5];
    let (gap_us, is_bursts) = (gaps_us[(seed % 6) as usize], seed % 6 == 5);
    let scan_us = [6_400, 100_000, 1_660_000][(seed / 6 % 3) as usize];
    let is_worn = seed / 18 % 2 == 1;
    let mut memory = Box::new(Memory::new());
    let pins = Rc::new(RefCell::new(Pins::default()));
    let slow = |bytes, erase_us, is_worn| {
        let clock = pins.clone();
        let wait = Rc::new(move |us| {
            let mut pins = clock.borrow_mut();
            pins.now_us = pins.now_us.wrapping_add(us);
        });
        let mut pair = Flash::pair(bytes);
        for flash in &mut pair {
            flash.slow = Some((erase_us, WORD_US, wait.clone()));
            flash.fails_to_erase = is_worn;
        }
        pair
    };
    let mut board = Board::new(nearly_full(slow(PAGE_BYTES, ERASE_PAGE_US, false), is_worn));
    *pins.borrow_mut() = Pins::default();
    board.pins = pins.clone();
    let mut bench = Bench::on(board.clone(), &mut memory, quiet());
    board.pins.borrow_mut().scan_us = scan_us;
    bench.frame.borrow_mut()[0][0] = f32::NAN; // so that all kinds of reports are sent
    let mut slots = slow(SLOT_BYTES, ERASE_US, is_worn);
    let model = blob_with_confidence(false);
    slots[0].flash(0, &model);
    let mut room = vec![0; MEMORY];
    let mut session = Session::start(&mut bench.app, &mut slots, &mut room);
    let new = blob(2, 4);
    let steps = upload_steps(&new, CHUNK);
    let mut uploads = steps[..steps.len() - 1].iter().cycle().copied().map(Request::Upload);
    let configure = Request::Configure(BUSY);
    board.pins.borrow_mut().to_device.extend(request_bytes(4, &configure));
    board.pins.borrow_mut().gap_us = gap_us;
    board.pins.borrow_mut().look_us = 100;
    for _ in 0..30 {
        let request = match random.next_u32() % 6 {
            0 => Request::Identify,
            1 => Request::Statistics,
            2 => Request::Upload(UploadStep::Abort),
            3 => Request::Keep(Setting::Configuration),
            4 => Request::Forget(Setting::Configuration),
            _ => uploads.next().expect("a step"),
        };
        board.pins.borrow_mut().to_device.extend(request_bytes(5, &request));
        if is_bursts {
            board.pins.borrow_mut().room = Some((random.next_u32() % 300) as usize);
        }
        session.step();
        board.pins.borrow_mut().to_host.clear();
    }
    f64::from(board.pins.borrow().longest_unfed_us) / 1e6
}

//! Lines and flash that are as slow as can be: the watchdog is fed in time.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::app::Session;
use firmware::link::message::{
    ConfidenceSent, Configuration, RecalibrationStep, Request, Setting, UploadStep,
};
use firmware::settings::PAGE_BYTES;
use firmware::store::{FlashError, Slot};
use mock_board::{
    Bench, Board, Memory, Pins, SharedSettings, blob, blob_to_recalibrate, blob_with_confidence,
    quiet, request_bytes, upload_steps,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::promises::power::presses;
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
/// Longest time in µs that the erase of a page of settings takes.
const ERASE_PAGE_US: u32 = 500_000;
/// Longest time in µs of writing a word.
const WORD_US: u32 = 100;
/// Words of a slot, as on the board.
const WORDS: usize = 32 * 1024;
/// Centres of a model that fills most of a slot.
const MANY_CENTRES: usize = 3000;
/// Words of memory for a recalibration.
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

/// A slot that takes its time.
struct SlowSlot {
    words: Vec<u32>,
    pins: Rc<RefCell<Pins>>,
    erase_us: u32,
    /// Whether erases fail at their end.
    is_worn: bool,
}

impl SlowSlot {
    fn wait(&self, us: u32) {
        let mut pins = self.pins.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(us);
    }
}

impl Slot for SlowSlot {
    const ERASE_INTERVAL_S: u32 = 0;

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.wait(self.erase_us);
        self.words.fill(u32::MAX);
        if self.is_worn { Err(FlashError) } else { Ok(()) }
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.wait(WORD_US * (bytes.len() / 4) as u32);
        bytemuck::cast_slice_mut(&mut self.words)[offset..offset + bytes.len()]
            .copy_from_slice(bytes);
        Ok(())
    }
}

/// Settings in these pages, one of which is full: they are exchanged at the next write. From then on the pages may be worn.
fn nearly_full(pages: [SlowSlot; 2], is_worn: bool) -> SharedSettings<SlowSlot> {
    let mut settings = SharedSettings::in_pages(pages);
    for number in 0..PAGE_BYTES / 64 - 1 {
        let kept = settings.keep_bytes(Setting::Configuration, &[number as u8; 40]);
        assert_eq!(kept, Ok(true), "write {number}");
    }
    settings.0.borrow_mut().pages().iter_mut().for_each(|page| page.is_worn = is_worn);
    settings
}

/// Longest time in s between feeds of the watchdog.
fn longest_unfed_s(seed: u64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let gaps_us = [0, 1_000, 10_000, 49_000, 1_000_000, 5];
    let (gap_us, is_bursts) = (gaps_us[(seed % 6) as usize], seed % 6 == 5);
    let scan_us = [6_400, 100_000, 1_660_000][(seed / 6 % 3) as usize];
    let [is_recalibrated, is_worn] = [seed / 18 % 2 == 1, seed / 36 % 2 == 1];
    let mut memory = Box::new(Memory::new());
    let pins = Rc::new(RefCell::new(Pins::default()));
    let slot = |words, erase_us, is_worn| SlowSlot {
        words: vec![u32::MAX; words],
        pins: pins.clone(),
        erase_us,
        is_worn,
    };
    let mut board = Board::with_settings(&nearly_full(
        [0, 1].map(|_| slot(PAGE_BYTES / 4, ERASE_PAGE_US, false)),
        is_worn,
    ));
    *pins.borrow_mut() = Pins::default();
    board.pins = pins.clone();
    let mut bench = Bench::on(board.clone(), &mut memory, quiet());
    board.pins.borrow_mut().scan_us = scan_us;
    bench.frame.borrow_mut()[0][0] = f32::NAN; // so that all kinds of reports are sent
    let mut slots = [0, 1].map(|_| slot(WORDS, ERASE_US, is_worn));
    let model = if is_recalibrated {
        blob_to_recalibrate(MANY_CENTRES)
    } else {
        blob_with_confidence(false)
    };
    bytemuck::cast_slice_mut(&mut slots[0].words)[..model.len()].copy_from_slice(&model);
    let mut room = vec![0; MEMORY];
    let mut session = Session::start(&mut bench.app, &mut slots, &mut room);
    let new = blob(2, 4);
    let steps = upload_steps(&new, CHUNK);
    let mut uploads = steps[..steps.len() - 1].iter().cycle().copied().map(Request::Upload);
    if is_recalibrated {
        presses::add(&mut session, &board, &model);
    }
    let configure = Request::Configure { configuration: BUSY, lease_ms: 0 };
    board.pins.borrow_mut().to_device.extend(request_bytes(4, &configure));
    board.pins.borrow_mut().gap_us = gap_us;
    board.pins.borrow_mut().look_us = 100;
    for _ in 0..30 {
        let request = match random.next_u32() % 6 {
            0 => Request::Identify,
            1 => Request::Statistics,
            2 if is_recalibrated => Request::Recalibrate(RecalibrationStep::Commit),
            2 => Request::Upload(UploadStep::Abort),
            3 => Request::Keep(Setting::Configuration),
            4 => Request::Forget(Setting::Configuration),
            _ if is_recalibrated => Request::Configuration,
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

//! Lines and flash that are as slow as can be: the watchdog is fed in time.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::app::Session;
use firmware::link::message::{ConfidenceSent, Configuration, Request, UploadStep};
use firmware::store::{FlashError, Slot};
use mock_board::{
    Bench, Memory, Pins, SharedSettings, blob, blob_with_confidence, quiet, request_bytes,
    upload_steps,
};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

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
/// Longest time in µs of writing a word.
const WORD_US: u32 = 100;
/// Words of a slot.
const WORDS: usize = 512;

/// Bytes of a chunk of an upload.
const CHUNK: usize = 100;

fn check(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let planted = effort.is_planted();
    Ok(effort.worst((LEAST, 1 << 40), (FASTEST_S, "s"), |seed| Ok(longest_unfed_s(seed, planted))))
}

/// A slot that takes its time.
struct SlowSlot {
    words: Vec<u32>,
    pins: Rc<RefCell<Pins>>,
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
        self.wait(ERASE_US);
        self.words.fill(u32::MAX);
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.wait(WORD_US * (bytes.len() / 4) as u32);
        bytemuck::cast_slice_mut(&mut self.words)[offset..offset + bytes.len()]
            .copy_from_slice(bytes);
        Ok(())
    }
}

/// Longest time in s between feeds of the watchdog, while a host asks, uploads and takes bytes slowly.
fn longest_unfed_s(seed: u64, planted: bool) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let gaps_us = [0, 1_000, 10_000, 49_000, 1_000_000, 5];
    let (gap_us, is_bursts) = (gaps_us[(seed % 6) as usize], seed % 6 == 5);
    let scan_us = [6_400, 100_000, 1_660_000][(seed / 6 % 3) as usize];
    let configuration = Configuration {
        frame_period_us: 10_000,
        send_readings: true,
        confidence: ConfidenceSent::Deviations,
        ..quiet()
    };
    let mut memory = Box::new(Memory::new());
    let mut bench = Bench::within(&mut memory, configuration, &SharedSettings::default());
    let board = bench.board.clone();
    board.pins.borrow_mut().scan_us = scan_us;
    bench.frame.borrow_mut()[0][0] = f32::NAN; // so that all kinds of reports are sent
    let mut slots =
        [0, 1].map(|_| SlowSlot { words: vec![u32::MAX; WORDS], pins: board.pins.clone() });
    let model = blob_with_confidence(false);
    bytemuck::cast_slice_mut(&mut slots[0].words)[..model.len()].copy_from_slice(&model);
    board.pins.borrow_mut().gap_us = gap_us;
    board.pins.borrow_mut().look_us = 100;
    let new = blob(2, 4);
    let steps = upload_steps(&new, CHUNK);
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    let mut next = 0;
    for _ in 0..30 {
        let step = steps[next % (steps.len() - 1)];
        let request = match random.next_u32() % 4 {
            0 => Request::Identify,
            1 => Request::Statistics,
            2 => Request::Upload(UploadStep::Abort),
            _ => {
                next += 1;
                Request::Upload(step)
            }
        };
        board.pins.borrow_mut().to_device.extend(request_bytes(5, &request));
        if is_bursts {
            board.pins.borrow_mut().room = Some((random.next_u32() % 300) as usize);
        }
        session.step();
        let mut pins = board.pins.borrow_mut();
        if planted {
            // A port that waits for two seconds more before it gives a turn up.
            pins.now_us = pins.now_us.wrapping_add(2_000_000);
        }
        pins.to_host.clear();
    }
    f64::from(board.pins.borrow().longest_unfed_us) / 1e6
}

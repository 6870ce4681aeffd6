//! The board: clock, serial line, watchdog and journal.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use taxel_firmware::link::message::Memory;
use taxel_firmware::platform::{Clock, Line, Platform, Storage, Watchdog};
use taxel_firmware::store::Journal;

use super::flash::Flash;
use super::shape::{TestFrame, frame_at_rest};

/// State of the board, which a test can see while the application owns the board.
#[derive(Default)]
pub struct Pins {
    /// Bytes that the device has not received yet.
    pub to_device: VecDeque<u8>,
    /// Bytes that the device has sent. Whoever runs it for long must empty this.
    pub to_host: Vec<u8>,
    /// The clock in µs. Each look at it takes one, and [`Pins::look_us`] more.
    pub now_us: u32,
    /// Time in µs that each look at the clock takes besides. It makes waiting short for tests of slow lines.
    pub look_us: u32,
    /// Time in µs that a scan takes besides 10 µs.
    pub scan_us: u32,
    /// Whether the sensor scans by itself, while the device does other things.
    pub scans_alone: bool,
    /// Number of scans that it began so, and of those that were given up.
    pub started: u32,
    pub stopped: u32,
    /// Number of times that the watchdog was fed.
    pub feeds: u32,
    /// What the board shows of touch, load and slip, and what it showed when the first of the bytes was sent.
    pub signal: [bool; 3],
    pub signal_at_first_byte: [bool; 3],
    /// Number of bytes that the host's side still takes; `None` takes all.
    pub room: Option<usize>,
    /// Least time in µs between two bytes that the host's side takes.
    pub gap_us: u32,
    /// When it took the last byte.
    taken_us: u32,
    looks: u32,
    cycles: u32,
}

/// A board. Clones have the same pins.
#[derive(Clone)]
pub struct Board {
    /// Clock, serial line and watchdog.
    pub pins: Rc<RefCell<Pins>>,
    /// The frame that its sensor shows, in Ω.
    pub frame: Rc<RefCell<TestFrame>>,
    /// What survives a restart besides the slots; that of a clone is another one.
    pub journal: Journal<Flash>,
}

impl Board {
    /// A board with this journal.
    pub fn new(journal: Journal<Flash>) -> Self {
        Self { pins: Rc::default(), frame: Rc::new(RefCell::new(frame_at_rest())), journal }
    }
}

impl Clock for Board {
    fn now_us(&mut self) -> u32 {
        let mut pins = self.pins.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(1 + pins.look_us);
        pins.now_us
    }

    /// Each look takes fewer cycles than the one before: 1000, 500, 333.
    fn cycles(&self) -> u32 {
        let mut pins = self.pins.borrow_mut();
        pins.looks += 1;
        pins.cycles = pins.cycles.wrapping_add(1000 / pins.looks);
        pins.cycles
    }
}

impl Line for Board {
    fn receive(&mut self) -> Option<u8> {
        self.pins.borrow_mut().to_device.pop_front()
    }

    /// Takes one byte in each gap, if there is one, and as many as there is room for.
    fn send(&mut self, bytes: &[u8]) -> usize {
        let mut pins = self.pins.borrow_mut();
        if pins.now_us.wrapping_sub(pins.taken_us) < pins.gap_us {
            return 0;
        }
        pins.taken_us = pins.now_us;
        let mut taken = if pins.gap_us > 0 { 1 } else { bytes.len() };
        if let Some(room) = &mut pins.room {
            taken = taken.min(*room);
            *room -= taken;
        }
        if pins.to_host.is_empty() {
            pins.signal_at_first_byte = pins.signal;
        }
        pins.to_host.extend_from_slice(&bytes[..taken]);
        taken
    }
}

impl Watchdog for Board {
    fn feed_watchdog(&mut self) {
        let mut pins = self.pins.borrow_mut();
        pins.feeds = pins.feeds.wrapping_add(1);
    }
}

impl Storage for Board {
    type Page = Flash;

    fn journal(&mut self) -> &mut Journal<Flash> {
        &mut self.journal
    }
}

impl Platform for Board {
    const BOARD: &'static str = "test";

    fn memory(&self) -> Memory {
        Memory { stack_reserved: 1024, ..Memory::default() }
    }

    fn signal(&mut self, going_on: [bool; 3]) {
        self.pins.borrow_mut().signal = going_on;
    }
}

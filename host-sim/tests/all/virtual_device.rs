//! The firmware's application in a thread of this process.
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use taxel_data::{Purpose, Random, Stream};
use taxel_firmware::app::{App, Buffers};
use taxel_firmware::capacity::Capacity;
use taxel_firmware::link::message::{Configuration, Memory};
use taxel_firmware::platform::{self, Clock, Platform, Storage, Watchdog};
use taxel_firmware::readout::{
    FrameSource, ScanReport, ScanSettings, Scanning, Selection, WaitingSource,
};
use taxel_firmware::store::Journal;

/// Line to the device that spoils bytes, in either direction: one in so many, or none.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    pub one_in: Option<usize>,
}

/// The mock flash of the firmware's tests, whose power is not cut here.
#[path = "../../../firmware/tests/mock/flash.rs"]
#[expect(dead_code, reason = "power cuts are for the firmware's tests")]
mod flash;

use flash::{Flash, Supply};

/// Board whose serial line is `W`, whose reads must not block.
struct Board<'s, W, N> {
    wire: W,
    journal: &'s mut Journal<Flash>,
    /// Called with each request's last byte, before the device sees it.
    notice: N,
    start: Instant,
    line: Line,
    random: Random,
    received: Vec<u8>,
    taken: usize,
    to_send: Vec<u8>,
    /// Whether the host has gone, so that the thread may end.
    gone: bool,
}

impl<W: Read + Write, N> Board<'_, W, N> {
    /// Byte as it arrives; `None` if it is lost.
    fn spoil(&mut self, byte: u8) -> Option<u8> {
        let Some(one_in) = self.line.one_in else { return Some(byte) };
        match self.random.below(3 * one_in) {
            0 => None,
            1 => Some(byte ^ 1 << self.random.below(8)),
            2 => Some(0),
            _ => Some(byte),
        }
    }

    fn flush(&mut self) {
        if !self.to_send.is_empty() {
            self.gone |= self.wire.write_all(&self.to_send).is_err();
            self.to_send.clear();
        }
    }
}

impl<W, N> Clock for Board<'_, W, N> {
    fn now_us(&mut self) -> u32 {
        self.start.elapsed().as_micros() as u32
    }
}

impl<W, N> Watchdog for Board<'_, W, N> {
    fn feed_watchdog(&mut self) {}
}

impl<W, N> Storage for Board<'_, W, N> {
    type Page = Flash;

    fn journal(&mut self) -> &mut Journal<Flash> {
        self.journal
    }
}

impl<W: Read + Write, N: FnMut()> platform::Line for Board<'_, W, N> {
    fn receive(&mut self) -> Option<u8> {
        if self.taken == self.received.len() {
            self.flush();
            self.received.resize(4096, 0);
            self.taken = 0;
            let count = match self.wire.read(&mut self.received) {
                Ok(0) => {
                    // The thread goes on as long as the tests do: it shall not take time from them.
                    std::thread::sleep(Duration::from_millis(20));
                    self.gone = true;
                    0
                }
                Ok(count) => count,
                Err(cause) if is_timeout(&cause) => {
                    std::thread::yield_now();
                    0
                }
                // Nobody is there at the moment.
                Err(_) => {
                    std::thread::sleep(Duration::from_millis(1));
                    0
                }
            };
            self.received.truncate(count);
        }
        let byte = *self.received.get(self.taken)?;
        self.taken += 1;
        if byte == 0 {
            (self.notice)();
        }
        self.spoil(byte)
    }

    fn send(&mut self, bytes: &[u8]) -> usize {
        for byte in bytes {
            if let Some(byte) = self.spoil(*byte) {
                self.to_send.push(byte);
            }
            if *byte == 0 {
                self.flush();
            }
        }
        bytes.len()
    }
}

impl<W: Read + Write, N: FnMut()> Platform for Board<'_, W, N> {
    const BOARD: &'static str = "virtual";

    fn memory(&self) -> Memory {
        let [vector_table, text, rodata, data] = [400, 20_000, 5000, 60];
        let [bss, uninit, stack_reserved, stack_high_water] = [3000, 700, 4096, 1000];
        Memory { vector_table, text, rodata, data, bss, uninit, stack_reserved, stack_high_water }
    }
}

fn is_timeout(cause: &std::io::Error) -> bool {
    matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

/// Sensor that goes through given frames again and again.
#[derive(Clone)]
pub struct Source {
    pub frames: Vec<[[f32; 18]; 8]>,
    pub next: usize,
}

impl FrameSource for Source {
    fn scanning(&mut self) -> Scanning<'_> {
        Scanning::Waits(self)
    }
}

impl WaitingSource for Source {
    fn scan(&mut self, _: ScanSettings, wires: Selection<'_>, frame: &mut [f32]) -> ScanReport {
        let shown = &self.frames[self.next % self.frames.len()];
        let readings = wires.rows.iter().flat_map(|row| wires.columns.pick(shown[row.0]));
        frame.iter_mut().zip(readings).for_each(|(place, reading)| *place = reading);
        self.next += 1;
        ScanReport::default()
    }
}

/// Runs a device on `wire` that goes through `frames` when the host asks for a scan: see [`run_scanning`].
pub fn run(
    wire: impl Read + Write + Send + 'static,
    line: Line,
    model: &[u8],
    frames: Vec<[[f32; 18]; 8]>,
) {
    run_scanning(wire, line, model, Source { frames, next: 0 }, QUIET, || ());
}

/// Configuration that scans only on request.
pub const QUIET: Configuration = Configuration { frame_period_us: 0, ..Configuration::DEFAULT };

/// Runs a device on `wire` that scans `source` by its `own` configuration, until the host goes. Calls `notice` with each
/// request's last byte, before it is carried out. The device is restarted whenever it asks for that.
///
/// `wire` must read without blocking.
pub fn run_scanning(
    mut wire: impl Read + Write + Send + 'static,
    line: Line,
    model: &[u8],
    source: impl FrameSource + Clone + Send + 'static,
    own: Configuration,
    mut notice: impl FnMut() + Send + 'static,
) {
    let model = model.to_vec();
    // Half of a large model fits: both ways are taken.
    let mut weights = vec![0; 8 * 1024];
    std::thread::spawn(move || {
        let supply = Supply::new(0);
        let mut slots = [0, 1].map(|_| Flash::erased(128 * 1024, &supply));
        slots[0].flash(0, &model);
        let mut journal = Flash::journal();
        for life in 0.. {
            let board = Board {
                wire: &mut wire,
                journal: &mut journal,
                notice: &mut notice,
                start: Instant::now(),
                line,
                random: Random::new(5, Stream::Test, Purpose::Damage, life, 2),
                received: Vec::new(),
                taken: 0,
                to_send: Vec::new(),
                gone: false,
            };
            let mut buffers = Buffers::<8, 18, 18, { Capacity::PAPER.message_bytes() }>::new();
            let mut app = App::new(board, source.clone(), own, &mut buffers);
            app.run(&mut slots, &mut weights);
            app.platform().flush();
            if app.platform().gone {
                return;
            }
        }
    });
}

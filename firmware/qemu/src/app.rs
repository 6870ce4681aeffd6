//! The application in the emulator. The link goes through a mailbox or the first serial line; the readout's parts
//! are at the other end of the second. `host-sim emulate` is at the other end of both.
#![no_std]
#![no_main]

use core::cell::Cell;

use board_common::region::take_weights;
use board_common::{BoardApp, CAPACITY, CONVERTERS, buffers};
use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;
use defmt::info;
use firmware::circuit::ZeroPotential;
use firmware::link::message::{Configuration, Memory};
use firmware::platform::{Platform, Port};
use firmware::readout::{Mcp3208s, Scanner, ShiftRegister595};
use firmware::settings::SettingPages;
use qemu_image::clock::Clock;
use qemu_image::mailbox::Mailbox;
use qemu_image::psram::Psram;
use qemu_image::slot::Slot;
use qemu_image::uart::Uart;
use qemu_image::watchdog::Watchdog;
use qemu_image::{exit, memory};
use remote_readout::Remote;

/// Watchdog period in ms: longer than a loop takes even on a very slow computer.
const WATCHDOG_MS: u32 = 20_000;

/// Number of the data pin of the rows' 74HC595 on the host's virtual board; clock and latch follow.
const ROW_DATA: u8 = 12;
const ROW_CLOCK: u8 = 13;
const ROW_LATCH: u8 = 14;

/// Constants of the circuit, until others are kept.
const CIRCUIT: ZeroPotential<{ CAPACITY.rows }, { CAPACITY.columns }> = ZeroPotential::TYPICAL;

/// Carrier of a serial line's bytes: the mailbox or a UART.
enum Carrier {
    Uart(Uart),
    Mailbox(Mailbox<Psram>),
}

impl Carrier {
    /// The link's carrier: the mailbox if the host has laid one out, else the first UART.
    fn of_link() -> Self {
        // SAFETY: the memory is taken here only.
        let psram = unsafe { Psram::take() };
        Mailbox::find(psram).map_or_else(|| Self::Uart(Uart::first()), Self::Mailbox)
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Uart(_) => "UART",
            Self::Mailbox(_) => "mailbox",
        }
    }
}

/// A serial line, with the clock that all lines share.
struct Line<'c> {
    carrier: Carrier,
    clock: &'c Cell<Clock>,
}

impl Port for Line<'_> {
    fn now_us(&mut self) -> u32 {
        let mut clock = self.clock.get();
        let now_us = clock.now_us();
        self.clock.set(clock);
        now_us as u32
    }

    fn receive(&mut self) -> Option<u8> {
        match &mut self.carrier {
            Carrier::Uart(uart) => uart.try_read(),
            Carrier::Mailbox(mailbox) => mailbox.try_read(),
        }
    }

    fn send(&mut self, byte: u8) -> bool {
        match &mut self.carrier {
            Carrier::Uart(uart) => uart.try_write(byte),
            Carrier::Mailbox(mailbox) => mailbox.try_write(byte),
        }
    }
}

struct Board<'c> {
    line: Line<'c>,
    watchdog: Watchdog,
    fed_us: u32,
    settings: SettingPages<Slot>,
    key: Slot,
}

impl Port for Board<'_> {
    fn now_us(&mut self) -> u32 {
        self.line.now_us()
    }

    fn receive(&mut self) -> Option<u8> {
        self.line.receive()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.line.send(byte)
    }
}

impl Platform for Board<'_> {
    type Settings = SettingPages<Slot>;
    type KeyArea = Slot;

    const BOARD: &'static str = "qemu mps2-an386";

    /// Feeds the watchdog at most once a millisecond, because feeding costs QEMU system calls.
    fn feed_watchdog(&mut self) {
        let now_us = self.now_us();
        if now_us.wrapping_sub(self.fed_us) >= 1000 {
            self.fed_us = now_us;
            self.watchdog.feed();
        }
    }

    fn memory(&self) -> Memory {
        memory::taken()
    }

    fn settings(&mut self) -> &mut SettingPages<Slot> {
        &mut self.settings
    }

    fn key_area(&mut self) -> &mut Slot {
        &mut self.key
    }
}

#[entry]
fn main() -> ! {
    info!("taxel {=str} on an emulated Cortex-M4F", env!("CARGO_PKG_VERSION"));
    let clock = Cell::new(Clock::start());
    let link = Carrier::of_link();
    info!("link: {=str}", link.name());
    let readout = Carrier::Uart(Uart::second());
    let remote = Remote::new(Line { carrier: readout, clock: &clock });
    let [data, clock_pin, latch] = [ROW_DATA, ROW_CLOCK, ROW_LATCH].map(|pin| remote.pin(pin));
    let drive = ShiftRegister595::<_, { CAPACITY.rows }> { data, clock: clock_pin, latch };
    let sampler =
        Mcp3208s { chips: core::array::from_fn::<_, CONVERTERS, _>(|chip| remote.spi(chip as u8)) };
    let scanner =
        Scanner::<_, _, _, _, { CAPACITY.columns }>::new(drive, sampler, remote.delay(), CIRCUIT);
    // SAFETY: the slots are taken here only.
    let (mut slots, pages, key) = unsafe { Slot::take() };
    let board = Board {
        line: Line { carrier: link, clock: &clock },
        watchdog: Watchdog::start(WATCHDOG_MS),
        fed_us: 0,
        settings: SettingPages::new(pages),
        key,
    };
    // The host says when to scan, because its virtual hardware may be missing.
    let configuration = Configuration { frame_period_us: 0, ..Configuration::DEFAULT };
    let Some(buffers) = buffers() else { exit::failure() };
    let mut app = BoardApp::<_, _>::new(board, scanner, configuration, buffers);
    // SAFETY: the memory is taken here only.
    app.run(&mut slots, unsafe { take_weights() });
    info!("restarting");
    SCB::sys_reset()
}

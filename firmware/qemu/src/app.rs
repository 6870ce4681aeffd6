//! The application in the emulator, without a sensor. `taxel emulate` is at the other end of its link, a mailbox.
#![no_std]
#![no_main]

use board_common::region::take_weights;
use board_common::{BoardApp, CAPACITY, buffers};
use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;
use defmt::{error, info};
use qemu_image::clock::Clock;
use qemu_image::mailbox::Mailbox;
use qemu_image::psram::Psram;
use qemu_image::slot::Slot;
use qemu_image::watchdog::Watchdog;
use qemu_image::{exit, memory};
use taxel_core::{Decoder, decoder_ram_bytes};
use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{Configuration, Memory};
use taxel_firmware::platform::{self, Line, Platform, Storage};
use taxel_firmware::readout::{
    FrameSource, ScanReport, ScanSettings, Scanning, Selection, WaitingSource,
};
use taxel_firmware::store::Journal;

/// The RAM figure of `taxel inspect` must be at least the compiler's.
const _: () = assert!(size_of::<Decoder<'static, 8>>() <= decoder_ram_bytes(8));

/// Watchdog period in ms: longer than a loop takes even on a very slow computer.
const WATCHDOG_MS: u32 = 20_000;

/// A circuit with constants to set and no sensor behind it: every reading is missing.
struct NoSensor(ZeroPotential<{ CAPACITY.rows }, { CAPACITY.columns }>);

impl WaitingSource for NoSensor {
    fn scan(&mut self, _: ScanSettings, _: Selection<'_>, frame: &mut [f32]) -> ScanReport {
        frame.fill(f32::NAN);
        ScanReport { failed_samples: frame.len() as u16, ..ScanReport::default() }
    }
}

impl FrameSource for NoSensor {
    fn scanning(&mut self) -> Scanning<'_> {
        Scanning::Waits(self)
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.0.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.0.set_constants(constants)
    }
}

struct Board {
    mailbox: Mailbox<Psram>,
    clock: Clock,
    watchdog: Watchdog,
    fed_us: u32,
    journal: Journal<Slot>,
}

impl platform::Clock for Board {
    fn now_us(&mut self) -> u32 {
        self.clock.now_us() as u32
    }
}

impl Line for Board {
    fn receive(&mut self) -> Option<u8> {
        self.mailbox.try_read()
    }

    fn send(&mut self, bytes: &[u8]) -> usize {
        bytes.iter().take_while(|byte| self.mailbox.try_write(**byte)).count()
    }
}

impl Storage for Board {
    type Page = Slot;

    fn journal(&mut self) -> &mut Journal<Slot> {
        &mut self.journal
    }
}

impl platform::Watchdog for Board {
    /// Feeds the watchdog at most once a millisecond, because feeding costs QEMU system calls.
    fn feed_watchdog(&mut self) {
        let now_us = self.clock.now_us() as u32;
        if now_us.wrapping_sub(self.fed_us) >= 1000 {
            self.fed_us = now_us;
            self.watchdog.feed();
        }
    }
}

impl Platform for Board {
    const BOARD: &'static str = "qemu mps2-an386";

    fn memory(&self) -> Memory {
        memory::taken()
    }
}

#[entry]
fn main() -> ! {
    info!("taxel {=str} on an emulated Cortex-M4F", env!("CARGO_PKG_VERSION"));
    let clock = Clock::start();
    #[cfg(feature = "must-fail")]
    info!("{=u8}", [0_u8; 4][memory::taken().text as usize]);
    // SAFETY: the memory is taken here only.
    let Some(mailbox) = Mailbox::find(unsafe { Psram::take() }) else {
        error!("the host has laid out no mailbox");
        exit::failure()
    };
    // SAFETY: the slots are taken here only.
    let (mut slots, pages) = unsafe { Slot::take() };
    let board = Board {
        mailbox,
        clock,
        watchdog: Watchdog::start(WATCHDOG_MS),
        fed_us: 0,
        journal: Journal::new(pages),
    };
    // There is nothing to scan, unless the host asks for it.
    let configuration = Configuration { frame_period_us: 0, ..Configuration::DEFAULT };
    let Some(buffers) = buffers() else { exit::failure() };
    let mut app =
        BoardApp::<_, _>::new(board, NoSensor(ZeroPotential::TYPICAL), configuration, buffers);
    // SAFETY: the memory is taken here only.
    app.run(&mut slots, unsafe { take_weights() });
    info!("restarting");
    SCB::sys_reset()
}
